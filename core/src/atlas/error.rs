//! Why bytes are not an atlas: one variant per kind of check, each with its numbers.

use core::fmt;

use super::{ALIGNMENT, MAGIC, VERSION};
use crate::route::MapError;

/// The first check that failed, with the numbers that failed it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AtlasError {
    /// The bytes do not start at a multiple of eight in memory.
    Misaligned {
        /// Bytes past the last multiple.
        offset: u8,
    },
    /// There are fewer bytes than the preamble or the stated length needs.
    Truncated {
        /// Bytes needed.
        needed: u32,
        /// Bytes found.
        have: u32,
    },
    /// It does not start with the magic bytes.
    Magic {
        /// The bytes found.
        found: [u8; 4],
    },
    /// It was written in another version of the format.
    Version {
        /// The version found.
        found: u16,
    },
    /// The CRC does not match.
    Crc {
        /// The CRC in the preamble.
        stored: u32,
        /// The CRC of the bytes.
        computed: u32,
    },
    /// The header is longer than the atlas, or than any header may be, or does not decode in its stated length.
    Header {
        /// The stated length of the header.
        len: u16,
    },
    /// A count or size in the header is outside its range.
    Range {
        /// What it counts.
        part: Part,
        /// The value found.
        found: u32,
        /// The smallest accepted value.
        min: u32,
        /// The largest accepted value.
        max: u32,
    },
    /// The stated length is not the one that the header implies.
    Length {
        /// The length the header implies.
        expected: u64,
        /// The length stated.
        found: u32,
    },
    /// A number that must be finite (and positive, or not negative, or in a range, or in order) is not.
    Number {
        /// Where.
        part: Part,
        /// Which one, 0-based.
        index: u32,
    },
    /// A basis row could overflow the accumulator: 255·Σ|w| is not below 2³¹.
    Weights {
        /// Basis row, 0-based.
        row: u32,
        /// Σ|w| found.
        sum: u32,
    },
    /// Under mean or unit-variance normalization a row's weights do not add up to zero.
    Unbalanced {
        /// Basis row, 0-based; the mean row is row k.
        row: u32,
        /// The sum found.
        sum: i32,
    },
    /// A landmark's coefficient is larger than squared distances allow.
    Coefficient {
        /// Landmark, 0-based.
        landmark: u32,
        /// The value found.
        found: i16,
        /// The largest accepted magnitude.
        limit: i16,
    },
    /// A landmark's stored squared norm is not that of its coefficients.
    Norm {
        /// Landmark, 0-based.
        landmark: u32,
        /// The value found.
        found: u32,
        /// The value of its coefficients.
        expected: u32,
    },
    /// A landmark names a candidate that the survey does not have.
    View {
        /// Landmark, 0-based.
        landmark: u32,
        /// The candidate named.
        found: u32,
        /// Number of candidates.
        candidates: u32,
    },
    /// Places and legs do not belong together.
    Topology(MapError),
    /// Padding is not zero.
    Padding {
        /// Where.
        part: Part,
    },
    /// There is no room for the atlas in the buffer to be written to.
    NoRoom {
        /// Bytes needed.
        needed: u64,
        /// Bytes given.
        have: u32,
    },
}

/// A part of an atlas, for errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Part {
    /// Pixels per side of a view.
    ViewSide,
    /// Dimensions of the eigenspace.
    Dimensions,
    /// Number of landmarks.
    Landmarks,
    /// Number of lattices.
    Lattices,
    /// Columns, rows, stride or origin of a lattice.
    Lattice,
    /// Number of headings.
    Headings,
    /// Altitudes, or their number.
    Altitudes,
    /// Size of the map, in pixels.
    Map,
    /// Side of a view's footprint.
    Footprint,
    /// Eigenspace units per coefficient step.
    Step,
    /// Error of a view's coefficients.
    Error,
    /// Limits of the known judgement.
    Limits,
    /// Sharpness and ceiling of the likelihood.
    Likelihood,
    /// Places of the topological map.
    Places,
    /// Legs of the topological map.
    Legs,
    /// The training settings.
    Training,
    /// Factors of the mean row.
    MeanRow,
    /// Weights of the mean row.
    MeanWeights,
    /// Factors of the basis rows.
    Rows,
    /// Weights of the basis.
    Weights,
    /// Coefficients of the landmarks.
    Coefficients,
    /// Candidate numbers and radii of the landmarks.
    Records,
    /// Space between blobs.
    Gap,
}

