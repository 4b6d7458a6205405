//! One number per map pixel, and separable filters over it.
//!
//! **Notation.** x to the right, y down, row-major. A tap is an offset in map pixels and a weight; outside the plane
//! its border is repeated.
//!
//! **Method.** Every filter is a sum of a few shifted rows, weighted: rows are independent, and all pixels add up in
//! the same order, so that flat ground stays exactly flat and the number of threads changes nothing.
//!
//! **Cost.** A multiply-add per pixel and tap, vectorized.

use rayon::prelude::*;

use crate::map::Map;

/// One number per map pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

/// A pixel's share of a filtered one: its offset, and its weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tap {
    pub(super) offset: isize,
    pub(super) weight: f32,
}

/// Taps one `pitch` apart, the middle one at the pixel itself.
///
/// # Panics
/// When the number of weights is even.
pub(super) fn spread(weights: &[f32], pitch: usize) -> Vec<Tap> {
    assert!(
        weights.len() % 2 == 1,
        "no middle of {} weights",
        weights.len()
    );
    let reach = (weights.len() / 2) as isize;
    (-reach..)
        .zip(weights)
        .map(|(step, &weight)| Tap {
            offset: step * pitch as isize,
            weight,
        })
        .collect()
}

impl Plane {
    /// The luminance of a map.
    #[must_use]
    pub fn of(map: &Map) -> Self {
        Self {
            width: map.width() as usize,
            height: map.height() as usize,
            values: map
                .luminance()
                .as_raw()
                .iter()
                .copied()
                .map(f32::from)
                .collect(),
        }
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// The numbers, row-major.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The number at column `x` of row `y`.
    ///
    /// # Panics
    /// Outside the plane.
    #[must_use]
    pub fn at(&self, x: usize, y: usize) -> f32 {
        assert!(x < self.width, "column {x} of {}", self.width);
        self.values[y * self.width + x]
    }

    /// The mean over the square of `side`×`side` pixels centered on every pixel. Squares of even sides cover half of
    /// the pixels at their border.
    pub(super) fn averaged(&self, side: usize) -> Self {
        if side < 2 {
            return self.clone();
        }
        let whole = 1.0 / side as f32;
        let mut weights = vec![whole; side / 2 * 2 + 1];
        if side.is_multiple_of(2) {
            weights[0] = whole / 2.0;
            weights[side] = whole / 2.0;
        }
        let taps = spread(&weights, 1);
        self.filtered(&taps, &taps)
    }

    /// Filtered along its rows, then along its columns.
    pub(super) fn filtered(&self, across: &[Tap], down: &[Tap]) -> Self {
        self.across(across).down(down)
    }

    /// The plane of `f` of the numbers of two planes of the same size.
    pub(super) fn combined(&self, other: &Self, f: impl Fn(f32, f32) -> f32 + Sync) -> Self {
        let values = (&self.values, &other.values)
            .into_par_iter()
            .with_min_len(self.width.max(1))
            .map(|(&a, &b)| f(a, b))
            .collect();
        Self { values, ..*self }
    }

    /// A plane of the same size with other numbers.
    pub(super) fn with_values(&self, values: Vec<f32>) -> Self {
        debug_assert_eq!(values.len(), self.values.len());
        Self { values, ..*self }
    }

    fn across(&self, taps: &[Tap]) -> Self {
        let width = self.width.max(1);
        let reach = reach(taps);
        let mut values = vec![0.0; self.values.len()];
        values
            .par_chunks_exact_mut(width)
            .zip(self.values.par_chunks_exact(width))
            .for_each_init(Vec::new, |padded, (to, from)| {
                padded.clear();
                padded.resize(reach, from[0]);
                padded.extend_from_slice(from);
                padded.resize(width + 2 * reach, from[width - 1]);
                for tap in taps {
                    let start = reach.saturating_add_signed(tap.offset);
                    add(to, &padded[start..start + width], tap.weight);
                }
            });
        self.with_values(values)
    }

    fn down(&self, taps: &[Tap]) -> Self {
        let width = self.width.max(1);
        let last = self.height.saturating_sub(1);
        let mut values = vec![0.0; self.values.len()];
        values
            .par_chunks_exact_mut(width)
            .enumerate()
            .for_each(|(y, to)| {
                for tap in taps {
                    let row = y.saturating_add_signed(tap.offset).min(last);
                    add(to, &self.values[row * width..(row + 1) * width], tap.weight);
                }
            });
        self.with_values(values)
    }
}

fn reach(taps: &[Tap]) -> usize {
    taps.iter()
        .map(|tap| tap.offset.unsigned_abs())
        .max()
        .unwrap_or(0)
}

fn add(to: &mut [f32], from: &[f32], weight: f32) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += weight * from;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use image::{GrayImage, Luma};
    use rand::RngExt;

    use super::*;
    use crate::simulate::seeded;

    /// Rounding of sums of some dozen f32 up to 255.
    const TOLERANCE: f64 = 1e-4;

    /// Noise, for comparisons with references.
    pub(in super::super) fn noise(width: u32, height: u32) -> Map {
        let mut random = seeded(11, u64::from(width));
        let picture =
            GrayImage::from_fn(width, height, |_, _| Luma([random.random_range(0..=255)]));
        Map::from_luminance("noise", picture)
    }

    /// The number at a place that may be outside, in f64.
    pub(in super::super) fn repeated(plane: &Plane, x: isize, y: isize) -> f64 {
        let inside = |at: isize, len: usize| at.clamp(0, len as isize - 1) as usize;
        f64::from(plane.at(inside(x, plane.width()), inside(y, plane.height())))
    }

    #[test]
    fn averages_match_reference() {
        for side in [1, 2, 3, 6, 7] {
            let plane = Plane::of(&noise(13, 9));
            let averaged = plane.averaged(side);
            // What of the pixel at `offset` lies within the square.
            let overlap = |offset: isize| {
                (side as f64 / 2.0 + 0.5 - offset.unsigned_abs() as f64).clamp(0.0, 1.0)
            };
            let reach = side as isize;
            for (x, y) in (0..13).flat_map(|x| (0..9).map(move |y| (x, y))) {
                let mut sum = 0.0;
                for (dx, dy) in
                    (-reach..=reach).flat_map(|dx| (-reach..=reach).map(move |dy| (dx, dy)))
                {
                    sum += overlap(dx) * overlap(dy) * repeated(&plane, x + dx, y + dy);
                }
                let expected = sum / (side * side) as f64;
                let found = repeated(&averaged, x, y);
                assert!(
                    (found - expected).abs() < TOLERANCE,
                    "{side} at {x}, {y}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn taps_are_a_pitch_apart() {
        let offsets: Vec<isize> = spread(&[1.0, 2.0, 3.0], 4)
            .iter()
            .map(|tap| tap.offset)
            .collect();
        assert_eq!(offsets, [-4, 0, 4]);
        let plane = Plane::of(&noise(7, 1));
        let shifted = plane.filtered(&spread(&[0.0, 0.0, 1.0], 2), &spread(&[1.0], 1));
        let expected = [2, 3, 4, 5, 6, 6, 6].map(|x| plane.at(x, 0));
        assert_eq!(shifted.values(), expected);
    }
}
