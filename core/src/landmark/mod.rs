//! Landmarks: stored coefficients, where they were seen, and how far each can be trusted.
//!
//! A [`LandmarkTable`] borrows its parts from an atlas and is valid by construction. Candidates are numbered from 1,
//! as in the report; a [`Survey`] says where on the map each number lies, and how it is seen.

mod dissimilarity;
mod lattice;
mod nearest;
mod prior;
mod refine;
mod survey;

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

pub use lattice::{Lattice, Lattices, Point};
pub use nearest::{Match, Nearest};
pub use prior::{Circle, Prior, Sector};
pub use refine::{MAX_STRIDE, Refined};
pub use survey::{Altitudes, Candidate, Layer, MAX_ALTITUDES, MAX_HEADINGS, Survey};

use crate::kernel::Pair;
pub use crate::kernel::Width;

/// How dissimilar two points of the eigenspace are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Metric {
    /// Normalized sum of squared differences ‖a − b‖² / (2(‖a‖² + ‖b‖²)), in 0..=1; report (2.35), corrected. 0/0 is 0.
    Nssd,
    /// Euclidean distance ‖a − b‖, in eigenspace units.
    Euclid,
    /// Angle between a and b, in radians, in 0..=π. The angle with a zero vector is π/2.
    Cosine,
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

/// All landmarks of an atlas, best first.
#[derive(Clone, Copy, Debug)]
pub struct LandmarkTable<'a> {
    pub(crate) metric: Metric,
    pub(crate) dimensions: u8,
    pub(crate) step: f32,
    pub(crate) width: Width,
    /// Words per row.
    pub(crate) row_len: usize,
    /// Landmark i (0-based) is candidate i + 1, and none is missing.
    pub(crate) is_whole: bool,
    pub(crate) coefficients: &'a [Pair],
    pub(crate) squared_norms: &'a [u32],
    pub(crate) records: &'a [Record],
}

impl Width {
    /// The largest magnitude of a coefficient of this width in k dimensions.
    #[must_use]
    pub fn limit(self, dimensions: u8) -> i16 {
        match self {
            Self::I16 => crate::eigenspace::coefficient_limit(dimensions),
            Self::I8 => crate::eigenspace::coefficient_limit(dimensions).min(127),
        }
    }

    /// How a row's number that stores the coefficients `a` (and, of this width, `b` after it) reads.
    ///
    /// A pair of 8-bit coefficients is one 16-bit number, 256·b + a: the board multiplies with both at once.
    #[must_use]
    pub fn pack(self, a: i16, b: i16) -> i16 {
        match self {
            Self::I16 => a,
            Self::I8 => b.wrapping_mul(256).wrapping_add(a),
        }
    }

    /// Coefficients per stored number.
    #[must_use]
    pub fn per_number(self) -> usize {
        match self {
            Self::I16 => 1,
            Self::I8 => 2,
        }
    }

    /// The coefficient `index` of a row.
    pub(crate) fn unpack(self, row: &[i16], index: usize) -> Option<i16> {
        let number = *row.get(index / self.per_number())?;
        Some(match (self, index % 2) {
            (Self::I16, _) => number,
            (Self::I8, 0) => i16::from(number as i8),
            (Self::I8, _) => number.wrapping_sub(i16::from(number as i8)) >> 8,
        })
    }
}

/// Words (of 32 bits) per stored row: k coefficients and zeros up to the end of the last word.
#[must_use]
pub fn row_len(dimensions: u8, width: Width) -> usize {
    usize::from(dimensions).div_ceil(2 * width.per_number())
}

impl<'a> LandmarkTable<'a> {
    /// Number of landmarks, l; at least one.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a table is never empty")]
    pub fn len(&self) -> usize {
        self.squared_norms.len()
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

    /// Whether it is the table of a whole survey: all candidates, in their order.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Width of the stored coefficients.
    #[must_use]
    pub fn width(&self) -> Width {
        self.width
    }

    /// Candidate numbers and radii, best landmark first.
    #[must_use]
    pub fn records(&self) -> &'a [Record] {
        self.records
    }

    /// The first `count` landmarks (at least one): a table of its own, because landmarks are stored best first.
    #[must_use]
    pub fn prefix(&self, count: usize) -> Self {
        let count = count.min(self.len()).max(1);
        Self {
            coefficients: first(self.coefficients, count * self.row_len),
            squared_norms: first(self.squared_norms, count),
            records: first(self.records, count),
            is_whole: self.is_whole && count == self.len(),
            ..*self
        }
    }

    /// The stored coefficients of landmark `index` (0-based), k of them; nothing past the end of the table.
    pub fn coefficients(&self, index: usize) -> impl Iterator<Item = i16> + use<'a> {
        let row = self
            .coefficients
            .chunks_exact(self.row_len.max(1))
            .nth(index);
        let (k, width) = (usize::from(self.dimensions), self.width);
        row.into_iter().flat_map(move |row| {
            (0..k).map_while(move |index| width.unpack(bytemuck::cast_slice(row), index))
        })
    }
}

fn first<T>(items: &[T], count: usize) -> &[T] {
    items.get(..count).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_of_8_bit_coefficients_come_back() {
        for a in -127..=127 {
            for b in -127..=127 {
                let row = [Width::I8.pack(a, b)];
                assert_eq!(Width::I8.unpack(&row, 0), Some(a));
                assert_eq!(Width::I8.unpack(&row, 1), Some(b));
            }
        }
    }

    #[test]
    fn rows_are_whole_words() {
        assert_eq!(
            [1, 2, 15, 16, 17].map(|k| row_len(k, Width::I16)),
            [1, 1, 8, 8, 9]
        );
        assert_eq!(
            [1, 4, 15, 16, 17].map(|k| row_len(k, Width::I8)),
            [1, 1, 4, 4, 5]
        );
    }
}
