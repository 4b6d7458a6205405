//! Flash for tests: one that wears, sticks, and loses power in the midst of a word.
//!
//! **Model.** NOR flash: erasing sets all bits of a page, writing clears bits. What is one step for power is the writing of
//! one flash word, or the erasing of one page; reading takes none. With [`power_after`](SimulatedFlash::power_after) power
//! is cut in the step after so many, and a [`Cut`] says what that step leaves. From then on everything fails, until
//! [`power_on`](SimulatedFlash::power_on).
//!
//! **Limits.** Bits that are left half programmed read the same each time, and words with a wrong ECC can be read: real
//! ones may do otherwise.

use std::{vec, vec::Vec};

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};

/// Flash with words of `WRITE` and pages of `ERASE` bytes; the first must divide the second, and eight divide both that and
/// the length. Its bytes begin at a multiple of eight in memory.
#[derive(Clone, Debug)]
pub struct SimulatedFlash<const WRITE: usize, const ERASE: usize> {
    words: Vec<u64>,
    /// Whether each flash word has been written since it was erased; none when that does not matter.
    written: Option<Vec<bool>>,
    /// Pages, by their numbers, that are not erased any more.
    worn: Vec<usize>,
    stuck: Vec<Stuck>,
    steps: u64,
    power: Power,
}

/// What a step that power is cut in leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// Nothing is changed yet.
    Before,
    /// The first half of the word or page is as it should become.
    FirstHalf,
    /// The second half is.
    SecondHalf,
    /// Every bit that should change has changed, or has not, as this seed will have it.
    Random(u64),
    /// All is done, but nobody was told.
    After,
}

/// Why an operation failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimulatedError {
    /// Its bounds are not in the flash, or not those of words or pages.
    Bounds(NorFlashErrorKind),
    /// Power was cut in it, or before.
    Power,
    /// A word would be written for the second time since it was erased.
    Rewritten {
        /// Offset of the word, in bytes.
        offset: u32,
    },
}

#[derive(Clone, Copy, Debug)]
enum Power {
    On,
    /// On for so many steps.
    Budget(u64, Cut),
    Off,
}

/// Bits of a byte that always read the same.
#[derive(Clone, Copy, Debug)]
struct Stuck {
    offset: usize,
    mask: u8,
    is_high: bool,
}

impl<const WRITE: usize, const ERASE: usize> SimulatedFlash<WRITE, ERASE> {
    /// Erased flash of `len` bytes, whose words may be written once between erases if `write_once`, or as often as only
    /// ones become zeros.
    ///
    /// # Panics
    /// When words are not whole parts of a page, or pages of the flash, or these not multiples of eight.
    #[must_use]
    pub fn new(len: usize, write_once: bool) -> Self {
        assert!(
            ERASE.is_multiple_of(WRITE) && ERASE.is_multiple_of(8) && len.is_multiple_of(ERASE)
        );
        Self {
            words: vec![u64::MAX; len / 8],
            written: write_once.then(|| vec![false; len / WRITE]),
            worn: Vec::new(),
            stuck: Vec::new(),
            steps: 0,
            power: Power::On,
        }
    }

