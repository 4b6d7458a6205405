//! The belief learns from a frame.

use super::Belief;
use crate::{
    atlas::Atlas, eigenspace::Coefficients, landmark::lattice::place, math::exp_of_negative,
};

/// What a frame is worth as evidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Way after which two frames are independent of each other, in map pixels.
    pub independent_px: f32,
    /// Least worth of a frame, however near it is to the one before: 0 to 1.
    pub least_worth: f32,
}

impl<const STATES: usize> Belief<STATES> {
    /// A frame of these coefficients was seen, which [`project`](crate::eigenspace::Eigenspace::project) made of a view
    /// for the atlas this belief was made for.
    pub fn observe(
        &mut self,
        atlas: &Atlas<'_>,
        coefficients: &Coefficients,
        observation: &Observation,
    ) {
        let likelihood = atlas.header().likelihood;
        let (cells, layer) = (self.cells, self.cells.layer());
        let states = cells.states();
        let least = self.least.get_mut(..states).unwrap_or_default();
        least.fill(likelihood.ceiling);
        let mut nearest = likelihood.ceiling;
        let landmarks = atlas.landmarks();
        let (lattices, records) = (atlas.lattices(), landmarks.records());
        // Half a cell of the vehicle's offset may lie between a landmark and the state it speaks for.
        let offset = self.offsets[0];
        landmarks.dissimilarities(coefficients, |landmark, squared| {
            if squared >= likelihood.ceiling {
                return;
            }
            let record = records.get(landmark as usize);
            let Some(mut at) = record.and_then(|record| place(lattices, record.view)) else {
                return;
            };
            at.x_px -= offset.x_px;
            at.y_px -= offset.y_px;
            let state = cells.find(at).filter(|&cell| cell < layer);
            if let Some(least) = state.and_then(|state| least.get_mut(state)) {
                *least = least.min(squared);
                nearest = nearest.min(squared);
            }
        });
        let worth = (self.way_px / observation.independent_px).clamp(observation.least_worth, 1.0);
        self.way_px = 0.0;
        let sharpness = likelihood.sharpness * worth;
        let states = self.weights.iter_mut().zip(&self.least).take(states);
        for (weight, &squared) in states {
            *weight *= exp_of_negative(sharpness * (nearest - squared));
        }
        self.normalize(0.0);
    }
}
