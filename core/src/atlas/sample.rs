//! Small atlases for tests: views of 2×2 pixels whose coefficients are their gray levels less 128.

use std::{boxed::Box, vec, vec::Vec};

use super::{Blur, Contents, Header, Likelihood, Limits, Training, emit, emitted_len};
use crate::{
    eigenspace::{MeanRow, Normalize, Row, weight_count, weight_index},
    landmark::{Lattice, Metric, Point, Record, Survey, Width},
    route::Place,
};

/// An atlas of a whole survey: every candidate is a landmark.
pub struct Sample<'s> {
    /// Where candidates lie.
    pub survey: Survey,
    /// Width and height of the map, in pixels.
    pub map_px: (u32, u32),
    /// Side of a view's footprint, in map pixels.
    pub footprint_px: f32,
    /// What a distance says.
    pub likelihood: Likelihood,
    /// Gray levels of the candidates' four pixels, in their order.
    pub grays: &'s [[u8; 4]],
    /// Where places are.
    pub places: &'s [[f32; 2]],
    /// The places that the legs of each place lead to.
    pub legs: &'s [&'s [u16]],
}

impl Sample<'_> {
    /// The atlas, at an aligned address.
    ///
    /// # Panics
    /// When the parts do not make an atlas.
    #[must_use]
    pub fn emit(&self) -> Box<[u64]> {
        let mut first_leg = 0;
        let places: Vec<Place> = (self.places.iter().zip(self.legs))
            .map(|(&[x_px, y_px], legs)| {
                let place = Place {
                    x_px,
                    y_px,
                    first_leg,
                };
                first_leg += legs.len() as u32;
                place
            })
            .collect();
        let legs = self.legs.concat();
        let header = Header {
            view_side: 2,
            dimensions: 4,
            landmarks: self.grays.len() as u32,
            width: Width::I16,
            thumbnail_side: 0,
            normalize: Normalize::None,
            metric: Metric::Euclid,
            step: 1.0,
            error: 0.0,
            limits: Limits {
                distance: 10.0,
                from_feature_space: 1e6,
            },
            mean: MeanRow {
                base: 128.0,
                scale: 1.0,
                energy: 65536.0,
            },
            footprint_px: self.footprint_px,
            map_px: self.map_px,
            survey: self.survey.clone(),
            likelihood: self.likelihood,
            places: places.len() as u32,
            legs: legs.len() as u32,
            training: Training {
                scale: 10.0,
                blur: Blur::None,
                highpass: 0.0,
                whiten: 0.0,
                covered_variance: 1.0,
                map_crc: 0,
            },
        };
        let mut weights = vec![0; weight_count(2, 4)];
        for pixel in 0..4 {
            weights[weight_index(2, pixel, pixel)] = 1;
        }
        let coefficients: Vec<i16> = self.grays.iter().flatten().copied().map(centered).collect();
        let records: Vec<Record> = (1..=header.landmarks)
            .map(|view| Record { view, radius: 1.0 })
            .collect();
        let contents = Contents {
            header: &header,
            weights: &weights,
            rows: &[Row {
                scale: 1.0,
                offset: 128.0,
                spread: 1.0,
            }; 4],
            mean_weights: &[0; 4],
            coefficients: &coefficients,
            records: &records,
            thumbnails: &[],
            places: &places,
            legs: &legs,
        };
        let len = emitted_len(&header).expect("header fits") as usize;
        let mut words = vec![0; len.div_ceil(8)];
        emit(&contents, bytemuck::cast_slice_mut(&mut words)).expect("valid");
        words.into()
    }
}

/// An atlas of four landmarks in a row, a hundred map pixels apart, with a place at each and legs both ways between
/// neighbors.
///
/// # Panics
/// Never.
#[must_use]
pub fn row() -> Box<[u64]> {
    let lattice = Lattice {
        origin: Point {
            x_px: 50.0,
            y_px: 50.0,
        },
        stride_px: 100.0,
        columns: 4,
        rows: 1,
    };
    let sample = Sample {
        survey: Survey::nominal([lattice].into_iter().collect()),
        map_px: (400, 100),
        footprint_px: 100.0,
        likelihood: Likelihood {
            sharpness: 0.02,
            ceiling: 600.0,
        },
        grays: &[
            [10, 20, 30, 40],
            [200, 30, 90, 150],
            [60, 220, 10, 120],
            [250, 240, 130, 20],
        ],
        places: &[[50.0, 50.0], [150.0, 50.0], [250.0, 50.0], [350.0, 50.0]],
        legs: &[&[1], &[0, 2], &[1, 3], &[2]],
    };
    sample.emit()
}

/// The coefficient of a gray level.
#[must_use]
pub fn centered(gray: u8) -> i16 {
    i16::from(gray) - 128
}

/// A frame of 32×32 pixels whose view has these gray levels.
#[must_use]
pub fn frame_of([a, b, c, d]: [u8; 4]) -> Vec<u8> {
    let row = |left, right| [[left; 16], [right; 16]].concat();
    [row(a, b).repeat(16), row(c, d).repeat(16)].concat()
}
