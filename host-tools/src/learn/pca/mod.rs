//! Principal component analysis of the candidates; report section 2.1.1.
//!
//! **Notation.** n vectors x of m numbers, k dimensions, mean x̄, basis rows e. Eigenvalues are those of the covariance
//! (1/n)·A·Aᵀ of the centered vectors (ERRATA of the report: everywhere). Basis vectors are orthonormal rows; their sign
//! makes the entry of largest magnitude positive.
//!
//! **Method.** [`Route`] says which products are decomposed: n×n (report (2.5) to (2.7)) when there are fewer vectors than
//! numbers in one, m×m otherwise, and neither but a random sketch of them when both are large. Vectors are read block by
//! block, in single precision, and summed in double; [`Fold`] is what is kept of them, and folds join. The rank is found
//! numerically, and k may not exceed it: n centered vectors span at most n − 1 dimensions.
//!
//! **Cost.** n·m·min(n, m)/2 multiply-adds and min(n, m)³ for the eigenvectors; memory for the products, not for the
//! vectors.

mod decompose;
mod fold;
mod sketch;

use faer::{Accum, MatMut, MatRef, Par, linalg::matmul::matmul};
use rayon::prelude::*;

use super::Rows;
use decompose::{Decomposed, decompose};

pub use fold::Fold;

/// The largest products that are decomposed: views of 50×50 pixels, the largest on board, always are.
const MAX_DECOMPOSED: usize = 2500;

/// Vectors that are projected at once.
const BLOCK: usize = 512;

/// An eigenspace in f64: Ω = (x̄, T, Λ, n) of the report.
#[derive(Clone, Debug)]
pub struct Model {
    /// x̄, m numbers.
    pub mean: Vec<f64>,
    /// The first k eigenvectors: k rows of m.
    pub basis: Vec<f64>,
    /// Every eigenvalue above the numerical zero, largest first; of a sketch, only the leading k.
    pub eigenvalues: Vec<f64>,
    /// Sum of all eigenvalues, known or not.
    pub total_variance: f64,
    /// Dimensions kept, k.
    pub dimensions: usize,
    /// Numbers per vector, m.
    pub pixels: usize,
    /// Number of vectors, n.
    pub count: usize,
    /// How it was learned.
    pub route: Route,
}

/// Which matrix the eigenvectors come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Route {
    /// The n×n products of fewer vectors than numbers in one.
    Gram,
    /// The m×m products.
    Covariance,
    /// A random sketch, because n and m are both large: `residual` is how far the vectors are from being eigenvectors,
    /// ‖C·e − λ·e‖/λ at most.
    Sketch {
        /// Largest residual, relative to its eigenvalue.
        residual: f64,
    },
}

/// Why there is no such eigenspace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PcaError {
    /// More dimensions are asked for than the views span.
    #[error(
        "{asked} dimensions are asked for, but the {views} views span only {rank}; choose --dims up to {rank}"
    )]
    BeyondRank {
        /// Dimensions asked for.
        asked: usize,
        /// Numerical rank of the centered views.
        rank: usize,
        /// Number of views.
        views: usize,
    },
    /// The eigenvalue decomposition did not converge.
    #[error("the eigenvalue decomposition of the views did not converge")]
    NoConvergence,
}

impl Model {
    /// Learns the eigenspace of all `rows` with `dimensions` dimensions.
    ///
    /// # Errors
    /// When the vectors span fewer dimensions.
    pub fn learn(rows: &dyn Rows, dimensions: usize) -> Result<Self, PcaError> {
        Self::learn_up_to(MAX_DECOMPOSED, rows, dimensions)
    }

    /// The same with as many dimensions as the vectors span, up to `most`.
    ///
    /// # Errors
    /// When they span none.
    pub fn learn_spanned(rows: &dyn Rows, most: usize) -> Result<Self, PcaError> {
        let fold = Fold::of(rows, 0, rows.count());
        match Self::of_fold(&fold, most) {
            Err(PcaError::BeyondRank { rank, .. }) if rank > 0 => Self::of_fold(&fold, rank),
            result => result,
        }
    }

