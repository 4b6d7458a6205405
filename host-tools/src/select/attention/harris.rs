//! Corner strength: det T − κ·(trace T)² of the structure tensor; Harris and Stephens, A combined corner and edge
//! detector, 1988.
//!
//! T sums products of the gradients around a pixel, weighted by a Gaussian of σ = 1 view pixel out to 3σ. Both
//! eigenvalues are large at corners and textured ground only; along an edge one is zero, the strength negative, and
//! the response 0. κ = 0.05 is the middle of the customary 0.04 to 0.06: an edge may turn by as much as makes the
//! eigenvalues 1 : 17.9 before it counts.
//!
//! **Limits.** The response grows with the fourth power of contrast: strong corners outweigh many weak ones.

use rayon::prelude::*;

use super::{
    gradient::Gradient,
    plane::{Plane, spread},
};

/// Weight of the squared trace.
const KAPPA: f32 = 0.05;

/// Sigma of the tensor's Gaussian, in view pixels.
const SIGMA: f64 = 1.0;

/// Pixels that a thread takes at once, at least.
const MIN_LEN: usize = 4096;

/// Corner strengths, at least 0.
pub(super) fn response(seen: &Plane, pitch: usize) -> Plane {
    let tensor = products(&Gradient::of(seen, pitch));
    let gaussian = spread(&gaussian(), pitch);
    let [across, down, mixed] = tensor.map(|product| product.filtered(&gaussian, &gaussian));
    let strengths = (across.values(), down.values(), mixed.values())
        .into_par_iter()
        .with_min_len(MIN_LEN)
        .map(|(&across, &down, &mixed)| {
            let trace = across + down;
            (across * down - mixed * mixed - KAPPA * trace * trace).max(0.0)
        })
        .collect();
    seen.with_values(strengths)
}

/// Elements of the tensor of every pixel alone: across², down², and across times down.
fn products(Gradient { across, down }: &Gradient) -> [Plane; 3] {
    [(across, across), (down, down), (across, down)]
        .map(|(one, other)| one.combined(other, |a, b| a * b))
}

/// Weights at −3σ to 3σ; they add up to one.
fn gaussian() -> Vec<f32> {
    let reach = (3.0 * SIGMA).ceil() as i32;
    let raw: Vec<f64> = (-reach..=reach)
        .map(|step| (-f64::from(step * step) / (2.0 * SIGMA * SIGMA)).exp())
        .collect();
    let sum: f64 = raw.iter().sum();
    raw.iter().map(|weight| (weight / sum) as f32).collect()
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};

    use super::super::{
        gradient,
        plane::tests::{noise, repeated},
    };
    use super::*;
    use crate::map::Map;

    /// Rounding of f32 products of tensor elements, relative to the squared trace.
    const TOLERANCE: f64 = 1e-5;

    #[test]
    fn responses_match_reference() {
        for pitch in [1, 2] {
            let seen = Plane::of(&noise(16, 11));
            let response = response(&seen, pitch);
            let pitch = pitch as isize;
            for (x, y) in (0..16).flat_map(|x| (0..11).map(move |y| (x, y))) {
                let (mut sum, mut tensor) = (0.0, [0.0; 3]);
                for (u, v) in (-3..=3).flat_map(|u| (-3..=3).map(move |v| (u, v))) {
                    let weight = (-((u * u + v * v) as f64) / (2.0 * SIGMA * SIGMA)).exp();
                    let (column, row) =
                        ((x + u * pitch).clamp(0, 15), (y + v * pitch).clamp(0, 10));
                    let (across, down) = gradient::tests::reference(&seen, pitch, column, row);
                    sum += weight;
                    tensor[0] += weight * across * across;
                    tensor[1] += weight * down * down;
                    tensor[2] += weight * across * down;
                }
                let [a, b, c] = tensor.map(|element| element / sum);
                let squared_trace = (a + b) * (a + b);
                let expected = (a * b - c * c - f64::from(KAPPA) * squared_trace).max(0.0);
                let found = repeated(&response, x, y);
                assert!(
                    (found - expected).abs() < TOLERANCE * squared_trace,
                    "{x}, {y}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn corners_of_a_square_respond_and_its_edges_do_not() {
        // The square covers columns 20 to 39 and rows 15 to 34.
        let picture = GrayImage::from_fn(60, 50, |x, y| {
            Luma([if (20..40).contains(&x) && (15..35).contains(&y) {
                220
            } else {
                30
            }])
        });
        let response = response(&Plane::of(&Map::from_luminance("square", picture)), 1);
        let largest = response.values().iter().fold(0.0, |a: f32, &b| a.max(b));
        for (x, y) in [(20, 15), (39, 15), (20, 34), (39, 34)] {
            let around = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y)));
            let found = around.map(|(x, y)| response.at(x, y)).fold(0.0, f32::max);
            assert!(
                found == largest && largest > 0.0,
                "{x}, {y}: {found} of {largest}"
            );
        }
        for (x, y) in [
            (30, 15),
            (30, 34),
            (20, 25),
            (39, 25),
            (30, 25),
            (5, 5),
            (50, 45),
        ] {
            assert_eq!(response.at(x, y), 0.0, "{x}, {y}");
        }
    }
}
