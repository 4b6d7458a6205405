//! An atlas that comes part by part → the slot that is not flown by.
//!
//! ```text
//!            begin               step, once per page               chunk …                    finish
//! idle ────────────────▶ erasing ───────────────────▶ announced ───────────▶ all written ───────────────▶ done
//!   ▲                       │ worn, driver             │ worn, driver             │ not the atlas, worn, driver
//!   └───────────────────────┴──────────────────────────┴──────────────────────────┴── abandon, from anywhere
//! ```
//!
//! **Safety.** The slot's first page is erased first, and with it the preamble: whatever the slot held is no atlas from
//! then on. Its record is erased last. Then the first half of the new record is written: it announces the atlas, and makes
//! the slot one that has a record, but not a whole one, so that an atlas which was written wholly but not checked is not
//! taken for one that was flashed without a record. The second half, with the record's CRC, is written when the atlas was
//! checked in place: that is what makes it valid, and newer.
//!
//! **Words.** No flash word is written twice between erases. What does not fill one is kept until the next part comes, or
//! padded with ones at the atlas's end. Everything is read back.

use embedded_storage::nor_flash::NorFlash;

use super::{RECORD_LEN, Record, Setup, Slot, SlotError, Target};
use crate::atlas::{Atlas, AtlasError, Checksum, HEAD_LEN, Head};

/// The longest flash word, in bytes: the STM32H7's.
const MAX_WORD_LEN: usize = 32;

/// Bytes of a record that announce; the others commit. Both are whole flash words.
const ANNOUNCEMENT_LEN: usize = RECORD_LEN / 2;

/// Bytes that are read back at once: whole flash words.
const PIECE_LEN: usize = 64;

const ERASED: u8 = 0xff;

const _: () = assert!(
    ANNOUNCEMENT_LEN.is_multiple_of(MAX_WORD_LEN) && PIECE_LEN.is_multiple_of(MAX_WORD_LEN)
);

const _: () = assert!(size_of::<Writer>() <= 72);

/// Writes one atlas at a time. What it knows is lost with power; the slot then is to be erased anew.
#[derive(Clone, Debug)]
pub struct Writer {
    /// Offset of the atlas region in the flash, in bytes.
    region: u32,
    slot_len: u32,
    state: State,
}

/// How far an upload is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Progress {
    /// Pages are to be erased: [`Writer::step`] has to be called.
    Erasing,
    /// The slot is erased, and the atlas may come.
    Writing {
        /// Where its next part begins, in bytes. Everything before has been written and read back, but for what does not
        /// fill a flash word yet.
        next: u32,
    },
}

#[derive(Clone, Copy, Debug)]
enum State {
    Idle,
    /// The offset of the next page to be erased, in the slot.
    Erasing(Order, u32),
    Writing(Order, Tail),
    Done(Order),
}

/// What was begun.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Order {
    slot: Slot,
    record: Record,
}

/// The end of what has come.
#[derive(Clone, Copy, Debug)]
struct Tail {
    /// Bytes that have come.
    next: u32,
    /// Those since the last whole flash word, and room for the rest of one.
    bytes: [u8; MAX_WORD_LEN],
}

/// One slot of one flash. Offsets are in the slot.
struct Place<'f, F> {
    flash: &'f mut F,
    /// Offset of the slot in the region.
    slot: u32,
    /// Offset of the region in the flash.
    region: u32,
    slot_len: u32,
}

impl Writer {
    /// A writer for a region that begins at offset `region` of its flash, as the flash's driver counts, and has two slots
    /// of `slot_len` bytes: whole pages, and for the promise about power cuts at least two of them.
    #[must_use]
    pub const fn new(region: u32, slot_len: u32) -> Self {
        Self {
            region,
            slot_len,
            state: State::Idle,
        }
    }

    /// Bytes of the longest atlas that can be written.
    #[must_use]
    pub fn room(&self) -> u32 {
        self.slot_len.saturating_sub(RECORD_LEN as u32)
    }

    /// Begins an upload of `len` bytes with the CRC-32 `crc` in their preamble. The same upload, if it is under way, goes on
    /// where it is; another one ends. The flash is not touched: [`step`](Self::step) has to be called until nothing is to
    /// be erased any more.
    ///
    /// # Errors
    /// [`SlotError::Length`] and [`SlotError::Setup`]; an upload under way then goes on.
    pub fn begin(
        &mut self,
        target: Target,
        len: u32,
        crc: u32,
        setup: Setup,
    ) -> Result<Progress, SlotError> {
        let room = self.room();
        if len == 0 || len > room {
            return Err(SlotError::Length { len, room });
        }
        if !setup.is_valid() {
            return Err(SlotError::Setup);
        }
        let record = Record {
            sequence: target.sequence(),
            len,
            crc,
            setup,
        };
        let order = Order {
            slot: target.slot(),
            record,
        };
        match self.state {
            State::Erasing(current, _) | State::Writing(current, _) if current == order => {}
            _ => self.state = State::Erasing(order, 0),
        }
        self.progress()
    }

