//! The candidates of a map at one scale and blur, in the eigenspace that they span.

use eigenmark_core::landmark::Metric;

use super::ExperimentError;
use crate::{
    learn::{Candidates, Model, PixelBasis, Preprocess, Settings, first_columns},
    map::Map,
};

/// An eigenspace of so many dimensions as its candidates span, up to a number; those of fewer are its first.
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
    /// Learns up to `most` dimensions from the candidates that the settings ask for, of any side.
    ///
    /// # Errors
    /// When there are no such candidates, or they span nothing.
    pub fn learn(map: &Map, settings: &Settings, most: usize) -> Result<Self, ExperimentError> {
        let preprocess = Preprocess::new(
            settings.view_side() as usize,
            settings.normalize,
            settings.blur,
            settings.highpass_px,
        );
        let candidates = Candidates::new(map, &settings.grid(map)?, &preprocess)?;
        let model = Model::learn_spanned(&candidates, most)?;
        Ok(Self {
            coordinates: model.whitened(model.project(&candidates), settings.whiten),
            basis: PixelBasis::new(&model, &preprocess, settings.whiten),
            metric: settings.metric,
            candidates,
            model,
        })
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