    /// What it holds.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words)
    }

    /// Puts `bytes` at `offset`, as a probe does that has erased the pages before: what else is in these pages is erased.
    ///
    /// # Panics
    /// When they do not fit.
    pub fn put(&mut self, offset: usize, bytes: &[u8]) {
        let end = offset + bytes.len();
        let pages = offset / ERASE * ERASE..end.next_multiple_of(ERASE);
        let content = bytemuck::cast_slice_mut::<_, u8>(&mut self.words);
        content[pages.clone()].fill(0xff);
        content[offset..end].copy_from_slice(bytes);
        if let Some(written) = &mut self.written {
            written[pages.start / WRITE..pages.end / WRITE].fill(false);
            written[offset / WRITE..end.div_ceil(WRITE)].fill(true);
        }
        self.stick();
    }

    /// Cuts power in the step after the next `steps`.
    pub fn power_after(&mut self, steps: u64, cut: Cut) {
        self.power = Power::Budget(steps, cut);
    }

    /// Whether power was cut.
    #[must_use]
    pub fn is_off(&self) -> bool {
        matches!(self.power, Power::Off)
    }

    /// Gives power again, without an end.
    pub fn power_on(&mut self) {
        self.power = Power::On;
    }

    /// Words written and pages erased so far.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// The page that `offset` is in is worn: erasing leaves every 16th byte as it is, the page's first among them.
    pub fn wear(&mut self, offset: usize) {
        self.worn.push(offset / ERASE);
    }

    /// From now on the bits of `mask` in the byte at `offset` are always ones if `is_high`, or always zeros.
    ///
    /// # Panics
    /// When there is no such byte.
    pub fn stick_bits(&mut self, offset: usize, mask: u8, is_high: bool) {
        self.stuck.push(Stuck {
            offset,
            mask,
            is_high,
        });
        self.stick();
    }

    /// Makes `bytes` of what is at `offset` in one step.
    fn change(
        &mut self,
        offset: usize,
        bytes: impl Iterator<Item = (usize, u8)>,
        len: usize,
    ) -> Result<(), SimulatedError> {
        let cut = match &mut self.power {
            Power::On => None,
            Power::Budget(0, cut) => Some(*cut),
            Power::Budget(steps, _) => {
                *steps -= 1;
                None
            }
            Power::Off => return Err(SimulatedError::Power),
        };
        self.steps += 1;
        let content = bytemuck::cast_slice_mut::<_, u8>(&mut self.words);
        let mut noise = cut.map_or(0, Cut::seed);
        for (index, new) in bytes {
            let place = &mut content[offset + index];
            let mask = cut.map_or(0xff, |cut| cut.mask(index, len, &mut noise));
            *place = (*place & !mask) | (new & mask);
        }
        self.stick();
        if cut.is_some() {
            self.power = Power::Off;
            return Err(SimulatedError::Power);
        }
        Ok(())
    }

    fn stick(&mut self) {
        let content = bytemuck::cast_slice_mut::<_, u8>(&mut self.words);
        for stuck in &self.stuck {
            if stuck.is_high {
                content[stuck.offset] |= stuck.mask;
            } else {
                content[stuck.offset] &= !stuck.mask;
            }
        }
    }
}

impl<const WRITE: usize, const ERASE: usize> ErrorType for SimulatedFlash<WRITE, ERASE> {
    type Error = SimulatedError;
}

impl<const WRITE: usize, const ERASE: usize> ReadNorFlash for SimulatedFlash<WRITE, ERASE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), SimulatedError> {
        if self.is_off() {
            return Err(SimulatedError::Power);
        }
        check_read(self, offset, bytes.len())?;
        bytes.copy_from_slice(&self.bytes()[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes().len()
    }
}

impl<const WRITE: usize, const ERASE: usize> NorFlash for SimulatedFlash<WRITE, ERASE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), SimulatedError> {
        check_erase(self, from, to)?;
        for page in from as usize / ERASE..to as usize / ERASE {
            let is_worn = self.worn.contains(&page);
            let erased = (0..ERASE).filter(|index| !is_worn || index % 16 != 0);
            self.change(page * ERASE, erased.map(|index| (index, 0xff)), ERASE)?;
            if let Some(written) = &mut self.written {
                written[page * ERASE / WRITE..][..ERASE / WRITE].fill(false);
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), SimulatedError> {
        if self.is_off() {
            return Err(SimulatedError::Power);
        }
        check_write(self, offset, bytes.len())?;
        for (word, bytes) in (offset as usize / WRITE..).zip(bytes.chunks(WRITE)) {
            let offset = word * WRITE;
            if let Some(written) = &mut self.written
                && std::mem::replace(&mut written[word], true)
            {
                return Err(SimulatedError::Rewritten {
                    offset: offset as u32,
                });
            }
            let old: [u8; WRITE] = std::array::from_fn(|index| self.bytes()[offset + index]);
            let cleared = old.into_iter().zip(bytes).map(|(old, new)| old & new);
            self.change(offset, cleared.enumerate(), WRITE)?;
        }
        Ok(())
    }
}

impl NorFlashError for SimulatedError {
    fn kind(&self) -> NorFlashErrorKind {
        match *self {
            Self::Bounds(kind) => kind,
            Self::Power | Self::Rewritten { .. } => NorFlashErrorKind::Other,
        }
    }
}

impl From<NorFlashErrorKind> for SimulatedError {
    fn from(kind: NorFlashErrorKind) -> Self {
        Self::Bounds(kind)
    }
}

impl Cut {
    fn seed(self) -> u64 {
        match self {
            Self::Random(seed) => seed,
            _ => 0,
        }
    }

