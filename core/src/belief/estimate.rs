//! What a belief comes down to.

use micromath::F32Ext;

use super::Layers;
use crate::{
    landmark::Point,
    math::{heading_of, wrapped},
};

/// An estimate is confident when at least this much of the belief is within one side of a view around it.
pub const CONFIDENT: f32 = 0.99;

/// Where the vehicle most likely is.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Estimate {
    /// Where on the map: the mean of the belief around its heaviest state.
    pub position: Point,
    /// Covariance of the position there: xx, xy, yy, in squared map pixels.
    pub covariance_px2: [f32; 3],
    /// Heading in radians, clockwise from map-up, in −π..=π: the mean there. What the belief was last
    /// moved with when there is one heading.
    pub heading_rad: f32,
    /// How much of the belief is within one side of a view around the heaviest state: 0 to 1.
    pub confidence: f32,
}

impl Estimate {
    /// Whether the confidence is at least [`CONFIDENT`].
    #[must_use]
    pub fn is_confident(&self) -> bool {
        self.confidence >= CONFIDENT
    }
}

impl Layers {
    /// See [`Belief::estimate`](super::Belief::estimate).
    #[inline(never)]
    pub(super) fn estimate(&self, weights: &[f32], footprint_px: f32) -> Estimate {
        let columns = usize::from(self.cells.columns());
        let (layer_len, side) = (self.cells.layer().max(1), self.cells.side_px());
        let (mut heaviest, mut peak) = (0, 0.0);
        for (&weight, state) in weights.iter().zip(0..) {
            if weight > peak {
                (peak, heaviest) = (weight, state);
            }
        }
        let cell = heaviest % layer_len;
        let (middle_column, middle_row) = (cell % columns.max(1), cell / columns.max(1));
        let around = self.offset(heaviest / layer_len);
        let reach = usize::from(((footprint_px / side) as u16).max(1));
        let columns_there = middle_column.saturating_sub(reach)..middle_column + reach + 1;
        let rows_there = middle_row.saturating_sub(reach)..middle_row + reach + 1;

        // From the heaviest state's position, so that squares stay small.
        let mut sums = Sums::default();
        let step = core::f32::consts::TAU / f32::from(self.cells.headings());
        let layers = weights.chunks_exact(layer_len);
        for (layer, index) in layers.zip(0_u8..) {
            let offset = self.offset(index.into());
            let (shift_x, shift_y) = (offset.x_px - around.x_px, offset.y_px - around.y_px);
            let mut here = 0.0;
            let rows = layer.chunks_exact(columns.max(1)).enumerate();
            for (row, weights) in rows.take(rows_there.end).skip(rows_there.start) {
                let y = (row as f32 - middle_row as f32) * side + shift_y;
                let cells = weights.iter().enumerate();
                for (column, &weight) in cells.take(columns_there.end).skip(columns_there.start) {
                    let x = (column as f32 - middle_column as f32) * side + shift_x;
                    sums.add(weight, x, y);
                    here += weight;
                }
            }
            let heading = wrapped(step * f32::from(index));
            sums.right += here * F32Ext::sin(heading);
            sums.up += here * F32Ext::cos(heading);
        }
        let total = sums.weight.max(f32::MIN_POSITIVE);
        let (x, y) = (sums.x / total, sums.y / total);
        let center = self.cells.center(middle_column as u16, middle_row as u16);
        // A state is a square, not a point.
        let within = side * side / 12.0;
        Estimate {
            position: Point {
                x_px: center.x_px + around.x_px + x,
                y_px: center.y_px + around.y_px + y,
            },
            covariance_px2: [
                (sums.xx / total - x * x).max(0.0) + within,
                sums.xy / total - x * y,
                (sums.yy / total - y * y).max(0.0) + within,
            ],
            heading_rad: wrapped(self.heading_rad + heading_of(sums.right, -sums.up)),
            confidence: sums.weight.min(1.0),
        }
    }
}

/// Weighted sums of positions and headings.
#[derive(Default)]
struct Sums {
    weight: f32,
    x: f32,
    y: f32,
    xx: f32,
    xy: f32,
    yy: f32,
    right: f32,
    up: f32,
}

impl Sums {
    fn add(&mut self, weight: f32, x: f32, y: f32) {
        self.weight += weight;
        self.x += weight * x;
        self.y += weight * y;
        self.xx += weight * x * x;
        self.xy += weight * x * y;
        self.yy += weight * y * y;
    }
}
