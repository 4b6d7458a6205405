//! The leading eigenvectors when both products would be too large: orthogonal iteration from a random start.
//!
//! **Notation.** A is m×n, the centered vectors as columns; Q m×s, orthonormal, s somewhat more than k.
//!
//! **Method.** Z = A·(Aᵀ·Q) in one pass over the vectors; the eigenvectors of QᵀZ (s×s) turn Q to the best eigenvectors
//! within its span (Rayleigh-Ritz), and ‖Z·w − θ·Q·w‖ says how good they are. Z made orthonormal is the next Q.
//! N. Halko, P. G. Martinsson and J. A. Tropp, *Finding structure with randomness* (2011), algorithm 4.4; deviations:
//! 1. iterated until the residual is small, not a fixed number of times; 2. products with A and Aᵀ in the same pass.
//!
//! **Cost.** 2·n·m·s multiply-adds per pass; [`PARTS`] times m·s numbers.
//!
//! **Limits.** A spectrum that hardly falls converges slowly; after [`MAX_PASSES`] the residual is what it is, and
//! [`Route`](super::Route) says so.

use faer::{Accum, Mat, MatRef, Par, Side, linalg::matmul::matmul};
use rand::RngExt;
use rayon::prelude::*;

use super::{super::Rows, PcaError, decompose::Decomposed};
use crate::simulate::seeded;

/// Residual at which iteration stops, relative to the eigenvalue: half of the digits, of which eigenvalues get all,
/// because their error is quadratic in it.
pub(super) const TOLERANCE: f64 = 1e-8;

/// Passes over the vectors, at most.
const MAX_PASSES: usize = 60;

/// Parts that are summed at the same time: fixed, so that results are the same for any number of threads.
const PARTS: usize = 8;

/// Vectors that are multiplied at once.
const BLOCK: usize = 64;

/// Columns beyond k, at least; as many again as k if that is more. They speed up convergence.
const OVERSAMPLING: usize = 10;

/// The start is random, but always the same.
const SEED: u64 = 0x5ce7_c4ed;

/// The eigenspace, and the largest residual relative to its eigenvalue.
pub(super) fn sketch(rows: &dyn Rows, dimensions: usize) -> Result<(Decomposed, f64), PcaError> {
    let (n, m) = (rows.count(), rows.pixels());
    let most = m.min(n.saturating_sub(1));
    if dimensions > most {
        return Err(beyond(dimensions, most, n));
    }
    let (mean, total) = mean_and_total(rows);
    let columns = (dimensions + OVERSAMPLING.max(dimensions)).min(most.max(1));
    let mut random = seeded(SEED, 0);
    let mut basis = orthonormal(&Mat::from_fn(m, columns, |_, _| {
        random.random_range(-1.0..1.0)
    }));
    for pass in 1.. {
        let image = multiplied(rows, &mean, &basis);
        let within = basis.transpose() * &image;
        let eigen = within
            .self_adjoint_eigen(Side::Lower)
            .map_err(|_| PcaError::NoConvergence)?;
        let turn = Mat::from_fn(columns, columns, |i, r| eigen.U()[(i, columns - 1 - r)]);
        let values: Vec<f64> = (0..columns)
            .rev()
            .map(|i| eigen.S().column_vector()[i])
            .collect();
        let (vectors, images) = (&basis * &turn, &image * &turn);
        let zero = values[0].max(0.0) * f64::EPSILON * n.max(m) as f64;
        let rank = values.iter().take_while(|&&value| value > zero).count();
        let residual = (0..dimensions.min(rank))
            .map(|r| (images.col(r) - values[r] * vectors.col(r)).norm_l2() / values[r])
            .fold(0.0, f64::max);
        if residual <= TOLERANCE || pass == MAX_PASSES {
            if dimensions > rank {
                return Err(beyond(dimensions, rank, n));
            }
            let decomposed = Decomposed {
                mean,
                vectors: vectors.subcols(0, dimensions).to_owned(),
                values: values[..dimensions].to_vec(),
                total,
            };
            return Ok((decomposed, residual));
        }
        basis = orthonormal(&image);
    }
    Err(PcaError::NoConvergence)
}

fn beyond(asked: usize, rank: usize, views: usize) -> PcaError {
    PcaError::BeyondRank { asked, rank, views }
}

fn orthonormal(columns: &Mat<f64>) -> Mat<f64> {
    columns.qr().compute_thin_Q()
}

/// x̄, and the sum of all eigenvalues of the products: Σ‖x − x̄‖².
fn mean_and_total(rows: &dyn Rows) -> (Vec<f64>, f64) {
    let m = rows.pixels();
    let sums = by_parts(rows, |mut sum: Vec<f64>, vectors| {
        sum.resize(m, 0.0);
        for row in vectors.chunks_exact(m) {
            for (sum, &x) in sum.iter_mut().zip(row) {
                *sum += f64::from(x);
            }
        }
        sum
    });
    let mut mean = vec![0.0; m];
    for sum in sums {
        mean.iter_mut()
            .zip(sum)
            .for_each(|(mean, sum)| *mean += sum);
    }
    mean.iter_mut()
        .for_each(|mean| *mean /= rows.count() as f64);
    let totals = by_parts(rows, |sum: f64, vectors| {
        let squares = vectors.chunks_exact(m).map(|row| {
            let parts = row.iter().zip(&mean);
            parts
                .map(|(&x, mean)| (f64::from(x) - mean).powi(2))
                .sum::<f64>()
        });
        sum + squares.sum::<f64>()
    });
    let total = totals.iter().sum();
    (mean, total)
}

/// A·Aᵀ·Q.
fn multiplied(rows: &dyn Rows, mean: &[f64], basis: &Mat<f64>) -> Mat<f64> {
    let m = rows.pixels();
    let images = by_parts(rows, |sum: Option<Mat<f64>>, vectors| {
        let count = vectors.len() / m;
        let mut centered = Vec::with_capacity(vectors.len());
        for row in vectors.chunks_exact(m) {
            centered.extend(row.iter().zip(mean).map(|(&x, mean)| f64::from(x) - mean));
        }
        let vectors = MatRef::from_column_major_slice(&centered, m, count);
        let mut image = sum.unwrap_or_else(|| Mat::zeros(m, basis.ncols()));
        let mut coordinates = Mat::<f64>::zeros(count, basis.ncols());
        matmul(
            &mut coordinates,
            Accum::Replace,
            vectors.transpose(),
            basis,
            1.0,
            Par::Seq,
        );
        matmul(&mut image, Accum::Add, vectors, &coordinates, 1.0, Par::Seq);
        Some(image)
    });
    images
        .into_iter()
        .flatten()
        .reduce(|one, other| one + other)
        .unwrap_or_else(|| Mat::zeros(m, basis.ncols()))
}

/// Folds blocks of vectors into one value per part.
fn by_parts<T: Default + Send>(rows: &dyn Rows, fold: impl Fn(T, &[f32]) -> T + Sync) -> Vec<T> {
    let n = rows.count();
    (0..PARTS)
        .into_par_iter()
        .map(|part| {
            let (first, end) = (n * part / PARTS, n * (part + 1) / PARTS);
            let mut buffer = Vec::new();
            (first..end)
                .step_by(BLOCK)
                .fold(T::default(), |folded, start| {
                    fold(
                        folded,
                        rows.block(start, BLOCK.min(end - start), &mut buffer),
                    )
                })
        })
        .collect()
}