    /// Erases the next page that the upload needs, and checks that it reads as erased; announces the atlas after the last.
    /// Does nothing when no page is left.
    ///
    /// It takes as long as the flash does for one page: 1 to 2 s for 128 KiB of an STM32F4, during which a processor that
    /// runs from the same bank stands still. A watchdog has to be fed between steps, and to bear one.
    ///
    /// # Errors
    /// [`SlotError::NotBegun`], or [`SlotError::Worn`] and [`SlotError::Driver`], which end the upload.
    pub fn step<F: NorFlash>(&mut self, flash: &mut F) -> Result<Progress, SlotError> {
        if let State::Erasing(order, page) = self.state {
            self.state = State::Idle;
            let mut place = self.place(flash, order.slot)?;
            place.erase(page)?;
            self.state = match place.page_after(page, order.record.len) {
                Some(page) => State::Erasing(order, page),
                None => {
                    let (announcement, _) = order.halves();
                    place.write(place.record(), &announcement)?;
                    State::Writing(order, Tail::EMPTY)
                }
            };
        }
        self.progress()
    }

    /// Takes the bytes of the atlas from `offset` on. Says where the next part begins; so it does for a part that has come
    /// before, wholly.
    ///
    /// # Errors
    /// [`SlotError::NotBegun`]; [`SlotError::Gap`] and, beyond the announced end, [`SlotError::Length`], after which the
    /// upload goes on; [`SlotError::Worn`] and [`SlotError::Driver`], which end it.
    pub fn chunk<F: NorFlash>(
        &mut self,
        flash: &mut F,
        offset: u32,
        bytes: &[u8],
    ) -> Result<u32, SlotError> {
        let State::Writing(order, mut tail) = self.state else {
            return Err(SlotError::NotBegun);
        };
        let len = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        let (end, room) = (offset.saturating_add(len), order.record.len);
        if end > room {
            return Err(SlotError::Length { len: end, room });
        }
        if end <= tail.next {
            return Ok(tail.next);
        }
        if offset != tail.next {
            return Err(SlotError::Gap {
                expected: tail.next,
            });
        }
        self.state = State::Idle;
        let mut place = self.place(flash, order.slot)?;
        tail.append(&mut place, bytes)?;
        if end == room {
            tail.pad(&mut place)?;
        }
        self.state = State::Writing(order, tail);
        Ok(end)
    }

    /// What has been written and read back, from its start on: at most the whole announced atlas.
    ///
    /// # Errors
    /// [`SlotError::NotBegun`] without a finished upload; [`SlotError::Atlas`] and [`SlotError::Driver`].
    pub fn head<F: NorFlash>(&mut self, flash: &mut F) -> Result<Head, SlotError> {
        let State::Done(order) = self.state else {
            return Err(SlotError::NotBegun);
        };
        self.place(flash, order.slot)?.head(order.record.len)
    }

