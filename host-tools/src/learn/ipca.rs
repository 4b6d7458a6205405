//! Incremental PCA of any size: vectors are added one at a time, and each may be forgotten afterwards.
//!
//! **What.** The eigenspace (x̄, T, Λ, n) of report section 2.1.2 in double precision, with the coefficients of every
//! vector added so far. Its twin in the core, `explore::IncrementalPca`, has a fixed size and single precision.
//!
//! **Notation.** m pixels, n vectors, k dimensions. x̄ mean, T basis, Λ eigenvalues of the covariance (1/n)·A·Aᵀ,
//! g coefficients, r residual, γ its norm, D and R as in report (2.25) and (2.26).
//!
//! **Method.** Report (2.19)–(2.27), corrected: g, r and γ to the old mean; r by Gram-Schmidt, twice; the eigenproblem
//! of D in k + 1 dimensions; coefficients carried along without their vectors, g_i′ = Rᵀ([g_i; 0] + η),
//! η = −[g; γ]/(n + 1). Deviations:
//! 1. r = (x − x̄) − Tg, the negative of (2.21), so that γ is positive.
//! 2. Basis vectors have the sign that makes their entry of largest magnitude positive, as in batch PCA.
//!
//! **Cost.** m·k² + n·k² + k³ multiply-adds per vector; m·k + n·k numbers of memory.
//!
//! **Limits.** An error in Λ is a share of the largest eigenvalue, not of each. Once dimensions have been dropped the
//! coefficients are those of what was kept.

use eigenmark_core::explore::Change;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};

use super::{pca::has_wrong_sign, preprocess::add_scaled};

/// Residuals up to this share of ‖x − x̄‖, or of ‖x̄‖ where that is larger, are rounding: they have no direction worth
/// a dimension.
///
/// A thousand updates leave the basis orthonormal to 5·10⁻¹² (measured), and pixels that are single precision differ
/// by 6·10⁻⁸ of their values, or not at all.
pub const RESIDUAL_TOLERANCE: f64 = 1e-10;

/// When an eigenspace gets a dimension more for a vector that it cannot express; report 2.1.2. Otherwise the dimension
/// with the smallest of the k + 1 eigenvalues is dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Growth {
    /// Always: nothing is lost.
    Exact,
    /// Always, up to this many dimensions: from then on k is fixed.
    Fixed {
        /// The largest k.
        dimensions: usize,
    },
    /// When the residual's norm ‖r‖ is above this.
    Residual {
        /// In the pixels' unit.
        above: f64,
    },
    /// When all that has not been covered so far, with this vector's part in the dimension to be dropped, is above
    /// this: the sum of squared reconstruction errors.
    LostEnergy {
        /// In the pixels' unit, squared; see [`IncrementalPca::lost_energy`].
        above: f64,
    },
    /// When the smallest eigenvalue of the larger eigenspace is above this.
    Eigenvalue {
        /// In the pixels' unit, squared.
        above: f64,
    },
}

/// An eigenspace of all vectors so far, in f64.
///
/// ```
/// use eigenmark::learn::{Growth, IncrementalPca};
/// use eigenmark_core::explore::Change;
///
/// // Three vectors on a line through (2, 2).
/// let mut pca = IncrementalPca::new(2, Growth::Exact);
/// assert_eq!(pca.add(&[2.0, 2.0]), Some(Change::First));
/// assert_eq!(pca.residual(&[5.0, 6.0]), [3.0, 4.0]);
/// assert_eq!(pca.add(&[5.0, 6.0]), Some(Change::Grown));
/// assert!((pca.eigenvalues()[0] - 6.25).abs() < 1e-12); // mean (3.5, 4): both are 2.5 away from it
/// assert_eq!(pca.add(&[8.0, 10.0]), Some(Change::Kept));
/// assert!((pca.coefficients()[0] + 5.0).abs() < 1e-12); // (2, 2) is 5 away from the mean (5, 6)
/// ```
#[derive(Clone, Debug)]
pub struct IncrementalPca {
    growth: Growth,
    pixels: usize,
    count: usize,
    lost_energy: f64,
    mean: Vec<f64>,
    /// k rows of m.
    basis: Vec<f64>,
    eigenvalues: Vec<f64>,
    /// n rows of k.
    coefficients: Vec<f64>,
}

