//! Boards whose flash is known.

use std::{fmt, ops::Range, str::FromStr};

use eigenmark_core::slots::RECORD_LEN;

/// A board with two slots in its flash.
#[derive(Debug, PartialEq, Eq)]
pub struct Board {
    /// What it is called.
    pub name: &'static str,
    /// What `probe-rs` calls its chip.
    pub chip: &'static str,
    /// Address of the first byte of each slot.
    pub slots: [u32; 2],
    /// Bytes of each slot, its record included.
    pub slot_len: u32,
    /// The chip's family as UF2 numbers them.
    pub uf2_family: u32,
}

/// One of the two slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// The first.
    A,
    /// The second.
    B,
}

/// The boards; the first is meant when none is named.
///
/// As `memory.x` has them:
/// - `stm32f405`: sectors 6 to 11, three per slot.
/// - `stm32h743`: bank 2, four sectors per slot, so that bank 1 can be executed from while they are written.
pub static BOARDS: [Board; 2] = [
    Board {
        name: "stm32f405",
        chip: "STM32F405RGTx",
        slots: [0x0804_0000, 0x080a_0000],
        slot_len: 384 << 10,
        uf2_family: 0x5775_5a57,
    },
    Board {
        name: "stm32h743",
        chip: "STM32H743VITx",
        slots: [0x0810_0000, 0x0818_0000],
        slot_len: 512 << 10,
        uf2_family: 0x6db6_6082,
    },
];

impl Board {
    /// The board of that name.
    ///
    /// # Errors
    /// Which ones there are.
    pub fn named(name: &str) -> Result<&'static Self, String> {
        let board = BOARDS.iter().find(|board| board.name == name);
        board.ok_or_else(|| {
            let names: Vec<&str> = BOARDS.iter().map(|board| board.name).collect();
            format!("expected a board ({}), found {name:?}", names.join(", "))
        })
    }

    /// Address of the first byte of a slot.
    #[must_use]
    pub fn start(&self, slot: Slot) -> u32 {
        let [a, b] = self.slots;
        match slot {
            Slot::A => a,
            Slot::B => b,
        }
    }

    /// Address of a slot's record: its last bytes.
    #[must_use]
    pub fn record_at(&self, slot: Slot) -> u32 {
        self.start(slot) + self.slot_len - RECORD_LEN as u32
    }

    /// The slot that begins at `address`.
    #[must_use]
    pub fn slot_at(&self, address: u32) -> Option<Slot> {
        [Slot::A, Slot::B]
            .into_iter()
            .find(|&slot| self.start(slot) == address)
    }

    /// Addresses of the slot that `address` lies in, and of what follows it without a gap.
    pub(super) fn room_at(&self, address: u32) -> Option<Range<u32>> {
        let [a, b] = self.slots;
        let (end_of_a, end_of_b) = (a + self.slot_len, b + self.slot_len);
        let rooms = if end_of_a == b {
            [a..end_of_b, b..end_of_b]
        } else {
            [a..end_of_a, b..end_of_b]
        };
        rooms.into_iter().find(|room| room.contains(&address))
    }
}

impl Slot {
    /// 0 or 1.
    #[must_use]
    pub fn index(self) -> usize {
        usize::from(self == Self::B)
    }

    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

impl FromStr for Slot {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "a" => Ok(Self::A),
            "b" => Ok(Self::B),
            _ => Err(format!("expected a or b, found {text:?}")),
        }
    }
}

impl fmt::Display for Slot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::A => "a",
            Self::B => "b",
        })
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// The linker's script says the same: numbers of the second board, then of the first.
    #[test]
    fn slots_are_where_the_linker_has_them() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../memory.x");
        let script = fs::read_to_string(path).expect("readable");
        let is_region = |line: &&str| line.trim_start().starts_with("ATLAS (");
        let line = script.lines().find(is_region).expect("an atlas region");
        let words: Vec<&str> = line.split([' ', ',']).collect();
        let origins = words.iter().filter_map(|word| word.strip_prefix("0x"));
        let origins: Vec<u32> = origins
            .map(|word| u32::from_str_radix(word, 16).expect("a number"))
            .collect();
        let lens = words.iter().filter_map(|word| word.strip_suffix('K'));
        let lens: Vec<u32> = lens.map(|word| word.parse().expect("KiB")).collect();
        assert_eq!((origins.len(), lens.len()), (2, 2), "{line}");
        for (board, (origin, len)) in BOARDS.iter().rev().zip(origins.into_iter().zip(lens)) {
            assert_eq!(board.slots, [origin, origin + len * 512], "{line}");
            assert_eq!(board.slot_len, len * 512, "{line}");
        }
    }

    #[test]
    fn slots_are_whole_sectors_and_do_not_overlap() {
        for board in &BOARDS {
            let [a, b] = board.slots;
            assert!(a + board.slot_len <= b, "{}", board.name);
            for number in [a, b, board.slot_len] {
                assert_eq!(number % (128 << 10), 0, "{}", board.name);
            }
            assert_eq!(board.slot_at(b), Some(Slot::B));
            assert_eq!(board.slot_at(b + 8), None);
        }
    }

    #[test]
    fn other_boards_are_refused_by_name() {
        let error = Board::named("uno").expect_err("is none");
        assert_eq!(
            error,
            "expected a board (stm32f405, stm32h743), found \"uno\""
        );
    }
}
