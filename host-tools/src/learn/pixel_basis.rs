//! An eigenspace turned through preprocessing onto the pixels of a view: what blur, high-pass and whitening do to a view
//! is done to the basis once instead.
//!
//! **Notation.** y pixels, n(y) after contrast normalization, x after blur and high-pass; W·n(y) − o are the whitened
//! coordinates Λ^(−α/2)·Tᵀ(x − x̄), report (2.10).

use eigenmark_core::eigenspace::Normalize;
use faer::{Accum, MatMut, MatRef, Par, linalg::matmul::matmul};

use super::{Model, Preprocess};
use crate::dense::Sums;

/// k rows of weights on the m pixels of a view, and the offset of each coordinate.
#[derive(Clone, Debug)]
pub struct PixelBasis {
    weights: Vec<f64>,
    offsets: Vec<f64>,
    pixels: usize,
    normalize: Normalize,
}

impl PixelBasis {
    /// The basis of `model` behind `preprocess`, its coordinates multiplied by λ^(−`whiten`/2).
    #[must_use]
    pub fn new(model: &Model, preprocess: &Preprocess, whiten: f64) -> Self {
        let (mut weights, mut offsets) = (Vec::new(), Vec::new());
        for (basis, whitening) in model.rows().zip(model.whitening(whiten)) {
            let folded = preprocess.fold(basis);
            weights.extend(folded.iter().map(|weight| weight * whitening));
            let offset: f64 = basis.iter().zip(&model.mean).map(|(e, x)| e * x).sum();
            offsets.push(whitening * offset);
        }
        Self {
            weights,
            offsets,
            pixels: model.pixels,
            normalize: preprocess.normalize(),
        }
    }

    /// Its first `dimensions`: what learning fewer gives.
    ///
    /// # Panics
    /// When it has fewer.
    #[must_use]
    pub fn first(&self, dimensions: usize) -> Self {
        Self {
            weights: self.weights[..dimensions * self.pixels].to_vec(),
            offsets: self.offsets[..dimensions].to_vec(),
            ..*self
        }
    }

    /// All weights: k rows of m.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The weights, row by row.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.weights.chunks_exact(self.pixels)
    }

    /// What is subtracted from each of the k coordinates.
    #[must_use]
    pub fn offsets(&self) -> &[f64] {
        &self.offsets
    }

    /// Dimensions, k.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        self.offsets.len()
    }

    /// Pixels per view, m.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.pixels
    }

    /// Coordinates of the view with these pixels; `None` for a flat view under [`Normalize::Std`].
    #[must_use]
    pub fn project(&self, view: &[u8]) -> Option<Vec<f64>> {
        let sums = Sums::of(view);
        let view: Vec<f64> = view.iter().map(|&y| f64::from(y)).collect();
        let mut coordinates: Vec<f64> = self
            .rows()
            .map(|row| row.iter().zip(&view).map(|(w, y)| w * y).sum())
            .collect();
        self.finish(sums, &mut coordinates).then_some(coordinates)
    }

    /// The first `dimensions` coordinates of many views at once, m pixels each; their last bits may differ from
    /// [`project`](Self::project)'s.
    ///
    /// # Panics
    /// When there is no whole number of views, or there are fewer dimensions.
    #[must_use]
    pub fn project_all(&self, views: &[u8], dimensions: usize) -> Vec<Option<Vec<f64>>> {
        let (m, k, n) = (self.pixels, dimensions, views.len() / self.pixels);
        assert!(views.len() == n * m, "whole views");
        let pixels: Vec<f64> = views.iter().map(|&y| f64::from(y)).collect();
        let mut products = vec![0.0; k * n];
        matmul(
            MatMut::from_column_major_slice_mut(&mut products, k, n),
            Accum::Replace,
            MatRef::from_row_major_slice(&self.weights[..k * m], k, m),
            MatRef::from_column_major_slice(&pixels, m, n),
            1.0,
            Par::Seq,
        );
        let of_views = views.chunks_exact(m).zip(products.chunks_exact_mut(k));
        of_views
            .map(|(view, products)| {
                (self.finish(Sums::of(view), products)).then(|| products.to_vec())
            })
            .collect()
    }

    /// Turns products w·y of a view with these sums of pixels into coordinates. `false` for a flat view under
    /// [`Normalize::Std`], which has none.
    ///
    /// Rows of a basis whose views are normalized add up to zero, so that w·(y − mean(y)) = w·y.
    pub fn finish(&self, sums: Sums, products: &mut [f64]) -> bool {
        let gain = match self.normalize {
            Normalize::None | Normalize::Mean => 1.0,
            Normalize::Std => {
                let m = self.pixels as u64;
                let scaled_variance = m * sums.squares - sums.pixels * sums.pixels; // m²σ², exact
                if scaled_variance == 0 {
                    return false;
                }
                self.pixels as f64 / (scaled_variance as f64).sqrt()
            }
        };
        for (product, offset) in products.iter_mut().zip(&self.offsets) {
            *product = *product * gain - offset;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use eigenmark_core::atlas::Blur;

    use super::*;
    use crate::learn::Matrix;

    /// Sums of a few dozen products of numbers up to 255.
    const TOLERANCE: f64 = 1e-8;

    #[test]
    fn coordinates_are_those_of_the_filtered_view() {
        let pixels =
            |seed: u32| -> Vec<u8> { (0..49).map(|i| (i * i * (seed + 11) % 251) as u8).collect() };
        for normalize in [Normalize::None, Normalize::Mean, Normalize::Std] {
            let preprocess = Preprocess::new(7, normalize, Blur::Gauss2, 1.5);
            let vectors: Vec<f32> = (0..9)
                .flat_map(|seed| preprocess.of_pixels(&pixels(seed)).expect("not flat"))
                .map(|x| x as f32)
                .collect();
            let model = Model::learn(&Matrix::new(&vectors, 49), 3).expect("learns");
            let basis = PixelBasis::new(&model, &preprocess, 0.5);
            let found = basis.project(&pixels(3)).expect("not flat");
            let expected = model.whitened(model.project(&Matrix::new(&vectors, 49)), 0.5);
            for (found, expected) in found.iter().zip(&expected[9..12]) {
                // Vectors are single precision.
                let difference = (found - expected).abs();
                assert!(difference < 1e-4, "{normalize:?}: {found} {expected}");
            }
            let exact = preprocess.of_pixels(&pixels(3)).expect("not flat");
            for ((row, whitening), found) in model.rows().zip(model.whitening(0.5)).zip(&found) {
                let x = exact.iter().zip(&model.mean).map(|(x, mean)| x - mean);
                let direct: f64 = whitening * row.iter().zip(x).map(|(e, x)| e * x).sum::<f64>();
                assert!((direct - found).abs() < TOLERANCE, "{direct} {found}");
            }
        }
    }

    #[test]
    fn flat_views_have_no_coordinates_of_unit_variance() {
        let preprocess = Preprocess::new(2, Normalize::Std, Blur::None, 0.0);
        let vectors = [1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -1.0];
        let model = Model::learn(&Matrix::new(&vectors, 4), 1).expect("learns");
        let basis = PixelBasis::new(&model, &preprocess, 0.0);
        assert!(basis.project(&[7; 4]).is_none());
        assert!(basis.project(&[7, 7, 7, 8]).is_some());
    }
}
