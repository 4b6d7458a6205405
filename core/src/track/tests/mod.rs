//! A camera over the made-up ground, in double precision, and what an odometry makes of it.

mod flights;
mod frames;

use core::f64::consts::TAU;
use std::vec::Vec;

use super::{digest::ground, *};
use crate::{
    frame::Frame,
    preprocess::{Pose, Tilt},
};

/// Field of view over the side of the frames, in radians: 60°.
const FIELD_OF_VIEW_RAD: f64 = TAU / 6.0;

/// A camera's frame over the made-up ground.
#[derive(Clone, Copy)]
struct Sight {
    side_px: u16,
    /// Sides.
    place: [f64; 2],
    heading_rad: f64,
    altitude_ratio: f64,
    roll_rad: f64,
    pitch_rad: f64,
    /// Level ↦ offset + gain·255·(level/255)^gamma.
    gamma: f64,
    gain: f64,
    offset: f64,
    /// Standard deviation, in gray levels.
    noise: f64,
    seed: u32,
}

impl Sight {
    fn new(side_px: u16) -> Self {
        Self {
            side_px,
            place: [0.0; 2],
            heading_rad: 0.0,
            altitude_ratio: 1.0,
            roll_rad: 0.0,
            pitch_rad: 0.0,
            gamma: 1.0,
            gain: 1.0,
            offset: 0.0,
            noise: 0.0,
            seed: 1,
        }
    }

    /// Rays in double precision, not by the formulas under test.
    fn pixels(&self) -> Vec<u8> {
        let q = f64::from(self.side_px);
        let reach = 2.0 * (FIELD_OF_VIEW_RAD / 2.0).tan();
        let (sin, cos) = self.heading_rad.sin_cos();
        let mut random = Random(self.seed);
        let mut pixels = Vec::with_capacity(usize::from(self.side_px).pow(2));
        for row in 0..self.side_px {
            for column in 0..self.side_px {
                // Forward, right, down in the axes of the body.
                let ray = [
                    -(f64::from(row) + 0.5 - q / 2.0) / q * reach,
                    (f64::from(column) + 0.5 - q / 2.0) / q * reach,
                    1.0,
                ];
                let (s, c) = self.roll_rad.sin_cos();
                let ray = [ray[0], c * ray[1] - s * ray[2], s * ray[1] + c * ray[2]];
                let (s, c) = self.pitch_rad.sin_cos();
                let ray = [c * ray[0] + s * ray[2], ray[1], c * ray[2] - s * ray[0]];
                let (u, w) = (ray[1] / ray[2] / reach, -ray[0] / ray[2] / reach);
                let (u, w) = (u * self.altitude_ratio, w * self.altitude_ratio);
                let at = [
                    self.place[0] + u * cos - w * sin,
                    self.place[1] + u * sin + w * cos,
                ];
                let level = f64::from(ground(at.map(|at| (at * q * 256.0).floor() as i32)));
                let level = 255.0 * (level / 255.0).powf(self.gamma) * self.gain + self.offset;
                let level = level + self.noise * random.gaussian();
                pixels.push((level + 0.5).clamp(0.0, 255.0) as u8);
            }
        }
        pixels
    }

    fn tilt(&self) -> Option<Tilt> {
        let [roll, pitch, view] =
            [self.roll_rad, self.pitch_rad, FIELD_OF_VIEW_RAD].map(|angle| angle as f32);
        let pose = Pose::NOMINAL.tilted(roll, pitch, view);
        pose.expect("in range").tilt()
    }

    /// What an odometry makes of it when it knows the tilt.
    fn show(&self, odometry: &mut Odometry) -> Option<Displacement> {
        show(odometry, self.side_px, &self.pixels(), self.tilt())
    }
}

fn show(
    odometry: &mut Odometry,
    side_px: u16,
    pixels: &[u8],
    tilt: Option<Tilt>,
) -> Option<Displacement> {
    let frame = Frame::new(pixels, side_px, side_px, side_px.into()).expect("valid");
    odometry.advance(&frame, tilt)
}

struct Random(u32);

impl Random {
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1 << 24)
    }

    /// Nearly normal: a sum of twelve.
    fn gaussian(&mut self) -> f64 {
        (0..12).map(|_| self.share()).sum::<f64>() - 6.0
    }
}

/// [x, y, heading, logarithm of the altitude ratio] minus what is true.
fn errors(odometry: &Odometry, sight: &Sight) -> [f64; 4] {
    let placement = odometry.placement();
    let turn = f64::from(placement.heading_rad) - sight.heading_rad;
    [
        f64::from(placement.x) - sight.place[0],
        f64::from(placement.y) - sight.place[1],
        turn - TAU * (turn / TAU).round(),
        (f64::from(placement.altitude_ratio) / sight.altitude_ratio).ln(),
    ]
}

fn distance(errors: [f64; 4]) -> f64 {
    errors[0].hypot(errors[1])
}
