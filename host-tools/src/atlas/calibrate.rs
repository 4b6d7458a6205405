//! What only trying can tell: what counts as known, and which radii are too wide in practice.
//!
//! Views are rendered from the map around every landmark (at most [`MAX_CALIBRATED`] of them, evenly spread over the
//! table) and located by the core itself.
//!
//! - **Known.** Slightly deviated views ([`Deviation::SLIGHT`]) set the limits of both distances. Each limit is the
//!   quantile that loses at most half of what may be lost in total, so that together they keep [`KEPT_SHARE`].
//! - **Likelihood.** What a belief observes with; see `likelihood.rs`.
//! - **Guaranteed.** A view may deviate so much that it comes to lie within the radius of a landmark it does not show:
//!   then that landmark *is* the nearest, as (2.39) says, and still wrong. Moderately deviated views
//!   ([`Deviation::MODERATE`]) find such cases, and the radius is narrowed to [`NARROWING`] of the distance of the
//!   nearest of them. Landmarks that overlap the truth by half a footprint, and are turned as it is or as its neighbours
//!   are, do not count as wrong.
//!
//! Both deviate at least as far as half way to the next heading and altitude of the atlas.

use std::f32::consts::FRAC_PI_4;

use eigenmark_core::{
    atlas::{Atlas, AtlasError, Limits},
    localizer::Fix,
    math::turn,
};

use super::{AtlasBuffer, likelihood::likelihood};
use crate::{
    evaluate::{Deviation, fixes_around},
    map::Map,
    output::Progress,
};

/// Share of slightly deviated training views that stay known; half a percent of it is for draws yet to come.
pub const KEPT_SHARE: f64 = 0.995;

/// Share of the distance of a wrong fix that the radius of its landmark is narrowed to.
const NARROWING: f32 = 0.7;

/// Views rendered per purpose, at least; each landmark has at least [`MIN_PER_LANDMARK`].
const TOTAL_VIEWS: usize = 8000;

/// Views rendered per landmark, at least.
const MIN_PER_LANDMARK: usize = 4;

/// Landmarks that take part; more would only take longer.
const MAX_CALIBRATED: usize = 2000;

/// Seed of the deviations; any fixed number will do.
const SEED: u64 = 0x00ca_11b2;

/// Why an atlas could not be calibrated.
#[derive(Clone, Debug, thiserror::Error)]
pub enum CalibrationError {
    /// No landmark has room for a deviated view.
    #[error(
        "the map is too small to deviate from any landmark's view; choose a smaller --view-size"
    )]
    NoRoom,
    /// The calibrated atlas was refused.
    #[error(transparent)]
    Atlas(#[from] AtlasError),
}

/// Sets the limits of `open`, an atlas whose limits admit every view, and narrows its radii.
///
/// # Errors
/// When no landmark has room on the map for a deviated view.
pub fn calibrate(
    map: &Map,
    open: &AtlasBuffer,
    progress: &Progress,
) -> Result<AtlasBuffer, CalibrationError> {
    let atlas = open.atlas();
    let slight: Vec<Fix> = located(map, &atlas, Deviation::SLIGHT, progress)
        .into_iter()
        .map(|(_, fix)| fix)
        .collect();
    if slight.is_empty() {
        return Err(CalibrationError::NoRoom);
    }
    let likelihood = likelihood(map, &atlas).ok_or(CalibrationError::NoRoom)?;
    let kept = 1.0 - (1.0 - KEPT_SHARE) / 2.0;
    let mut header = atlas.header().clone();
    header.limits = Limits {
        distance: quantile(slight.iter().map(|fix| fix.distance).collect(), kept),
        from_feature_space: quantile(
            slight.iter().map(|fix| fix.from_feature_space).collect(),
            kept,
        ),
    };

    header.likelihood = likelihood;

    let mut records = atlas.landmarks().records().to_vec();
    let mut nearest_wrong = vec![f32::MAX; records.len()];
    for (truth, fix) in located(map, &atlas, Deviation::MODERATE, progress) {
        if is_elsewhere(&atlas, truth, &fix) {
            let nearest = &mut nearest_wrong[fix.landmark as usize];
            *nearest = nearest.min(fix.distance);
        }
    }
    for (record, nearest) in records.iter_mut().zip(nearest_wrong) {
        if nearest < record.radius {
            record.radius = nearest * NARROWING;
        }
    }

    Ok(AtlasBuffer::with(&atlas, &header, &records)?)
}

/// Fixes of deviated views, each with the landmark (0-based) it deviates from.
fn located(
    map: &Map,
    atlas: &Atlas<'_>,
    deviation: Deviation,
    progress: &Progress,
) -> Vec<(usize, Fix)> {
    let deviation = deviation.covering(atlas.survey());
    let count = atlas.landmarks().len();
    let taking_part = count.min(MAX_CALIBRATED);
    let per_landmark = TOTAL_VIEWS.div_ceil(taking_part).max(MIN_PER_LANDMARK);
    let landmarks: Vec<usize> = (0..taking_part)
        .map(|part| part * count / taking_part)
        .collect();
    let fixes = fixes_around(
        map,
        atlas,
        &landmarks,
        &deviation,
        per_landmark,
        SEED,
        progress,
    );
    let labelled = |(landmark, fixes): (usize, Vec<Option<Fix>>)| {
        fixes.into_iter().flatten().map(move |fix| (landmark, fix))
    };
    landmarks
        .into_iter()
        .zip(fixes)
        .flat_map(labelled)
        .collect()
}

/// Whether the fix is on a landmark at least half a footprint away from landmark `truth` (0-based), or turned by more than
/// an eighth of a turn and more than its neighbours are.
fn is_elsewhere(atlas: &Atlas<'_>, truth: usize, fix: &Fix) -> bool {
    let (survey, records) = (atlas.survey(), atlas.landmarks().records());
    let [truth, found] =
        [truth, fix.landmark as usize].map(|landmark| survey.find(records[landmark].view));
    let (Some(truth), Some(found)) = (truth, found) else {
        return true;
    };
    let (from, to) = (truth.place(), found.place());
    let away_px = (from.x_px - to.x_px).hypot(from.y_px - to.y_px);
    let turned_rad = turn(truth.layer.heading_rad, found.layer.heading_rad).abs();
    let neighbors_rad = survey.heading_step_rad().max(FRAC_PI_4);
    away_px >= atlas.header().footprint_px / 2.0 || turned_rad > 1.01 * neighbors_rad
}

/// The smallest number that at least `share` of the numbers do not exceed.
fn quantile(mut numbers: Vec<f32>, share: f64) -> f32 {
    numbers.sort_by(f32::total_cmp);
    let count = (share * numbers.len() as f64).ceil() as usize;
    numbers[count.clamp(1, numbers.len()) - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_keep_at_least_their_share() {
        let numbers: Vec<f32> = (1..=1000).rev().map(|i| i as f32).collect();
        assert_eq!(quantile(numbers.clone(), 0.995), 995.0);
        assert_eq!(quantile(numbers, 1.0), 1000.0);
        assert_eq!(quantile(vec![7.0], 0.5), 7.0);
    }
}
