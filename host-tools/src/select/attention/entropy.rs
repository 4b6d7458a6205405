//! Local entropy: how many different levels a neighborhood has, and how evenly.
//!
//! **Notation.** H = −Σ p·log₂ p over 32 levels of luminance, each eight of the camera's; p is a level's share of the
//! square of 9×9 view pixels around. 0 for flat ground, 5 bits at most. Nine pixels are about the central half of a
//! view, and 81 fill 32 levels without being the whole view.
//!
//! **Method.** Every column keeps the histogram of its part of the window. A step to the right adds a column to the
//! window's histogram and takes one away; a step down adds a pixel to each column's and takes one away (Perreault and
//! Hébert, Median filtering in constant time, 2007). Bands of rows run in parallel. All map pixels of the window count,
//! each averaged over a view pixel, so that the alignment of a view does not matter.
//!
//! **Cost.** About a hundred operations per pixel whatever the window's size; 128 bytes per column and thread, and four
//! per pixel of the window.
//!
//! **Limits.** Flat ground whose luminance lies between two levels has up to one bit from noise alone.

use rayon::prelude::*;

use super::plane::Plane;

/// Levels of luminance that are told apart.
const LEVELS: usize = 32;

/// Camera levels per level.
const LEVEL_WIDTH: f32 = 256.0 / LEVELS as f32;

/// Side of the window, in view pixels.
const WINDOW: usize = 9;

/// Rows that one thread does in turn; columns are counted anew for each band.
const BAND: usize = 128;

type Histogram = [u32; LEVELS];

/// Entropies in bits.
pub(super) fn response(seen: &Plane, pitch: usize) -> Plane {
    let levels = Levels::of(seen);
    let reach = WINDOW * pitch / 2;
    let terms = terms((2 * reach + 1) * (2 * reach + 1));
    let width = seen.width().max(1);
    let mut values = vec![0.0; seen.values().len()];
    values
        .par_chunks_mut(BAND * width)
        .enumerate()
        .for_each(|(band, to)| levels.entropies(band * BAND, reach, &terms, to));
    seen.with_values(values)
}

/// What of the entropy a level adds that occurs `count` times in a window of `pixels`: −p·log₂ p.
fn terms(pixels: usize) -> Vec<f32> {
    let all = pixels as f64;
    (0..=pixels)
        .map(|count| match count {
            0 => 0.0,
            count => (count as f64 / all * (all / count as f64).log2()) as f32,
        })
        .collect()
}

struct Levels {
    width: usize,
    height: usize,
    levels: Vec<u8>,
}

impl Levels {
    fn of(seen: &Plane) -> Self {
        let level = |&value: &f32| ((value / LEVEL_WIDTH) as u8).min(LEVELS as u8 - 1);
        Self {
            width: seen.width(),
            height: seen.height(),
            levels: seen.values().iter().map(level).collect(),
        }
    }

    /// A row, or the one at the border when `y` is outside.
    fn row(&self, y: isize) -> &[u8] {
        let y = y.clamp(0, self.height as isize - 1) as usize;
        &self.levels[y * self.width..(y + 1) * self.width]
    }

    /// Entropies of the rows from `first` on.
    fn entropies(&self, first: usize, reach: usize, terms: &[f32], to: &mut [f32]) {
        let (first, reach_down) = (first as isize, reach as isize);
        let mut columns: Vec<Histogram> = vec![[0; LEVELS]; self.width];
        for y in first - reach_down..=first + reach_down {
            for (column, &level) in columns.iter_mut().zip(self.row(y)) {
                column[usize::from(level)] += 1;
            }
        }
        for (y, to) in (first..).zip(to.chunks_exact_mut(self.width)) {
            along_a_row(&columns, reach, terms, to);
            let (leaving, entering) = (self.row(y - reach_down), self.row(y + reach_down + 1));
            for (column, (&leaving, &entering)) in
                columns.iter_mut().zip(leaving.iter().zip(entering))
            {
                column[usize::from(leaving)] -= 1;
                column[usize::from(entering)] += 1;
            }
        }
    }
}

fn along_a_row(columns: &[Histogram], reach: usize, terms: &[f32], to: &mut [f32]) {
    let last = columns.len() - 1;
    let mut window = [0; LEVELS];
    // The window of the pixel left of the first one.
    for offset in 0..=2 * reach {
        add(
            &mut window,
            &columns[offset.saturating_sub(reach + 1).min(last)],
        );
    }
    for (x, to) in to.iter_mut().enumerate() {
        add(&mut window, &columns[(x + reach).min(last)]);
        take(&mut window, &columns[x.saturating_sub(reach + 1)]);
        *to = window.iter().map(|&count| terms[count as usize]).sum();
    }
}

fn add(window: &mut Histogram, column: &Histogram) {
    for (all, count) in window.iter_mut().zip(column) {
        *all += count;
    }
}

fn take(window: &mut Histogram, column: &Histogram) {
    for (all, count) in window.iter_mut().zip(column) {
        *all -= count;
    }
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};

    use super::super::plane::tests::{noise, repeated};
    use super::*;
    use crate::map::Map;

    /// Rounding of a sum of 32 f32 up to 5.
    const TOLERANCE: f64 = 1e-5;

    /// A window of 9×9 has 41 squares of one color and 40 of the other: 1 − H(41/81) = 1.1e-4.
    const ODD_WINDOW: f32 = 1.2e-4;

    #[test]
    fn responses_match_reference() {
        // More rows than a band, and windows larger than the map.
        for (width, height, pitch) in [(23, BAND as u32 + 30, 1), (31, 17, 2), (5, 3, 2)] {
            let seen = Plane::of(&noise(width, height));
            let response = response(&seen, pitch);
            let reach = (9 * pitch / 2) as isize;
            let window = || -reach..=reach;
            for (x, y) in
                (0..width as isize).flat_map(|x| (0..height as isize).map(move |y| (x, y)))
            {
                let mut counts = [0.0; 32];
                for (u, v) in window().flat_map(|u| window().map(move |v| (u, v))) {
                    counts[(repeated(&seen, x + u, y + v) / 8.0) as usize] += 1.0;
                }
                let all: f64 = counts.iter().sum();
                let present = counts.iter().filter(|&&count| count > 0.0);
                let expected: f64 = present
                    .map(|count| -count / all * (count / all).log2())
                    .sum();
                let found = repeated(&response, x, y);
                assert!(
                    (found - expected).abs() < TOLERANCE,
                    "{x}, {y}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn a_checkerboard_of_two_levels_has_one_bit() {
        let picture = GrayImage::from_fn(40, 30, |x, y| {
            Luma([if (x + y) % 2 == 0 { 20 } else { 180 }])
        });
        let response = response(&Plane::of(&Map::from_luminance("checkerboard", picture)), 1);
        for (x, y) in (4..36).flat_map(|x| (4..26).map(move |y| (x, y))) {
            assert!(
                (response.at(x, y) - 1.0).abs() < ODD_WINDOW,
                "{}",
                response.at(x, y)
            );
        }
    }

    #[test]
    fn no_neighborhood_has_more_than_five_bits() {
        let response = response(&Plane::of(&noise(60, 60)), 3);
        assert!(
            response
                .values()
                .iter()
                .all(|&bits| (4.0..=5.0).contains(&bits))
        );
    }
}