/// A vector, seen from an eigenspace.
struct Split {
    /// g, report (2.20).
    coefficients: Vec<f64>,
    /// r, report (2.21).
    residual: Vec<f64>,
    /// ‖x − x̄‖.
    deviation: f64,
}

impl IncrementalPca {
    /// An eigenspace of no vectors yet, which will have `pixels` numbers each.
    #[must_use]
    pub fn new(pixels: usize, growth: Growth) -> Self {
        Self {
            growth,
            pixels,
            count: 0,
            lost_energy: 0.0,
            mean: vec![0.0; pixels],
            basis: Vec::new(),
            eigenvalues: Vec::new(),
            coefficients: Vec::new(),
        }
    }

    /// The eigenspace of many vectors (rows of `pixels` numbers) at once, by singular values; nothing is truncated, and
    /// `growth` is for those added later. `None` when numbers are not finite.
    ///
    /// # Panics
    /// When `pixels` is zero.
    #[must_use]
    pub fn of_all(vectors: &[f64], pixels: usize, growth: Growth) -> Option<Self> {
        let mut pca = Self::new(pixels, growth);
        pca.count = vectors.len() / pixels;
        if pca.count == 0 {
            return Some(pca);
        }
        let n = pca.count as f64;
        for vector in vectors.chunks_exact(pixels) {
            for (mean, x) in pca.mean.iter_mut().zip(vector) {
                *mean += x / n;
            }
        }
        let centered = Mat::from_fn(pca.count, pixels, |i, pixel| {
            vectors[i * pixels + pixel] - pca.mean[pixel]
        });
        let energy = centered.squared_norm_l2();
        if !energy.is_finite() {
            return None;
        }
        let decomposed = centered.thin_svd().ok()?;
        let singular = decomposed.S().column_vector();
        let floor = RESIDUAL_TOLERANCE * energy.sqrt();
        // n centered vectors span at most n − 1 dimensions.
        let most = pixels.min(pca.count - 1);
        pca.eigenvalues = (0..most)
            .map(|i| singular[i])
            .take_while(|&value| value > floor)
            .map(|value| value * value / n)
            .collect();
        let k = pca.eigenvalues.len();
        for i in 0..k {
            let start = pca.basis.len();
            pca.basis.extend(decomposed.V().col(i).iter());
            if has_wrong_sign(&pca.basis[start..]) {
                pca.basis[start..].iter_mut().for_each(|x| *x = -*x);
            }
        }
        pca.coefficients = vec![0.0; pca.count * k];
        if k > 0 {
            product(
                &mut pca.coefficients,
                centered.as_ref(),
                MatRef::from_row_major_slice(&pca.basis, k, pixels).transpose(),
            );
        }
        Some(pca)
    }

