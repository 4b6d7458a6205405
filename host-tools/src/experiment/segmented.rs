//! What color segmentation changes, as it is shown and kept.

use image::{DynamicImage, RgbImage, imageops::FilterType};
use serde::{Deserialize, Serialize};

use super::{
    ExperimentError, Plan,
    cache::Cache,
    cell::{SEED, STEPS},
    segmentation::{SegmentationEffect, Variant, segmentation_effect},
    seven,
};
use crate::{
    map::Map,
    output::{Progress, jpeg_uri},
};

/// Width of the segmented map, in pixels.
const WIDTH_PX: u32 = 800;

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

impl Segmented {
    /// Measures the effect of a segmentation of `picture`, the map in color, into `colors` colors; what is known in
    /// `directory` is not measured again.
    ///
    /// # Errors
    /// When the picture cannot be segmented, or the result not be kept.
    pub fn measure(
        map: &Map,
        picture: &RgbImage,
        plan: &Plan,
        colors: usize,
        (directory, provenance): (&std::path::Path, &str),
        progress: &Progress,
    ) -> Result<Self, ExperimentError> {
        let cache = Cache::new(directory, map, plan, provenance);
        let key = cache.key((&plan.settings, colors, SEED));
        let name = format!("segmentation-{colors}");
        if let Some(known) = cache.read(&name, &key) {
            return Ok(known);
        }
        let effect = segmentation_effect(picture, &plan.settings, (colors, SEED), STEPS, progress)?;
        let found = Self::of(&effect);
        cache.write(&name, &key, &found)?;
        Ok(found)
    }

    fn of(effect: &SegmentationEffect) -> Self {
        let picture = DynamicImage::ImageLuma8(effect.picture.clone());
        let height =
            u64::from(WIDTH_PX) * u64::from(picture.height()) / u64::from(picture.width().max(1));
        let shown = picture.resize(WIDTH_PX, height as u32 + 1, FilterType::Triangle);
        let shade = |color: &crate::map::PaletteColor| {
            let [red, green, blue] = color.rgb;
            Shade {
                rgb: format!("#{red:02x}{green:02x}{blue:02x}"),
                gray: color.gray,
                share: color.share,
            }
        };
        let rows = effect.variants.iter().map(|found| Tolerates {
            name: match found.variant {
                Variant::Plain => "plain map and camera",
                Variant::Segmented => "segmented map and camera",
                Variant::SegmentedMapOnly => "segmented map under a plain camera",
            }
            .to_owned(),
            nearest: seven(&found.mean.nearest),
            guaranteed: seven(&found.mean.guaranteed),
        });
        Self {
            uri: jpeg_uri(&shown),
            palette: effect.palette.iter().map(shade).collect(),
            rows: rows.collect(),
        }
    }
}