    /// The same with another limit of what is decomposed.
    fn learn_up_to(
        decomposed: usize,
        rows: &dyn Rows,
        dimensions: usize,
    ) -> Result<Self, PcaError> {
        if rows.count().min(rows.pixels()) <= decomposed {
            Self::of_fold(&Fold::of(rows, 0, rows.count()), dimensions)
        } else {
            let (sketched, residual) = sketch::sketch(rows, dimensions)?;
            let route = Route::Sketch { residual };
            Ok(Self::new(sketched, rows.count(), route))
        }
    }

    /// Learns the eigenspace of folded vectors.
    ///
    /// # Errors
    /// When the vectors span fewer dimensions.
    pub fn of_fold(fold: &Fold, dimensions: usize) -> Result<Self, PcaError> {
        let route = if fold.count() < fold.pixels() {
            Route::Gram
        } else {
            Route::Covariance
        };
        Ok(Self::new(decompose(fold, dimensions)?, fold.count(), route))
    }

    fn new(decomposed: Decomposed, count: usize, route: Route) -> Self {
        let (pixels, dimensions) = decomposed.vectors.shape();
        // Products of few vectors give eigenvectors that are orthogonal only as far as their eigenvalues are exact.
        let orthonormal = decomposed.vectors.qr().compute_thin_Q();
        let mut basis: Vec<f64> = (0..dimensions)
            .flat_map(|r| orthonormal.col(r).iter().copied())
            .collect();
        basis.chunks_exact_mut(pixels).for_each(fix_sign);
        let n = count as f64;
        Self {
            mean: decomposed.mean,
            basis,
            eigenvalues: decomposed.values.iter().map(|value| value / n).collect(),
            total_variance: decomposed.total / n,
            dimensions,
            pixels,
            count,
            route,
        }
    }

    /// Coordinates g of all `rows`, report (2.10): n rows of k.
    #[must_use]
    pub fn project(&self, rows: &dyn Rows) -> Vec<f64> {
        let (m, k) = (self.pixels, self.dimensions);
        let mut coordinates = vec![0.0; rows.count() * k];
        let basis = MatRef::from_row_major_slice(&self.basis, k, m);
        coordinates
            .par_chunks_mut(BLOCK * k)
            .enumerate()
            .for_each_init(
                || (Vec::new(), Vec::new()),
                |(buffer, centered), (block, out)| {
                    let count = out.len() / k;
                    let vectors = rows.block(block * BLOCK, count, buffer);
                    centered.clear();
                    for row in vectors.chunks_exact(m) {
                        let centered_row = row.iter().zip(&self.mean);
                        centered.extend(centered_row.map(|(&x, mean)| f64::from(x) - mean));
                    }
                    matmul(
                        MatMut::from_column_major_slice_mut(out, k, count),
                        Accum::Replace,
                        basis,
                        MatRef::from_column_major_slice(centered, m, count),
                        1.0,
                        Par::Seq,
                    );
                },
            );
        coordinates
    }

    /// The vector that has `coordinates`, report (2.12).
    #[must_use]
    pub fn reconstruct(&self, coordinates: &[f64]) -> Vec<f64> {
        let mut vector = self.mean.clone();
        for (row, g) in self.rows().zip(coordinates) {
            vector.iter_mut().zip(row).for_each(|(x, e)| *x += g * e);
        }
        vector
    }

    /// What `coordinates` leave of `vector`, r = y − T·g − x̄, report (2.13).
    #[must_use]
    pub fn residual(&self, vector: &[f32], coordinates: &[f64]) -> Vec<f64> {
        let reconstructed = self.reconstruct(coordinates);
        vector
            .iter()
            .zip(reconstructed)
            .map(|(&y, recovered)| f64::from(y) - recovered)
            .collect()
    }

    /// Share of the variance that the k dimensions cover, report (2.8).
    #[must_use]
    pub fn covered_variance(&self) -> f64 {
        self.eigenvalues[..self.dimensions].iter().sum::<f64>() / self.total_variance
    }

