//! View → coefficients: projection on the basis of the map's eigenspace, in integers.
//!
//! **What.** g = Tᵀ(x − x̄) (report (2.10)) where x is the view after normalization, blur and high-pass. All of those
//! are linear up to one division, so the trainer folds them into integer weights and the board computes, per row r,
//! one dot product of pixels with i16 weights in an i32, then
//! `coefficient = round(dot · gain · scale_r − offset_r)` in steps of the landmark table.
//!
//! **Notation.** m pixels y (u8), k rows, S = Σy, Q = Σy². The gain is 1, or 1/σ of the view under
//! [`Normalize::Std`]. With [`Normalize::Mean`] and [`Normalize::Std`] the weights of every row add up to zero, so
//! that subtracting the view's mean costs nothing.
//!
//! **Distance from feature space.** ‖n(y) − ȳ‖² − ‖g‖² where n is the normalization and ȳ the mean of n(y) over the
//! training views (Moghaddam and Pentland 1997). ‖n(y)‖² follows from S and Q; ȳ·n(y) is one more row of 8-bit
//! weights. It is an energy in squared gray levels (in units of m under `Std`).
//!
//! **Layout.** Rows come in blocks of [`ROWS_PER_BLOCK`], pixels in groups of four; a group of a block holds its rows
//! one after the other, and within a row the weights of pixels 0, 2, 1, 3 — the order in which Armv7E-M's UXTB16
//! unpacks bytes. Rows and pixels that do not exist have weight zero. [`weight_index`] is the map.
//!
//! **Limits.** 255·Σ|w| < 2³¹ for every row, so that no view overflows; the atlas parser checks it.

mod project;

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use crate::kernel::{Pair, Weights};

pub use crate::kernel::{PIXELS_PER_GROUP, ROWS_PER_BLOCK};
pub use project::Projection;

/// The largest number of dimensions, k.
pub const MAX_DIMENSIONS: u8 = 128;

/// Where the weight of pixel p of a group stands within the group; its own inverse.
const LANE: [usize; PIXELS_PER_GROUP] = [0, 2, 1, 3];

/// Contrast normalization n(y) of a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Normalize {
    /// n(y) = y.
    None,
    /// n(y) = y − mean(y): offsets of brightness drop out.
    Mean,
    /// n(y) = (y − mean(y)) / σ(y): gain and offset drop out. A flat view has no n(y).
    Std,
}

/// Per basis row: how its integer dot product becomes a coefficient.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Row {
    /// Steps per unit of dot product; positive.
    pub scale: f32,
    /// Projection of the training mean, in steps; subtracted.
    pub offset: f32,
    /// Eigenspace units per step, before whitening; positive.
    pub spread: f32,
}

/// The mean row: ȳ·n(y) = (base·S + scale·Σ weight·y) · gain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeanRow {
    /// Gray level common to all pixels of ȳ; zero unless the normalization is [`Normalize::None`].
    pub base: f32,
    /// Gray levels per unit of weight; positive.
    pub scale: f32,
    /// ‖ȳ‖².
    pub energy: f32,
}

/// k coordinates of a view in an eigenspace, in steps of its landmark table.
///
/// Values are stored in pairs; those that do not exist are zero.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Coefficients {
    pairs: [Pair; MAX_DIMENSIONS as usize / 2],
    len: u8,
    squared_norm: u32,
}

/// The basis of an eigenspace, borrowed from an atlas; valid by construction.
#[derive(Clone, Copy, Debug)]
pub struct Eigenspace<'a> {
    pub(crate) side: u8,
    pub(crate) normalize: Normalize,
    pub(crate) limit: i16,
    pub(crate) mean: MeanRow,
    pub(crate) mean_weights: &'a [Weights],
    pub(crate) rows: &'a [Row],
    pub(crate) weights: &'a [Pair],
}

impl Coefficients {
    /// k zeros; k is clamped to [`MAX_DIMENSIONS`].
    #[must_use]
    pub fn zeros(k: u8) -> Self {
        Self {
            pairs: [Pair([0; 2]); MAX_DIMENSIONS as usize / 2],
            len: k.min(MAX_DIMENSIONS),
            squared_norm: 0,
        }
    }

    /// Coefficients with some values; `None` when there are more than [`MAX_DIMENSIONS`].
    #[must_use]
    pub fn from_values(values: &[i16]) -> Option<Self> {
        let len = u8::try_from(values.len()).ok()?;
        if len > MAX_DIMENSIONS {
            return None;
        }
        let mut coefficients = Self::zeros(len);
        bytemuck::cast_slice_mut(&mut coefficients.pairs)[..values.len()].copy_from_slice(values);
        coefficients.squared_norm = squared_norm(values.iter().copied());
        Some(coefficients)
    }

    /// Their number, k.
    #[must_use]
    pub fn dimensions(&self) -> u8 {
        self.len
    }

    /// The k values.
    #[must_use]
    pub fn values(&self) -> &[i16] {
        let values: &[i16] = bytemuck::cast_slice(&self.pairs);
        values.get(..usize::from(self.len)).unwrap_or_default()
    }

