//! Where a frame has texture in both directions: corners by the smallest eigenvalue of the structure tensor.
//!
//! **What.** A window can be found again when its gradients g point everywhere: when the smaller eigenvalue of
//! Σ g·gᵀ, the matrix that tracking has to invert, is large (Shi and Tomasi 1994).
//!
//! **Method.** On the half-sized level, central differences are multiplied and summed over cells of 2×2 pixels, and
//! those over windows of 3×3 cells: 12×12 pixels of the frame, just what is tracked. All of that in integers. In every
//! block of cells, 4×4 of the largest frames and fewer of smaller ones, the best window is a candidate. Candidates are taken best first, but no two closer than a
//! distance, which shrinks while too few were found: first corners are spread, then gaps are filled. Deviations from
//! the paper:
//! 1. Windows lie on a raster of 4 pixels: tracking needs no point to be a local maximum, and texture is as good there.
//! 2. No threshold relative to the best corner: one bright roof would leave fields without any.

use heapless::Vec;

use super::{MAX_TRACKS, Track, level::Level};
use crate::math::sqrt;

/// Pixels of a level per cell and direction.
const CELL: usize = 2;

/// Cells of the largest level per direction, without its border pixel: of 100 pixels at half size.
const MAX_CELLS: usize = 49;

/// Blocks per direction, at most: of the largest level's cells, four and four are one.
const MAX_BLOCKS: usize = 13;

/// Frames below this side, in pixels, are looked at themselves, not at half size.
const MIN_HALVED_SIDE_PX: u16 = 64;

/// The smallest eigenvalue of a corner, as a mean squared slope in gray levels per pixel of the level. Sensor noise of
/// two gray levels has 0.5.
const MIN_SLOPE: f32 = 2.0;

/// An eigenvalue is the sum over 36 pixels of squared differences over two pixels.
const MIN_EIGENVALUE: f32 = MIN_SLOPE * 4.0 * 36.0;

/// Distances between corners that are tried, as shares of the frame's side.
const SPACINGS: [f32; 3] = [1.0 / 6.0, 1.0 / 9.0, 1.0 / 14.0];

/// The middle of a window with texture in both directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Corner {
    /// Position in the tracked square, [x, y] in pixels from its top-left corner.
    pub at_px: [f32; 2],
    /// The smaller eigenvalue of the structure tensor; 0 for no corner.
    pub eigenvalue: f32,
}

/// Sums of products of differences over a cell: xx, xy, yy.
type Tensor = [i32; 3];

/// A row of cells.
type Row = [Tensor; MAX_CELLS];

/// The best window of every block.
pub struct Candidates {
    corners: [Corner; MAX_BLOCKS * MAX_BLOCKS],
    side_px: f32,
}

impl Candidates {
    /// None.
    pub fn none() -> Self {
        Self {
            corners: [Corner::default(); MAX_BLOCKS * MAX_BLOCKS],
            side_px: 0.0,
        }
    }

    /// Adds those of a frame, given its finest level and the next.
    #[inline(never)] // its rows are not the caller's
    pub fn find(&mut self, base: &Level<'_>, half: &Level<'_>) {
        self.side_px = base.side.into();
        let (level, scale) = if base.side < MIN_HALVED_SIDE_PX {
            (base, 1.0)
        } else {
            (half, 2.0)
        };
        let cells = (usize::from(level.side).saturating_sub(2) / CELL).min(MAX_CELLS);
        let block = cells.div_ceil(MAX_BLOCKS).max(1);
        let mut rows = [[Tensor::default(); MAX_CELLS]; 3];
        for y in 0..cells {
            // The oldest row makes way for this one.
            let [a, b, c] = &mut rows;
            let (first, second, third) = match y % 3 {
                0 => (b, c, a),
                1 => (c, a, b),
                _ => (a, b, c),
            };
            sum_cells(level, y, third);
            if y < 2 {
                continue;
            }
            // The sums of three rows, in place of the first; the window's middle is that of the row before.
            for (sum, (b, c)) in first.iter_mut().zip(second.iter().zip(&*third)) {
                *sum = add(*sum, add(*b, *c));
            }
            let sums = &*first;
            let middle = |cell: usize| ((cell * CELL) as f32 + 2.0) * scale;
            let row = (y - 1) / block * MAX_BLOCKS;
            for (x, three) in sums.windows(3).enumerate().take(cells.saturating_sub(2)) {
                let &[a, b, c] = three else { continue };
                let tensor = add(a, add(b, c));
                let Some(best) = self.corners.get_mut(row + (x + 1) / block) else {
                    continue;
                };
                if let Some(eigenvalue) = smaller_eigenvalue(tensor, best.eigenvalue) {
                    *best = Corner {
                        at_px: [middle(x + 1), middle(y - 1)],
                        eigenvalue,
                    };
                }
            }
        }
    }

