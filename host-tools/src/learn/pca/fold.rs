//! Everything PCA needs to know of some vectors, in a form that joins: number, mean, and products about the mean.
//!
//! **Notation.** n vectors of m numbers; products are Σ (x − x̄)(x − x̄)ᵀ, m×m, of which the lower triangle is kept.
//!
//! **Method.** Fewer than m vectors are kept as they are: less to keep, and (n×n) products of them are all that is
//! needed. From m vectors on, blocks of them are centered about their own mean and added to the products in double
//! precision; two groups join by report section 2.1.2's idea for many vectors at once (T. F. Chan, G. H. Golub and R. J.
//! LeVeque, *Updating formulae and a pairwise algorithm for computing sample variances*, 1979):
//! products = products₁ + products₂ + n₁n₂/(n₁ + n₂)·(x̄₁ − x̄₂)(x̄₁ − x̄₂)ᵀ.
//!
//! **Cost.** n·m²/2 multiply-adds in matrix products; [`PARTS`] times the products while folding.
//!
//! **Limits.** Joining in another order rounds differently: by some 10⁻¹⁵ of the largest eigenvalue.

use faer::{
    Accum, Mat, MatMut, MatRef, Par,
    linalg::matmul::triangular::{self, BlockStructure},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::super::Rows;

/// Parts that are folded at the same time: fixed, so that results are the same for any number of threads.
const PARTS: usize = 8;

/// Vectors that are centered and multiplied at once.
const BLOCK: usize = 512;

/// What PCA needs to know of some vectors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fold {
    pixels: usize,
    vectors: Vectors,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Vectors {
    /// Fewer than m: themselves, row by row.
    Few(Vec<f32>),
    /// m or more.
    Many(Products),
}

/// Number, mean and products about the mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Products {
    count: usize,
    pub(super) mean: Vec<f64>,
    /// m×m by columns; only the lower triangle means anything.
    values: Vec<f64>,
}

impl Fold {
    /// Folds the vectors `first..end` of `rows`.
    ///
    /// # Panics
    /// When there are not that many.
    #[must_use]
    pub fn of(rows: &dyn Rows, first: usize, end: usize) -> Self {
        assert!(first <= end && end <= rows.count(), "vectors that exist");
        let (count, pixels) = (end - first, rows.pixels());
        if count < pixels {
            let mut few = vec![0.0; count * pixels];
            few.par_chunks_mut(BLOCK * pixels)
                .enumerate()
                .for_each(|(block, out)| rows.read(first + block * BLOCK, out));
            return Self {
                pixels,
                vectors: Vectors::Few(few),
            };
        }
        let parts = PARTS.min(count.div_ceil(BLOCK));
        let cut = |part: usize| first + count * part / parts;
        let folded: Vec<Products> = (0..parts)
            .into_par_iter()
            .map(|part| Products::of_rows(rows, cut(part), cut(part + 1)))
            .collect();
        let joined = folded.into_iter().reduce(|one, other| one.join(&other));
        Self {
            pixels,
            vectors: Vectors::Many(joined.unwrap_or_else(|| Products::none(pixels))),
        }
    }

    /// Both groups of vectors as one.
    ///
    /// # Errors
    /// When their vectors have different lengths: the two numbers.
    pub fn join(self, other: Self) -> Result<Self, (usize, usize)> {
        let pixels = self.pixels;
        if pixels != other.pixels {
            return Err((pixels, other.pixels));
        }
        let vectors = match (self.vectors, other.vectors) {
            (Vectors::Few(mut one), Vectors::Few(other)) => {
                one.extend(other);
                if one.len() < pixels * pixels {
                    Vectors::Few(one)
                } else {
                    Vectors::Many(Products::of_few(&one, pixels))
                }
            }
            (one, other) => {
                let [one, other] = [one, other].map(|vectors| match vectors {
                    Vectors::Few(few) => Products::of_few(&few, pixels),
                    Vectors::Many(products) => products,
                });
                Vectors::Many(one.join(&other))
            }
        };
        Ok(Self { pixels, vectors })
    }

    /// Number of vectors, n.
    #[must_use]
    pub fn count(&self) -> usize {
        match &self.vectors {
            Vectors::Few(few) => few.len() / self.pixels.max(1),
            Vectors::Many(products) => products.count,
        }
    }

