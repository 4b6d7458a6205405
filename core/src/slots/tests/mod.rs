//! A board with simulated flash: what it chooses, what uploads do, and what is left when power is cut.

mod choosing;
mod power_cuts;
mod properties;
mod upload;

use std::{vec, vec::Vec};

use super::*;
use crate::{
    atlas::{Likelihood, sample::Sample},
    landmark::{Lattice, Point, Survey},
};

const PAGE_LEN: usize = 128;
const SLOT_LEN: usize = 5 * PAGE_LEN;

/// Where the region begins in the flash: before it and behind it is what is not ours.
const REGION: usize = 2 * PAGE_LEN;
const FLASH_LEN: usize = REGION + 2 * SLOT_LEN + PAGE_LEN;

/// Longest atlas that can be uploaded.
const ROOM: usize = SLOT_LEN - RECORD_LEN;

/// Divides no page and no word, and is no multiple of one.
const PART_LEN: usize = 37;

const SETUP: Setup = Setup {
    meters_per_px: 0.25,
    field_of_view_rad: 0.75,
};

/// A board whose flash words have `W` bytes and are written once.
#[derive(Clone)]
struct Board<const W: usize> {
    flash: SimulatedFlash<W, PAGE_LEN>,
    writer: Writer,
}

/// What a slot holds before a test.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Content {
    Erased,
    Zeros,
    /// This many landmarks, without a record.
    Flashed(u8),
    /// With a record of this number.
    Recorded(u8, u32),
    /// With a record of another atlas.
    Stale(u8),
    /// Written wholly, announced, not committed.
    Uncommitted(u8),
}

impl<const W: usize> Board<W> {
    fn new(contents: [Content; 2]) -> Self {
        let mut flash = SimulatedFlash::new(FLASH_LEN, true);
        flash.put(0, &[0x5a; REGION]);
        flash.put(FLASH_LEN - PAGE_LEN, &[0xa5; PAGE_LEN]);
        for (slot, content) in Slot::BOTH.into_iter().zip(contents) {
            if content != Content::Erased {
                flash.put(start(slot), &content.bytes());
            }
        }
        Self {
            flash,
            writer: Writer::new(REGION as u32, SLOT_LEN as u32),
        }
    }

    /// Power comes again, and what was known is lost.
    fn restart(&mut self) {
        self.flash.power_on();
        self.writer = Writer::new(REGION as u32, SLOT_LEN as u32);
    }

    fn region(&self) -> Region<'_> {
        Region::read(&self.flash.bytes()[REGION..][..2 * SLOT_LEN], SLOT_LEN)
    }

    fn slot(&self, slot: Slot) -> &[u8] {
        &self.flash.bytes()[start(slot)..][..SLOT_LEN]
    }

    /// The slot chosen, and the CRC of its atlas.
    fn chosen(&self) -> Option<(Slot, u32)> {
        let choice = self.region().choose()?;
        Some((choice.slot, choice.atlas.crc()))
    }

    fn begin(&mut self, flown: Option<Slot>, atlas: &[u8]) -> Result<Target, SlotError> {
        let target = self.region().target(flown)?;
        self.writer
            .begin(target, atlas.len() as u32, crc_of(atlas), SETUP)?;
        self.erase()?;
        Ok(target)
    }

    fn erase(&mut self) -> Result<(), SlotError> {
        while self.writer.step(&mut self.flash)? == Progress::Erasing {}
        Ok(())
    }

    fn chunk(&mut self, atlas: &[u8], from: usize, len: usize) -> Result<u32, SlotError> {
        let part = &atlas[from..atlas.len().min(from + len)];
        self.writer.chunk(&mut self.flash, from as u32, part)
    }

    fn chunks(&mut self, atlas: &[u8], len: usize) -> Result<(), SlotError> {
        for from in (0..atlas.len()).step_by(len) {
            let next = self.chunk(atlas, from, len)? as usize;
            assert_eq!(next, atlas.len().min(from + len));
        }
        Ok(())
    }

    /// Finishes, and asserts that a board whose memory does not show yet what was written comes to the same; but for what
    /// is wrong with an atlas whose head and CRC are right, which it sees at its next start.
    fn finish(&mut self, slot: Slot) -> Result<Record, SlotError> {
        let (mut writer, mut flash) = (self.writer.clone(), self.flash.clone());
        let unseen = writer.finish(&mut flash, |_| None);
        let seen = self.writer.finish(&mut self.flash, |flash| {
            Some(&flash.bytes()[start(slot)..][..SLOT_LEN])
        });
        if !matches!(seen, Err(SlotError::Atlas(_))) {
            assert_eq!(unseen, seen);
        }
        seen
    }

    fn upload(&mut self, flown: Option<Slot>, atlas: &[u8]) -> Result<Record, SlotError> {
        let target = self.begin(flown, atlas)?;
        self.chunks(atlas, PART_LEN)?;
        self.finish(target.slot())
    }
}