    /// The basis, row by row.
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.basis.chunks_exact(self.pixels)
    }

    /// λ^(−α/2) per dimension; α = 0 changes nothing.
    #[must_use]
    pub fn whitening(&self, alpha: f64) -> Vec<f64> {
        self.eigenvalues[..self.dimensions]
            .iter()
            .map(|value| value.powf(-alpha / 2.0))
            .collect()
    }

    /// `coordinates` (rows of k) multiplied by λ^(−α/2) per dimension.
    #[must_use]
    pub fn whitened(&self, coordinates: Vec<f64>, alpha: f64) -> Vec<f64> {
        if alpha == 0.0 {
            return coordinates;
        }
        let factors = self.whitening(alpha);
        let mut whitened = coordinates;
        for row in whitened.chunks_exact_mut(self.dimensions) {
            row.iter_mut()
                .zip(&factors)
                .for_each(|(g, factor)| *g *= factor);
        }
        whitened
    }
}

/// The first `count` of every row of `width` coordinates: those of an eigenspace of fewer dimensions.
///
/// # Panics
/// When rows are shorter.
#[must_use]
pub fn first_columns(rows: &[f64], width: usize, count: usize) -> Vec<f64> {
    let rows = rows.chunks_exact(width);
    rows.flat_map(|row| &row[..count]).copied().collect()
}

/// Makes the entry of largest magnitude positive.
fn fix_sign(row: &mut [f64]) {
    if has_wrong_sign(row) {
        row.iter_mut().for_each(|x| *x = -*x);
    }
}