    /// Numbers per vector, m.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.pixels
    }

    /// Whether its lengths agree and its numbers can be those of vectors whose numbers are at most `largest`; a fold that
    /// was read from a file may be anything.
    #[must_use]
    pub fn is_sound(&self, largest: f64) -> bool {
        let m = self.pixels;
        m > 0
            && match &self.vectors {
                Vectors::Few(few) => {
                    few.len().is_multiple_of(m)
                        && few.len() / m < m
                        && few.iter().all(|x| f64::from(x.abs()) <= largest)
                }
                Vectors::Many(products) => {
                    let most = 4.0 * largest * largest * products.count as f64;
                    products.count >= m
                        && products.mean.len() == m
                        && Some(products.values.len()) == m.checked_mul(m)
                        && products.mean.iter().all(|x| x.abs() <= largest)
                        && products.values.iter().all(|x| x.abs() <= most)
                        && (0..m).all(|i| products.values[i * m + i] >= 0.0)
                }
            }
    }

    pub(super) fn vectors(&self) -> &Vectors {
        &self.vectors
    }
}

impl Products {
    fn none(pixels: usize) -> Self {
        Self {
            count: 0,
            mean: vec![0.0; pixels],
            values: vec![0.0; pixels * pixels],
        }
    }

    fn of_rows(rows: &dyn Rows, first: usize, end: usize) -> Self {
        let pixels = rows.pixels();
        let mut products = Self::none(pixels);
        let mut buffer = Vec::new();
        let mut centered = vec![0.0; BLOCK * pixels];
        for start in (first..end).step_by(BLOCK) {
            let block = rows.block(start, BLOCK.min(end - start), &mut buffer);
            products.add(block, &mut centered[..block.len()]);
        }
        products
    }

    fn of_few(few: &[f32], pixels: usize) -> Self {
        let mut products = Self::none(pixels);
        for block in few.chunks(BLOCK * pixels) {
            products.add(block, &mut vec![0.0; block.len()]);
        }
        products
    }

    /// Adds the vectors of `block`; `centered` is room for as many numbers.
    fn add(&mut self, block: &[f32], centered: &mut [f64]) {
        let pixels = self.mean.len();
        let count = block.len() / pixels;
        let mean = mean_of(block, pixels);
        let rows = centered.chunks_exact_mut(pixels);
        for (centered, row) in rows.zip(block.chunks_exact(pixels)) {
            for ((centered, &x), mean) in centered.iter_mut().zip(row).zip(&mean) {
                *centered = f64::from(x) - mean;
            }
        }
        let vectors = MatRef::from_column_major_slice(&*centered, pixels, count);
        add_products(&mut self.values, vectors);
        self.shift(count, &mean);
    }

    fn join(mut self, other: &Self) -> Self {
        for (one, other) in self.values.iter_mut().zip(&other.values) {
            *one += other;
        }
        self.shift(other.count, &other.mean);
        self
    }

    /// Accounts for `count` more vectors whose mean was another; their products are in already.
    fn shift(&mut self, count: usize, mean: &[f64]) {
        let (old, new) = (self.count as f64, count as f64);
        self.count += count;
        if old + new == 0.0 {
            return;
        }
        let weight = (old * new / (old + new)).sqrt();
        let step: Vec<f64> = mean
            .iter()
            .zip(&self.mean)
            .map(|(new, old)| (new - old) * weight)
            .collect();
        add_products(
            &mut self.values,
            MatRef::from_column_major_slice(&step, step.len(), 1),
        );
        for (own, other) in self.mean.iter_mut().zip(mean) {
            *own += (other - *own) * (new / (old + new));
        }
    }

    /// m×m; only the lower triangle means anything.
    pub(super) fn matrix(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.values, self.mean.len(), self.mean.len())
    }
}

/// `values` (m×m, lower triangle) += Σ x·xᵀ over the columns of `vectors` (m×n).
fn add_products(values: &mut [f64], vectors: MatRef<'_, f64>) {
    let order = vectors.nrows();
    triangular::matmul(
        MatMut::from_column_major_slice_mut(values, order, order),
        BlockStructure::TriangularLower,
        Accum::Add,
        vectors,
        BlockStructure::Rectangular,
        vectors.transpose(),
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
}

/// Few vectors (rows of `pixels` numbers) about their mean, m×n, and the mean.
pub(super) fn center(few: &[f32], pixels: usize) -> (Mat<f64>, Vec<f64>) {
    let count = few.len() / pixels;
    let mean = mean_of(few, pixels);
    let centered = Mat::from_fn(pixels, count, |i, j| {
        f64::from(few[j * pixels + i]) - mean[i]
    });
    (centered, mean)
}

/// The mean of vectors (rows of `pixels` numbers); zeros when there are none.
fn mean_of(vectors: &[f32], pixels: usize) -> Vec<f64> {
    let mut mean = vec![0.0; pixels];
    for row in vectors.chunks_exact(pixels) {
        for (sum, &x) in mean.iter_mut().zip(row) {
            *sum += f64::from(x);
        }
    }
    let count = (vectors.len() / pixels).max(1);
    mean.iter_mut().for_each(|sum| *sum /= count as f64);
    mean
}
