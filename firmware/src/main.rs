//! Runs compensator and actuator for 1000 samples and prints every number's bits, then what a sample costs.
//!
//! `cargo run --release --target thumbv7em-none-eabihf` runs it in QEMU, without `--target` on the host.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg_attr(target_os = "none", path = "cortex_m.rs")]
#[cfg_attr(not(target_os = "none"), path = "host.rs")]
mod platform;

use core::hint::black_box;
use gpi_core::operators::Operator;
use gpi_firmware::{SAMPLES, actuator, as_read::AsRead, compensator::Compensator, reference};
use platform::Platform;

#[cfg(feature = "c")]
mod in_c;

fn run(platform: &mut Platform) {
    let Ok(actuator) = actuator::actuator() else { return platform.print("no actuator\n") };
    let Ok(compensator) = actuator::compensator() else { return platform.print("no inverse\n") };
    let first = reference(0);
    let (mut exported, mut streaming) =
        (Compensator::standing_at(first), compensator.standing_at(first));
    let mut state = actuator.standing_at(streaming.drive);
    platform.print("exported streaming output\n");
    for sample in 0..SAMPLES {
        let wanted = reference(sample);
        let (drive, other) = (exported.step(wanted), compensator.step(&mut streaming, wanted));
        platform.print_bits(drive);
        platform.print_bits(other);
        platform.print_bits(actuator.step(&mut state, other));
        platform.print("\n");
    }
    let mut as_read = AsRead::default();
    cost(platform, "none", |wanted| wanted);
    cost(platform, "as-read", |wanted| as_read.step(wanted));
    cost(platform, "exported", |wanted| exported.step(wanted));
    cost(platform, "streaming", |wanted| compensator.step(&mut streaming, wanted));
    cost(platform, "actuator", |drive| actuator.step(&mut state, drive));
    #[cfg(feature = "c")]
    in_c::cost(platform);
}

/// Prints what a sample takes: instructions on the microcontroller, nanoseconds on the host.
fn cost(platform: &mut Platform, name: &str, mut step: impl FnMut(f32) -> f32) {
    platform.print("cost ");
    platform.print(name);
    let counted = platform.count(&mut || {
        for sample in 0..SAMPLES {
            black_box(step(black_box(reference(sample))));
        }
    });
    platform.print(" ");
    platform.print_count(counted);
    platform.print("\n");
}

#[cfg(not(target_os = "none"))]
fn main() {
    run(&mut Platform);
}

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    if let Some(mut platform) = Platform::new() {
        run(&mut platform);
    }
    platform::leave()
}