/// Whether the entry of largest magnitude is negative; of equals the first decides.
pub(super) fn has_wrong_sign(vector: &[f64]) -> bool {
    vector.iter().fold(
        0.0_f64,
        |best, &x| if x.abs() > best.abs() { x } else { best },
    ) < 0.0
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::super::Matrix;
    use super::*;
    use crate::simulate::seeded;

    const TOLERANCE: f64 = 1e-10;

    /// n vectors of m numbers with the spectrum of pictures: every direction half as strong as the one before, down to
    /// a thousandth.
    fn vectors(n: usize, m: usize, seed: u64) -> Vec<f32> {
        let mut random = seeded(seed, 0);
        let directions: Vec<f32> = (0..12 * m)
            .map(|_| random.random_range(-1.0..1.0))
            .collect();
        let mut vectors = Vec::with_capacity(n * m);
        for _ in 0..n {
            let weights: [f32; 12] =
                std::array::from_fn(|i| random.random_range(-50.0..50.0) * 0.5_f32.powi(i as i32));
            vectors.extend((0..m).map(|pixel| {
                let parts = weights.iter().enumerate();
                let sum: f32 = parts.map(|(i, w)| w * directions[i * m + pixel]).sum();
                100.0 + sum + random.random_range(-0.01..0.01)
            }));
        }
        vectors
    }

    fn assert_same(one: &Model, other: &Model, tolerance: f64) {
        let largest = one.eigenvalues[0];
        for (a, b) in one.mean.iter().zip(&other.mean) {
            assert!((a - b).abs() < tolerance * 100.0, "mean {a} {b}");
        }
        for (a, b) in one.basis.iter().zip(&other.basis) {
            assert!((a - b).abs() < tolerance, "basis {a} {b}");
        }
        for (a, b) in one.eigenvalues.iter().zip(&other.eigenvalues) {
            assert!((a - b).abs() < tolerance * largest, "eigenvalue {a} {b}");
        }
        let total = (one.total_variance - other.total_variance).abs();
        assert!(
            total < tolerance * largest,
            "total variance differs by {total}"
        );
    }

    #[test]
    fn an_ellipse_has_its_axes() {
        // Four points on the axes of an ellipse around (1, 2): eigenvalues 2·3²/4 and 2·1²/4.
        let views = [4.0, 2.0, -2.0, 2.0, 1.0, 3.0, 1.0, 1.0];
        let rows = Matrix::new(&views, 2);
        let model = Model::learn(&rows, 2).expect("rank 2");
        assert_eq!(model.mean, [1.0, 2.0]);
        assert!(
            (model.eigenvalues[0] - 4.5).abs() < TOLERANCE
                && (model.eigenvalues[1] - 0.5).abs() < TOLERANCE
        );
        assert!(
            (model.basis[0] - 1.0).abs() < TOLERANCE && (model.basis[3] - 1.0).abs() < TOLERANCE
        );
        assert!((model.project(&rows)[0] - 3.0).abs() < TOLERANCE);
        let one = Model::learn(&rows, 1).expect("rank 2");
        assert!((one.covered_variance() - 0.9).abs() < TOLERANCE);
        // (1, 3) lies on the second axis: the first dimension recovers the mean and leaves (0, 1).
        let recovered = one.reconstruct(&one.project(&rows)[2..3]);
        assert!((recovered[0] - 1.0).abs() < TOLERANCE && (recovered[1] - 2.0).abs() < TOLERANCE);
        let residual = one.residual(&views[4..6], &[0.0]);
        assert!(residual[0].abs() < TOLERANCE && (residual[1] - 1.0).abs() < TOLERANCE);
    }

    #[test]
    fn few_and_many_vectors_take_routes_that_agree() {
        let few = vectors(30, 40, 1);
        let gram = Model::learn(&Matrix::new(&few, 40), 8).expect("rank 29");
        assert_eq!(gram.route, Route::Gram);
        let twice: Vec<f32> = few.iter().chain(&few).copied().collect();
        let covariance = Model::learn(&Matrix::new(&twice, 40), 8).expect("rank 29");
        assert_eq!(covariance.route, Route::Covariance);
        assert_same(&gram, &covariance, TOLERANCE);
    }

    #[test]
    fn a_sketch_finds_the_same_eigenspace() {
        let views = vectors(300, 200, 2);
        let rows = Matrix::new(&views, 200);
        let exact = Model::learn(&rows, 9).expect("rank 199");
        let sketched = Model::learn_up_to(199, &rows, 9).expect("rank 199");
        let Route::Sketch { residual } = sketched.route else {
            panic!("{:?}", sketched.route);
        };
        assert!(residual <= sketch::TOLERANCE, "{residual}");
        // An eigenvector turns by residual·λ/gap at most, and eigenvalues here are four times the next.
        assert_same(&sketched, &exact, 2.0 * sketch::TOLERANCE);
        assert!((sketched.covered_variance() - exact.covered_variance()).abs() < TOLERANCE);
    }

    #[test]
    fn a_sketch_knows_the_rank() {
        let flat = vec![3.0; 40 * 30];
        let error = sketch::sketch(&Matrix::new(&flat, 30), 2).err();
        let expected = PcaError::BeyondRank {
            asked: 2,
            rank: 0,
            views: 40,
        };
        assert_eq!(error, Some(expected));
    }

    #[test]
    fn folds_join_to_what_one_run_learns() {
        for (n, m) in [(30, 40), (70, 40), (1500, 24)] {
            let views = vectors(n, m, 3);
            let rows = Matrix::new(&views, m);
            let whole = Model::learn(&rows, 8).expect("rank");
            for parts in [2, 3, 7] {
                let fold = (0..parts)
                    .map(|part| Fold::of(&rows, n * part / parts, n * (part + 1) / parts))
                    .reduce(|one, other| one.join(other).expect("one length"))
                    .expect("parts");
                assert_eq!(fold.count(), n);
                assert!(fold.is_sound(1e3) && !fold.is_sound(50.0));
                assert_same(&Model::of_fold(&fold, 8).expect("rank"), &whole, TOLERANCE);
            }
        }
    }

    #[test]
    fn folds_of_other_lengths_do_not_join() {
        let values = [0.0; 12];
        let [one, other] = [3, 4].map(|m| Fold::of(&Matrix::new(&values, m), 0, 2));
        assert_eq!(one.join(other).err(), Some((3, 4)));
    }

    #[test]
    fn a_large_common_offset_costs_no_digits() {
        let near: Vec<f32> = vectors(600, 20, 4).iter().map(|x| x.round()).collect();
        let far: Vec<f32> = near.iter().map(|x| x + 65536.0).collect();
        let [near, far] =
            [&near, &far].map(|v| Model::learn(&Matrix::new(v, 20), 5).expect("rank"));
        for (a, b) in near.eigenvalues.iter().zip(&far.eigenvalues) {
            assert!((a - b).abs() < TOLERANCE * near.eigenvalues[0]);
        }
    }

    #[test]
    fn dimensions_beyond_the_rank_are_refused() {
        let views = [0.0, 0.0, 1.0, 1.0, 2.0, 2.0];
        let error = Model::learn(&Matrix::new(&views, 2), 2).expect_err("points on a line");
        assert_eq!(
            error,
            PcaError::BeyondRank {
                asked: 2,
                rank: 1,
                views: 3
            }
        );
    }
}
