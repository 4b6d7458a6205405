//! The processor's system timer as a board's clock: an interrupt per millisecond, and its counter between them.

use cortex_m::peripheral::{SCB, SYST, syst::SystClkSource};

use crate::crash;

/// The clock of a board whose timer counts so many ticks per microsecond.
#[derive(Debug)]
pub struct Clock<const TICKS_PER_US: u32>(());

impl<const TICKS_PER_US: u32> Clock<TICKS_PER_US> {
    const TICKS_PER_MS: u32 = 1000 * TICKS_PER_US;

    /// Starts it.
    pub fn start(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(Self::TICKS_PER_MS - 1);
        timer.clear_current();
        timer.enable_interrupt();
        timer.enable_counter();
        Self(())
    }

    /// Time since the start, in microseconds.
    pub fn now_us(&self) -> u64 {
        loop {
            let before = crash::now_ms();
            let left = SYST::get_current();
            let is_pending = SCB::is_pendst_pending();
            if crash::now_ms() == before {
                let part = (Self::TICKS_PER_MS - 1).saturating_sub(left) / TICKS_PER_US;
                // A millisecond has begun that its interrupt did not count yet.
                let uncounted = u64::from(is_pending && left > Self::TICKS_PER_MS / 2);
                return (u64::from(before) + uncounted) * 1000 + u64::from(part);
            }
        }
    }
}
