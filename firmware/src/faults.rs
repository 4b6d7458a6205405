//! What went wrong, kept in memory that a reset does not clear.

use eigenmark_core::link::{Cause, Crash, Faults};

/// Bytes that are kept over resets.
pub const KEPT_LEN: usize = 128;

/// Words that faults are kept as, each with its complement.
const WORDS: usize = 8;
const _: () = assert!(KEPT_LEN >= 8 * WORDS);

/// Faults before the last reset and since, and where they are kept.
#[derive(Debug)]
pub struct FaultLog<'k> {
    faults: Faults,
    kept: &'k mut [u8; KEPT_LEN],
}

impl<'k> FaultLog<'k> {
    /// At the start, after a reset for that reason. Memory that was not kept, or was damaged, begins anew.
    #[must_use]
    pub fn begin(kept: &'k mut [u8; KEPT_LEN], cause: Cause) -> Self {
        let before = read(kept).filter(|_| cause != Cause::PowerOn);
        let faults = before.unwrap_or_default();
        let mut log = Self {
            faults: Faults {
                cause,
                resets: faults
                    .resets
                    .saturating_add((cause != Cause::PowerOn).into()),
                by_watchdog: faults
                    .by_watchdog
                    .saturating_add((cause == Cause::Watchdog).into()),
                by_brown_out: faults
                    .by_brown_out
                    .saturating_add((cause == Cause::BrownOut).into()),
                crash: faults.crash,
                camera_losses: 0,
                link_storms: 0,
                worn_pages: faults.worn_pages,
            },
            kept,
        };
        log.keep();
        log
    }

    /// What went wrong.
    #[must_use]
    pub fn faults(&self) -> &Faults {
        &self.faults
    }

    /// Notes that something went wrong.
    pub fn note(&mut self, change: impl FnOnce(&mut Faults)) {
        change(&mut self.faults);
        self.keep();
    }

    /// Notes that something went wrong once more.
    pub fn count(&mut self, which: impl FnOnce(&mut Faults) -> &mut u16) {
        self.note(|faults| {
            let count = which(faults);
            *count = count.saturating_add(1);
        });
    }

    /// Forgets everything but the reason of the last reset.
    pub fn forget(&mut self) {
        let cause = self.faults.cause;
        self.note(|faults| {
            *faults = Faults {
                cause,
                ..Faults::default()
            };
        });
    }

    fn keep(&mut self) {
        write(self.kept, &self.faults);
    }
}

/// What went wrong before the start, in words of at most 50 characters: the first, the second …
#[must_use]
pub fn words(faults: &Faults, number: u8) -> Option<&'static str> {
    let cause = match faults.cause {
        Cause::BrownOut => Some("reset: power was low"),
        Cause::Watchdog => Some("reset by the watchdog"),
        Cause::PowerOn | Cause::Pin | Cause::Software => None,
    };
    let crash = faults.crash.map(|crash| match crash {
        Crash::HardFault { .. } => "crashed before: hard fault",
        Crash::StackOverflow { .. } => "crashed before: stack overflow",
        Crash::Hang { .. } => "crashed before: no progress",
        Crash::Panic { .. } => "crashed before: panic",
    });
    let worn = (faults.worn_pages > 0).then_some("a flash page is worn");
    let mut said = [cause, crash, worn].into_iter().flatten();
    said.nth(number.into())
}

/// Notes a crash in kept memory, when nothing else can be relied on.
pub fn note_crash(kept: &mut [u8; KEPT_LEN], crash: Crash) {
    let faults = Faults {
        crash: Some(crash),
        ..read(kept).unwrap_or_default()
    };
    write(kept, &faults);
}

