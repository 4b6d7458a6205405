//! The belief learns from a frame.

use super::Layers;
use crate::{
    atlas::Atlas,
    eigenspace::Coefficients,
    landmark::Candidate,
    math::{exp_of_negative, turn},
};

/// The ceiling of δ, in its parts.
const CEILING: u16 = u16::MAX;

/// What a frame is worth as evidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Way after which two frames are independent of each other, in map pixels.
    pub independent_px: f32,
    /// Least worth of a frame, however near it is to the one before: 0 to 1.
    pub least_worth: f32,
}

impl Layers {
    /// See [`Belief::observe`](super::Belief::observe).
    #[inline(never)]
    pub(super) fn observe(
        &mut self,
        weights: &mut [f32],
        least: &mut [u16],
        atlas: &Atlas<'_>,
        coefficients: &Coefficients,
        observation: &Observation,
    ) {
        let likelihood = atlas.header().likelihood;
        let (cells, layer) = (self.cells, self.cells.layer());
        least.fill(CEILING);
        let mut nearest = CEILING;
        let parts = f32::from(CEILING) / likelihood.ceiling;
        let landmarks = atlas.landmarks();
        let (survey, records) = (&atlas.header().survey, landmarks.records());
        let offsets = &self.offsets;
        // Where the landmark before was: the next is mostly in the same row.
        let mut last: Option<Candidate> = None;
        landmarks.dissimilarities(coefficients, |landmark, squared| {
            if squared >= likelihood.ceiling {
                return;
            }
            let record = records.get(landmark as usize);
            let Some(view) = record.map(|record| record.view) else {
                return;
            };
            let along = last.as_ref().and_then(|last| last.along(view));
            let Some(candidate) = along.or_else(|| survey.find(view)) else {
                return;
            };
            last = Some(candidate);
            let heading = candidate.layer.index as usize % usize::from(cells.headings().max(1));
            let Some(offset) = offsets.get(heading) else {
                return;
            };
            // It speaks for the state in which the vehicle, off its cell's center, would be there.
            let mut at = candidate.place();
            at.x_px -= offset.x_px;
            at.y_px -= offset.y_px;
            let state = cells.find(at).map(|cell| heading * layer + cell);
            if let Some(least) = state.and_then(|state| least.get_mut(state)) {
                let squared = (squared * parts) as u16;
                *least = squared.min(*least);
                nearest = nearest.min(squared);
            }
        });
        let share = self.way_px / observation.independent_px;
        // Whatever the numbers are, this does not panic, and no worth is more than one.
        let worth = share.max(observation.least_worth).min(1.0);
        self.way_px = 0.0;
        let sharpness = likelihood.sharpness * worth / parts;
        let states = weights.iter_mut().zip(least);
        let likely = |squared: u16| {
            let farther = squared.saturating_sub(nearest);
            exp_of_negative(-sharpness * f32::from(farther))
        };
        let unlike = likely(CEILING);
        for (weight, &mut squared) in states {
            *weight *= if squared == CEILING {
                unlike
            } else {
                likely(squared)
            };
        }
        self.normalize(weights, 0.0);
    }
}

/// How likely a heading is that the compass rules out.
const RULED_OUT: f32 = 1e-4;

impl Layers {
    /// See [`Belief::gate`](super::Belief::gate).
    pub(super) fn gate(&mut self, weights: &mut [f32], heading_rad: f32, tolerance_rad: f32) {
        let headings = self.cells.headings();
        if headings <= 1
            || !heading_rad.is_finite()
            || tolerance_rad.is_nan()
            || tolerance_rad < 0.0
        {
            return;
        }
        let step = core::f32::consts::TAU / f32::from(headings);
        let reach = tolerance_rad + step / 2.0;
        let (layer, first) = (self.cells.layer().max(1), self.heading_rad);
        for (weights, index) in weights.chunks_exact_mut(layer).zip(0_u8..) {
            let off = turn(first + step * f32::from(index), heading_rad);
            let is_kept = off.abs() <= reach;
            if !is_kept {
                weights.iter_mut().for_each(|weight| *weight *= RULED_OUT);
            }
        }
        self.normalize(weights, 0.0);
    }
}
