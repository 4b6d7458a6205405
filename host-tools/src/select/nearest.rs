//! The nearest other point of each of many: what radii need.
//!
//! Products of blocks of rows (‖a − b‖² = A + B − 2a·b) find it; its distance is then computed from the difference,
//! because small ones drown in the rounding of large norms.
//!
//! **Cost.** n²·k multiply-adds by matrix products, [`BLOCK`]·n numbers of memory per thread.

use eigenmark_core::landmark::Metric;
use faer::{Accum, Mat, MatRef, Par, linalg::matmul::matmul};
use rayon::prelude::*;

use super::{dissimilarity::nearness, metric_distance};

/// Rows whose products with all rows are held at once.
const BLOCK: usize = 64;

/// The [`metric_distance`] of every point (rows of `dimensions` numbers) to the nearest other; infinite for a single
/// one.
#[must_use]
pub fn nearest_others(metric: Metric, points: &[f64], dimensions: usize) -> Vec<f64> {
    let rows = points.len() / dimensions;
    let point = |index: usize| &points[index * dimensions..(index + 1) * dimensions];
    let norms: Vec<f64> = (0..rows)
        .map(|index| point(index).iter().map(|g| g * g).sum())
        .collect();
    let all = MatRef::from_column_major_slice(points, dimensions, rows);
    let starts: Vec<usize> = (0..rows).step_by(BLOCK).collect();
    starts
        .into_par_iter()
        .flat_map_iter(|start| {
            let len = BLOCK.min(rows - start);
            let mut products = Mat::<f64>::zeros(rows, len);
            let block = all.subcols(start, len);
            matmul(
                products.as_mut(),
                Accum::Replace,
                all.transpose(),
                block,
                1.0,
                Par::Seq,
            );
            (0..len)
                .map(|column| {
                    let one = start + column;
                    let near = |other: usize| {
                        nearness(metric, products[(other, column)], norms[one], norms[other])
                    };
                    let others = (0..rows).filter(|&other| other != one);
                    let nearest = others.max_by(|&a, &b| near(a).total_cmp(&near(b)));
                    nearest.map_or(f64::INFINITY, |other| {
                        metric_distance(metric, point(one), point(other))
                    })
                })
                .collect::<Vec<f64>>()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::simulate::seeded;

    #[test]
    fn nearest_others_match_reference() {
        let mut random = seeded(1, 2);
        for (rows, dimensions) in [(1, 3), (2, 1), (130, 7)] {
            let points: Vec<f64> = (0..rows * dimensions)
                .map(|_| random.random_range(-9.0..9.0))
                .collect();
            for metric in [Metric::Nssd, Metric::Euclid, Metric::Cosine] {
                let found = nearest_others(metric, &points, dimensions);
                for (index, found) in found.iter().enumerate() {
                    let point = |i: usize| &points[i * dimensions..(i + 1) * dimensions];
                    let expected = (0..rows)
                        .filter(|&other| other != index)
                        .map(|other| metric_distance(metric, point(index), point(other)))
                        .fold(f64::INFINITY, f64::min);
                    assert!(*found == expected, "{metric:?} {index}: {found} {expected}");
                }
            }
        }
    }
}
