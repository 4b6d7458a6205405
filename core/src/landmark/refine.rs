//! Where between the landmarks of a dense grid a view was taken.
//!
//! **What.** In a dense table neighbouring landmarks are views that overlap almost entirely, and a view from between
//! them lies between them in the eigenspace, too: interpolation in the eigenspace (Artac, Jogan and Leonardis 2002;
//! report section 1.3.2).
//!
//! **Method.** The similarity s to a landmark is what the metric compares: 2a·b − B (Euclid), a·b/(A + B) (nSSD),
//! a·b/√B (cosine). Around the nearest landmark of a lattice it is quadratic where coefficients change linearly with
//! the place. The quadratic that fits the similarities of the 3×3 landmarks around best (least squares) has its
//! maximum at the refined position. Where the lattice ends, the axis without neighbours on both sides stays as it is.
//!
//! **Cost.** Nine dot products of k coefficients and some fifty float operations, once per fix.
//!
//! **Limits.** Steps of the lattice have to be small beside what a view resolves: see [`MAX_STRIDE`]. Whatever else
//! moves a view in the eigenspace, such as brightness without normalization, is taken for a displacement.

use super::{
    LandmarkTable, Lattice, Metric, Point,
    lattice::{self, Window},
};
use crate::{
    eigenspace::{Coefficients, MAX_DIMENSIONS},
    kernel::{Dots, Pair},
    math::sqrt,
};

/// The widest step between landmarks that are refined, in pixels of a view.
///
/// On maps of 7 to 10 map pixels per view pixel, the refined error was at most 0.85 of the unrefined one for steps up
/// to two view pixels, whatever the setting; for steps of three and more it could be the larger.
pub const MAX_STRIDE: f32 = 2.0;

/// Similarities of a landmark and its eight neighbours, row by row; `None` beyond the lattice.
type Neighborhood = [[Option<f32>; 3]; 3];

impl LandmarkTable<'_> {
    /// Where a view with these coefficients was taken, between the neighbours of the landmark (0-based) it is nearest
    /// to: at most one step of the lattice away from it.
    ///
    /// `None` when the table is not one of whole lattices, the lattice's step is wider than `widest_px`, or the
    /// similarities have no maximum there.
    #[must_use]
    pub fn refine(
        &self,
        lattices: &[Lattice],
        widest_px: f32,
        coefficients: &Coefficients,
        landmark: u32,
    ) -> Option<Point> {
        if coefficients.dimensions() != self.dimensions {
            return None;
        }
        let record = self.records.get(landmark as usize)?;
        let window = lattice::find(lattices, record.view)?;
        if !self.is_whole || window.lattice.stride_px > widest_px {
            return None;
        }
        let mut split = [Pair::default(); MAX_DIMENSIONS as usize / 2];
        let view = self.prepare(coefficients, &mut split);
        let neighborhood = self.neighborhood(&window, view, coefficients.squared_norm());
        let (x, y) = maximum(&neighborhood)?;
        let stride = window.lattice.stride_px;
        let at = window.lattice.point(window.column, window.row);
        Some(Point {
            x_px: at.x_px + x * stride,
            y_px: at.y_px + y * stride,
        })
    }

    fn neighborhood(&self, window: &Window, view: &[Pair], squared_norm: u32) -> Neighborhood {
        let mut neighborhood = Neighborhood::default();
        let mut dots = Dots::new();
        for (line, dy) in neighborhood.iter_mut().zip(-1..=1) {
            for (similarity, dx) in line.iter_mut().zip(-1..=1) {
                let Some(view_number) = window.neighbor(dx, dy) else {
                    continue;
                };
                let index = view_number as usize - 1;
                let rows = index * self.row_len..(index + 1) * self.row_len;
                let (Some(row), Some(&norm)) =
                    (self.coefficients.get(rows), self.squared_norms.get(index))
                else {
                    continue;
                };
                let dots = dots.of(self.width, view, row, 1);
                *similarity = dots
                    .first()
                    .map(|&dot| similarity_of(self.metric, dot, squared_norm, norm));
            }
        }
        neighborhood
    }
}

