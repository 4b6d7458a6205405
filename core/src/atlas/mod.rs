//! The atlas: everything the vehicle knows about its map, in one flash bundle that is used in place.
//!
//! The format is normative in `core/docs/atlas-format.md`; [`parse`](Atlas::parse) and [`emit()`] mirror each other
//! and share [`Layout`]. Parsing checks everything once, in a fixed order, with one error per rejection; afterwards
//! every accessor is total. The CRC covers every byte but itself.
//!
//! **Cost.** Parsing reads every byte twice (CRC, then limits) and copies none of the blobs; an [`Atlas`] is a few
//! slices and the decoded header.

mod emit;
mod error;
mod header;
mod parse;

pub use emit::{Contents, emit, emitted_len};
pub use error::{AtlasError, Part};
pub use header::{Blur, Header, Layout, Likelihood, Limits, Training};
pub use parse::Head;

use crate::{
    eigenspace::Eigenspace,
    landmark::{LandmarkTable, Survey},
    route::TopologicalMap,
};

/// The first bytes of every atlas.
pub const MAGIC: [u8; 4] = *b"EIGM";

/// The version of the format this code reads and writes.
pub const VERSION: u16 = 3;

/// Bytes before the header: magic, version, header length, total length, CRC.
pub const PREAMBLE_LEN: usize = 16;

/// Bytes that the header may take at most.
pub const MAX_HEADER_LEN: usize = 240;

/// The first bytes of an atlas, which hold preamble and header.
pub const HEAD_LEN: usize = PREAMBLE_LEN + MAX_HEADER_LEN;

/// Blobs start at multiples of this many bytes, and so must an atlas in memory.
pub const ALIGNMENT: usize = 8;

/// An atlas that passed every check, borrowed from wherever it lies.
#[derive(Clone, Debug)]
pub struct Atlas<'a> {
    header: Header,
    total_len: u32,
    crc: u32,
    eigenspace: Eigenspace<'a>,
    landmarks: LandmarkTable<'a>,
    thumbnails: &'a [u8],
    topology: TopologicalMap<'a>,
}

impl<'a> Atlas<'a> {
    /// The basis its views are projected on.
    #[must_use]
    pub fn eigenspace(&self) -> &Eigenspace<'a> {
        &self.eigenspace
    }

    /// Its landmarks, best first.
    #[must_use]
    pub fn landmarks(&self) -> &LandmarkTable<'a> {
        &self.landmarks
    }

    /// Its places and the legs between them; empty when it has none.
    #[must_use]
    pub fn topology(&self) -> &TopologicalMap<'a> {
        &self.topology
    }

    /// Where, in which direction and from what altitude its candidates are seen.
    #[must_use]
    pub fn survey(&self) -> &Survey {
        &self.header.survey
    }

    /// What counts as known.
    #[must_use]
    pub fn limits(&self) -> Limits {
        self.header.limits
    }

    /// The decoded header.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Its length in bytes.
    #[must_use]
    pub fn total_len(&self) -> u32 {
        self.total_len
    }

    /// Its CRC-32, which also serves as its identity.
    #[must_use]
    pub fn crc(&self) -> u32 {
        self.crc
    }

    /// All thumbnails, one after the other; empty when the atlas has none.
    #[must_use]
    pub fn thumbnails(&self) -> &'a [u8] {
        self.thumbnails
    }

    /// The thumbnail of landmark `index` (0-based), row-major, `header().thumbnail_side` pixels per side; `None` when
    /// the atlas has none or no such landmark.
    #[must_use]
    pub fn thumbnail(&self, index: usize) -> Option<&'a [u8]> {
        let len = usize::from(self.header.thumbnail_side) * usize::from(self.header.thumbnail_side);
        if len == 0 {
            return None;
        }
        self.thumbnails.chunks_exact(len).nth(index)
    }
}

/// CRC-32 (ISO-HDLC, as in zlib) of everything in `atlas` but the four bytes of the CRC field itself.
/// Of nothing where it is too short for that.
#[must_use]
pub fn checksum(atlas: &[u8]) -> u32 {
    let mut checksum = Checksum::new();
    checksum.update(atlas);
    checksum.finalize()
}

/// The same of an atlas that comes in pieces, of which the first has the whole preamble.
#[derive(Clone)]
pub struct Checksum {
    digest: crc::Digest<'static, u32>,
    has_begun: bool,
}

static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

impl Default for Checksum {
    fn default() -> Self {
        Self::new()
    }
}

impl Checksum {
    /// Of nothing.
    #[must_use]
    pub fn new() -> Self {
        Self {
            digest: CRC.digest(),
            has_begun: false,
        }
    }

    /// Takes the next piece.
    pub fn update(&mut self, piece: &[u8]) {
        let mut rest = piece;
        if !core::mem::replace(&mut self.has_begun, true) {
            self.digest
                .update(piece.get(..PREAMBLE_LEN - 4).unwrap_or_default());
            rest = piece.get(PREAMBLE_LEN..).unwrap_or_default();
        }
        self.digest.update(rest);
    }

    /// The CRC.
    #[must_use]
    pub fn finalize(self) -> u32 {
        self.digest.finalize()
    }
}

#[cfg(any(test, feature = "std"))]
pub mod sample;
#[cfg(test)]
mod tests;