/// Writes every word with its complement: what memory holds after power was off is no such thing.
fn write(kept: &mut [u8; KEPT_LEN], faults: &Faults) {
    let (kind, crash) = match faults.crash {
        None => (0, [0; 4]),
        Some(Crash::HardFault {
            pc,
            lr,
            status,
            address,
        }) => (1, [pc, lr, status, address]),
        Some(Crash::StackOverflow { pc, lr }) => (2, [pc, lr, 0, 0]),
        Some(Crash::Hang { pc, lr }) => (3, [pc, lr, 0, 0]),
        Some(Crash::Panic { line }) => (4, [line, 0, 0, 0]),
    };
    let cause = match faults.cause {
        Cause::PowerOn => 0,
        Cause::BrownOut => 1,
        Cause::Pin => 2,
        Cause::Software => 3,
        Cause::Watchdog => 4,
    };
    let pair = |low: u16, high: u16| u32::from(low) | u32::from(high) << 16;
    let counts = [
        pair(cause, kind),
        pair(faults.resets, faults.by_watchdog),
        pair(faults.by_brown_out, faults.worn_pages),
        pair(faults.camera_losses, faults.link_storms),
    ];
    let words = counts.into_iter().chain(crash);
    for (place, word) in kept.as_chunks_mut().0.iter_mut().zip(words) {
        *place = (u64::from(word) << 32 | u64::from(!word)).to_le_bytes();
    }
}

fn read(kept: &[u8; KEPT_LEN]) -> Option<Faults> {
    let mut words = [0; WORDS];
    for (word, place) in words.iter_mut().zip(kept.as_chunks().0) {
        let both = u64::from_le_bytes(*place);
        *word = (both >> 32) as u32;
        if *word != !(both as u32) {
            return None;
        }
    }
    let [kinds, resets, others, losses, crash @ ..] = words;
    let pair = |word: u32| (word as u16, (word >> 16) as u16);
    let (cause, kind) = pair(kinds);
    let (resets, by_watchdog) = pair(resets);
    let (by_brown_out, worn_pages) = pair(others);
    let (camera_losses, link_storms) = pair(losses);
    let [pc, lr, status, address] = crash;
    Some(Faults {
        cause: match cause {
            0 => Cause::PowerOn,
            1 => Cause::BrownOut,
            2 => Cause::Pin,
            3 => Cause::Software,
            4 => Cause::Watchdog,
            _ => return None,
        },
        resets,
        by_watchdog,
        by_brown_out,
        crash: match kind {
            0 => None,
            1 => Some(Crash::HardFault {
                pc,
                lr,
                status,
                address,
            }),
            2 => Some(Crash::StackOverflow { pc, lr }),
            3 => Some(Crash::Hang { pc, lr }),
            4 => Some(Crash::Panic { line: pc }),
            _ => return None,
        },
        camera_losses,
        link_storms,
        worn_pages,
    })
}

/// Why an STM32F4 was reset, by its RCC_CSR (reference manual RM0090, 7.3.21).
///
/// Switching power on sets the flags of brown-out and pin, too; every other reset sets that of the pin.
#[must_use]
pub fn stm32f4_cause(csr: u32) -> Option<Cause> {
    let is_set = |bit: u32| csr & 1 << bit != 0;
    Some(match () {
        () if is_set(27) => Cause::PowerOn,
        () if is_set(25) => Cause::BrownOut,
        () if is_set(29) || is_set(30) => Cause::Watchdog,
        () if is_set(28) || is_set(31) => Cause::Software,
        () if is_set(26) => Cause::Pin,
        () => return None,
    })
}