/// What the metric compares, in single precision.
fn similarity_of(metric: Metric, dot: i32, view: u32, landmark: u32) -> f32 {
    match metric {
        // Of the same magnitude for all, which rounding would otherwise tell apart.
        Metric::Euclid => dot.wrapping_mul(2).wrapping_sub_unsigned(landmark) as f32,
        Metric::Nssd => dot as f32 / view.wrapping_add(landmark).max(1) as f32,
        Metric::Cosine => dot as f32 / sqrt(landmark.max(1) as f32),
    }
}

/// Where the quadratic that fits best has its maximum, in steps from the middle to the right and down, within ±1.
fn maximum(s: &Neighborhood) -> Option<(f32, f32)> {
    let middle = s[1][1]?;
    let along = |before: Option<f32>, after: Option<f32>| match (before, after) {
        (Some(before), Some(after)) => {
            vertex((after - before) / 2.0, before + after - 2.0 * middle)
        }
        _ => None,
    };
    let [
        [Some(a), Some(b), Some(c)],
        [Some(d), _, Some(e)],
        [Some(f), Some(g), Some(h)],
    ] = *s
    else {
        let (x, y) = (along(s[1][0], s[1][2]), along(s[0][1], s[2][1]));
        return (x.is_some() || y.is_some()).then(|| (x.unwrap_or(0.0), y.unwrap_or(0.0)));
    };
    // Gradient and second derivatives of the least-squares quadratic over 3×3 points.
    let gx = (c + e + h - a - d - f) / 6.0;
    let gy = (f + g + h - a - b - c) / 6.0;
    let hxx = (a + c + d + e + f + h - 2.0 * (b + middle + g)) / 3.0;
    let hyy = (a + b + c + f + g + h - 2.0 * (d + middle + e)) / 3.0;
    let hxy = (a + h - c - f) / 4.0;
    let determinant = hxx * hyy - hxy * hxy;
    let is_maximum = hxx < 0.0 && determinant > 0.0;
    let (x, y) = (
        (hxy * gy - hyy * gx) / determinant,
        (hxy * gx - hxx * gy) / determinant,
    );
    (is_maximum && x.is_finite() && y.is_finite()).then(|| (x.clamp(-1.0, 1.0), y.clamp(-1.0, 1.0)))
}

/// The same along one axis: slope and second derivative in the middle.
fn vertex(slope: f32, curvature: f32) -> Option<f32> {
    let at = -slope / curvature;
    (curvature < 0.0 && at.is_finite()).then(|| at.clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(quadratic: impl Fn(f32, f32) -> f32) -> Neighborhood {
        core::array::from_fn(|row| {
            core::array::from_fn(|column| Some(quadratic(column as f32 - 1.0, row as f32 - 1.0)))
        })
    }

    #[test]
    fn a_quadratics_maximum_is_found() {
        // Tilted axes: the mixed derivative matters.
        let s = sampled(|x, y| {
            let (x, y) = (x - 0.25, y + 0.5);
            7.0 - 2.0 * x * x - y * y + x * y
        });
        assert_eq!(maximum(&s), Some((0.25, -0.5)));
    }

    #[test]
    fn beyond_a_border_the_other_axis_is_refined() {
        let mut s = sampled(|x, y| -(x - 0.25) * (x - 0.25) - (y - 0.5) * (y - 0.5));
        s[0] = [None; 3];
        assert_eq!(maximum(&s), Some((0.25, 0.0)));
        for line in &mut s {
            line[2] = None;
        }
        assert_eq!(maximum(&s), None);
    }

    #[test]
    fn saddles_and_plains_are_not_refined_and_steps_are_bounded() {
        assert_eq!(maximum(&sampled(|x, y| x * x - y * y)), None);
        assert_eq!(maximum(&sampled(|_, _| 3.0)), None);
        let far = sampled(|x, y| -(x - 9.0) * (x - 9.0) - y * y);
        assert_eq!(maximum(&far), Some((1.0, 0.0)));
    }
}
