//! What a user can choose about training.

use eigenmark_core::{
    atlas::Blur,
    eigenspace::Normalize,
    landmark::{Metric, Width},
};

use crate::map::{Grid, GridError, Map};

/// How an atlas is trained. The default is the report's representative setting.
#[derive(Clone, Debug, PartialEq)]
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

/// Which candidates become landmarks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// The first l of the profile ranking (report algorithm 2.3).
    Profile {
        /// Number of landmarks, l.
        landmarks: u32,
    },
    /// All of them, in the order of their numbers: a dense table.
    All,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            scale: 10.0,
            blur: Blur::Gauss1,
            dimensions: 15,
            selection: Selection::Profile { landmarks: 8 },
            view_size_px: 200,
            stride_px: None,
            normalize: Normalize::None,
            highpass_px: 0.0,
            whiten: 0.0,
            metric: Metric::Nssd,
            width: Width::I16,
        }
    }
}

impl Settings {
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

    /// The candidates of `map`.
    ///
    /// # Errors
    /// When the map is too small for the view size, or the stride too fine.
    pub fn grid(&self, map: &Map) -> Result<Grid, GridError> {
        match self.stride_px {
            None => Grid::report(map, self.view_size_px),
            Some(stride_px) => Grid::dense(map, self.view_size_px, stride_px),
        }
    }
}
