//! How far each landmark can be trusted: orientation, altitude, brightness and position (report section 3.5), and tilt,
//! noise, motion and occlusion; by both criteria.
//!
//! **Method.** A camera as fine as the map looks down on a landmark's place and deviates in one respect, step by step
//! outward, until a [`Judge`](super::Judge) no longer localizes its view at the landmark. The camera renders what it sees
//! from the whole map, so that nothing is missing in the corners of a turned view: the same as cutting large, deforming,
//! then cutting the view. Every pixel of a view is a mean over its area. What would show anything beyond the map is not
//! tried: that limit ends at the map, and is left out of means.
//!
//! **Limits.** A camera has 512×512 pixels at most: from larger windows it sees views sampled twice, which may differ from
//! the landmarks' own by a few gray levels. Catchments do not go through a camera, and are cut off at the map's edge.

mod catchment;
mod limits;
mod measure;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub(crate) use catchment::spiral;
pub use catchment::{Catchment, catchment};
pub(crate) use limits::Observer;
pub use limits::{End, Limit, Limits};
pub use measure::{Measure, Steps};

/// What one landmark tolerates by one criterion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reliability {
    /// Lower and upper limit of each measure.
    pub limits: BTreeMap<Measure, [f64; 2]>,
    /// Why they are the limits.
    pub ends: BTreeMap<Measure, [End; 2]>,
    /// Positions at which it is found: an area in map pixels. 0 when not even its own view is localized.
    pub catchment_px: u64,
    /// The same as a share of the map.
    pub catchment_share: f64,
    /// Whether the catchment ends at the map or where localization fails.
    pub catchment_end: End,
}

/// What landmarks tolerate on average, by one criterion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeanReliability {
    /// Means of the lower and upper limits that do not end at the map; where all do, of all of them: at least.
    #[serde(flatten)]
    pub limits: BTreeMap<Measure, [f64; 2]>,
    /// How many limits do not end at the map.
    pub counted: BTreeMap<Measure, [usize; 2]>,
    /// Mean area of the catchments in map pixels, as far as the map goes.
    pub catchment_px: f64,
    /// The same as a share of the map.
    pub catchment_share: f64,
    /// How many catchments do not end at the map.
    pub catchments_counted: usize,
}

impl Reliability {
    /// Collects limits and a catchment, on a map of so many pixels.
    #[must_use]
    pub fn new(
        limits: impl IntoIterator<Item = (Measure, Limits)>,
        catchment: Catchment,
        map_px: u64,
    ) -> Self {
        let limits: Vec<(Measure, Limits)> = limits.into_iter().collect();
        let values = limits
            .iter()
            .map(|(m, limits)| (*m, limits.map(|limit| limit.value)));
        let ends = limits
            .iter()
            .map(|(m, limits)| (*m, limits.map(|limit| limit.end)));
        Self {
            limits: values.collect(),
            ends: ends.collect(),
            catchment_px: catchment.area_px,
            catchment_share: catchment.area_px as f64 / map_px as f64,
            catchment_end: catchment.end,
        }
    }
}

impl MeanReliability {
    /// The means over some landmarks, all evaluated by the same measures. No landmarks have means of zero.
    ///
    /// # Panics
    /// When they were not evaluated by the same measures.
    #[must_use]
    pub fn of(landmarks: &[&Reliability]) -> Self {
        let measures = landmarks
            .first()
            .into_iter()
            .flat_map(|first| first.limits.keys());
        let (mut limits, mut counted) = (BTreeMap::new(), BTreeMap::new());
        for &measure in measures {
            let sides = [0, 1].map(|side| {
                let all = landmarks.iter().map(|one| one.limits[&measure][side]);
                let ends = landmarks.iter().map(|one| one.ends[&measure][side]);
                let inside = all.clone().zip(ends).filter(|(_, end)| *end != End::Map);
                let inside: Vec<f64> = inside.map(|(limit, _)| limit).collect();
                (mean(inside.iter().copied()).or(mean(all)), inside.len())
            });
            limits.insert(measure, sides.map(|(mean, _)| mean.unwrap_or(0.0)));
            counted.insert(measure, sides.map(|(_, count)| count));
        }
        let average = |value: fn(&Reliability) -> f64| {
            mean(landmarks.iter().map(|one| value(one))).unwrap_or(0.0)
        };
        let whole = landmarks.iter().filter(|one| one.catchment_end != End::Map);
        Self {
            limits,
            counted,
            catchment_px: average(|one| one.catchment_px as f64),
            catchment_share: average(|one| one.catchment_share),
            catchments_counted: whole.count(),
        }
    }
}

/// The mean of some numbers, if there are any.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    (count > 0.0).then(|| sum / count)
}
