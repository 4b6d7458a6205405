//! Levelling as the definition says it: every sample's ray on its own, in double precision.

use std::vec::Vec;

use super::super::Pose;
use crate::frame::Frame;

/// The levels of a view of `side`×`side` pixels, row-major: means of n×n bilinear samples each, and the frame position
/// of each pixel's middle. Beyond the border its pixels are repeated. Without a ray to the ground: NaN.
pub fn level(frame: &Frame<'_>, pose: &Pose, side: u8, n: u32) -> Vec<(f64, [f64; 2])> {
    let v = f64::from(side);
    let mut levels = Vec::new();
    for row in 0..side {
        for column in 0..side {
            let at = |i: f64, j: f64| {
                let dx = 2.0 * (f64::from(column) + i) / v - 1.0;
                let dy = 2.0 * (f64::from(row) + j) / v - 1.0;
                position(frame, pose, dx, dy)
            };
            let share = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
            let mut sum = 0.0;
            for j in 0..n {
                for i in 0..n {
                    sum += bilinear(frame, at(share(i), share(j)));
                }
            }
            levels.push((sum / f64::from(n * n), at(0.5, 0.5)));
        }
    }
    levels
}

/// Where the point (dx, dy) of the nominal view lies in the frame.
fn position(frame: &Frame<'_>, pose: &Pose, dx: f64, dy: f64) -> [f64; 2] {
    let (sin, cos) = f64::from(pose.heading_rad()).sin_cos();
    let (u, w) = (dx * cos + dy * sin, dy * cos - dx * sin);
    let half = f64::from(frame.square_side()) / 2.0;
    let ratio = f64::from(pose.altitude_ratio());
    let [left, top] = frame.square_corner().map(f64::from);
    let (right, ahead) = match pose.tilt() {
        None => (u / ratio, -w / ratio),
        Some(tilt) => {
            let t = (f64::from(tilt.field_of_view_rad()) / 2.0).tan();
            let (forward, right, down) = (-w * t / ratio, u * t / ratio, 1.0);
            let (sin, cos) = f64::from(tilt.pitch_rad()).sin_cos();
            let (forward, down) = (forward * cos - down * sin, forward * sin + down * cos);
            let (sin, cos) = f64::from(tilt.roll_rad()).sin_cos();
            let (right, down) = (right * cos + down * sin, down * cos - right * sin);
            if down <= 0.0 {
                return [f64::NAN; 2];
            }
            (right / down / t, forward / down / t)
        }
    };
    [left + half + half * right, top + half - half * ahead]
}

/// The level between the middles of the frame's pixels.
fn bilinear(frame: &Frame<'_>, [x, y]: [f64; 2]) -> f64 {
    let (x, y) = (x - 0.5, y - 0.5);
    let at = |column: f64, row: f64| {
        let column = column.clamp(0.0, f64::from(frame.width() - 1)) as usize;
        let row = row.clamp(0.0, f64::from(frame.height() - 1)) as usize;
        f64::from(frame.pixels()[row * frame.stride() + column])
    };
    let (column, row) = (x.floor(), y.floor());
    let (u, v) = (x - column, y - row);
    let above = at(column, row) * (1.0 - u) + at(column + 1.0, row) * u;
    let below = at(column, row + 1.0) * (1.0 - u) + at(column + 1.0, row + 1.0) * u;
    above * (1.0 - v) + below * v
}