    /// At most `count` corners where they are allowed: best first, away from each other and from those `present`.
    pub fn spread(
        &self,
        present: &[Track],
        count: usize,
        is_allowed: impl Fn([f32; 2]) -> bool,
    ) -> Vec<Corner, MAX_TRACKS> {
        let mut taken: Vec<Corner, MAX_TRACKS> = Vec::new();
        for spacing in SPACINGS {
            let spacing_px = spacing * self.side_px;
            // Those too close to another one may do at the next spacing.
            let mut is_out = [false; MAX_BLOCKS * MAX_BLOCKS];
            for (corner, is_out) in self.corners.iter().zip(&mut is_out) {
                let mut others = present.iter().map(|track| track.at_px);
                let is_far =
                    |other| distance_squared(corner.at_px, other) >= spacing_px * spacing_px;
                *is_out = corner.eigenvalue <= 0.0
                    || !is_allowed(corner.at_px)
                    || !others.all(is_far)
                    || !taken.iter().all(|other| is_far(other.at_px));
            }
            while taken.len() < count {
                let Some(best) = self.best(&is_out) else {
                    break;
                };
                if taken.push(best).is_err() {
                    break;
                }
                for (corner, is_out) in self.corners.iter().zip(&mut is_out) {
                    *is_out |= distance_squared(corner.at_px, best.at_px) < spacing_px * spacing_px;
                }
            }
        }
        taken
    }

    fn best(&self, is_out: &[bool]) -> Option<Corner> {
        let mut best = None;
        let mut eigenvalue = 0.0;
        for (corner, is_out) in self.corners.iter().zip(is_out) {
            if !is_out && corner.eigenvalue > eigenvalue {
                (best, eigenvalue) = (Some(*corner), corner.eigenvalue);
            }
        }
        best
    }
}

fn distance_squared(a: [f32; 2], b: [f32; 2]) -> f32 {
    let [dx, dy] = [a[0] - b[0], a[1] - b[1]];
    dx * dx + dy * dy
}

