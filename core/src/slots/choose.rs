//! Which slot is flown by, and which one may be written.
//!
//! **Order.** Of two valid atlases the newer one is flown by; without a record an atlas is older than any with one; of
//! equals, slot A. Sequence numbers are compared as serial numbers are (RFC 1982): a is newer than b when a − b, taken
//! modulo 2³², is below 2³¹. So they may wrap around.

use super::{RECORD_LEN, Record, Setup, Slot, SlotError};
use crate::{
    atlas::Atlas,
    link::{AtlasIdentity, SlotState},
};

/// What memory reads where nothing is written: erased flash, and emulated or unusual flash.
const BLANKS: [u8; 2] = [0xff, 0];

/// What was found in both slots.
#[derive(Clone, Debug)]
pub struct Region<'a> {
    /// In slot A, and in slot B.
    pub slots: [Found<'a>; 2],
}

/// What was found in a slot.
#[derive(Clone, Debug)]
pub struct Found<'a> {
    /// The atlas, or why it does not count.
    pub atlas: Result<Atlas<'a>, SlotError>,
    /// The record, if it is whole. With a valid atlas it is that atlas's.
    pub record: Option<Record>,
}

/// What to fly by.
#[derive(Clone, Debug)]
pub struct Choice<'a> {
    /// Where it is.
    pub slot: Slot,
    /// The atlas.
    pub atlas: Atlas<'a>,
    /// What was written with it; [`Setup::default`] without a record.
    pub setup: Setup,
}

/// The slot that may be written, and the number to give to what is written. Only [`Region::target`] makes one, so that it
/// is never the slot flown by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    slot: Slot,
    sequence: u32,
}

impl<'a> Region<'a> {
    /// Looks at both slots of a region, the second of which begins at `slot_len`. Bytes must start at a multiple of eight in
    /// memory, and so must the second slot, or no atlas is found.
    #[must_use]
    pub fn read(bytes: &'a [u8], slot_len: usize) -> Self {
        Self {
            slots: Slot::BOTH.map(|slot| Found::read(bytes, slot_len, slot)),
        }
        .without_covered(slot_len)
    }

    /// What was found in `slot`.
    #[must_use]
    pub fn found(&self, slot: Slot) -> &Found<'a> {
        let [a, b] = &self.slots;
        match slot {
            Slot::A => a,
            Slot::B => b,
        }
    }

    /// The slot with the newest valid atlas.
    #[must_use]
    pub fn newest(&self) -> Option<Slot> {
        let [a, b] = &self.slots;
        match (&a.atlas, &b.atlas) {
            (Ok(_), Ok(_)) if is_newer(b.sequence(), a.sequence()) => Some(Slot::B),
            (Ok(_), _) => Some(Slot::A),
            (Err(_), Ok(_)) => Some(Slot::B),
            (Err(_), Err(_)) => None,
        }
    }

    /// What to fly by from a start on: the newest valid atlas.
    #[must_use]
    pub fn choose(&self) -> Option<Choice<'a>> {
        let slot = self.newest()?;
        let found = self.found(slot);
        Some(Choice {
            slot,
            atlas: found.atlas.as_ref().ok()?.clone(),
            setup: found.setup(),
        })
    }

    /// The slot to write a new atlas to, when `flown` is the slot flown by: the other one. When none is, the one that is
    /// not the newest, and slot A of an empty region.
    ///
    /// # Errors
    /// [`SlotError::Covered`] when the atlas to be kept takes both slots: only a probe can replace it.
    pub fn target(&self, flown: Option<Slot>) -> Result<Target, SlotError> {
        let Some(kept) = flown.or(self.newest()) else {
            return Ok(Target {
                slot: Slot::A,
                sequence: 1,
            });
        };
        if self.found(kept.other()).is_covered() {
            return Err(SlotError::Covered);
        }
        Ok(Target {
            slot: kept.other(),
            sequence: self.found(kept).sequence().unwrap_or(0).wrapping_add(1),
        })
    }

    /// What the link says of the slots, when `flown` is the slot flown by.
    #[must_use]
    pub fn states(&self, flown: Option<Slot>) -> [SlotState; 2] {
        Slot::BOTH.map(|slot| self.found(slot).state(flown == Some(slot)))
    }

    /// An atlas in slot A that is longer than a slot takes slot B from whatever else seems to be there.
    fn without_covered(mut self, slot_len: usize) -> Self {
        let [a, b] = &mut self.slots;
        if matches!(&a.atlas, Ok(atlas) if atlas.total_len() as usize > slot_len) {
            *b = Found {
                atlas: Err(SlotError::Covered),
                record: None,
            };
        }
        self
    }
}