impl fmt::Display for AtlasError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Misaligned { offset } => {
                write!(
                    f,
                    "the atlas must start at a multiple of {ALIGNMENT} bytes in memory, not {offset} past it"
                )
            }
            Self::Truncated { needed, have } => {
                write!(
                    f,
                    "the atlas is cut short: {needed} bytes needed, {have} found"
                )
            }
            Self::Magic { found } => {
                write!(
                    f,
                    "not an atlas: expected it to start with {MAGIC:02x?}, found {found:02x?}"
                )
            }
            Self::Version { found } => {
                write!(
                    f,
                    "the atlas has format version {found}; this program reads version {VERSION}"
                )
            }
            Self::Crc { stored, computed } => {
                write!(
                    f,
                    "the atlas is damaged: its CRC is {stored:08x}, its bytes give {computed:08x}"
                )
            }
            Self::Header { len } => write!(f, "the atlas header of {len} bytes does not decode"),
            Self::Range {
                part,
                found,
                min,
                max,
            } => {
                write!(f, "{part}: expected {min} to {max}, found {found}")
            }
            Self::Length { expected, found } => {
                write!(
                    f,
                    "the atlas states {found} bytes, its header implies {expected}"
                )
            }
            Self::Number { part, index } => {
                write!(
                    f,
                    "{part}: number {index} is not finite, has the wrong sign, or is out of range"
                )
            }
            Self::Weights { row, sum } => {
                write!(
                    f,
                    "basis row {row} could overflow: the magnitudes of its weights add up to {sum}"
                )
            }
            Self::Unbalanced { row, sum } => {
                write!(
                    f,
                    "the weights of row {row} must add up to 0 when the mean is removed, not {sum}"
                )
            }
            Self::Coefficient {
                landmark,
                found,
                limit,
            } => {
                write!(
                    f,
                    "landmark {landmark} has the coefficient {found}, beyond ±{limit}"
                )
            }
            Self::Norm {
                landmark,
                found,
                expected,
            } => {
                write!(
                    f,
                    "landmark {landmark} has the squared norm {found}, its coefficients give {expected}"
                )
            }
            Self::View {
                landmark,
                found,
                candidates,
            } => {
                write!(f, "landmark {landmark} names view {found} of {candidates}")
            }
            Self::Topology(error) => error.fmt(f),
            Self::Padding { part } => write!(f, "{part}: padding is not zero"),
            Self::NoRoom { needed, have } => {
                write!(f, "the atlas needs {needed} bytes, {have} are given")
            }
        }
    }
}

impl core::error::Error for AtlasError {}

impl From<MapError> for AtlasError {
    fn from(error: MapError) -> Self {
        Self::Topology(error)
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ViewSide => "pixels per side of a view",
            Self::Dimensions => "dimensions of the eigenspace",
            Self::Landmarks => "number of landmarks",
            Self::Lattices => "number of lattices",
            Self::Lattice => "lattice",
            Self::Headings => "number of headings",
            Self::Altitudes => "altitudes",
            Self::Map => "size of the map",
            Self::Footprint => "footprint of a view",
            Self::Step => "coefficient step",
            Self::Error => "coefficient error",
            Self::Limits => "limits of known",
            Self::Likelihood => "likelihood",
            Self::Places => "number of places",
            Self::Legs => "number of legs",
            Self::Training => "training settings",
            Self::MeanRow => "mean row",
            Self::MeanWeights => "weights of the mean row",
            Self::Rows => "basis rows",
            Self::Weights => "weights of the basis",
            Self::Coefficients => "landmark coefficients",
            Self::Records => "landmark records",
            Self::Gap => "space between blobs",
        })
    }
}
