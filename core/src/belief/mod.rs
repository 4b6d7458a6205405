//! Where the vehicle may be: a discrete Bayes filter over the map, driven by what it sees and how it moves.
//!
//! **What.** One frame can look like several places, and some look like none. The filter keeps for every cell of a
//! regular grid over the map (and every heading, when the landmarks were stored at several) the probability that the
//! vehicle is there. Path integration moves it ([`predict`](Belief::predict)); the distances of a frame to the landmarks
//! sharpen it ([`observe`](Belief::observe)); [`estimate`](Belief::estimate) says where most of it is, and how much.
//! Cells lie between the places of the topological map, too: there, path integration carries the belief from one place
//! to the next.
//!
//! **Notation.** A *state* is a cell at a heading. δ is a landmark's squared dissimilarity, s and c the atlas's
//! sharpness and ceiling ([`Likelihood`](crate::atlas::Likelihood)).
//!
//! **Method.** Markov localization on a grid (Fox, Burgard and Thrun 1999).
//! - *Predict.* All states of a heading move alike, so the fraction of a cell is kept once per heading as an offset, and
//!   weights move by whole cells only. The uncertainty of displacements adds up until a binomial kernel of that variance
//!   spreads the weights. A little of all weight goes everywhere: the vehicle may have been carried away.
//! - *Observe.* A state's weight is multiplied by exp(−s·η·min(δ, c)) with the least δ of the landmarks in its cell; cells
//!   without landmark have δ = c. Frames that follow each other are wrong alike, so each counts as a share η of an
//!   independent one, which grows with the way between them.
//! - *Estimate.* Mean and covariance within one side of a view around the heaviest state; the weight there is the
//!   confidence.
//!
//! **Cost.** Six bytes per state. An observation streams the landmark table and passes over the states twice. On the
//! target, with 3,621 landmarks of 48 dimensions (8 bits) and 4,941 states: 191,773 instructions to predict, 954,313
//! when weights are spread as widely as they ever are; 462,648 to observe; 60,591 to estimate.
//!
//! **Limits.** Off the map there are no states: a vehicle that leaves it is believed to be somewhere else.

mod cells;
mod estimate;
mod observe;
mod predict;
#[cfg(test)]
mod tests;

use crate::{atlas::Atlas, eigenspace::Coefficients, landmark::Point};

pub use cells::Cells;
pub use estimate::{CONFIDENT, Estimate};
pub use observe::Observation;
pub use predict::Motion;

/// The largest number of headings.
const MAX_HEADINGS: usize = crate::landmark::MAX_HEADINGS as usize;

const ORIGIN: Point = Point {
    x_px: 0.0,
    y_px: 0.0,
};

/// Where the vehicle may be: at most `STATES` cells times headings.
///
/// Nothing but room: what is done with it is compiled once, for slices of any length.
#[derive(Clone, Debug)]
pub struct Belief<const STATES: usize> {
    layers: Layers,
    /// Probabilities; together one. Layer by layer of a heading, row by row.
    weights: [f32; STATES],
    /// The least δ of the landmarks in each state, in the last observation, in parts of the ceiling: 1/65,535.
    least: [u16; STATES],
}

/// All but the weights: the grid, and how its layers of one heading each lie under the vehicle. Weights are given to
/// its methods: as many as there are states.
#[derive(Clone, Debug)]
struct Layers {
    cells: Cells,
    /// From the centers of cells to where the vehicle would be, per heading.
    offsets: [Point; MAX_HEADINGS],
    /// Heading of the first layer: within half a step of the headings; of the vehicle when there is one heading.
    heading_rad: f32,
    /// Variance that displacements added since weights were last spread, along each axis, in squared map pixels.
    spread_px2: f32,
    /// Variance of the heading since weights were last spread over headings, in squared radians.
    spread_rad2: f32,
    /// Way since the last observation, in map pixels; infinite when the frames have nothing in common.
    way_px: f32,
}

