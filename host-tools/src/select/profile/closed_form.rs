//! The profile of squared differences from sums: Σ_b ‖a − b‖² = n·A + Σ_b B − 2·a·Σ_b b.
//!
//! Differences do not change when one point is taken from all, so the mean is: then nothing large cancels, however far
//! from the origin the points are. The literal sum of row a is n·A + Σ_b B − 2·a·Σ_b b for any such point.
//!
//! **Rounding.** A shifted element is off by u of itself, a square by (k+2)·u, a sum over chunks of [`CHUNK`] points by
//! (CHUNK + n/CHUNK)·u. By 2·|a·b| ≤ A + B all of them act on at most 2·(n·A + Σ B).
//!
//! **Cost.** n·k, and a copy of the points.

use rayon::prelude::*;

use super::{Averages, HIGHER_ORDERS, ROUNDING, literal, points::Points};
use crate::select::Dissimilarity;

/// Points that one thread sums up before the partial sums are added in order.
const CHUNK: usize = 1024;

/// The profile of [`Dissimilarity::Ssd`].
pub(super) fn averages(points: Points<'_>) -> Averages {
    let (count, dimensions) = (points.count(), points.dimensions());
    let shifted = without_mean(points);
    let shifted = Points::new(&shifted, dimensions);
    let norms = shifted.squared_norms();
    let total = sum(shifted);
    let total_norm: f64 = norms.chunks(CHUNK).map(|c| c.iter().sum::<f64>()).sum();
    let chunks = (count / CHUNK + 1) as f64;
    let roundings = 2.0 * (CHUNK as f64 + chunks + dimensions as f64 + 8.0);
    let (values, errors) = (0..count)
        .into_par_iter()
        .map(|index| {
            let with_total: f64 = shifted
                .point(index)
                .iter()
                .zip(&total)
                .map(|(a, b)| a * b)
                .sum();
            let size = count as f64 * norms[index] + total_norm;
            let value = (size - 2.0 * with_total).max(0.0) / points.others();
            let own = HIGHER_ORDERS * ROUNDING * roundings * size / points.others();
            let error = own + literal::error(Dissimilarity::Ssd, points, value + own);
            (value, error)
        })
        .unzip();
    Averages { values, errors }
}

/// The points less their mean, element by element.
pub(super) fn without_mean(points: Points<'_>) -> Vec<f64> {
    let mut mean = sum(points);
    for mean in &mut mean {
        *mean /= points.count() as f64;
    }
    points
        .values()
        .par_chunks_exact(points.dimensions())
        .flat_map_iter(|point| point.iter().zip(&mean).map(|(x, mean)| x - mean))
        .collect()
}

/// Σ_b b, in an order that does not depend on the number of threads.
fn sum(points: Points<'_>) -> Vec<f64> {
    let add = |mut sum: Vec<f64>, point: &[f64]| {
        sum.iter_mut().zip(point).for_each(|(sum, x)| *sum += x);
        sum
    };
    let dimensions = points.dimensions();
    let partial: Vec<Vec<f64>> = points
        .values()
        .par_chunks(CHUNK * dimensions)
        .map(|chunk| {
            let rows = chunk.chunks_exact(dimensions);
            rows.fold(vec![0.0; dimensions], add)
        })
        .collect();
    partial
        .iter()
        .fold(vec![0.0; dimensions], |sum, part| add(sum, part))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squared_differences_are_averaged_by_hand() {
        // 3² = 9, 4² = 16, 5² = 25.
        let points = [0.0, 0.0, 3.0, 0.0, 0.0, 4.0];
        let found = averages(Points::new(&points, 2));
        for (found, expected) in found.values.iter().zip([12.5, 17.0, 20.5]) {
            assert!((found - expected).abs() <= 1e-14 * expected, "{found}");
        }
    }

    #[test]
    fn a_common_offset_costs_no_digits() {
        let points: Vec<f64> = (0..4).map(|x| 1e9 + f64::from(x)).collect();
        let found = averages(Points::new(&points, 1));
        assert_eq!(found.values, [14.0 / 3.0, 2.0, 2.0, 14.0 / 3.0]);
        assert!(found.errors.iter().all(|error| *error < 1e-11));
    }
}
