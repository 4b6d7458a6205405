//! Landmarks: stored coefficients, where they were seen, and how far each can be trusted.
//!
//! A [`LandmarkTable`] borrows its parts from an atlas and is valid by construction. Candidates are numbered from 1,
//! as in the report; [`lattice`] says where on the map each number lies.

pub mod lattice;
mod nearest;

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

pub use lattice::{Lattice, Lattices, Point};
pub use nearest::{Match, Nearest};

/// How dissimilar two points of the eigenspace are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Metric {
    /// Normalized sum of squared differences ‖a − b‖² / (2(‖a‖² + ‖b‖²)), in 0..=1; report (2.35), corrected. 0/0 is 0.
    Nssd,
    /// Euclidean distance ‖a − b‖, in eigenspace units.
    Euclid,
}

/// What an atlas stores per landmark beside its coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Record {
    /// Number of the candidate this landmark was selected from, 1-based.
    pub view: u32,
    /// A fix closer than this is guaranteed: at most ε_i of report (2.38), reconstructed, narrowed by the quantization
    /// error and by wrong fixes met in training; in the metric's unit.
    pub radius: f32,
}

/// The stored coefficients of all landmarks, l rows of [`row_len`] numbers.
#[derive(Clone, Copy, Debug)]
pub enum Table<'a> {
    /// 16-bit coefficients.
    I16(&'a [i16]),
    /// 8-bit coefficients.
    I8(&'a [i8]),
}

/// Width of a stored coefficient.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Width {
    /// 16 bits.
    I16,
    /// 8 bits.
    I8,
}

/// All landmarks of an atlas, best first.
#[derive(Clone, Copy, Debug)]
pub struct LandmarkTable<'a> {
    pub(crate) metric: Metric,
    pub(crate) dimensions: u8,
    pub(crate) step: f32,
    pub(crate) coefficients: Table<'a>,
    pub(crate) squared_norms: &'a [u32],
    pub(crate) records: &'a [Record],
}

impl Width {
    /// Bytes per coefficient.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::I16 => 2,
            Self::I8 => 1,
        }
    }

    /// The largest magnitude of a coefficient of this width in k dimensions.
    #[must_use]
    pub fn limit(self, dimensions: u8) -> i16 {
        match self {
            Self::I16 => crate::eigenspace::coefficient_limit(dimensions),
            Self::I8 => crate::eigenspace::coefficient_limit(dimensions).min(127),
        }
    }
}

/// Numbers per stored row: k rounded up so that every row starts on a 32-bit word; the surplus is zero.
#[must_use]
pub fn row_len(dimensions: u8, width: Width) -> usize {
    usize::from(dimensions).next_multiple_of(4 / width.bytes())
}

impl<'a> LandmarkTable<'a> {
    /// Number of landmarks, l; at least one.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a table is never empty")]
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// The metric it is matched with.
    #[must_use]
    pub fn metric(&self) -> Metric {
        self.metric
    }

    /// Eigenspace units per step of a coefficient.
    #[must_use]
    pub fn step(&self) -> f32 {
        self.step
    }

    /// Width of the stored coefficients.
    #[must_use]
    pub fn width(&self) -> Width {
        match self.coefficients {
            Table::I16(_) => Width::I16,
            Table::I8(_) => Width::I8,
        }
    }

    /// Candidate numbers and radii, best landmark first.
    #[must_use]
    pub fn records(&self) -> &'a [Record] {
        self.records
    }

    /// The first `count` landmarks (at least one): a table of its own, because landmarks are stored best first.
    #[must_use]
    pub fn prefix(&self, count: usize) -> Self {
        let count = count.clamp(1, self.len());
        let len = count * row_len(self.dimensions, self.width());
        Self {
            coefficients: match self.coefficients {
                Table::I16(values) => Table::I16(&values[..len]),
                Table::I8(values) => Table::I8(&values[..len]),
            },
            squared_norms: &self.squared_norms[..count],
            records: &self.records[..count],
            ..*self
        }
    }

    /// The stored coefficients of landmark `index` (0-based), k of them; nothing past the end of the table.
    pub fn coefficients(&self, index: usize) -> impl Iterator<Item = i16> + use<'a> {
        let (k, stride) = (
            usize::from(self.dimensions),
            row_len(self.dimensions, self.width()),
        );
        let table = self.coefficients;
        (index * stride..index * stride + k).map_while(move |i| match table {
            Table::I16(values) => values.get(i).copied(),
            Table::I8(values) => values.get(i).map(|&value| i16::from(value)),
        })
    }
}