    /// The bits of byte `index` of `len` that become what they should.
    fn mask(self, index: usize, len: usize, noise: &mut u64) -> u8 {
        // In a word of one byte, halves are halves of its bits.
        let first = match (2 * index + 1).cmp(&len) {
            std::cmp::Ordering::Less => 0xff,
            std::cmp::Ordering::Equal => 0x0f,
            std::cmp::Ordering::Greater => 0,
        };
        match self {
            Self::Before => 0,
            Self::FirstHalf => first,
            Self::SecondHalf => !first,
            Self::Random(_) => {
                *noise = congruent(*noise);
                (*noise >> 32) as u8
            }
            Self::After => 0xff,
        }
    }
}

/// The next of a row of numbers that look random: a multiplicative congruential step, of which the upper bits are taken.
fn congruent(number: u64) -> u64 {
    number
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writing_clears_bits_and_erasing_sets_them() {
        let mut flash = SimulatedFlash::<1, 16>::new(32, false);
        flash.write(3, &[0b1010]).expect("power");
        flash.write(3, &[0b0110]).expect("power");
        assert_eq!(flash.bytes()[2..5], [0xff, 0b0010, 0xff]);
        flash.erase(0, 16).expect("power");
        assert_eq!(flash.bytes(), [0xff; 32]);
        assert_eq!(flash.steps(), 3);
        let bounds = flash.erase(0, 8).expect_err("half a page");
        assert_eq!(bounds.kind(), NorFlashErrorKind::NotAligned);
    }

    #[test]
    fn a_word_is_written_once() {
        let mut flash = SimulatedFlash::<8, 16>::new(32, true);
        flash.write(8, &[0xff; 8]).expect("the first time");
        let error = SimulatedError::Rewritten { offset: 8 };
        assert_eq!(flash.write(0, &[0; 16]), Err(error));
        flash.erase(0, 16).expect("power");
        flash.write(0, &[0; 16]).expect("erased before");
    }

    #[test]
    fn cuts_leave_what_they_say() {
        let left = |cut| {
            let mut flash = SimulatedFlash::<4, 16>::new(32, true);
            flash.power_after(1, cut);
            assert_eq!(flash.write(0, &[0; 12]), Err(SimulatedError::Power));
            assert_eq!(flash.read(0, &mut [0]), Err(SimulatedError::Power));
            assert_eq!(flash.erase(0, 16), Err(SimulatedError::Power));
            flash.power_on();
            assert_eq!(flash.bytes()[..4], [0; 4]);
            assert_eq!(flash.bytes()[8..], [0xff; 24]);
            flash.bytes()[4..8].to_vec()
        };
        assert_eq!(left(Cut::Before), [0xff; 4]);
        assert_eq!(left(Cut::FirstHalf), [0, 0, 0xff, 0xff]);
        assert_eq!(left(Cut::SecondHalf), [0xff, 0xff, 0, 0]);
        assert_eq!(left(Cut::After), [0; 4]);
        assert_ne!(left(Cut::Random(1)), left(Cut::Random(2)));
    }

    #[test]
    fn stuck_bits_and_worn_pages_stay() {
        let mut flash = SimulatedFlash::<1, 16>::new(32, false);
        flash.stick_bits(1, 0x81, true);
        flash.stick_bits(2, 0x01, false);
        flash.wear(16);
        flash.write(0, &[0; 32]).expect("power");
        assert_eq!(flash.bytes()[..3], [0, 0x81, 0]);
        flash.erase(0, 32).expect("power");
        assert_eq!(flash.bytes()[..4], [0xff, 0xff, 0xfe, 0xff]);
        assert_eq!(flash.bytes()[16..18], [0, 0xff]);
    }
}
