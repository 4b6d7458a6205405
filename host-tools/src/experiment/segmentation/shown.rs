//! What color segmentation changes, as it is shown and kept.

use image::{DynamicImage, RgbImage};
use serde::{Deserialize, Serialize};

use super::{SegmentationEffect, Variant, segmentation_effect};
use crate::{
    experiment::{
        ExperimentError, Plan,
        cache::{Cache, crc},
        cell::{SEED, STEPS},
        seven,
    },
    learn::Settings,
    map::Map,
    output::{Progress, fitted, jpeg_uri},
    select::Selection,
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

/// What a variant tolerates: orientation, altitude and gamma from and to, and the catchment in percent.
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
        is_fresh: bool,
        progress: &Progress,
    ) -> Result<Self, ExperimentError> {
        let cache = Cache::new(directory, map, plan, provenance);
        // As many landmarks as the plan selects, by profile.
        let settings = Settings {
            selection: Selection::profile(plan.landmarks),
            ..plan.settings.clone()
        };
        let key = cache.key((&settings, colors, SEED, crc(picture.as_raw())));
        let name = format!("segmentation-{colors}");
        if let Some(known) = cache.read(&name, &key).filter(|_| !is_fresh) {
            return Ok(known);
        }
        let effect = segmentation_effect(picture, &settings, (colors, SEED), STEPS, progress)?;
        let found = Self::of(&effect);
        cache.write(&name, &key, &found)?;
        Ok(found)
    }

    fn of(effect: &SegmentationEffect) -> Self {
        let picture = DynamicImage::ImageLuma8(effect.picture.clone());
        let shown = fitted(&picture, WIDTH_PX);
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
