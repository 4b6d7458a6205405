//! Principal component analysis of the candidates; report section 2.1.1.
//!
//! Eigenvalues are those of the covariance (1/n)·A·Aᵀ of the centred views (ERRATA of the report: everywhere).
//! The smaller of the two Gram matrices is decomposed: n×n (report (2.5)–(2.7)) when there are fewer views than
//! pixels, m×m otherwise. Basis vectors are orthonormal rows; their sign makes the entry of largest magnitude
//! positive. The rank is found numerically, and k may not exceed it: n centred views span at most n − 1 dimensions.

use faer::{Mat, MatRef, Side};

/// The largest matrix that is decomposed: min(n, m).
const MAX_DECOMPOSED: usize = 5000;

/// An eigenspace in f64: Ω = (x̄, T, Λ, n) of the report, with the candidates' coordinates.
#[derive(Clone, Debug)]
pub struct Model {
    /// x̄, m numbers.
    pub mean: Vec<f64>,
    /// The first k eigenvectors: k rows of m.
    pub basis: Vec<f64>,
    /// Every eigenvalue above the numerical zero, largest first.
    pub eigenvalues: Vec<f64>,
    /// Coordinates g of the candidates, report (2.10): n rows of k.
    pub coefficients: Vec<f64>,
    /// Dimensions kept, k.
    pub dimensions: usize,
    /// Pixels per view, m.
    pub pixels: usize,
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
        /// Numerical rank of the centred views.
        rank: usize,
        /// Number of views.
        views: usize,
    },
    /// Both the number of views and the number of pixels are too large for a full decomposition.
    #[error(
        "{views} views of {pixels} pixels are too many for a full decomposition; raise --stride or --scale"
    )]
    TooLarge {
        /// Number of views.
        views: usize,
        /// Pixels per view.
        pixels: usize,
    },
    /// The eigenvalue decomposition did not converge.
    #[error("the eigenvalue decomposition of the views did not converge")]
    NoConvergence,
}

impl Model {
    /// Learns the eigenspace of `views` (rows of `pixels` numbers) with `dimensions` dimensions.
    ///
    /// # Errors
    /// When the views span fewer dimensions, or are too many.
    pub fn learn(views: &[f64], pixels: usize, dimensions: usize) -> Result<Self, PcaError> {
        let n = views.len() / pixels;
        if n.min(pixels) > MAX_DECOMPOSED {
            return Err(PcaError::TooLarge { views: n, pixels });
        }
        let mut mean = vec![0.0; pixels];
        for row in views.chunks_exact(pixels) {
            mean.iter_mut().zip(row).for_each(|(sum, x)| *sum += x);
        }
        mean.iter_mut().for_each(|sum| *sum /= n as f64);
        let centred: Vec<f64> = views
            .chunks_exact(pixels)
            .flat_map(|row| row.iter().zip(&mean).map(|(x, mean)| x - mean))
            .collect();
        let a = MatRef::from_row_major_slice(&centred, n, pixels);

        let is_gram = n <= pixels;
        let gram = if is_gram {
            a * a.transpose()
        } else {
            a.transpose() * a
        };
        let decomposed = gram
            .self_adjoint_eigen(Side::Lower)
            .map_err(|_| PcaError::NoConvergence)?;
        let order = gram.nrows();
        let ascending = decomposed.S().column_vector();
        let largest = ascending[order - 1].max(0.0);
        // Rounding of the Gram matrix itself is of this size.
        let zero = largest * f64::EPSILON * n.max(pixels) as f64;
        let scatter: Vec<f64> = (0..order)
            .rev()
            .map(|i| ascending[i])
            .take_while(|&value| value > zero)
            .collect();
        let rank = scatter.len().min(n.saturating_sub(1));
        if dimensions > rank {
            return Err(PcaError::BeyondRank {
                asked: dimensions,
                rank,
                views: n,
            });
        }

        let vectors = Mat::from_fn(order, dimensions, |i, r| decomposed.U()[(i, order - 1 - r)]);
        let basis = if is_gram {
            vectors.transpose() * a
        } else {
            vectors.transpose().to_owned()
        };
        let mut basis: Vec<f64> = (0..dimensions)
            .flat_map(|r| basis.row(r).iter().copied().collect::<Vec<_>>())
            .collect();
        orthonormalize(&mut basis, pixels);
        basis.chunks_exact_mut(pixels).for_each(fix_sign);

        let t = MatRef::from_row_major_slice(&basis, dimensions, pixels);
        let g = a * t.transpose();
        let coefficients = (0..n)
            .flat_map(|i| g.row(i).iter().copied().collect::<Vec<_>>())
            .collect();
        let eigenvalues = scatter[..rank]
            .iter()
            .map(|value| value / n as f64)
            .collect();
        Ok(Self {
            mean,
            basis,
            eigenvalues,
            coefficients,
            dimensions,
            pixels,
        })
    }

