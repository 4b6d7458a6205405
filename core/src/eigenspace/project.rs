//! The projection itself: integer dot products, then one float multiply-subtract per dimension.
//!
//! **Cost.** m·k integer multiply-adds, m more for the mean row, and k roundings; under `Std` one square root.

use super::{Coefficients, Eigenspace, Normalize, PIXELS_PER_GROUP, ROWS_PER_BLOCK};
use crate::{
    kernel::{self, Pair},
    math::{round_clamped, sqrt},
    preprocess::View,
};

/// What the eigenspace says about a view, beside its coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Distance from feature space ‖n(y) − ȳ‖² − ‖g‖²; finite, and never negative.
    pub from_feature_space: f32,
    /// Whether a coordinate was clamped: the view is far from everything the table can hold.
    pub clamped: bool,
}

impl Eigenspace<'_> {
    /// Projects a view into `coefficients`: its coordinates g, in steps.
    ///
    /// `None` when the view has no contrast to normalize (flat, under [`Normalize::Std`]), its side is not the
    /// eigenspace's, or there are not k coefficients; they are then left as they were.
    #[must_use]
    pub fn project(&self, view: &View, coefficients: &mut Coefficients) -> Option<Projection> {
        if view.side() != self.side || coefficients.len != self.dimensions() {
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

        let (mut in_feature_space, mut squared_norm, mut clamped) = (0.0_f32, 0_i32, false);
        let values: &mut [i16] = bytemuck::cast_slice_mut(&mut coefficients.pairs);
        let groups = view.groups();
        let mut targets = self.rows.iter().zip(values);
        for block in self.blocks() {
            for dot in kernel::block_dots(groups, block) {
                let Some((row, target)) = targets.next() else {
                    break;
                };
                let (steps, was_clamped) =
                    round_clamped(dot as f32 * gain * row.scale - row.offset, self.limit);
                let coordinate = f32::from(steps) * row.spread;
                in_feature_space += coordinate * coordinate;
                squared_norm = squared_norm.wrapping_add(i32::from(steps) * i32::from(steps));
                clamped |= was_clamped;
                *target = steps;
            }
        }
        coefficients.squared_norm = squared_norm as u32;

        let mean_dot = kernel::mean_dot(groups, self.mean_weights);
        let mean_dot = self.mean.base * view.sum() as f32 + self.mean.scale * mean_dot as f32;
        let from_mean = energy - 2.0 * gain * mean_dot + self.mean.energy;
        let from_feature_space = from_mean - in_feature_space;
        Some(Projection {
            from_feature_space: if !from_feature_space.is_finite() {
                f32::MAX
            } else if from_feature_space > 0.0 {
                from_feature_space
            } else {
                0.0
            },
            clamped,
        })
    }

    /// Blocks of stored weights, [`ROWS_PER_BLOCK`] rows each.
    fn blocks(&self) -> core::slice::ChunksExact<'_, Pair> {
        let pixels = super::padded_pixels(self.side).max(PIXELS_PER_GROUP);
        self.weights.chunks_exact(ROWS_PER_BLOCK * pixels / 2)
    }
}
