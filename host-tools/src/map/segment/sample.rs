//! Colors drawn from a picture: even neighborhoods more often than varied ones.

use image::RgbImage;
use rand::{Rng, RngExt};
use rayon::prelude::*;

use super::lab::{self, Lab};
use crate::simulate::seeded;

/// Pixels whose neighborhoods are looked at, about: one in each of as many squares.
const LOOKED_AT: usize = 1 << 16;

/// Colors drawn of them.
const DRAWN: usize = 1 << 14;

/// How far a neighborhood reaches.
const REACH_PX: u32 = 2;

/// Keeps the draws apart from others with the same seed.
const STREAM: u64 = 0x5e67;

/// A sample of the picture's colors, in proportion to their weights. Not empty.
pub(super) fn draw(picture: &RgbImage, seed: u64) -> Vec<Lab> {
    let mut random = seeded(seed, STREAM);
    let places = places(picture, &mut random);
    let looked_at: Vec<(Lab, f64)> = places.par_iter().map(|&at| look(picture, at)).collect();
    let mean = looked_at.iter().map(|(_, variance)| variance).sum::<f64>() / looked_at.len() as f64;
    let weight = |variance: f64| {
        if mean > 0.0 {
            1.0 / (1.0 + variance / mean)
        } else {
            1.0
        }
    };

    // Every share of the sum of all weights has a color of its own, drawn within it: no color is drawn much too often by
    // chance, nor by a texture that keeps step.
    let sum: f64 = looked_at
        .iter()
        .map(|&(_, variance)| weight(variance))
        .sum();
    let count = looked_at.len().min(DRAWN);
    let mut colors = looked_at.iter();
    let (mut color, mut passed) = (looked_at[0].0, 0.0);
    (0..count)
        .map(|share| {
            let target = sum * (share as f64 + random.random_range(0.0..1.0)) / count as f64;
            while passed <= target {
                let Some(&(next, variance)) = colors.next() else {
                    break;
                };
                passed += weight(variance);
                color = next;
            }
            color
        })
        .collect()
}

/// A random pixel of each square of a grid.
fn places(picture: &RgbImage, random: &mut impl Rng) -> Vec<[u32; 2]> {
    let (width, height) = picture.dimensions();
    let pixels = width as usize * height as usize;
    let side = pixels.div_ceil(LOOKED_AT).isqrt().max(1) as u32;
    let mut places = Vec::new();
    for top in (0..height).step_by(side as usize) {
        for left in (0..width).step_by(side as usize) {
            let mut within =
                |start: u32, size: u32| random.random_range(start..size.min(start + side));
            places.push([within(left, width), within(top, height)]);
        }
    }
    places
}

/// A pixel's color, and V, the variance of its neighborhood as far as there is one.
fn look(picture: &RgbImage, [x, y]: [u32; 2]) -> (Lab, f64) {
    let around = |at: u32, size: u32| at.saturating_sub(REACH_PX)..(at + REACH_PX + 1).min(size);
    let rows = around(y, picture.height());
    let colors: Vec<Lab> = rows
        .flat_map(|y| around(x, picture.width()).map(move |x| (x, y)))
        .map(|(x, y)| lab::of(picture.get_pixel(x, y).0))
        .collect();
    let count = colors.len() as f64;
    let variance = [0, 1, 2].map(|i| {
        let mean = colors.iter().map(|color| color[i]).sum::<f64>() / count;
        let squares = colors
            .iter()
            .map(|color| (color[i] - mean) * (color[i] - mean));
        squares.sum::<f64>() / count
    });
    (lab::of(picture.get_pixel(x, y).0), variance.iter().sum())
}

#[cfg(test)]
mod tests {
    use image::Rgb;

    use super::*;

    #[test]
    fn even_neighborhoods_are_drawn_more_often() {
        // The left half is even, the right half a chessboard.
        let picture = RgbImage::from_fn(100, 50, |x, y| {
            let is_dark = x >= 50 && (x + y) % 2 == 0;
            Rgb([if is_dark { 20 } else { 220 }; 3])
        });
        let drawn = draw(&picture, 1);
        assert_eq!(drawn.len(), 5000);
        let dark = drawn.iter().filter(|color| color[0] < 50.0).count();
        // V is 0 on one half and V₂ on the other: V̄ = V₂/2, weights 1 and 1/3, a quarter of all is drawn on the right,
        // half of it dark.
        assert!((590..660).contains(&dark), "{dark}");
    }

    #[test]
    fn samples_are_no_larger_than_they_need_to_be() {
        for (width, height) in [(1, 1), (3, 1), (700, 900)] {
            let picture = RgbImage::from_pixel(width, height, Rgb([9, 8, 7]));
            let drawn = draw(&picture, 4);
            let pixels = width as usize * height as usize;
            assert_eq!(drawn.len(), pixels.min(DRAWN));
        }
    }
}