    /// Share of the variance that the k dimensions cover, report (2.8).
    #[must_use]
    pub fn covered_variance(&self) -> f64 {
        self.eigenvalues[..self.dimensions].iter().sum::<f64>()
            / self.eigenvalues.iter().sum::<f64>()
    }

    /// The basis, row by row.
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.basis.chunks_exact(self.pixels)
    }

    /// The same coordinates multiplied by λ^(−α/2) per dimension; α = 0 changes nothing.
    #[must_use]
    pub fn whitened(&self, alpha: f64) -> Vec<f64> {
        let factors = self.whitening(alpha);
        self.coefficients
            .iter()
            .zip(factors.iter().cycle())
            .map(|(g, factor)| g * factor)
            .collect()
    }

    /// λ^(−α/2) per dimension.
    #[must_use]
    pub fn whitening(&self, alpha: f64) -> Vec<f64> {
        self.eigenvalues[..self.dimensions]
            .iter()
            .map(|value| value.powf(-alpha / 2.0))
            .collect()
    }
}

/// Gram-Schmidt on rows, twice: the second pass removes what rounding left in the first.
fn orthonormalize(rows: &mut [f64], len: usize) {
    for r in 0..rows.len() / len {
        let (before, rest) = rows.split_at_mut(r * len);
        let row = &mut rest[..len];
        normalize(row);
        for _ in 0..2 {
            for earlier in before.chunks_exact(len) {
                let dot: f64 = earlier.iter().zip(row.iter()).map(|(a, b)| a * b).sum();
                row.iter_mut().zip(earlier).for_each(|(x, e)| *x -= dot * e);
            }
            normalize(row);
        }
    }
}

fn normalize(row: &mut [f64]) {
    let norm = row.iter().map(|x| x * x).sum::<f64>().sqrt();
    row.iter_mut().for_each(|x| *x /= norm);
}

/// Makes the entry of largest magnitude positive; of equals the first decides.
fn fix_sign(row: &mut [f64]) {
    let largest = row.iter().fold(
        0.0_f64,
        |best, &x| if x.abs() > best.abs() { x } else { best },
    );
    if largest < 0.0 {
        row.iter_mut().for_each(|x| *x = -*x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: f64 = 1e-10;

    #[test]
    fn an_ellipse_has_its_axes() {
        // Four points on the axes of an ellipse around (1, 2): eigenvalues 2·3²/4 and 2·1²/4.
        let views = [4.0, 2.0, -2.0, 2.0, 1.0, 3.0, 1.0, 1.0];
        let model = Model::learn(&views, 2, 2).expect("rank 2");
        assert_eq!(model.mean, [1.0, 2.0]);
        assert!(
            (model.eigenvalues[0] - 4.5).abs() < TOLERANCE
                && (model.eigenvalues[1] - 0.5).abs() < TOLERANCE
        );
        assert!(
            (model.basis[0] - 1.0).abs() < TOLERANCE && (model.basis[3] - 1.0).abs() < TOLERANCE
        );
        assert!((model.coefficients[0] - 3.0).abs() < TOLERANCE);
        let one = Model::learn(&views, 2, 1).expect("rank 2");
        assert!((one.covered_variance() - 0.9).abs() < TOLERANCE);
    }

    #[test]
    fn both_routes_agree() {
        let value = |i: usize| ((i * 7919) % 1009) as f64 / 10.0;
        let wide: Vec<f64> = (0..6 * 9).map(value).collect(); // 6 views of 9 pixels: Gram
        let gram = Model::learn(&wide, 9, 5).expect("rank 5");
        let repeated: Vec<f64> = wide.iter().chain(&wide).copied().collect(); // 12 views of 9: covariance
        let covariance = Model::learn(&repeated, 9, 5).expect("rank 5");
        for (a, b) in gram.basis.iter().zip(&covariance.basis) {
            assert!((a - b).abs() < 1e-8, "{a} {b}");
        }
        for (a, b) in gram.eigenvalues.iter().zip(&covariance.eigenvalues) {
            assert!((a - b).abs() < 1e-8 * gram.eigenvalues[0]);
        }
    }

    #[test]
    fn dimensions_beyond_the_rank_are_refused() {
        let views = [0.0, 0.0, 1.0, 1.0, 2.0, 2.0];
        let error = Model::learn(&views, 2, 2).expect_err("points on a line");
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