    /// Vectors so far, n.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Numbers per vector, m.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.pixels
    }

    /// Dimensions, k.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        self.eigenvalues.len()
    }

    /// x̄, m numbers; zeros before the first vector.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The eigenvectors: k orthonormal rows of m.
    #[must_use]
    pub fn basis(&self) -> &[f64] {
        &self.basis
    }

    /// The k eigenvalues of the covariance (1/n)·A·Aᵀ, descending.
    #[must_use]
    pub fn eigenvalues(&self) -> &[f64] {
        &self.eigenvalues
    }

    /// Coefficients of the vectors in the order in which they were added: n rows of k.
    #[must_use]
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// n times the variance that was dropped: ‖x_i − x̄‖² summed over all vectors, less what the eigenvalues cover.
    #[must_use]
    pub fn lost_energy(&self) -> f64 {
        self.lost_energy
    }

    /// g = Tᵀ(x − x̄), report (2.20): k numbers.
    ///
    /// # Panics
    /// When the vector does not have m numbers.
    #[must_use]
    pub fn project<P: Copy + Into<f64>>(&self, vector: &[P]) -> Vec<f64> {
        self.split(vector).coefficients
    }

    /// r = (x − x̄) − Tg, report (2.21): what the eigenspace cannot express of a vector, m numbers.
    ///
    /// # Panics
    /// When the vector does not have m numbers.
    #[must_use]
    pub fn residual<P: Copy + Into<f64>>(&self, vector: &[P]) -> Vec<f64> {
        self.split(vector).residual
    }

    /// Tg + x̄, report (2.12): the vector that has these coefficients, m numbers.
    ///
    /// # Panics
    /// When there are not k coefficients.
    #[must_use]
    pub fn reconstruct(&self, coefficients: &[f64]) -> Vec<f64> {
        assert_eq!(
            coefficients.len(),
            self.dimensions(),
            "one coefficient per dimension"
        );
        let mut vector = self.mean.clone();
        for (g, row) in coefficients.iter().zip(self.rows()) {
            add_scaled(&mut vector, *g, row);
        }
        vector
    }

    /// Takes a vector in. `None`, and nothing happens, for what is not finite.
    ///
    /// # Panics
    /// When the vector does not have m numbers.
    pub fn add<P: Copy + Into<f64>>(&mut self, vector: &[P]) -> Option<Change> {
        let split = self.split(vector);
        let gamma = norm(&split.residual);
        if !(split.deviation.is_finite() && gamma.is_finite()) {
            return None;
        }
        let (change, coefficients) = if self.count == 0 {
            (Change::First, Vec::new())
        } else {
            let tolerance = RESIDUAL_TOLERANCE * split.deviation.max(norm(&self.mean));
            // In m dimensions nothing is left outside but rounding.
            if gamma > tolerance && self.dimensions() < self.pixels {
                self.turn(split.coefficients, Some((&split.residual, gamma)))?
            } else if self.dimensions() > 0 {
                self.turn(split.coefficients, None)?
            } else {
                (Change::Kept, Vec::new())
            }
        };
        self.coefficients.extend(coefficients);
        self.count += 1;
        let part = 1.0 / self.count as f64;
        for (mean, &x) in self.mean.iter_mut().zip(vector) {
            *mean += (x.into() - *mean) * part;
        }
        Some(change)
    }

    /// The new eigenvalues, basis and coefficients; returns those of the new vector. `residual` is r with its norm γ,
    /// unless that is rounding. `None` when the eigenproblem has no solution, and nothing has changed then.
    fn turn(
        &mut self,
        mut extended: Vec<f64>,
        residual: Option<(&[f64], f64)>,
    ) -> Option<(Change, Vec<f64>)> {
        let (k, n) = (self.dimensions(), self.count as f64);
        extended.extend(residual.map(|(_, gamma)| gamma));
        let order = extended.len();

        // D, report (2.26), corrected.
        let d = Mat::from_fn(order, order, |i, j| {
            let lambda = if i == j && i < k {
                self.eigenvalues[i]
            } else {
                0.0
            };
            n / (n + 1.0) * lambda + n / (n + 1.0).powi(2) * extended[i] * extended[j]
        });
        let decomposed = d.self_adjoint_eigen(Side::Lower).ok()?;
        let eigenvalue = |i: usize| decomposed.S().column_vector()[order - 1 - i].max(0.0);
        let change = match residual {
            None => Change::Kept,
            Some((_, gamma)) => self.grow_or_truncate(gamma, eigenvalue(k)),
        };
        let kept = if change == Change::Truncated {
            k
        } else {
            order
        };
        let mut rotation = Mat::from_fn(order, kept, |i, j| decomposed.U()[(i, order - 1 - j)]);
        self.eigenvalues = (0..kept).map(eigenvalue).collect();

        // T′ = [T, r̂]·R, report (2.23), corrected.
        let mut larger = std::mem::take(&mut self.basis);
        if let Some((residual, gamma)) = residual {
            larger.extend(residual.iter().map(|r| r / gamma));
        }
        self.basis = vec![0.0; kept * self.pixels];
        if kept > 0 {
            product(
                &mut self.basis,
                rotation.transpose(),
                MatRef::from_row_major_slice(&larger, order, self.pixels),
            );
        }
        for (j, row) in self.basis.chunks_exact_mut(self.pixels).enumerate() {
            if has_wrong_sign(row) {
                row.iter_mut().for_each(|x| *x = -*x);
                rotation.col_mut(j).iter_mut().for_each(|x| *x = -*x);
            }
        }

        // g_i′ = Rᵀ([g_i; 0] + η), report (2.24), corrected; for the new vector [g; γ] + η = [g; γ]·n/(n + 1).
        let shifted = Mat::from_fn(self.count + 1, order, |i, j| {
            let own = match i {
                i if i == self.count => extended[j],
                i if j < k => self.coefficients[i * k + j],
                _ => 0.0,
            };
            own - extended[j] / (n + 1.0)
        });
        let mut carried = vec![0.0; (self.count + 1) * kept];
        if kept > 0 {
            product(&mut carried, shifted.as_ref(), rotation.as_ref());
        }
        let newest = carried.split_off(self.count * kept);
        self.coefficients = carried;
        Some((change, newest))
    }

    /// Decides about the dimension with the smallest of the k + 1 eigenvalues, and keeps account of what is lost.
    fn grow_or_truncate(&mut self, gamma: f64, smallest: f64) -> Change {
        let lost_energy = self.lost_energy + smallest * (self.count as f64 + 1.0);
        let grows = match self.growth {
            Growth::Exact => true,
            Growth::Fixed { dimensions } => self.dimensions() < dimensions,
            Growth::Residual { above } => gamma > above,
            Growth::LostEnergy { above } => lost_energy > above,
            Growth::Eigenvalue { above } => smallest > above,
        };
        if grows {
            Change::Grown
        } else {
            self.lost_energy = lost_energy;
            Change::Truncated
        }
    }

    /// Gram-Schmidt, twice: the second pass removes what rounding left in the first.
    fn split<P: Copy + Into<f64>>(&self, vector: &[P]) -> Split {
        assert_eq!(vector.len(), self.pixels, "one number per pixel");
        let mut residual: Vec<f64> = vector
            .iter()
            .zip(&self.mean)
            .map(|(&x, mean)| x.into() - mean)
            .collect();
        let deviation = norm(&residual);
        let mut coefficients = vec![0.0; self.dimensions()];
        for _ in 0..2 {
            for (g, row) in coefficients.iter_mut().zip(self.rows()) {
                let dot: f64 = row.iter().zip(&residual).map(|(a, b)| a * b).sum();
                add_scaled(&mut residual, -dot, row);
                *g += dot;
            }
        }
        Split {
            coefficients,
            residual,
            deviation,
        }
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.basis.chunks_exact(self.pixels)
    }
}

