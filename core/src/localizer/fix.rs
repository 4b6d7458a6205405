//! The answer.

use core::ops::Range;

use serde::{Deserialize, Serialize};

use crate::{
    atlas::Atlas,
    eigenspace::Coefficients,
    landmark::{MAX_STRIDE, Metric, Point},
    math::{sqrt, whole_turn},
    preprocess::{Pose, View},
};

/// Where a frame was taken, with three independent judgements of that answer. All numbers are finite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fix {
    /// The nearest landmark: its rank in the table, 0-based.
    pub landmark: u32,
    /// The candidate that landmark was selected from, 1-based.
    pub view: u32,
    /// Where that landmark was seen.
    pub place: Point,
    /// Where the vehicle is: between that landmark and its neighbours where the table is a dense grid, else the same.
    pub position: Point,
    /// The heading in radians, clockwise from map-up to frame-up, 0 to below 2π: that landmark's, or between its
    /// neighbours' where the table holds all headings. Relative to the pose that the frame was levelled by, see
    /// [`heading_from`](Self::heading_from).
    pub heading_rad: f32,
    /// Actual over nominal altitude: that landmark's. Relative to the pose, see [`altitude_from`](Self::altitude_from).
    pub altitude_ratio: f32,
    /// Distance to the landmark, in the metric's unit.
    pub distance: f32,
    /// Distance to the second nearest landmark, not less than `distance`; `f32::MAX` when only one was looked at.
    pub second: f32,
    /// `second` over `distance`, at least 1; `f32::MAX` when the distance is zero.
    pub margin: f32,
    /// Distance from feature space ‖n(y) − ȳ‖² − ‖g‖²: how much of the view the eigenspace cannot express.
    pub from_feature_space: f32,
    /// The distance is below the landmark's radius: whatever rounding did, no other landmark is nearer (report (2.39),
    /// reconstructed), and in training no view of another landmark came so near.
    pub guaranteed: bool,
    /// Both the distance and the distance from feature space are below the atlas's limits: this looks like a view of
    /// the map near a landmark, not of somewhere else.
    pub known: bool,
}

impl Fix {
    /// Finds a view among some ranges of an atlas's landmarks, with room for its k coefficients. `None` when the view has
    /// nothing to go by, its side is not the atlas's, or the ranges are empty.
    pub(super) fn new(
        atlas: &Atlas<'_>,
        view: &View,
        coefficients: &mut Coefficients,
        among: impl IntoIterator<Item = Range<u32>>,
    ) -> Option<Self> {
        let projection = atlas.eigenspace().project(view, coefficients)?;
        let landmarks = atlas.landmarks();
        let nearest = landmarks.nearest(coefficients, among)?;
        let record = landmarks.records().get(nearest.first.landmark as usize)?;
        let survey = atlas.survey();
        let candidate = survey.find(record.view)?;
        let (place, layer) = (candidate.place(), candidate.layer);
        let pixel_px = atlas.header().footprint_px / f32::from(atlas.eigenspace().side());
        let widest_px = MAX_STRIDE * pixel_px;
        let refined = landmarks.refine(survey, widest_px, coefficients, &candidate);

        let distance = nearest.first.distance;
        // Of all but equal distances, the larger may be rounded to the smaller number.
        let second = nearest.second.map_or(f32::MAX, |second| second.distance);
        let second = second.max(distance);
        let margin = if distance > 0.0 {
            (second / distance).clamp(1.0, f32::MAX)
        } else {
            f32::MAX
        };
        // What rounding may have turned the view by: the radii of other metrics already allow for it.
        let turn = match landmarks.metric() {
            Metric::Nssd | Metric::Euclid => 0.0,
            Metric::Cosine => {
                let norm = sqrt(coefficients.squared_norm().max(1) as f32);
                core::f32::consts::FRAC_PI_2 * atlas.header().error / norm
            }
        };
        let limits = atlas.limits();
        let is_near = distance <= limits.distance;
        let is_expressed = projection.from_feature_space <= limits.from_feature_space;
        Some(Self {
            landmark: nearest.first.landmark,
            view: record.view,
            place,
            position: refined.position.unwrap_or(place),
            heading_rad: refined.heading_rad.unwrap_or(layer.heading_rad),
            altitude_ratio: layer.altitude_ratio,
            distance,
            second,
            margin,
            from_feature_space: projection.from_feature_space,
            guaranteed: !projection.clamped && distance + turn < record.radius,
            known: !projection.clamped && is_near && is_expressed,
        })
    }

    /// The vehicle's heading, when its frame was levelled by `pose`: in radians, clockwise from map-up to frame-up, 0 to
    /// below 2π.
    #[must_use]
    pub fn heading_from(&self, pose: &Pose) -> f32 {
        whole_turn(pose.heading_rad() + self.heading_rad)
    }

    /// The vehicle's actual over nominal altitude, when its frame was levelled by `pose`.
    #[must_use]
    pub fn altitude_from(&self, pose: &Pose) -> f32 {
        pose.altitude_ratio() * self.altitude_ratio
    }
}
