//! Frame positions and the level ground: what a tilted camera would have seen had it looked straight down.
//!
//! **Notation.** Frame positions are [x, y] in pixels of the tracked square. Ground positions are [right, behind] of
//! the point below the vehicle, in sides at altitude ratio 1, in axes that turn with the vehicle but stay level. Angles
//! and field of view as in [`Pose`](crate::preprocess::Pose).
//!
//! **Accuracy.** Sines and cosines of the tilt are those of `micromath`, 0.0011 off at most: as if the vehicle were
//! tilted by 0.06° more or less, which is far below what an autopilot knows, and harmless for the same reason, see the
//! notes on tilt in [`track`](super). The field of view would be a lasting error of scale, so its tangent is exact
//! ([`math`](crate::math)).

use micromath::F32Ext;

use crate::preprocess::Tilt;

/// The smallest cosine of a ray with the way down: 84°, beyond which nothing is to be seen.
const HORIZON: f32 = 0.1;

/// How a frame lies over the ground.
#[derive(Clone, Copy, Debug)]
pub struct Ground {
    /// The middle of the frame's square, in pixels of the tracked square.
    middle_px: f32,
    /// Sides of the frame's square per pixel.
    per_px: f32,
    tilt: Option<Rotation>,
}

#[derive(Clone, Copy, Debug)]
struct Rotation {
    /// Side of the square at distance 1 from the camera.
    reach: f32,
    roll: [f32; 2],
    pitch: [f32; 2],
}

impl Ground {
    /// Of a frame whose square has that side, of which the middle `side_px` pixels are tracked.
    pub fn new(square_px: u16, side_px: u16, tilt: Option<Tilt>) -> Self {
        let margin = square_px.saturating_sub(side_px) / 2;
        Self {
            middle_px: f32::from(square_px) / 2.0 - f32::from(margin),
            per_px: 1.0 / f32::from(square_px.max(1)),
            tilt: tilt.map(|tilt| Rotation {
                reach: 2.0 * crate::math::tan(tilt.field_of_view_rad() / 2.0),
                roll: sin_cos(tilt.roll_rad()),
                pitch: sin_cos(tilt.pitch_rad()),
            }),
        }
    }

    /// Sides per pixel.
    pub fn per_px(&self) -> f32 {
        self.per_px
    }

    /// The ground that a frame position shows; `None` near the horizon and beyond.
    pub fn level(&self, at_px: [f32; 2]) -> Option<[f32; 2]> {
        let [x, y] = at_px.map(|at| (at - self.middle_px) * self.per_px);
        let Some(tilt) = &self.tilt else {
            return Some([x, y]);
        };
        let ([sin_roll, cos_roll], [sin_pitch, cos_pitch]) = (tilt.roll, tilt.pitch);
        // The ray in the axes of the body, out of the roll, out of the pitch.
        let (forward, right) = (-y * tilt.reach, x * tilt.reach);
        let (right, down) = (right * cos_roll - sin_roll, right * sin_roll + cos_roll);
        let (forward, down) = (
            forward * cos_pitch + down * sin_pitch,
            down * cos_pitch - forward * sin_pitch,
        );
        if down < HORIZON {
            return None;
        }
        let scale = 1.0 / (down * tilt.reach);
        Some([right * scale, -forward * scale])
    }

    /// The frame position that shows a ground position; `None` when the camera looks away from it.
    pub fn project(&self, [right, behind]: [f32; 2]) -> Option<[f32; 2]> {
        let at = match &self.tilt {
            None => [right, behind],
            Some(tilt) => {
                let ([sin_roll, cos_roll], [sin_pitch, cos_pitch]) = (tilt.roll, tilt.pitch);
                let (forward, right) = (-behind * tilt.reach, right * tilt.reach);
                let (forward, down) = (
                    forward * cos_pitch - sin_pitch,
                    forward * sin_pitch + cos_pitch,
                );
                let (right, down) = (
                    right * cos_roll + down * sin_roll,
                    down * cos_roll - right * sin_roll,
                );
                if down < HORIZON {
                    return None;
                }
                let scale = 1.0 / (down * tilt.reach);
                [right * scale, -forward * scale]
            }
        };
        Some(at.map(|at| at / self.per_px + self.middle_px))
    }
}

/// Not as methods: those of the standard library would take their place where it is linked.
fn sin_cos(angle: f32) -> [f32; 2] {
    [F32Ext::sin(angle), F32Ext::cos(angle)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preprocess::Pose;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_levelled_is_projected_back(
            roll in -0.5_f32..0.5, pitch in -0.5_f32..0.5, view in 0.3_f32..1.5,
            at_px in prop::array::uniform2(0.0_f32..200.0), square_px in 200_u16..240,
        ) {
            let pose = Pose::NOMINAL.tilted(roll, pitch, view).expect("in range");
            let ground = Ground::new(square_px, 200, pose.tilt());
            if let Some(below) = ground.level(at_px) {
                // Those of micromath are not quite a rotation: 0.1 % of the frame.
                let back = ground.project(below).expect("seen");
                let off = (back[0] - at_px[0]).hypot(back[1] - at_px[1]);
                prop_assert!(off < 0.005 * 200.0, "{off} pixels");
            }
        }
    }

    #[test]
    fn sines_and_cosines_err_by_a_thousandth() {
        let largest = (-600..=600)
            .map(|step| {
                let angle = step as f32 / 600.0 * crate::preprocess::MAX_TILT_RAD;
                let [sin, cos] = sin_cos(angle);
                let (exact_sin, exact_cos) = crate::math::sin_cos(angle);
                (sin - exact_sin).abs().max((cos - exact_cos).abs())
            })
            .fold(0.0, f32::max);
        assert!(largest < 0.0012, "{largest}");
    }

    #[test]
    fn the_middle_of_a_tilted_frame_shows_what_lies_beside() {
        let fov = 60_f32.to_radians();
        let pose = Pose::NOMINAL.tilted(0.1, 0.0, fov).expect("in range");
        let ground = Ground::new(120, 120, pose.tilt());
        let [right, behind] = ground.level([60.0, 60.0]).expect("seen");
        // Right side down: the camera looks left, by the tangent of the roll, in sides of 2·tan 30° altitudes.
        let expected = -crate::math::tan(0.1) / (2.0 * crate::math::tan(fov / 2.0));
        assert!((right - expected).abs() < 0.0015, "{right} {expected}");
        assert!(behind.abs() < 0.0015);
    }
}
