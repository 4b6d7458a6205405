//! What is in an atlas, for people and for scripts.

use eigenmark_core::{
    atlas::Atlas,
    eigenspace::Normalize,
    landmark::{Metric, Width},
    localizer::Localizer,
};
use serde::Serialize;

use crate::learn::blur_name;

/// What is in an atlas.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Format version.
    pub version: u16,
    /// CRC-32 of the atlas, in hexadecimal: its identity.
    pub crc: String,
    /// Length of the atlas: the flash it needs.
    pub flash_bytes: u32,
    /// RAM of the localizer, frames not included.
    pub ram_bytes: usize,
    /// Pixels per side of a view.
    pub view_side: u8,
    /// Dimensions of the eigenspace.
    pub dims: u8,
    /// Number of landmarks.
    pub landmarks: usize,
    /// Number of candidates they were selected from.
    pub candidates: u32,
    /// Share of the candidates' variance that the dimensions cover.
    pub covered_variance: f32,
    /// Limits of known: distance, and distance from feature space.
    pub known: KnownLimits,
    /// Number of places of the topological map.
    pub places: usize,
    /// Number of legs between them, each of which can be flown both ways.
    pub legs: usize,
    /// How it was trained.
    pub settings: SettingsSummary,
    /// The map it was trained on.
    pub map: MapSummary,
    /// Every landmark, best first.
    pub table: Vec<LandmarkSummary>,
}

/// Limits of the known judgement.
#[derive(Clone, Debug, Serialize)]
pub struct KnownLimits {
    /// Largest distance to the landmark.
    pub distance: f32,
    /// Largest distance from feature space.
    pub from_feature_space: f32,
}

/// Training settings under the names of the command line.
#[derive(Clone, Debug, Serialize)]
pub struct SettingsSummary {
    /// Map pixels per view pixel.
    pub scale: f32,
    /// Gaussian blur.
    pub blur: &'static str,
    /// Contrast normalization.
    pub normalize: &'static str,
    /// Sigma of the high-pass in view pixels, 0 for none.
    pub highpass: f32,
    /// Whitening exponent, 0 for none.
    pub whiten: f32,
    /// Metric.
    pub metric: &'static str,
    /// Width of the coefficients.
    pub coefficients: &'static str,
    /// Side of a view's footprint, in map pixels.
    pub view_size: f32,
    /// Headings that views are seen at.
    pub headings: u8,
    /// Altitude ratios that views are seen from.
    pub altitudes: Vec<f32>,
}

/// The map of an atlas.
#[derive(Clone, Debug, Serialize)]
pub struct MapSummary {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// CRC-32 of its luminance, in hexadecimal.
    pub crc: String,
}

/// One landmark.
#[derive(Clone, Debug, Serialize)]
pub struct LandmarkSummary {
    /// Rank in the table, 1-based.
    pub landmark: usize,
    /// Candidate number, 1-based.
    pub view: u32,
    /// Centre of its window, in map pixels.
    pub place: [f32; 2],
    /// Heading it was seen at, in degrees clockwise from map-up to frame-up.
    pub heading_deg: f32,
    /// Altitude it was seen from, over nominal altitude.
    pub altitude_ratio: f32,
    /// Distance below which a fix is guaranteed.
    pub radius: f32,
}

impl Summary {
    /// The summary of `atlas`.
    #[must_use]
    pub fn of(atlas: &Atlas<'_>) -> Self {
        let header = atlas.header();
        let (training, survey) = (header.training, atlas.survey());
        let table = atlas
            .landmarks()
            .records()
            .iter()
            .zip(1..)
            .filter_map(|(record, landmark)| {
                let candidate = survey.find(record.view)?;
                let (place, layer) = (candidate.place(), candidate.layer);
                let headings = u32::from(survey.headings);
                Some(LandmarkSummary {
                    landmark,
                    view: record.view,
                    place: [place.x_px, place.y_px],
                    heading_deg: 360.0 * (layer.index % headings) as f32 / headings as f32,
                    altitude_ratio: layer.altitude_ratio,
                    radius: record.radius,
                })
            });
        Self {
            version: eigenmark_core::atlas::VERSION,
            crc: format!("{:08x}", atlas.crc()),
            flash_bytes: atlas.total_len(),
            ram_bytes: size_of::<Localizer<'_>>(),
            view_side: header.view_side,
            dims: header.dimensions,
            landmarks: atlas.landmarks().len(),
            candidates: survey.count(),
            covered_variance: training.covered_variance,
            known: KnownLimits {
                distance: header.limits.distance,
                from_feature_space: header.limits.from_feature_space,
            },
            places: atlas.topology().len(),
            legs: atlas.topology().stored_legs().len() / 2,
            settings: SettingsSummary {
                scale: training.scale,
                blur: blur_name(training.blur),
                normalize: match header.normalize {
                    Normalize::None => "none",
                    Normalize::Mean => "mean",
                    Normalize::Std => "std",
                },
                highpass: training.highpass,
                whiten: training.whiten,
                metric: match header.metric {
                    Metric::Nssd => "nssd",
                    Metric::Euclid => "euclid",
                    Metric::Cosine => "cosine",
                },
                coefficients: match header.width {
                    Width::I16 => "i16",
                    Width::I8 => "i8",
                },
                view_size: header.footprint_px,
                headings: survey.headings,
                altitudes: survey.altitudes.to_vec(),
            },
            map: MapSummary {
                width: header.map_px.0,
                height: header.map_px.1,
                crc: format!("{:08x}", training.map_crc),
            },
            table: table.collect(),
        }
    }
}
