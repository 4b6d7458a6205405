//! What color segmentation changes, as it is shown.

use serde::{Deserialize, Serialize};

/// The effect of a segmentation on reliability: report section 5.2.1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segmented {
    /// The segmented map in gray, as a data URI.
    pub uri: String,
    /// From dark to light.
    pub palette: Vec<Shade>,
    /// By variant.
    pub rows: Vec<Tolerates>,
}

/// A color of the palette.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shade {
    /// As `#rrggbb`.
    pub rgb: String,
    /// The gray it becomes.
    pub gray: u8,
    /// Share of the map.
    pub share: f64,
}

/// What a variant tolerates: the numbers that [`SEVEN`](super::SEVEN) names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tolerates {
    /// How the map is learned and seen.
    pub name: String,
    /// As the strict nearest neighbor.
    pub nearest: [Option<f64>; 7],
    /// With a guarantee.
    pub guaranteed: [Option<f64>; 7],
}
