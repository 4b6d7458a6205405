//! The projection itself: integer dot products, then one float multiply-subtract per dimension.
//!
//! **Cost.** m·k integer multiply-adds, m more for the mean row, and k roundings; under `Std` one square root.

use super::{Coefficients, Eigenspace, Normalize, PIXELS_PER_GROUP, ROWS_PER_BLOCK};
use crate::{
    math::{round_clamped, sqrt},
    preprocess::View,
};

/// What the eigenspace says about a view.
#[derive(Clone, Debug, PartialEq)]
pub struct Projection {
    /// Its coordinates g, in steps.
    pub coefficients: Coefficients,
    /// Distance from feature space ‖n(y) − ȳ‖² − ‖g‖²; finite, and never negative.
    pub from_feature_space: f32,
    /// Whether a coordinate was clamped: the view is far from everything the table can hold.
    pub clamped: bool,
}

impl Eigenspace<'_> {
    /// Projects a view. `None` when the view has no contrast to normalize (flat, under [`Normalize::Std`]) or its
    /// side is not the eigenspace's.
    #[must_use]
    pub fn project(&self, view: &View) -> Option<Projection> {
        if view.side() != self.side {
            return None;
        }
        let m = view.pixels().len() as f32;
        let variance = view.scaled_variance() as f32; // m²σ²
        let (gain, energy) = match self.normalize {
            Normalize::None => (1.0, view.sum_of_squares() as f32),
            Normalize::Mean => (1.0, variance / m),
            Normalize::Std if view.scaled_variance() == 0 => return None,
            Normalize::Std => (m / sqrt(variance), m),
        };

        let mut coefficients = Coefficients::zeros(self.dimensions());
        let (mut in_feature_space, mut clamped) = (0.0_f32, false);
        let targets = coefficients.values.chunks_mut(ROWS_PER_BLOCK);
        for ((block, rows), targets) in self
            .blocks()
            .zip(self.rows.chunks(ROWS_PER_BLOCK))
            .zip(targets)
        {
            let dots = block_dots(view.padded(), block);
            for ((dot, row), target) in dots.into_iter().zip(rows).zip(targets) {
                let (steps, was_clamped) =
                    round_clamped(dot as f32 * gain * row.scale - row.offset, self.limit);
                let coordinate = f32::from(steps) * row.spread;
                in_feature_space += coordinate * coordinate;
                clamped |= was_clamped;
                *target = steps;
            }
        }

        let mean_dot =
            self.mean.base * view.sum() as f32 + self.mean.scale * self.mean_dot(view) as f32;
        let from_mean = energy - 2.0 * gain * mean_dot + self.mean.energy;
        let from_feature_space = from_mean - in_feature_space;
        let from_feature_space = if from_feature_space.is_finite() {
            from_feature_space.max(0.0)
        } else {
            f32::MAX
        };
        Some(Projection {
            coefficients,
            from_feature_space,
            clamped,
        })
    }

    /// Blocks of stored weights, [`ROWS_PER_BLOCK`] rows each.
    fn blocks(&self) -> core::slice::ChunksExact<'_, i16> {
        self.weights
            .chunks_exact(ROWS_PER_BLOCK * super::padded_pixels(self.side))
    }

    /// Σ weight·pixel of the mean row: below 2³¹ by the sizes of its types.
    fn mean_dot(&self, view: &View) -> i32 {
        let groups = self.mean_weights.chunks_exact(PIXELS_PER_GROUP);
        let pixels = view.padded().chunks_exact(PIXELS_PER_GROUP);
        groups.zip(pixels).map(|(w, y)| group_dot(w, y)).sum()
    }
}

/// Dot products of the pixels with the rows of one block.
fn block_dots(pixels: &[u8], block: &[i16]) -> [i32; ROWS_PER_BLOCK] {
    let mut dots = [0; ROWS_PER_BLOCK];
    let groups = block.chunks_exact(ROWS_PER_BLOCK * PIXELS_PER_GROUP);
    for (group, pixels) in groups.zip(pixels.chunks_exact(PIXELS_PER_GROUP)) {
        for (dot, weights) in dots.iter_mut().zip(group.chunks_exact(PIXELS_PER_GROUP)) {
            *dot += group_dot(weights, pixels);
        }
    }
    dots
}

/// Dot product of one group: weights in stored order, pixels in picture order.
fn group_dot<W: Copy + Into<i32>>(weights: &[W], pixels: &[u8]) -> i32 {
    match (weights, pixels) {
        (&[w0, w2, w1, w3], &[y0, y1, y2, y3]) => {
            w0.into() * i32::from(y0)
                + w1.into() * i32::from(y1)
                + w2.into() * i32::from(y2)
                + w3.into() * i32::from(y3)
        }
        _ => 0,
    }
}
