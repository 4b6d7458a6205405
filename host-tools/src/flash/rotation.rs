//! Which slot is written next.

use eigenmark_core::slots::Record;

use super::Slot;

/// The records of the two slots, where there are any.
pub type Records = [Option<Record>; 2];

/// A slot's turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turn {
    /// The slot that is written.
    pub slot: Slot,
    /// Its number in the order of writing: larger than those of both records.
    pub sequence: u32,
}

/// Why no slot can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RotationError {
    /// No number is larger than the newest record's.
    #[error(
        "the newest record has the last number, {}; erase both slots",
        u32::MAX
    )]
    LastNumber,
}

impl Turn {
    /// The turn after `records`: `slot`, or the one that does not hold the newest atlas; A when neither has a record.
    ///
    /// # Errors
    /// [`RotationError::LastNumber`].
    pub fn after(records: &Records, slot: Option<Slot>) -> Result<Self, RotationError> {
        let [a, b] = records.map(|record| record.map(|record| record.sequence));
        let Some(newest) = a.max(b) else {
            return Ok(Self {
                slot: slot.unwrap_or(Slot::A),
                sequence: 1,
            });
        };
        let holds_newest = if a >= b { Slot::A } else { Slot::B };
        Ok(Self {
            slot: slot.unwrap_or(holds_newest.other()),
            sequence: newest.checked_add(1).ok_or(RotationError::LastNumber)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use eigenmark_core::slots::Setup;

    use super::*;

    fn records(sequences: [Option<u32>; 2]) -> Records {
        sequences.map(|sequence| {
            sequence.map(|sequence| Record {
                sequence,
                len: 1,
                crc: 2,
                setup: Setup::default(),
            })
        })
    }

    #[test]
    fn the_newest_atlas_is_never_overwritten_unasked() {
        for (sequences, slot, sequence) in [
            ([None, None], Slot::A, 1),
            ([Some(5), None], Slot::B, 6),
            ([None, Some(5)], Slot::A, 6),
            ([Some(7), Some(6)], Slot::B, 8),
            ([Some(6), Some(7)], Slot::A, 8),
            ([Some(0), None], Slot::B, 1),
        ] {
            let turn = Turn::after(&records(sequences), None);
            assert_eq!(turn, Ok(Turn { slot, sequence }), "{sequences:?}");
        }
    }

    #[test]
    fn a_named_slot_is_still_newer_than_both() {
        let turn = Turn::after(&records([Some(7), Some(6)]), Some(Slot::A));
        let expected = Turn {
            slot: Slot::A,
            sequence: 8,
        };
        assert_eq!(turn, Ok(expected));
    }

    #[test]
    fn numbers_do_not_wrap() {
        let turn = Turn::after(&records([Some(u32::MAX), None]), None);
        assert_eq!(turn, Err(RotationError::LastNumber));
    }
}
