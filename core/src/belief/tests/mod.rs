//! The filter against its plain reference; what it finds, and what it survives.

mod behavior;
mod properties;
mod reference;

use std::{boxed::Box, vec::Vec};

use super::*;
use crate::{
    atlas::{
        Likelihood,
        sample::{Sample, centered},
    },
    eigenspace::Coefficients,
    landmark::{Lattice, Survey},
};

/// The grid of the tests: as many landmarks, and one cell around each.
const COLUMNS: u16 = 9;
const ROWS: u16 = 7;
const SIDE_PX: f32 = 20.0;

/// Room for eight headings.
const STATES: usize = 8 * COLUMNS as usize * ROWS as usize;

type Filter = Box<Belief<STATES>>;

/// A number as well mixed as a hash, for gray levels and weights that have nothing to do with each other.
fn mixed(number: usize) -> u32 {
    let number = (number as u32).wrapping_add(1).wrapping_mul(0x9e37_79b9);
    (number ^ number >> 15).wrapping_mul(0x85eb_ca6b)
}

/// A dense table over a map that its cells cover wholly.
fn world(headings: u8) -> Box<[u64]> {
    let lattice = Lattice {
        origin: Point {
            x_px: SIDE_PX / 2.0,
            y_px: SIDE_PX / 2.0,
        },
        stride_px: SIDE_PX,
        columns: COLUMNS,
        rows: ROWS,
    };
    let survey = Survey {
        headings,
        ..Survey::nominal([lattice].into_iter().collect())
    };
    let grays: Vec<[u8; 4]> = (0..survey.count() as usize)
        .map(|index| mixed(index).to_le_bytes())
        .collect();
    let sample = Sample {
        survey,
        map_px: (
            u32::from(COLUMNS) * SIDE_PX as u32,
            u32::from(ROWS) * SIDE_PX as u32,
        ),
        footprint_px: 2.0 * SIDE_PX,
        likelihood: Likelihood {
            sharpness: 1e-3,
            ceiling: 8000.0,
        },
        grays: &grays,
        places: &[],
        legs: &[],
    };
    sample.emit()
}

fn atlas(words: &[u64]) -> Atlas<'_> {
    Atlas::parse(bytemuck::cast_slice(words)).expect("valid")
}

/// What a view at a landmark (0-based) comes to.
fn seen_at(landmark: usize) -> Coefficients {
    let values = mixed(landmark).to_le_bytes().map(centered);
    Coefficients::from_values(&values).expect("four")
}

/// A belief of arbitrary weights.
fn arbitrary(atlas: &Atlas<'_>, seed: usize) -> Filter {
    let mut belief = Filter::default();
    belief.begin(atlas);
    for (index, weight) in belief.parts().1.iter_mut().enumerate() {
        *weight = (mixed(seed + index) >> 16) as f32;
    }
    let (layers, weights, _) = belief.parts();
    layers.normalize(weights, 0.0);
    belief
}

fn at_rest() -> Motion {
    Motion {
        forward_px: 0.0,
        right_px: 0.0,
        yaw_rad: 0.0,
        variance_px2: 0.0,
        variance_rad2: 0.0,
        carried_away: 0.0,
    }
}

const INDEPENDENT: Observation = Observation {
    independent_px: 10.0,
    least_worth: 0.2,
};