    /// The first `len` pairs of values and the zeros after them; no more than [`MAX_DIMENSIONS`] values.
    pub(crate) fn pairs(&self, len: usize) -> &[Pair] {
        &self.pairs[..len.min(self.pairs.len())]
    }

    /// ‖g‖² in squared steps: below 2²⁹ for values within [`coefficient_limit`].
    #[must_use]
    pub fn squared_norm(&self) -> u32 {
        self.squared_norm
    }
}

impl<'a> Eigenspace<'a> {
    /// Pixels per side of the views it projects, v.
    #[must_use]
    pub fn side(&self) -> u8 {
        self.side
    }

    /// Dimensions, k.
    #[must_use]
    pub fn dimensions(&self) -> u8 {
        self.rows.len() as u8
    }

    /// Contrast normalization of its views.
    #[must_use]
    pub fn normalize(&self) -> Normalize {
        self.normalize
    }

    /// The largest magnitude of a coefficient; larger ones are clamped and reported.
    #[must_use]
    pub fn coefficient_limit(&self) -> i16 {
        self.limit
    }

    /// Per-row factors, k of them.
    #[must_use]
    pub fn rows(&self) -> &'a [Row] {
        self.rows
    }

    /// All weights as stored, see [`weight_index`].
    #[must_use]
    pub fn stored_weights(&self) -> &'a [i16] {
        bytemuck::cast_slice(self.weights)
    }

    /// The weights of the mean row as stored: in picture order, padded with zeros to whole groups.
    #[must_use]
    pub fn stored_mean_weights(&self) -> &'a [i8] {
        bytemuck::cast_slice(self.mean_weights)
    }

    /// The integer weight of `pixel` in basis row `row`, as stored; zero outside the basis.
    #[must_use]
    pub fn weight(&self, row: usize, pixel: usize) -> i16 {
        self.stored_weights()
            .get(weight_index(self.side, row, pixel))
            .copied()
            .unwrap_or(0)
    }
}

/// Where the weight of `pixel` in basis row `row` is stored, for views of `side`×`side` pixels.
///
/// ```
/// use eigenmark_core::eigenspace::weight_index;
/// assert_eq!(weight_index(2, 0, 1), 2); // pixels 0, 1, 2, 3 are stored as 0, 2, 1, 3
/// assert_eq!(weight_index(2, 1, 0), 4); // the next row of the block follows
/// ```
#[must_use]
pub fn weight_index(side: u8, row: usize, pixel: usize) -> usize {
    let (block, row) = (row / ROWS_PER_BLOCK, row % ROWS_PER_BLOCK);
    let (group, pixel) = (pixel / PIXELS_PER_GROUP, pixel % PIXELS_PER_GROUP);
    let run = (block * groups(side) + group) * ROWS_PER_BLOCK + row;
    run * PIXELS_PER_GROUP + LANE[pixel]
}

/// Number of stored weights of a basis of `dimensions` rows for views of `side`×`side` pixels.
#[must_use]
pub fn weight_count(side: u8, dimensions: u8) -> usize {
    usize::from(dimensions).div_ceil(ROWS_PER_BLOCK) * ROWS_PER_BLOCK * padded_pixels(side)
}

/// m rounded up to whole groups: the number of weights of the mean row.
#[must_use]
pub fn padded_pixels(side: u8) -> usize {
    groups(side) * PIXELS_PER_GROUP
}

/// The largest magnitude of an i16 coefficient for which squared distances of k of them stay below 2³¹:
/// k·(2·limit)² < 2³¹.
///
/// ```
/// use eigenmark_core::eigenspace::coefficient_limit;
/// assert_eq!(coefficient_limit(15), 5982);
/// assert_eq!(coefficient_limit(1), 16_383); // differences also fit an i16
/// ```
#[must_use]
pub fn coefficient_limit(dimensions: u8) -> i16 {
    let k = u32::from(dimensions.max(1));
    let limit = ((i32::MAX as u32) / k).isqrt() / 2;
    limit.min(16_383) as i16
}

/// Sum of squares; wraps only beyond [`coefficient_limit`], which the atlas parser refuses.
pub(crate) fn squared_norm(values: impl Iterator<Item = i16>) -> u32 {
    values
        .map(|value| (i32::from(value) * i32::from(value)) as u32)
        .fold(0, u32::wrapping_add)
}

fn groups(side: u8) -> usize {
    (usize::from(side) * usize::from(side)).div_ceil(PIXELS_PER_GROUP)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_weight_has_a_place_of_its_own() {
        for (side, dimensions) in [(2, 1), (3, 5), (5, 7), (20, 15), (50, 128)] {
            let mut seen = std::vec![false; weight_count(side, dimensions)];
            for row in 0..usize::from(dimensions) {
                for pixel in 0..usize::from(side) * usize::from(side) {
                    let index = weight_index(side, row, pixel);
                    assert!(!seen[index], "row {row} pixel {pixel}");
                    seen[index] = true;
                }
            }
        }
    }

    #[test]
    fn limits_keep_squared_distances_below_two_to_the_31() {
        for k in 1..=MAX_DIMENSIONS {
            let limit = i64::from(coefficient_limit(k));
            assert!(i64::from(k) * 4 * limit * limit < 1 << 31);
            assert!(2 * limit <= i64::from(i16::MAX));
        }
    }
}