fn add(a: Tensor, b: Tensor) -> Tensor {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The tensors of a row of cells.
fn sum_cells(level: &Level<'_>, y: usize, cells: &mut Row) {
    *cells = [Tensor::default(); MAX_CELLS];
    for y in [1 + y * CELL, 2 + y * CELL] {
        let (above, row, below) = (level.row(y - 1), level.row(y), level.row(y + 1));
        // Pixels 1 and 2 of these belong to the cell.
        let steps = above.windows(4).zip(row.windows(4)).zip(below.windows(4));
        for (cell, ((above, row), below)) in cells.iter_mut().zip(steps.step_by(CELL)) {
            let (&[_, a1, a2, _], &[r0, r1, r2, r3], &[_, b1, b2, _]) = (above, row, below) else {
                continue;
            };
            for [left, right, top, bottom] in [[r0, r2, a1, b1], [r1, r3, a2, b2]] {
                let x = i32::from(right) - i32::from(left);
                let y = i32::from(bottom) - i32::from(top);
                *cell = add(*cell, [x * x, x * y, y * y]);
            }
        }
    }
}

/// The smaller eigenvalue where it is above both `limit` and what a corner needs.
fn smaller_eigenvalue([xx, xy, yy]: Tensor, limit: f32) -> Option<f32> {
    let limit = limit.max(MIN_EIGENVALUE);
    // It is at most the smaller of the two: most windows end here.
    if xx.min(yy) as f32 <= limit {
        return None;
    }
    let (sum, difference, xy) = ((xx + yy) as f32, (xx - yy) as f32, xy as f32);
    let eigenvalue = 0.5 * (sum - sqrt(difference * difference + 4.0 * xy * xy));
    (eigenvalue > limit).then_some(eigenvalue)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::see_ground;
    use std::vec::Vec;

    const SIDE_PX: u16 = 100;

    fn ground() -> Vec<u8> {
        let mut pixels = std::vec![0; usize::from(SIDE_PX).pow(2)];
        see_ground(&crate::track::Placement::ORIGIN, SIDE_PX, &mut pixels);
        pixels
    }

    fn level(pixels: &[u8], side: u16) -> Level<'_> {
        Level {
            pixels,
            stride: side.into(),
            side,
        }
    }

    /// The smaller eigenvalue over the 6×6 pixels around a position of the level, literally.
    fn literal(level: &Level<'_>, x: usize, y: usize) -> f64 {
        let at = |x: usize, y: usize| f64::from(level.row(y)[x]);
        let mut tensor = nalgebra::Matrix2::zeros();
        for row in y - 3..y + 3 {
            for column in x - 3..x + 3 {
                let slope = nalgebra::Vector2::new(
                    at(column + 1, row) - at(column - 1, row),
                    at(column, row + 1) - at(column, row - 1),
                );
                tensor += slope * slope.transpose();
            }
        }
        tensor.symmetric_eigenvalues().min()
    }

    #[test]
    fn candidates_have_the_eigenvalues_of_their_windows_and_are_the_best_around() {
        let pixels = ground();
        let half = level(&pixels, SIDE_PX);
        let mut candidates = Candidates::none();
        // As if of a frame twice as large.
        candidates.find(&level(&pixels, 2 * SIDE_PX), &half);
        let mut count = 0;
        for corner in candidates
            .corners
            .iter()
            .filter(|corner| corner.eigenvalue > 0.0)
        {
            let [x, y] = corner.at_px.map(|at| (at / 2.0) as usize);
            let expected = literal(&half, x, y);
            let error = (f64::from(corner.eigenvalue) - expected).abs() / expected;
            assert!(error < 1e-4, "{corner:?} {expected}");
            count += 1;
        }
        assert!(count > 100, "{count}");
        let best = candidates
            .best(&[false; MAX_BLOCKS * MAX_BLOCKS])
            .expect("some");
        let everywhere = (4..SIDE_PX as usize - 4).step_by(2);
        let all = everywhere
            .clone()
            .flat_map(|y| everywhere.clone().map(move |x| (x, y)));
        let greatest = all.map(|(x, y)| literal(&half, x, y)).fold(0.0, f64::max);
        assert!((f64::from(best.eigenvalue) - greatest).abs() < 1e-4 * greatest);
    }

    #[test]
    fn corners_are_apart_and_where_they_are_allowed() {
        let pixels = ground();
        let mut candidates = Candidates::none();
        candidates.find(&level(&pixels, 2 * SIDE_PX), &level(&pixels, SIDE_PX));
        let corners = candidates.spread(&[], MAX_TRACKS, |[x, _]| x > 50.0);
        assert_eq!(corners.len(), MAX_TRACKS);
        for (index, corner) in corners.iter().enumerate() {
            assert!(corner.at_px[0] > 50.0);
            for other in &corners[..index] {
                let apart = distance_squared(corner.at_px, other.at_px).sqrt();
                assert!(apart >= 200.0 / 14.0, "{apart}");
            }
        }
        assert!(candidates.spread(&[], MAX_TRACKS, |_| false).is_empty());
        assert_eq!(candidates.spread(&[], 3, |_| true).len(), 3);
    }
}
