//! A Cortex-M4F in QEMU: prints by semihosting, counts instructions by the system timer.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_semihosting::debug::{EXIT_SUCCESS, exit};
use cortex_m_semihosting::hio::{HostStream, hstdout};
use panic_halt as _;

/// Of the board's 25 MHz, at a nanosecond an instruction.
const INSTRUCTIONS_A_TICK: u32 = 40;
const LARGEST: u32 = 0x00FF_FFFF;

pub struct Platform {
    out: HostStream,
}

impl Platform {
    pub fn new() -> Option<Self> {
        let out = hstdout().ok()?;
        let mut timer = cortex_m::Peripherals::take()?.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(LARGEST);
        timer.clear_current();
        timer.enable_counter();
        Some(Self { out })
    }

    pub fn print(&mut self, text: &str) {
        // nothing could be said of an error
        let _ = self.out.write_all(text.as_bytes());
    }

    /// The bits in eight hexadecimal digits.
    pub fn print_bits(&mut self, value: f32) {
        let mut text = [b' '; 9];
        for (place, digit) in text.iter_mut().take(8).enumerate() {
            let four = (value.to_bits() >> (28 - 4 * place as u32)) as u8 & 15;
            *digit = if four < 10 { b'0' + four } else { b'a' + four - 10 };
        }
        let _ = self.out.write_all(&text);
    }

    pub fn print_count(&mut self, mut count: u32) {
        let mut text = [b' '; 10];
        for digit in text.iter_mut().rev() {
            *digit = b'0' + (count % 10) as u8;
            count /= 10;
            if count == 0 {
                break;
            }
        }
        let _ = self.out.write_all(&text);
    }

    /// Instructions of a piece of work.
    pub fn count(&mut self, work: &mut dyn FnMut()) -> u32 {
        let before = SYST::get_current();
        work();
        // the timer counts down
        before.wrapping_sub(SYST::get_current()) % (LARGEST + 1) * INSTRUCTIONS_A_TICK
    }
}

pub fn leave() -> ! {
    exit(EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}
