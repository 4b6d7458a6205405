//! A share of the candidates, folded: what one of several machines, or one of several runs, contributes to training.
//!
//! **File.** `EIGPART` and a version byte, the [`Part`] as postcard, and a CRC-32 (ISO-HDLC, little-endian) of all bytes
//! before it. A file may come from anywhere: lengths, numbers and the checksum are checked before anything is used.

use std::{
    fmt,
    fs::File,
    io::{self, Read},
    path::Path,
    str::FromStr,
};

use serde::{Deserialize, Serialize};

use crate::learn::{Fold, Settings};

/// What a file begins with; the last byte is the version.
const MAGIC: [u8; 8] = *b"EIGPART\x02";

/// The largest file: products of views of 50×50 pixels take 50 MB.
const MAX_PART_BYTES: u64 = 64 << 20;

/// No number of a vector is larger: 255 gray levels, or the square root of the largest number of pixels under unit
/// variance; a high-pass doubles it at most.
const LARGEST: f64 = 512.0;

/// Which share of the candidates: part `index` of `of`, 1-based.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    index: u32,
    of: u32,
}

/// A folded share of the candidates, and what it was folded for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Which share.
    pub shard: Shard,
    /// How the atlas is to be trained: the same in all parts.
    pub settings: Settings,
    /// CRC-32 of the map's luminance.
    pub map_crc: u32,
    /// The candidates of the share.
    pub fold: Fold,
}

/// Why bytes are not a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PartError {
    /// The file cannot be read.
    #[error("cannot read: {0}")]
    Read(io::ErrorKind),
    /// The file has more bytes than a part can have.
    #[error("no part of a training: a part has at most {MAX_PART_BYTES} bytes")]
    TooLarge,
    /// They begin with something else.
    #[error("no part of a training: it does not begin with EIGPART and version {}", MAGIC[7])]
    Magic,
    /// Something was changed, cut off or added.
    #[error("a damaged part of a training: its checksum is {found:08x}, expected {expected:08x}")]
    Checksum {
        /// In the last four bytes.
        expected: u32,
        /// Of the bytes before them.
        found: u32,
    },
    /// The checksum is right, but what it covers is no part.
    #[error("a damaged part of a training: its contents make no sense")]
    Contents,
}

impl Shard {
    /// Part `index` of `of`, 1-based; `None` unless 1 ≤ index ≤ of.
    #[must_use]
    pub fn new(index: u32, of: u32) -> Option<Self> {
        (1..=of).contains(&index).then_some(Self { index, of })
    }

    /// Which part, 1-based.
    #[must_use]
    pub fn index(self) -> u32 {
        self.index
    }

    /// Number of parts.
    #[must_use]
    pub fn of(self) -> u32 {
        self.of
    }

    /// First and end of its share of `count` candidates, 0-based.
    ///
    /// ```
    /// use eigenmark::train::Shard;
    /// let shares = [1, 2, 3].map(|index| Shard::new(index, 3).expect("of 3").range(83));
    /// assert_eq!(shares, [(0, 27), (27, 55), (55, 83)]);
    /// ```
    #[must_use]
    pub fn range(self, count: usize) -> (usize, usize) {
        let cut = |parts: u32| (count as u128 * u128::from(parts) / u128::from(self.of)) as usize;
        (cut(self.index - 1), cut(self.index))
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.split_once('/')
            .and_then(|(index, of)| Self::new(index.parse().ok()?, of.parse().ok()?))
            .ok_or_else(|| "expected i/n with i from 1 to n, such as 2/4".to_owned())
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl Part {
    /// The file's bytes.
    ///
    /// # Panics
    /// Never: everything in a part can be written.
    #[must_use]
    pub fn emit(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(postcard::to_stdvec(self).expect("a part can be written"));
        let crc = checksum(&bytes);
        bytes.extend(crc.to_le_bytes());
        bytes
    }

    /// Reads a part from a file, which may be of any kind and size.
    ///
    /// # Errors
    /// When it cannot be read, is too large, or is no part, or a damaged one.
    pub fn read(path: &Path) -> Result<Self, PartError> {
        let mut bytes = Vec::new();
        let read = |error: io::Error| PartError::Read(error.kind());
        let file = File::open(path).map_err(read)?;
        file.take(MAX_PART_BYTES + 1)
            .read_to_end(&mut bytes)
            .map_err(read)?;
        if bytes.len() as u64 > MAX_PART_BYTES {
            return Err(PartError::TooLarge);
        }
        Self::parse(&bytes)
    }

    /// Reads a file's bytes.
    ///
    /// # Errors
    /// When they are no part, or a damaged one.
    pub fn parse(bytes: &[u8]) -> Result<Self, PartError> {
        let body = bytes.strip_prefix(&MAGIC).ok_or(PartError::Magic)?;
        let (body, crc) = body.split_last_chunk::<4>().ok_or(PartError::Magic)?;
        let expected = u32::from_le_bytes(*crc);
        let found = checksum(&bytes[..bytes.len() - crc.len()]);
        if found != expected {
            return Err(PartError::Checksum { expected, found });
        }
        let (part, rest) =
            postcard::take_from_bytes::<Self>(body).map_err(|_| PartError::Contents)?;
        let is_shard = Shard::new(part.shard.index, part.shard.of).is_some();
        let is_sound = part.fold.is_sound(LARGEST) && part.settings.is_sound();
        if is_shard && rest.is_empty() && is_sound {
            Ok(part)
        } else {
            Err(PartError::Contents)
        }
    }
}

fn checksum(bytes: &[u8]) -> u32 {
    crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(bytes)
}