impl Content {
    fn bytes(self) -> Vec<u8> {
        let (atlas, end) = match self {
            Self::Erased => (vec![], vec![]),
            Self::Zeros => return vec![0; SLOT_LEN],
            Self::Flashed(landmarks) => (atlas(landmarks), vec![]),
            Self::Recorded(landmarks, sequence) => {
                let atlas = atlas(landmarks);
                let record = record_of(&atlas, sequence).encode().to_vec();
                (atlas, record)
            }
            Self::Stale(landmarks) => {
                let record = record_of(&atlas(landmarks + 1), 9).encode();
                (atlas(landmarks), record.to_vec())
            }
            Self::Uncommitted(landmarks) => {
                let atlas = atlas(landmarks);
                let record = record_of(&atlas, 9).encode()[..RECORD_LEN / 2].to_vec();
                (atlas, record)
            }
        };
        let mut bytes = vec![0xff; SLOT_LEN];
        bytes[..atlas.len()].copy_from_slice(&atlas);
        bytes[ROOM..][..end.len()].copy_from_slice(&end);
        bytes
    }
}

fn start(slot: Slot) -> usize {
    match slot {
        Slot::A => REGION,
        Slot::B => REGION + SLOT_LEN,
    }
}

/// An atlas with so many landmarks, and as many bytes more.
fn atlas(landmarks: u8) -> Vec<u8> {
    let lattice = Lattice {
        origin: Point {
            x_px: 50.0,
            y_px: 50.0,
        },
        stride_px: 100.0,
        columns: landmarks.into(),
        rows: 1,
    };
    let grays = (0..landmarks).map(|number| [number, 255 - number, 7, 100]);
    let sample = Sample {
        survey: Survey::nominal([lattice].into_iter().collect()),
        map_px: (100 * u32::from(landmarks), 100),
        footprint_px: 100.0,
        likelihood: Likelihood {
            sharpness: 0.02,
            ceiling: 600.0,
        },
        grays: &grays.collect::<Vec<_>>(),
        places: &[[10.0, 10.0], [20.0, 20.0]],
        legs: &[&[1], &[0]],
    };
    let words = sample.emit();
    let bytes: &[u8] = bytemuck::cast_slice(&words);
    let len = u32::from_le_bytes(*bytes[8..].first_chunk().expect("a preamble"));
    bytes[..len as usize].to_vec()
}

/// The longest that can be uploaded: pages of a slot are all in use.
fn longest() -> Vec<u8> {
    let all = (1..).map(atlas).take_while(|atlas| atlas.len() <= ROOM);
    let longest = all.last().expect("a short one");
    assert!(longest.len() > SLOT_LEN - PAGE_LEN);
    longest
}

/// The CRC-32 in the preamble.
fn crc_of(atlas: &[u8]) -> u32 {
    u32::from_le_bytes(*atlas[12..].first_chunk().expect("a preamble"))
}

fn record_of(atlas: &[u8], sequence: u32) -> Record {
    Record {
        sequence,
        len: atlas.len() as u32,
        crc: crc_of(atlas),
        setup: SETUP,
    }
}