    /// Checks the atlas where it lies and, if all is well, commits it: from the next start on it is flown by. Said again
    /// after that, it gives the same answer, and [`Region::target`](super::Region::target) a new target. `mapped` gives the slot's bytes as memory shows them now, at least the atlas;
    /// a board with a cache over its flash has to empty it there. Where memory does not show them yet, it gives none: then
    /// the head and the CRC are checked through the driver, and the rest at the next start, which flies by the other slot
    /// if that fails.
    ///
    /// # Errors
    /// [`SlotError::NotBegun`]; [`SlotError::Gap`] while parts are missing; then [`SlotError::Atlas`],
    /// [`SlotError::Other`], [`SlotError::Length`], [`SlotError::Worn`] and [`SlotError::Driver`], which end the upload.
    pub fn finish<F: NorFlash>(
        &mut self,
        flash: &mut F,
        mapped: impl for<'f> FnOnce(&'f F) -> Option<&'f [u8]>,
    ) -> Result<Record, SlotError> {
        let (order, next) = match self.state {
            State::Writing(order, tail) => (order, tail.next),
            State::Done(order) => return Ok(order.record),
            State::Idle | State::Erasing(..) => return Err(SlotError::NotBegun),
        };
        if next != order.record.len {
            return Err(SlotError::Gap { expected: next });
        }
        self.state = State::Idle;
        match mapped(flash) {
            Some(slot) => order.record.check(slot)?,
            None => self.place(flash, order.slot)?.check(&order.record)?,
        }
        let mut place = self.place(flash, order.slot)?;
        let (announcement, commitment) = order.halves();
        let record = place.record();
        place.compare(record, &announcement)?;
        place.write(record.saturating_add(ANNOUNCEMENT_LEN as u32), &commitment)?;
        self.state = State::Done(order);
        Ok(order.record)
    }

    /// Ends the upload. What is written stays, and is not valid unless it was finished.
    pub fn abandon(&mut self) {
        self.state = State::Idle;
    }

    /// How far the upload is.
    ///
    /// # Errors
    /// [`SlotError::NotBegun`].
    pub fn progress(&self) -> Result<Progress, SlotError> {
        match self.state {
            State::Erasing(..) => Ok(Progress::Erasing),
            State::Writing(_, tail) => Ok(Progress::Writing { next: tail.next }),
            State::Idle | State::Done(_) => Err(SlotError::NotBegun),
        }
    }

    /// The slot in `flash`, if the flash's pages and words fit.
    fn place<'f, F: NorFlash>(
        &self,
        flash: &'f mut F,
        slot: Slot,
    ) -> Result<Place<'f, F>, SlotError> {
        const {
            assert!(F::WRITE_SIZE.is_power_of_two() && F::WRITE_SIZE <= MAX_WORD_LEN);
            assert!(F::WRITE_SIZE.is_multiple_of(F::READ_SIZE));
            assert!(F::ERASE_SIZE.is_multiple_of(MAX_WORD_LEN) && F::ERASE_SIZE > 0);
            assert!(F::ERASE_SIZE >= RECORD_LEN && F::ERASE_SIZE <= 1 << 31);
        }
        let (region, slot_len) = (self.region, self.slot_len);
        let end = slot_len
            .checked_mul(2)
            .and_then(|len| region.checked_add(len));
        let is_whole = |bytes: u32| bytes.is_multiple_of(F::ERASE_SIZE as u32);
        if end.is_none() || slot_len == 0 || !is_whole(region) || !is_whole(slot_len) {
            return Err(SlotError::Driver);
        }
        Ok(Place {
            flash,
            slot: match slot {
                Slot::A => 0,
                Slot::B => slot_len,
            },
            region,
            slot_len,
        })
    }
}

impl Order {
    /// The record's bytes: what announces, and what commits.
    fn halves(&self) -> ([u8; ANNOUNCEMENT_LEN], [u8; ANNOUNCEMENT_LEN]) {
        let mut halves = [[0; ANNOUNCEMENT_LEN]; 2];
        let bytes = self.record.encode();
        for (half, bytes) in halves.iter_mut().zip(bytes.as_chunks().0) {
            *half = *bytes;
        }
        let [announcement, commitment] = halves;
        (announcement, commitment)
    }
}

impl Record {
    /// Whether the atlas at the start of `slot` is the one of this record.
    fn check(&self, slot: &[u8]) -> Result<(), SlotError> {
        let atlas = Atlas::parse(slot.get(..self.len as usize).unwrap_or(slot))?;
        self.compare(atlas.crc(), atlas.total_len())
    }

    fn compare(&self, crc: u32, len: u32) -> Result<(), SlotError> {
        if crc != self.crc {
            return Err(SlotError::Other {
                expected: self.crc,
                found: crc,
            });
        }
        if len != self.len {
            return Err(SlotError::Length {
                len,
                room: self.len,
            });
        }
        Ok(())
    }
}

impl Tail {
    const EMPTY: Self = Self {
        next: 0,
        bytes: [ERASED; MAX_WORD_LEN],
    };

    /// Writes what fills whole flash words, and keeps the rest.
    fn append<F: NorFlash>(
        &mut self,
        place: &mut Place<'_, F>,
        bytes: &[u8],
    ) -> Result<(), SlotError> {
        let held = self.held::<F>();
        let missing = if held == 0 { 0 } else { F::WRITE_SIZE - held };
        let (first, rest) = bytes.split_at_checked(missing).unwrap_or((bytes, &[]));
        if !first.is_empty() {
            let start = self.start::<F>();
            self.keep(held, first);
            if self.held::<F>() == 0 {
                place.write(start, self.word::<F>())?;
            }
        }
        let whole = rest.len() - rest.len() % F::WRITE_SIZE;
        let (words, rest) = rest.split_at_checked(whole).unwrap_or_default();
        if !words.is_empty() {
            place.write(self.next, words)?;
            self.next = self.next.saturating_add(words.len() as u32);
        }
        if !rest.is_empty() {
            self.keep(0, rest);
        }
        Ok(())
    }

    /// Writes what is left when no more comes.
    fn pad<F: NorFlash>(&mut self, place: &mut Place<'_, F>) -> Result<(), SlotError> {
        let held = self.held::<F>();
        if held == 0 {
            return Ok(());
        }
        for byte in self.bytes.iter_mut().skip(held) {
            *byte = ERASED;
        }
        place.write(self.start::<F>(), self.word::<F>())
    }