impl<const STATES: usize> Belief<STATES> {
    /// Without a map yet, and without states: nothing but zeros, so that a static one needs no copy in flash. See
    /// [`begin`](Self::begin).
    #[must_use]
    pub const fn new() -> Self {
        Self {
            layers: Layers {
                cells: Cells::NONE,
                offsets: [ORIGIN; MAX_HEADINGS],
                heading_rad: 0.0,
                spread_px2: 0.0,
                spread_rad2: 0.0,
                way_px: 0.0,
            },
            weights: [0.0; STATES],
            least: [0; STATES],
        }
    }

    /// Begins with an atlas, of which it knows nothing: every state of its grid is as likely as any other.
    pub fn begin(&mut self, atlas: &Atlas<'_>) {
        self.layers.cells = Cells::of(atlas, STATES);
        self.layers.heading_rad = 0.0;
        self.forget();
    }

    /// The grid.
    #[must_use]
    pub fn cells(&self) -> &Cells {
        &self.layers.cells
    }

    /// The probabilities of all states, layer by layer of a heading, row by row; they add up to one.
    #[must_use]
    pub fn weights(&self) -> &[f32] {
        let states = self.layers.cells.states();
        self.weights.get(..states).unwrap_or_default()
    }

    /// Knows nothing again.
    pub fn forget(&mut self) {
        let (layers, weights, _) = self.parts();
        layers.forget(weights);
    }

    /// The vehicle moved. With one heading, `heading_rad` is the vehicle's as far as it is known, halfway; with several
    /// it is not used, each of them turns by itself. After a motion that is not finite it knows nothing.
    pub fn predict(&mut self, motion: &Motion, heading_rad: f32) {
        let (layers, weights, _) = self.parts();
        layers.predict(weights, motion, heading_rad);
    }

    /// A frame of these coefficients was seen, which [`project`](crate::eigenspace::Eigenspace::project) made of a view
    /// for the atlas this belief was made for.
    pub fn observe(
        &mut self,
        atlas: &Atlas<'_>,
        coefficients: &Coefficients,
        observation: &Observation,
    ) {
        let (layers, weights, least) = self.parts();
        layers.observe(weights, least, atlas, coefficients, observation);
    }

    /// What a compass says of the heading, in radians, which is wrong by at most a tolerance: headings beyond it hardly
    /// count any more. It says nothing where there is one heading.
    pub fn gate(&mut self, heading_rad: f32, tolerance_rad: f32) {
        let (layers, weights, _) = self.parts();
        layers.gate(weights, heading_rad, tolerance_rad);
    }

    /// Where the vehicle most likely is, for views whose footprint has that side.
    #[must_use]
    pub fn estimate(&self, footprint_px: f32) -> Estimate {
        self.layers.estimate(self.weights(), footprint_px)
    }

    /// What is in use: the layers, their weights, and the least δ.
    fn parts(&mut self) -> (&mut Layers, &mut [f32], &mut [u16]) {
        let states = self.layers.cells.states();
        (
            &mut self.layers,
            self.weights.get_mut(..states).unwrap_or_default(),
            self.least.get_mut(..states).unwrap_or_default(),
        )
    }
}

impl<const STATES: usize> Default for Belief<STATES> {
    fn default() -> Self {
        Self::new()
    }
}

impl Layers {
    #[inline(never)]
    fn forget(&mut self, weights: &mut [f32]) {
        weights.fill(self.uniform());
        self.offsets.fill(ORIGIN);
        (self.spread_px2, self.spread_rad2) = (0.0, 0.0);
        self.way_px = f32::INFINITY;
    }

    /// The weight of a state when nothing is known.
    fn uniform(&self) -> f32 {
        1.0 / self.cells.states().max(1) as f32
    }

    /// Makes the weights add up to one again, and spreads `share` of all weight evenly. Knows nothing when there is no
    /// weight left.
    #[inline(never)]
    fn normalize(&mut self, weights: &mut [f32], share: f32) {
        let total: f32 = weights.iter().sum();
        if !(total > 1e-30 && total < f32::MAX) {
            return self.forget(weights);
        }
        let (factor, floor) = ((1.0 - share) / total, share * self.uniform());
        for weight in weights {
            *weight = *weight * factor + floor;
        }
    }

    /// Where the vehicle would be in a state, from the center of its cell.
    fn offset(&self, layer: usize) -> Point {
        self.offsets.get(layer).copied().unwrap_or(ORIGIN)
    }
}
