//! What a user can choose about training.

use std::ops::RangeInclusive;

use eigenmark_core::{
    atlas::Blur,
    eigenspace::{MAX_DIMENSIONS, Normalize},
    landmark::{Altitudes, MAX_HEADINGS, Metric, Width},
    preprocess::{MAX_ALTITUDE_RATIO, MIN_ALTITUDE_RATIO},
};

use serde::{Deserialize, Serialize};

use crate::{
    map::{Grid, GridError, Map},
    select::{Dissimilarity, Selection},
};

/// Scales that can be chosen.
pub const SCALES: RangeInclusive<f64> = 1.0..=1000.0;

/// Sigmas of a high-pass that can be chosen, in view pixels.
pub const HIGHPASSES: RangeInclusive<f64> = 0.0..=1000.0;

/// Whitening exponents that can be chosen.
pub const WHITENINGS: RangeInclusive<f64> = 0.0..=2.0;

/// Numbers of headings that can be chosen.
pub const HEADINGS: RangeInclusive<u8> = 1..=MAX_HEADINGS;

/// Altitude ratios that can be chosen.
pub const ALTITUDES: RangeInclusive<f32> = MIN_ALTITUDE_RATIO..=MAX_ALTITUDE_RATIO;

/// What users call a blur.
#[must_use]
pub fn blur_name(blur: Blur) -> &'static str {
    match blur {
        Blur::None => "none",
        Blur::Gauss1 => "gauss1",
        Blur::Gauss2 => "gauss2",
        Blur::Gauss3 => "gauss3",
    }
}

/// How an atlas is trained. The default is the report's representative setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Map pixels per view pixel: a view has ⌊view size / scale⌋ pixels per side (report table 3.1).
    pub scale: f64,
    /// Gaussian blur of the views (report table 3.2).
    pub blur: Blur,
    /// Dimensions of the eigenspace, k.
    pub dimensions: u8,
    /// Which candidates become landmarks.
    pub selection: Selection,
    /// Side of a view's footprint, in map pixels.
    pub view_size_px: u32,
    /// Distance between candidates in map pixels; `None` for the report's layout.
    pub stride_px: Option<u32>,
    /// Headings that candidates are seen at, evenly spread from map-up on.
    pub headings: u8,
    /// Ratios of actual over nominal altitude that candidates are seen from, ascending.
    pub altitudes: Altitudes,
    /// Contrast normalization.
    pub normalize: Normalize,
    /// Sigma of the high-pass in view pixels; 0 for none.
    pub highpass_px: f64,
    /// Whitening exponent α; 0 for none.
    pub whiten: f64,
    /// Metric of selection and matching.
    pub metric: Metric,
    /// Width of the landmarks' coefficients.
    pub width: Width,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            scale: 10.0,
            blur: Blur::Gauss1,
            dimensions: 15,
            selection: Selection::profile(8),
            view_size_px: 200,
            stride_px: None,
            headings: 1,
            altitudes: [1.0].into_iter().collect(),
            normalize: Normalize::None,
            highpass_px: 0.0,
            whiten: 0.0,
            metric: Metric::Nssd,
            width: Width::I16,
        }
    }
}

impl Settings {
    /// Whether its numbers are in the ranges that the command line accepts; settings read from a file may be anything.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        SCALES.contains(&self.scale)
            && (1..=MAX_DIMENSIONS).contains(&self.dimensions)
            && self.view_size_px > 0
            && self.stride_px != Some(0)
            && HEADINGS.contains(&self.headings)
            && !self.altitudes.is_empty()
            && self.altitudes.is_sorted_by(|a, b| a < b)
            && self.altitudes.iter().all(|ratio| ALTITUDES.contains(ratio))
            && HIGHPASSES.contains(&self.highpass_px)
            && WHITENINGS.contains(&self.whiten)
            && match &self.selection {
                Selection::All => true,
                Selection::Best(best) => best.is_sound(),
            }
    }

    /// Whether candidates are seen at the nominal heading and altitude only.
    #[must_use]
    pub fn is_nominal(&self) -> bool {
        self.headings == 1 && self.altitudes[..] == [1.0]
    }

    /// Pixels per side of a view, v = ⌊view size / scale⌋.
    ///
    /// ```
    /// use eigenmark::learn::Settings;
    /// let sides = [1.0, 3.0, 6.0, 12.0, 15.0].map(|scale| Settings { scale, ..Settings::default() }.view_side());
    /// assert_eq!(sides, [200, 66, 33, 16, 13]); // report table 3.1
    /// ```
    #[must_use]
    pub fn view_side(&self) -> u32 {
        (f64::from(self.view_size_px) / self.scale) as u32
    }

    /// What a profile averages: the selection's own choice, or the dissimilarity of the metric.
    #[must_use]
    pub fn dissimilarity(&self) -> Dissimilarity {
        let chosen = match &self.selection {
            Selection::All => None,
            Selection::Best(best) => best.dissimilarity,
        };
        chosen.unwrap_or(self.metric.into())
    }

    /// The candidates of `map`.
    ///
    /// # Errors
    /// When the map is too small for the view size, its headings and altitudes, or the stride too fine.
    pub fn grid(&self, map: &Map) -> Result<Grid, GridError> {
        let grid = match self.stride_px {
            None => Grid::report(map, self.view_size_px),
            Some(stride_px) => Grid::dense(map, self.view_size_px, stride_px),
        };
        grid?.layered(map, self.headings, &self.altitudes)
    }
}
