//! The host: prints to its terminal, counts nanoseconds.

use std::time::Instant;

pub struct Platform;

impl Platform {
    pub fn print(&mut self, text: &str) {
        print!("{text}");
    }

    /// The bits in eight hexadecimal digits.
    pub fn print_bits(&mut self, value: f32) {
        print!("{:08x} ", value.to_bits());
    }

    pub fn print_count(&mut self, count: u32) {
        print!("{count}");
    }

    /// Nanoseconds of a piece of work, the shortest time of many.
    pub fn count(&mut self, work: &mut dyn FnMut()) -> u32 {
        const RUNS: usize = 200;
        let mut time = || {
            let begin = Instant::now();
            work();
            begin.elapsed().as_nanos() as u32
        };
        (0..RUNS).map(|_| time()).min().unwrap_or(0)
    }
}
