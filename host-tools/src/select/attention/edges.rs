//! Edge density: where the gradient is larger than noise explains.
//!
//! **Method.** A pixel is an edge when its gradient's magnitude is above 3σ of the gradients of noise. The magnitude of
//! two normal components is Rayleigh distributed, with the median σ·√(2·ln 2); the median over the map therefore tells
//! σ, whatever the rarer edges do, and one pixel in ninety of noise is taken for an edge. Differences below one level
//! of an 8-bit camera are never edges. Counting edges instead of averaging magnitudes keeps a few hard shadows from
//! outweighing a whole neighborhood of roofs.
//!
//! **Limits.** Where most of the map is edges the median is theirs, and only the strongest count.

use super::{gradient::Gradient, plane::Plane};

/// A Rayleigh distribution's median: √(2·ln 2) of its σ.
const MEDIAN_OF_RAYLEIGH: f32 = 1.177_41;

/// How many σ of noise an edge exceeds: exp(−3²/2) = 1/90 of noise does.
const SIGMAS: f32 = 3.0;

/// The smallest gradient of an edge, in levels per view pixel.
const SMALLEST: f32 = 1.0;

/// 1 at edges, 0 elsewhere.
pub(super) fn response(seen: &Plane, pitch: usize) -> Plane {
    let magnitudes = magnitudes(seen, pitch);
    let threshold = threshold(&magnitudes);
    let edges = magnitudes
        .values()
        .iter()
        .map(|&magnitude| if magnitude > threshold { 1.0 } else { 0.0 })
        .collect();
    magnitudes.with_values(edges)
}

fn magnitudes(seen: &Plane, pitch: usize) -> Plane {
    let Gradient { across, down } = Gradient::of(seen, pitch);
    across.combined(&down, |a, b| (a * a + b * b).sqrt())
}

fn threshold(magnitudes: &Plane) -> f32 {
    let mut sorted = magnitudes.values().to_vec();
    let middle = sorted.len() / 2;
    if sorted.is_empty() {
        return SMALLEST;
    }
    let (_, &mut median, _) = sorted.select_nth_unstable_by(middle, f32::total_cmp);
    (SIGMAS / MEDIAN_OF_RAYLEIGH * median).max(SMALLEST)
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};
    use rand::RngExt;

    use super::super::{
        gradient,
        plane::tests::{noise, repeated},
    };
    use super::*;
    use crate::{map::Map, simulate::seeded};

    /// Magnitudes nearer to the threshold than f32 tells, which may fall on either side.
    const TOLERANCE: f64 = 1e-3;

    #[test]
    fn responses_match_reference() {
        for pitch in [1, 2] {
            let seen = Plane::of(&noise(19, 11));
            let response = response(&seen, pitch);
            let places: Vec<(isize, isize)> =
                (0..11).flat_map(|y| (0..19).map(move |x| (x, y))).collect();
            let magnitude = |&(x, y): &(isize, isize)| {
                let (across, down) = gradient::tests::reference(&seen, pitch as isize, x, y);
                across.hypot(down)
            };
            let mut sorted: Vec<f64> = places.iter().map(magnitude).collect();
            sorted.sort_by(f64::total_cmp);
            let threshold = 3.0 * sorted[sorted.len() / 2] / (2.0 * 2.0_f64.ln()).sqrt();
            for place in &places {
                let excess = magnitude(place) - threshold;
                if excess.abs() > TOLERANCE {
                    let expected = f64::from(u8::from(excess > 0.0));
                    assert_eq!(repeated(&response, place.0, place.1), expected, "{place:?}");
                }
            }
        }
    }

    #[test]
    fn the_outline_of_a_square_is_its_edge() {
        let picture = GrayImage::from_fn(60, 50, |x, y| {
            Luma([if (20..40).contains(&x) && (15..35).contains(&y) {
                90
            } else {
                80
            }])
        });
        let response = response(&Plane::of(&Map::from_luminance("square", picture)), 1);
        for (x, y) in [(20, 20), (19, 30), (39, 20), (40, 20), (30, 15), (30, 34)] {
            assert_eq!(response.at(x, y), 1.0, "{x}, {y}");
        }
        // A ring of 76 pixels inside, and one of 84 outside.
        assert_eq!(response.values().iter().sum::<f32>(), 160.0);
    }

    #[test]
    fn noise_is_hardly_ever_an_edge() {
        let mut random = seeded(3, 4);
        // The sum of twelve equally distributed numbers is nearly normal.
        let picture = GrayImage::from_fn(200, 200, |_, _| {
            Luma([(0..12).map(|_| random.random_range(0..=20_u8)).sum()])
        });
        let response = response(&Plane::of(&Map::from_luminance("noise", picture)), 1);
        let density = response.values().iter().sum::<f32>() / 40_000.0;
        // 1/90 is expected; neighbors share pixels, so that the share of 40,000 scatters more than theirs alone.
        assert!((0.007..0.016).contains(&density), "{density}");
    }
}
