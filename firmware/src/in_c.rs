//! The compensator in C: as `gpi export` writes it, and written by hand.

use crate::{Platform, cost as cost_of, reference};
use core::ffi::{c_float, c_ulong};

/// `gpi_compensator_state` and `by_hand_state`: more than both need.
#[repr(C, align(8))]
struct Room([c_float; 64], c_ulong);

unsafe extern "C" {
    fn gpi_compensator_start(state: *mut Room, reference: c_float);
    fn gpi_compensator_step(state: *mut Room, reference: c_float) -> c_float;
    fn by_hand_step(state: *mut Room, reference: c_float) -> c_float;
}

pub fn cost(platform: &mut Platform) {
    let mut room = Room([0.0; 64], 0);
    // SAFETY: the functions keep to their state, which is smaller than the room.
    unsafe { gpi_compensator_start(&raw mut room, reference(0)) };
    cost_of(platform, "exported-c", |wanted| unsafe {
        gpi_compensator_step(&raw mut room, wanted)
    });
    let mut room = Room([0.0; 64], 0);
    cost_of(platform, "by-hand-c", |wanted| unsafe { by_hand_step(&raw mut room, wanted) });
}