/// `out` (row-major) = `left` · `right`.
fn product(out: &mut [f64], left: MatRef<'_, f64>, right: MatRef<'_, f64>) {
    let out = MatMut::from_row_major_slice_mut(out, left.nrows(), right.ncols());
    matmul(out, Accum::Replace, left, right, 1.0, Par::Seq);
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::simulate::seeded;

    /// Against batch PCA, as a share of the largest eigenvalue or deviation: measured at most 6·10⁻¹³. Of |TᵀT − I|
    /// after a thousand updates: measured 5·10⁻¹².
    const TOLERANCE: f64 = 1e-10;

    /// Batch PCA by the covariance matrix: eigenvalues and eigenvectors (rows), descending, up to `rank`.
    fn batch(vectors: &[Vec<f64>], rank: usize) -> (Vec<f64>, Vec<f64>, Mat<f64>) {
        let (n, m) = (vectors.len(), vectors[0].len());
        let mean: Vec<f64> = (0..m)
            .map(|pixel| vectors.iter().map(|x| x[pixel]).sum::<f64>() / n as f64)
            .collect();
        let centered = Mat::from_fn(n, m, |i, pixel| vectors[i][pixel] - mean[pixel]);
        let covariance = centered.transpose() * &centered;
        let eigen = covariance
            .self_adjoint_eigen(Side::Lower)
            .expect("convergence");
        let values = (0..rank)
            .map(|i| eigen.S().column_vector()[m - 1 - i] / n as f64)
            .collect();
        let basis = Mat::from_fn(rank, m, |i, pixel| eigen.U()[(pixel, m - 1 - i)]);
        (mean, values, basis)
    }

    fn random_vectors(stream: u64, n: usize, m: usize) -> Vec<Vec<f64>> {
        let mut random = seeded(3, stream);
        // Deviations differ from pixel to pixel, so that eigenvalues do.
        (0..n)
            .map(|_| {
                (0..m)
                    .map(|pixel| 100.0 + random.random_range(-9.0..9.0) * (1.0 + pixel as f64))
                    .collect()
            })
            .collect()
    }

    fn learned(vectors: &[Vec<f64>], growth: Growth) -> IncrementalPca {
        let mut pca = IncrementalPca::new(vectors[0].len(), growth);
        for vector in vectors {
            pca.add(vector).expect("finite");
        }
        pca
    }

    fn assert_matches_batch(pca: &IncrementalPca, vectors: &[Vec<f64>], rank: usize) {
        let (mean, values, basis) = batch(vectors, rank);
        assert_eq!((pca.count(), pca.dimensions()), (vectors.len(), rank));
        for (ours, expected) in pca.mean().iter().zip(&mean) {
            assert!((ours - expected).abs() < TOLERANCE * 100.0);
        }
        let largest = values.first().copied().unwrap_or(0.0);
        for (ours, expected) in pca.eigenvalues().iter().zip(&values) {
            assert!(
                (ours - expected).abs() <= TOLERANCE * largest,
                "{ours} {expected}"
            );
        }
        if rank == 0 {
            return;
        }
        let m = pca.pixels();
        let ours = MatRef::from_row_major_slice(pca.basis(), rank, m);
        let subspaces = ours.transpose() * ours - basis.transpose() * &basis;
        assert!(
            subspaces.norm_max() < TOLERANCE,
            "{:e}",
            subspaces.norm_max()
        );
        assert!(orthogonality(pca) < TOLERANCE);
        let scale = (largest * vectors.len() as f64).sqrt();
        for (g, vector) in pca.coefficients().chunks_exact(rank).zip(vectors) {
            for (ours, expected) in g.iter().zip(pca.project(vector)) {
                assert!((ours - expected).abs() < TOLERANCE * scale);
            }
            for (ours, expected) in pca.reconstruct(g).iter().zip(vector) {
                assert!(
                    (ours - expected).abs() < TOLERANCE * scale,
                    "{ours} {expected}"
                );
            }
            for (i, ours) in g.iter().enumerate() {
                let dot: f64 = (0..m).map(|j| basis[(i, j)] * (vector[j] - mean[j])).sum();
                assert!((ours.abs() - dot.abs()).abs() < TOLERANCE * scale);
            }
        }
    }

    /// The largest entry of |TᵀT − I|.
    fn orthogonality(pca: &IncrementalPca) -> f64 {
        let basis = MatRef::from_row_major_slice(pca.basis(), pca.dimensions(), pca.pixels());
        let gram = basis * basis.transpose();
        (gram - Mat::<f64>::identity(pca.dimensions(), pca.dimensions())).norm_max()
    }

    #[test]
    fn exact_growth_matches_batch() {
        for (stream, (n, m)) in [(12, 30), (30, 12), (2, 5), (1, 4), (9, 1), (2, 1), (40, 40)]
            .into_iter()
            .enumerate()
        {
            let vectors = random_vectors(stream as u64, n, m);
            let pca = learned(&vectors, Growth::Exact);
            assert_matches_batch(&pca, &vectors, m.min(n - 1));
            assert_eq!(pca.lost_energy(), 0.0);
        }
    }

    #[test]
    fn all_at_once_matches_batch_and_goes_on_incrementally() {
        for (first, n, m) in [(1, 6, 20), (5, 9, 20), (20, 30, 8), (3, 3, 1)] {
            let vectors = random_vectors(50, n, m);
            let at_once = vectors[..first].concat();
            let mut pca = IncrementalPca::of_all(&at_once, m, Growth::Exact).expect("finite");
            assert_matches_batch(&pca, &vectors[..first], m.min(first - 1));
            for vector in &vectors[first..] {
                pca.add(vector).expect("finite");
            }
            assert_matches_batch(&pca, &vectors, m.min(n - 1));
        }
        assert!(IncrementalPca::of_all(&[1.0, f64::NAN], 1, Growth::Exact).is_none());
        let none = IncrementalPca::of_all(&[], 3, Growth::Exact).expect("empty");
        assert_eq!(none.count(), 0);
    }

    #[test]
    fn vectors_inside_the_span_add_no_dimension() {
        let mut vectors = random_vectors(20, 4, 15);
        vectors.push(vectors[1].clone());
        let between = |a: f64, x: &[f64], y: &[f64]| -> Vec<f64> {
            x.iter()
                .zip(y)
                .map(|(x, y)| a * x + (1.0 - a) * y)
                .collect()
        };
        vectors.push(between(0.3, &vectors[0], &vectors[2]));
        vectors.push(between(7.0, &vectors[1], &vectors[3]));
        let mut pca = learned(&vectors[..4], Growth::Exact);
        for vector in &vectors[4..] {
            assert_eq!(pca.add(vector), Some(Change::Kept));
        }
        assert_matches_batch(&pca, &vectors, 3);
    }

    #[test]
    fn equal_vectors_are_their_own_mean() {
        let vector: Vec<f64> = (0..7).map(|i| 0.1 + f64::from(i)).collect();
        let mut vectors = vec![vector; 100];
        let pca = learned(&vectors, Growth::Exact);
        assert_matches_batch(&pca, &vectors, 0);
        vectors.push(vec![3.0; 7]);
        assert_matches_batch(&learned(&vectors, Growth::Exact), &vectors, 1);
    }

    #[test]
    fn single_precision_and_bytes_are_taken_in_too() {
        let mut pca = IncrementalPca::new(2, Growth::Exact);
        assert_eq!(pca.add(&[1_u8, 1]), Some(Change::First));
        assert_eq!(pca.add(&[3.0_f32, 1.0]), Some(Change::Grown));
        assert_eq!(pca.mean(), [2.0, 1.0]);
        assert_eq!(pca.basis(), [1.0, 0.0]);
        assert_eq!(pca.coefficients(), [-1.0, 1.0]);
    }

    #[test]
    fn vectors_that_are_not_finite_change_nothing() {
        let mut pca = learned(&random_vectors(30, 5, 4), Growth::Exact);
        let before = pca.clone();
        for bad in [f64::NAN, f64::INFINITY, f64::MAX] {
            assert_eq!(pca.add(&[1.0, bad, 2.0, 3.0]), None);
            assert_eq!(pca.mean(), before.mean());
            assert_eq!(pca.basis(), before.basis());
            assert_eq!(pca.coefficients(), before.coefficients());
            assert_eq!(pca.count(), 5);
        }
    }

    #[test]
    fn a_fixed_number_of_dimensions_is_never_exceeded() {
        let vectors = random_vectors(31, 40, 25);
        for dimensions in [0, 1, 6] {
            let mut pca = IncrementalPca::new(25, Growth::Fixed { dimensions });
            for (i, vector) in vectors.iter().enumerate() {
                let change = pca.add(vector).expect("finite");
                assert_eq!(pca.dimensions(), i.min(dimensions));
                assert_eq!(pca.coefficients().len(), (i + 1) * pca.dimensions());
                assert_eq!(change == Change::Truncated, i > dimensions);
            }
            assert_total_is_kept(&pca, &vectors);
        }
    }

    #[test]
    fn a_fixed_number_beyond_the_rank_loses_nothing() {
        let vectors = random_vectors(32, 8, 25);
        let pca = learned(&vectors, Growth::Fixed { dimensions: 7 });
        assert_matches_batch(&pca, &vectors, 7);
    }

    /// What is covered and what is lost make up all the energy there is.
    fn assert_total_is_kept(pca: &IncrementalPca, vectors: &[Vec<f64>]) {
        let (mean, _, _) = batch(vectors, 0);
        let total: f64 = vectors
            .iter()
            .flat_map(|x| x.iter().zip(&mean).map(|(x, mean)| (x - mean).powi(2)))
            .sum();
        let covered = pca.eigenvalues().iter().sum::<f64>() * vectors.len() as f64;
        assert!((covered + pca.lost_energy() - total).abs() < TOLERANCE * total);
    }

    /// Vectors on the axes, with these deviations from the first: what each policy makes of them.
    fn dimensions_after(growth: Growth, amplitudes: &[f64]) -> usize {
        let mut pca = IncrementalPca::new(8, growth);
        pca.add(&[0.0; 8]).expect("finite");
        for (axis, &amplitude) in amplitudes.iter().enumerate() {
            let mut vector = [0.0; 8];
            vector[axis] = amplitude;
            pca.add(&vector).expect("finite");
        }
        pca.dimensions()
    }

    #[test]
    fn the_residual_policy_ignores_vectors_that_are_almost_expressed() {
        let growth = Growth::Residual { above: 5.0 };
        assert_eq!(dimensions_after(growth, &[9.0, 1.0, 9.0, 2.0]), 2);
        assert_eq!(dimensions_after(growth, &[1.0, 1.0, 1.0]), 0);
    }

    #[test]
    fn the_lost_energy_policy_grows_when_too_much_has_been_lost() {
        // The first is half lost with the mean: 9²·1/2 = 40.5.
        let after =
            |above, amplitudes: &[f64]| dimensions_after(Growth::LostEnergy { above }, amplitudes);
        assert_eq!(after(40.0, &[9.0]), 1);
        assert_eq!(after(41.0, &[9.0]), 0);
        assert_eq!(after(41.0, &[9.0, 9.0]), 1);
    }

    #[test]
    fn the_eigenvalue_policy_wants_variance_in_every_dimension() {
        // The first has variance 9²/4 = 20.25.
        let after =
            |above, amplitudes: &[f64]| dimensions_after(Growth::Eigenvalue { above }, amplitudes);
        assert_eq!(after(20.0, &[9.0]), 1);
        assert_eq!(after(21.0, &[9.0]), 0);
        assert_eq!(after(1.0, &[9.0, 1.0, 9.0]), 2);
    }

    #[test]
    fn a_thousand_updates_keep_the_basis_orthonormal() {
        for growth in [Growth::Exact, Growth::Fixed { dimensions: 15 }] {
            let pca = learned(&random_vectors(40, 1000, 50), growth);
            assert!(orthogonality(&pca) < TOLERANCE, "{:e}", orthogonality(&pca));
        }
    }
}
