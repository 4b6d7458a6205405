//! What the landmarks say of the compass: by how much it is wrong.
//!
//! **Method.** A frame that is levelled by a wrong heading looks less like its landmark. So frames are levelled in turn by a
//! heading a little to the left of what is believed and a little to the right: whichever side looks more alike is where
//! the heading is, and the deviation that is believed follows (extremum seeking). It takes no second look at any frame.

use crate::math::wrapped;

/// How far to the sides frames are levelled, in radians: 3.4°.
const ASIDE_RAD: f32 = 0.06;

/// How far the deviation follows, in radians, when one side looks like nothing and the other is the landmark itself.
const GAIN_RAD: f32 = 0.02;

/// The largest deviation that is believed, in radians: 15°.
const LARGEST_RAD: f32 = 15.0_f32.to_radians();

/// How far a compass is believed to be off.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Compass {
    /// What it reads less the heading, in radians.
    deviation_rad: f32,
    /// Whether the next frame is levelled by a heading to the left.
    is_left: bool,
    /// The squared distance to the nearest landmark, of the last frame.
    last: Option<f32>,
    /// What it read last less the heading of path integration then, in radians.
    ahead_rad: f32,
}

impl Compass {
    /// What it reads, or would read: with path integration's heading, in radians.
    pub fn read(&mut self, reading_rad: Option<f32>, integrated_rad: f32) -> f32 {
        let known = reading_rad.filter(|reading| reading.is_finite());
        if let Some(reading) = known {
            self.ahead_rad = wrapped(reading - integrated_rad);
        }
        wrapped(integrated_rad + self.ahead_rad)
    }

    /// What it reads less the heading, in radians.
    pub fn deviation_rad(&self) -> f32 {
        self.deviation_rad
    }

    /// The heading by which the next frame is levelled, for one that is believed.
    pub fn aside(&self, heading_rad: f32) -> f32 {
        wrapped(heading_rad + if self.is_left { -ASIDE_RAD } else { ASIDE_RAD })
    }

    /// The frame that was levelled so has that squared distance to the nearest landmark.
    pub fn learn(&mut self, distance: f32) {
        if let Some(last) = self.last {
            let (sum, more) = (last + distance, distance - last);
            let share = if sum > 0.0 { more / sum } else { 0.0 };
            // Less alike to the left: the heading is to the right of what is believed, and the compass reads too little.
            let toward = if self.is_left { -share } else { share };
            if toward.is_finite() {
                let deviation = self.deviation_rad + GAIN_RAD * toward;
                self.deviation_rad = deviation.clamp(-LARGEST_RAD, LARGEST_RAD);
            }
        }
        self.last = Some(distance);
        self.is_left = !self.is_left;
    }

    /// The next frame has nothing to do with the last one.
    pub fn forget_last(&mut self) {
        self.last = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_it_would_read_follows_path_integration() {
        let mut compass = Compass::default();
        assert_eq!(compass.read(None, 0.3), 0.3, "there was none yet");
        for (reading, integrated, expected) in [
            (Some(1.0), 0.25, 1.0),
            (None, 0.5, 1.25),
            (Some(f32::NAN), -0.25, 0.5),
            (Some(-1.0), 3.0, -1.0),
            (None, 3.0, -1.0),
        ] {
            let found = compass.read(reading, integrated);
            assert!((found - expected).abs() < 1e-5, "{found} {expected}");
        }
    }

    #[test]
    fn a_deviation_is_found_from_what_looks_more_alike() {
        for (off, sign) in [(0.15_f32, 1.0_f32), (0.15, -1.0), (0.0, 1.0), (0.5, 1.0)] {
            let off = off * sign;
            let mut compass = Compass::default();
            for number in 0..600 {
                // The vehicle turns; so does what the compass reads.
                let heading = wrapped(0.02 * number as f32);
                let believed = heading + off - compass.deviation_rad();
                let wrong = wrapped(compass.aside(believed) - heading);
                compass.learn(0.1 + (27.0 * wrong * wrong).min(1.0));
            }
            let expected = off.clamp(-LARGEST_RAD, LARGEST_RAD);
            // Where nothing looks alike, nothing is learned.
            let expected = if off > 0.4 { 0.0 } else { expected };
            let found = compass.deviation_rad();
            assert!((found - expected).abs() < 0.02, "{off} {found}");
        }
        let mut compass = Compass::default();
        for odd in [
            f32::NAN,
            f32::INFINITY,
            0.0,
            0.0,
            -1.0,
            1.0,
            f32::MAX,
            f32::MAX,
        ] {
            compass.learn(odd);
            assert!(compass.deviation_rad().abs() <= LARGEST_RAD);
        }
    }
}
