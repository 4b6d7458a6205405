//! From folded vectors to eigenvectors: n×n products of few vectors (report (2.5) to (2.7)), m×m products of many.

use faer::{
    Accum, Mat, MatRef, Par, Side,
    linalg::matmul::triangular::{self, BlockStructure},
};

use super::{
    PcaError,
    fold::{Fold, Vectors, center},
};

/// Eigenvectors and eigenvalues of the products of n vectors; not yet divided by n.
pub(super) struct Decomposed {
    /// x̄.
    pub mean: Vec<f64>,
    /// The leading eigenvectors: k columns of m, almost orthonormal.
    pub vectors: Mat<f64>,
    /// Every eigenvalue that is not numerically zero, largest first.
    pub values: Vec<f64>,
    /// Sum of all eigenvalues.
    pub total: f64,
}

/// Decomposes all of it; `dimensions` eigenvectors.
pub(super) fn decompose(fold: &Fold, dimensions: usize) -> Result<Decomposed, PcaError> {
    match fold.vectors() {
        Vectors::Few(few) => {
            let (centered, mean) = center(few, fold.pixels());
            let mut products = Mat::zeros(fold.count(), fold.count());
            triangular::matmul(
                products.as_mut(),
                BlockStructure::TriangularLower,
                Accum::Replace,
                centered.transpose(),
                BlockStructure::Rectangular,
                centered.as_ref(),
                BlockStructure::Rectangular,
                1.0,
                Par::Seq,
            );
            let mut decomposed = of_products(products.as_ref(), mean, fold, dimensions)?;
            // e = A·ẽ (2.7), up to its length.
            decomposed.vectors = &centered * &decomposed.vectors;
            Ok(decomposed)
        }
        Vectors::Many(products) => {
            of_products(products.matrix(), products.mean.clone(), fold, dimensions)
        }
    }
}

fn of_products(
    products: MatRef<'_, f64>,
    mean: Vec<f64>,
    fold: &Fold,
    dimensions: usize,
) -> Result<Decomposed, PcaError> {
    let order = products.nrows();
    let eigen = products
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| PcaError::NoConvergence)?;
    let n = fold.count();
    let descending = || (0..order).rev().map(|i| eigen.S().column_vector()[i]);
    // Rounding of the products themselves is of this size.
    let zero = descending().next().unwrap_or(0.0) * f64::EPSILON * n.max(fold.pixels()) as f64;
    let mut values: Vec<f64> = descending()
        .take_while(|&value| value > zero.max(0.0))
        .collect();
    // Centred vectors span one dimension less than there are.
    values.truncate(n.saturating_sub(1));
    if dimensions > values.len() {
        return Err(PcaError::BeyondRank {
            asked: dimensions,
            rank: values.len(),
            views: n,
        });
    }
    Ok(Decomposed {
        mean,
        vectors: Mat::from_fn(order, dimensions, |i, r| eigen.U()[(i, order - 1 - r)]),
        total: values.iter().sum(),
        values,
    })
}