impl<'a> Found<'a> {
    /// Looks at one slot of a region, as [`Region::read`] does at both: what is in slot B, whether or not the atlas in slot
    /// A goes on there.
    #[must_use]
    pub fn read(region: &'a [u8], slot_len: usize, slot: Slot) -> Self {
        let none = |error| Self {
            atlas: Err(error),
            record: None,
        };
        // What an atlas may fill, and the slot.
        let (room, bytes) = match slot {
            Slot::A => (Some(region), region.get(..slot_len)),
            Slot::B => {
                let rest = region.get(slot_len..).and_then(|rest| rest.get(..slot_len));
                (rest, rest)
            }
        };
        let (Some(room), Some(bytes)) = (room, bytes) else {
            return none(SlotError::Length { len: 0, room: 0 });
        };
        let Some((free, end)) = bytes.split_last_chunk::<RECORD_LEN>() else {
            return none(SlotError::Length { len: 0, room: 0 });
        };
        let record = Record::decode(end);
        let atlas = match Atlas::parse(room) {
            // What would be the record belongs to the atlas.
            Ok(atlas) if atlas.total_len() as usize > free.len() => {
                return Self {
                    atlas: Ok(atlas),
                    record: None,
                };
            }
            Ok(atlas) => vouched_for(atlas, record, end),
            Err(_) if bytes.iter().all(|&byte| byte == 0xff) => Err(SlotError::Empty),
            Err(error) => Err(error.into()),
        };
        Self { atlas, record }
    }

    /// Its number in the order of writing; none without a record.
    #[must_use]
    pub fn sequence(&self) -> Option<u32> {
        self.record.map(|record| record.sequence)
    }

    /// What was written with the atlas; [`Setup::default`] without a record.
    #[must_use]
    pub fn setup(&self) -> Setup {
        self.record.map(|record| record.setup).unwrap_or_default()
    }

    /// What the link says of it.
    #[must_use]
    pub fn state(&self, is_flown: bool) -> SlotState {
        SlotState {
            sequence: self.sequence(),
            atlas: match &self.atlas {
                Ok(atlas) => Ok(AtlasIdentity::of(atlas)),
                Err(error) => Err(*error),
            },
            is_flown,
        }
    }

    fn is_covered(&self) -> bool {
        matches!(self.atlas, Err(SlotError::Covered))
    }
}

impl Target {
    /// Where to write.
    #[must_use]
    pub fn slot(&self) -> Slot {
        self.slot
    }

    /// The same once an atlas has been written there, when `flown` is the slot flown by: without one the other slot, for the
    /// new atlas is to be kept.
    #[must_use]
    pub fn after_writing(self, flown: Option<Slot>) -> Self {
        match flown {
            Some(_) => self,
            None => Self {
                slot: self.slot.other(),
                sequence: self.sequence.wrapping_add(1),
            },
        }
    }

    /// The number to give.
    #[must_use]
    pub fn sequence(&self) -> u32 {
        self.sequence
    }
}

/// The atlas, if its record is its own or it has none. `end` is where the record is or is not.
fn vouched_for<'a>(
    atlas: Atlas<'a>,
    record: Option<Record>,
    end: &[u8; RECORD_LEN],
) -> Result<Atlas<'a>, SlotError> {
    match record {
        Some(record) if record.crc != atlas.crc() => Err(SlotError::Other {
            expected: record.crc,
            found: atlas.crc(),
        }),
        Some(record) if record.len == atlas.total_len() => Ok(atlas),
        None if BLANKS.iter().any(|&blank| *end == [blank; RECORD_LEN]) => Ok(atlas),
        _ => Err(SlotError::Unfinished),
    }
}

/// Whether the atlas with number `a` was written after the one with number `b`.
fn is_newer(a: Option<u32>, b: Option<u32>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a.wrapping_sub(b).cast_signed() > 0,
        (a, b) => a.is_some() && b.is_none(),
    }
}
