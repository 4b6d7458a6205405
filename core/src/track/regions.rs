//! Where in the frame corners come in, stay, and go out.
//!
//! The report's figure B.1 has three bands, for a blimp that only flies forward. Here the way of the ground through the
//! frame says where the outgoing one is; the others are wherever there is no corner yet.

use crate::math::sqrt;

/// Where its window will not fit any more, a corner is dropped: half a window, a difference, and a pixel to spare.
const MARGIN_PX: f32 = 8.0;

/// The outgoing region: beyond this share of the side from the middle, along the way of the ground.
const OUTGOING: f32 = 0.3;

/// Regions of the frame by the way of the ground through it.
#[derive(Clone, Copy, Debug)]
pub struct Regions {
    side_px: f32,
    /// Unit vector of the ground's way, or none when it stands still.
    way: [f32; 2],
}

impl Regions {
    /// Of a square in which the ground goes along [x, y], in sides per frame.
    pub fn new(side_px: u16, [x, y]: [f32; 2]) -> Self {
        let length = sqrt(x * x + y * y);
        // Half a percent of the side: a pixel of 200.
        let is_moving = length > 0.005;
        Self {
            side_px: side_px.into(),
            way: if is_moving {
                [x / length, y / length]
            } else {
                [0.0; 2]
            },
        }
    }

    /// Whether a window fits around it.
    pub fn is_inside(&self, at_px: [f32; 2]) -> bool {
        let inside = MARGIN_PX..=self.side_px - MARGIN_PX;
        at_px.iter().all(|at| inside.contains(at))
    }

    /// Whether it will soon have left.
    pub fn is_outgoing(&self, at_px: [f32; 2]) -> bool {
        let [x, y] = at_px.map(|at| at - self.side_px / 2.0);
        x * self.way[0] + y * self.way[1] > OUTGOING * self.side_px
    }
}
