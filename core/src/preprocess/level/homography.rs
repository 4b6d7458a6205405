//! From the nominal view to the frame: where a view pixel lies.

use super::super::Pose;
use crate::{
    frame::Frame,
    math::{sin_cos, tan},
};

/// Fraction bits of frame positions, which are counted from the middle of the top-left pixel.
pub const FRACTION: u32 = 10;

/// One pixel, as a frame position.
pub const ONE: f32 = (1 << FRACTION) as f32;

/// The smallest Z of a ray that is followed, in units of its way down: nearly at the horizon.
const HORIZON: f32 = 1e-3;

/// Where points of the view lie in the frame: three rows linear in (column, row, 1), in view pixels. The frame
/// position is (x/z, y/z) from `middle`, in units of 1/[`ONE`] pixel.
pub struct Homography {
    x: [f32; 3],
    y: [f32; 3],
    z: [f32; 3],
    middle: [f32; 2],
}

/// Where a view pixel lies in the frame: its middle, and how far that moves to the next view pixel to the right and
/// downwards; [x, y] in units of 1/[`ONE`] pixel.
#[derive(Clone, Copy)]
pub struct Patch {
    pub middle: [f32; 2],
    pub right: [f32; 2],
    pub down: [f32; 2],
}

impl Homography {
    pub fn new(frame: &Frame<'_>, pose: &Pose, side: u8) -> Self {
        let half = f32::from(frame.square_side()) / 2.0 * ONE;
        let (sin_h, cos_h) = sin_cos(pose.heading_rad());
        let ((sin_roll, cos_roll), (sin_pitch, cos_pitch), t) = match pose.tilt() {
            Some(tilt) => (
                sin_cos(tilt.roll_rad()),
                sin_cos(tilt.pitch_rad()),
                tan(tilt.field_of_view_rad() / 2.0),
            ),
            None => ((0.0, 1.0), (0.0, 1.0), 1.0),
        };
        let focal = half / t;
        let reach = t / pose.altitude_ratio();
        // F·Y, −F·X and Z, linear in (u, w, 1).
        let x = [
            focal * reach * cos_roll,
            -focal * reach * sin_pitch * sin_roll,
            focal * cos_pitch * sin_roll,
        ];
        let y = [0.0, focal * reach * cos_pitch, focal * sin_pitch];
        let z = [
            -reach * sin_roll,
            -reach * sin_pitch * cos_roll,
            cos_pitch * cos_roll,
        ];
        // (u, w) is (dx, dy) turned, and that is 2/v·(column, row) − 1.
        let step = 2.0 / f32::from(side);
        let turned = |[u, w, one]: [f32; 3]| {
            let (right, down) = (u * cos_h - w * sin_h, u * sin_h + w * cos_h);
            [right * step, down * step, one - right - down]
        };
        Self {
            x: turned(x),
            y: turned(y),
            z: turned(z),
            middle: frame
                .square_corner()
                .map(|start| (f32::from(start) - 0.5) * ONE + half),
        }
    }

    /// The view pixel around a point: exact there, linear around it. `None` at the horizon and beyond.
    #[inline(always)] // a call more per view pixel, and its patch through memory, would not fit the budget
    pub fn patch(&self, column: f32, row: f32) -> Option<Patch> {
        let value = |[a, b, c]: [f32; 3]| a * column + (b * row + c);
        let z = value(self.z);
        if z < HORIZON {
            return None;
        }
        let scale = 1.0 / z;
        let (x, y) = (value(self.x) * scale, value(self.y) * scale);
        // The derivative of a quotient.
        let step = |i: usize| {
            [
                (self.x[i] - x * self.z[i]) * scale,
                (self.y[i] - y * self.z[i]) * scale,
            ]
        };
        Some(Patch {
            middle: [x + self.middle[0], y + self.middle[1]],
            right: step(0),
            down: step(1),
        })
    }
}

impl Patch {
    /// Half of its extent in x or y.
    pub fn reach(&self, axis: usize) -> f32 {
        (self.right[axis].abs() + self.down[axis].abs()) / 2.0
    }

    /// The sum of its squared sides.
    pub fn squares(&self) -> f32 {
        let square = |[x, y]: [f32; 2]| x * x + y * y;
        square(self.right) + square(self.down)
    }
}
