//! Candidates in the eigenspace that was learned from them.

use eigenmark_core::landmark::Metric;

use super::{Candidates, Model, PixelBasis, first_columns};

/// Candidates of a map, and an eigenspace of theirs; those of fewer dimensions are its first.
#[derive(Clone, Debug)]
pub struct Space {
    /// The candidates, preprocessed.
    pub candidates: Candidates,
    /// What was learned from them.
    pub model: Model,
    /// What they are compared by.
    pub metric: Metric,
    /// n rows of as many coordinates as the model has dimensions, whitened.
    pub coordinates: Vec<f64>,
    /// The model on the pixels of views.
    pub basis: PixelBasis,
}

impl Space {
    /// Projects the candidates; coordinates are multiplied by λ^(−`whiten`/2).
    #[must_use]
    pub fn new(candidates: Candidates, model: Model, whiten: f64, metric: Metric) -> Self {
        Self {
            coordinates: model.whitened(model.project(&candidates), whiten),
            basis: PixelBasis::new(&model, candidates.preprocess(), whiten),
            metric,
            candidates,
            model,
        }
    }

    /// Dimensions that were learned, K.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        self.model.dimensions
    }

    /// Number of candidates, n.
    #[must_use]
    pub fn count(&self) -> usize {
        self.coordinates.len() / self.dimensions()
    }

    /// Pixels per side of a view, v.
    #[must_use]
    pub fn side(&self) -> usize {
        self.model.pixels.isqrt()
    }

    /// The candidates in `dimensions`: n rows of so many.
    ///
    /// # Panics
    /// When there are fewer.
    #[must_use]
    pub fn first(&self, dimensions: usize) -> Vec<f64> {
        first_columns(&self.coordinates, self.dimensions(), dimensions)
    }

    /// All coordinates of candidate `view` (1-based).
    ///
    /// # Panics
    /// When there is no such candidate.
    #[must_use]
    pub fn point(&self, view: u32) -> &[f64] {
        let k = self.dimensions();
        &self.coordinates[(view as usize - 1) * k..][..k]
    }
}