    /// Takes less than what is missing of a flash word, or just that, after `held` bytes of it.
    fn keep(&mut self, held: usize, bytes: &[u8]) {
        for (place, byte) in self.bytes.iter_mut().skip(held).zip(bytes) {
            *place = *byte;
        }
        self.next = self.next.saturating_add(bytes.len() as u32);
    }

    /// Bytes since the last whole flash word.
    fn held<F: NorFlash>(&self) -> usize {
        self.next as usize % F::WRITE_SIZE
    }

    /// Where the flash word begins that is not whole yet.
    fn start<F: NorFlash>(&self) -> u32 {
        self.next - self.next % F::WRITE_SIZE as u32
    }

    fn word<F: NorFlash>(&self) -> &[u8] {
        self.bytes.get(..F::WRITE_SIZE).unwrap_or_default()
    }
}

impl<F: NorFlash> Place<'_, F> {
    /// Where the record is.
    fn record(&self) -> u32 {
        self.slot_len.saturating_sub(RECORD_LEN as u32)
    }

    /// The page to be erased after that at `page` for an atlas of `len` bytes: those of the atlas, in their order, and the
    /// record's.
    fn page_after(&self, page: u32, len: u32) -> Option<u32> {
        let last = self.slot_len.saturating_sub(F::ERASE_SIZE as u32);
        let next = page.saturating_add(F::ERASE_SIZE as u32);
        (page < last).then_some(if next < len { next } else { last })
    }

    fn erase(&mut self, page: u32) -> Result<(), SlotError> {
        let start = self.address(page);
        let erased = self
            .flash
            .erase(start, start.saturating_add(F::ERASE_SIZE as u32));
        erased.map_err(|_| SlotError::Driver)?;
        for piece in (0..F::ERASE_SIZE as u32).step_by(MAX_WORD_LEN) {
            self.compare(page.saturating_add(piece), &[ERASED; MAX_WORD_LEN])?;
        }
        Ok(())
    }

    /// Writes whole flash words, and reads them back.
    fn write(&mut self, offset: u32, words: &[u8]) -> Result<(), SlotError> {
        let written = self.flash.write(self.address(offset), words);
        written.map_err(|_| SlotError::Driver)?;
        self.compare(offset, words)
    }

    /// Preamble and header of an atlas of `len` bytes.
    fn head(&mut self, len: u32) -> Result<Head, SlotError> {
        const { assert!(HEAD_LEN.is_multiple_of(MAX_WORD_LEN)) };
        let mut bytes = [0; HEAD_LEN];
        let read = self.flash.read(self.address(0), &mut bytes);
        read.map_err(|_| SlotError::Driver)?;
        Ok(Head::read(bytes.get(..len as usize).unwrap_or(&bytes))?)
    }

    /// Whether the atlas is the one of this record, by what its first bytes say and the CRC of all.
    fn check(&mut self, record: &Record) -> Result<(), SlotError> {
        let head = self.head(record.len)?;
        record.compare(head.crc, head.total_len)?;
        let mut checksum = Checksum::new();
        for offset in (0..record.len).step_by(PIECE_LEN) {
            let mut piece = [0; PIECE_LEN];
            let read = self.flash.read(self.address(offset), &mut piece);
            read.map_err(|_| SlotError::Driver)?;
            let left = record.len.saturating_sub(offset) as usize;
            checksum.update(piece.get(..left).unwrap_or(&piece));
        }
        let (stored, computed) = (head.crc, checksum.finalize());
        if stored == computed {
            Ok(())
        } else {
            Err(SlotError::Atlas(AtlasError::Crc { stored, computed }))
        }
    }

    fn compare(&mut self, offset: u32, words: &[u8]) -> Result<(), SlotError> {
        let mut offset = offset;
        for expected in words.chunks(PIECE_LEN) {
            let mut piece = [0; PIECE_LEN];
            let found = piece.get_mut(..expected.len()).unwrap_or_default();
            let read = self.flash.read(self.address(offset), found);
            read.map_err(|_| SlotError::Driver)?;
            if found != expected {
                let same = found.iter().zip(expected).take_while(|(a, b)| a == b);
                let byte = self
                    .slot
                    .saturating_add(offset)
                    .saturating_add(same.count() as u32);
                return Err(SlotError::Worn {
                    offset: byte - byte % F::ERASE_SIZE as u32,
                });
            }
            offset = offset.saturating_add(expected.len() as u32);
        }
        Ok(())
    }

    /// Where the driver has it.
    fn address(&self, offset: u32) -> u32 {
        self.region.saturating_add(self.slot).saturating_add(offset)
    }
}