/// Why an STM32H7 was reset, by its RCC_RSR (reference manual RM0433, 8.7.39).
#[must_use]
pub fn stm32h7_cause(rsr: u32) -> Option<Cause> {
    let is_set = |bit: u32| rsr & 1 << bit != 0;
    Some(match () {
        () if is_set(23) => Cause::PowerOn,
        () if is_set(21) => Cause::BrownOut,
        () if is_set(26) || is_set(28) => Cause::Watchdog,
        () if is_set(24) || is_set(30) => Cause::Software,
        () if is_set(22) => Cause::Pin,
        () => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CRASH: Crash = Crash::HardFault {
        pc: u32::MAX,
        lr: u32::MAX,
        status: u32::MAX,
        address: u32::MAX,
    };

    #[test]
    fn faults_are_kept_over_resets_until_power_is_switched_off() {
        let mut kept = [0xa5; KEPT_LEN];
        let log = FaultLog::begin(&mut kept, Cause::PowerOn);
        assert_eq!(*log.faults(), Faults::default());
        note_crash(&mut kept, CRASH);
        let mut log = FaultLog::begin(&mut kept, Cause::Software);
        assert_eq!((log.faults().resets, log.faults().crash), (1, Some(CRASH)));
        log.note(|faults| {
            faults.worn_pages = u16::MAX;
            faults.camera_losses = 3;
        });
        let log = FaultLog::begin(&mut kept, Cause::Watchdog);
        let expected = Faults {
            cause: Cause::Watchdog,
            resets: 2,
            by_watchdog: 1,
            crash: Some(CRASH),
            worn_pages: u16::MAX,
            ..Faults::default()
        };
        assert_eq!(*log.faults(), expected);
        let log = FaultLog::begin(&mut kept, Cause::BrownOut);
        assert_eq!((log.faults().resets, log.faults().by_brown_out), (3, 1));
        FaultLog::begin(&mut kept, Cause::Pin).forget();
        let log = FaultLog::begin(&mut kept, Cause::Software);
        assert_eq!((log.faults().resets, log.faults().crash), (1, None));
        let log = FaultLog::begin(&mut kept, Cause::PowerOn);
        assert_eq!(log.faults().resets, 0);
    }

    #[test]
    fn every_record_is_read_as_it_was_written_and_a_damaged_one_begins_anew() {
        let different = Faults {
            cause: Cause::PowerOn,
            resets: 1,
            by_watchdog: 2,
            by_brown_out: 3,
            crash: None,
            camera_losses: 4,
            link_storms: 5,
            worn_pages: u16::MAX,
        };
        let hard_fault = Crash::HardFault {
            pc: 1,
            lr: 2,
            status: 3,
            address: u32::MAX,
        };
        for crash in [
            None,
            Some(hard_fault),
            Some(Crash::StackOverflow { pc: 1, lr: 2 }),
            Some(Crash::Hang { pc: 1, lr: 2 }),
            Some(Crash::Panic { line: 1 }),
        ] {
            for cause in [
                Cause::PowerOn,
                Cause::BrownOut,
                Cause::Pin,
                Cause::Software,
                Cause::Watchdog,
            ] {
                let faults = Faults {
                    cause,
                    crash,
                    ..different
                };
                let mut kept = [0; KEPT_LEN];
                write(&mut kept, &faults);
                assert_eq!(read(&kept), Some(faults));
            }
        }
        let mut kept = [0; KEPT_LEN];
        write(&mut kept, &different);
        for bit in 0..8 * WORDS * 8 {
            let mut damaged = kept;
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(read(&damaged), None, "bit {bit}");
        }
        assert_eq!(read(&[0; KEPT_LEN]), None);
        assert_eq!(read(&[0xff; KEPT_LEN]), None);
    }

    #[test]
    fn flags_of_resets_are_told_apart() {
        let f4 = |bits: &[u32]| stm32f4_cause(bits.iter().map(|bit| 1 << bit).sum());
        assert_eq!(f4(&[25, 26, 27]), Some(Cause::PowerOn));
        assert_eq!(f4(&[25, 26]), Some(Cause::BrownOut));
        assert_eq!(f4(&[26, 29]), Some(Cause::Watchdog));
        assert_eq!(f4(&[26, 28]), Some(Cause::Software));
        assert_eq!(f4(&[26]), Some(Cause::Pin));
        assert_eq!(f4(&[]), None);
        let h7 = |bits: &[u32]| stm32h7_cause(bits.iter().map(|bit| 1 << bit).sum());
        assert_eq!(h7(&[17, 19, 21, 22, 23]), Some(Cause::PowerOn));
        assert_eq!(h7(&[17, 21, 22]), Some(Cause::BrownOut));
        assert_eq!(h7(&[17, 22, 26]), Some(Cause::Watchdog));
        assert_eq!(h7(&[17, 22, 24]), Some(Cause::Software));
        assert_eq!(h7(&[17, 22]), Some(Cause::Pin));
    }
}
