//! What an autopilot tells about the vehicle: heading, roll and pitch, altitude. Nothing tells where it is or how fast.

use eigenmark_core::{navigator, preprocess::Pose};
use serde::{Deserialize, Serialize};

use super::{
    Truth,
    chance::{Cause, Walk, Wander},
    vehicle::wrapped,
};

/// How wrong the instruments are; each can be absent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instruments {
    /// Largest error of the heading, in radians; it begins anywhere and walks.
    pub heading_rad: Option<f64>,
    /// Standard deviation of the errors of roll and pitch, in radians.
    pub tilt_rad: Option<f64>,
    /// Largest relative error of the altitude; it begins anywhere and walks.
    pub altitude: Option<f64>,
    /// How long errors of heading and altitude take to forget where they were, in seconds.
    pub walk_time_s: f64,
    /// How long an error of roll or pitch lasts, in seconds.
    pub tilt_time_s: f64,
}

/// What the instruments read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Readings {
    /// Heading in radians clockwise from map-up, in −π..=π.
    pub heading_rad: Option<f32>,
    /// Roll (right side down) and pitch (nose up), in radians.
    pub tilt_rad: Option<(f32, f32)>,
    /// Actual over nominal altitude.
    pub altitude_ratio: Option<f32>,
}

impl Readings {
    /// The same as the core takes them, with a camera of that field of view over the side of its square. A tilt out of
    /// the core's range is left out.
    #[must_use]
    pub fn for_core(self, field_of_view_rad: f32) -> navigator::Readings {
        let tilt = |(roll_rad, pitch_rad)| {
            let pose = Pose::NOMINAL.tilted(roll_rad, pitch_rad, field_of_view_rad);
            pose.ok()?.tilt()
        };
        navigator::Readings {
            heading_rad: self.heading_rad,
            tilt: self.tilt_rad.and_then(tilt),
            altitude_ratio: self.altitude_ratio,
        }
    }
}

impl Instruments {
    /// Without errors.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            heading_rad: Some(0.0),
            tilt_rad: Some(0.0),
            altitude: Some(0.0),
            ..Self::default()
        }
    }

    /// None at all.
    #[must_use]
    pub fn none() -> Self {
        Self {
            heading_rad: None,
            tilt_rad: None,
            altitude: None,
            ..Self::default()
        }
    }
}

impl Default for Instruments {
    /// A magnetic compass within 10°, a level within about 1°, a barometer within 3 %.
    fn default() -> Self {
        Self {
            heading_rad: Some(10.0_f64.to_radians()),
            tilt_rad: Some(1.0_f64.to_radians()),
            altitude: Some(0.03),
            walk_time_s: 60.0,
            tilt_time_s: 2.0,
        }
    }
}

/// The instruments of one flight.
#[derive(Clone, Debug)]
pub(crate) struct Panel {
    heading: Option<Walk>,
    tilt: Option<[Wander; 2]>,
    altitude: Option<Walk>,
}

impl Panel {
    pub(crate) fn new(instruments: &Instruments, seed: u64, step_s: f64) -> Self {
        let walk = |largest: f64, cause: Cause| {
            let random = cause.random(seed, 0);
            Walk::new([-largest, largest], instruments.walk_time_s, step_s, random)
        };
        let tilt = |deviation: f64, axis| {
            let random = Cause::Level.random(seed, axis);
            Wander::new(deviation, instruments.tilt_time_s, step_s, random)
        };
        Self {
            heading: instruments
                .heading_rad
                .map(|error| walk(error, Cause::Compass)),
            tilt: instruments
                .tilt_rad
                .map(|error| [tilt(error, 0), tilt(error, 1)]),
            altitude: instruments
                .altitude
                .map(|error| walk(error, Cause::Barometer)),
        }
    }

    /// Goes on by one step.
    pub(crate) fn step(&mut self) {
        self.heading.iter_mut().for_each(Walk::step);
        self.tilt.iter_mut().flatten().for_each(Wander::step);
        self.altitude.iter_mut().for_each(Walk::step);
    }

    /// What the compass reads more than the heading, in radians; zero without one.
    pub(crate) fn heading_error_rad(&self) -> f64 {
        self.heading.as_ref().map_or(0.0, Walk::value)
    }

    /// What the instruments read now.
    pub(crate) fn read(&self, truth: &Truth) -> Readings {
        let heading = |error: &Walk| wrapped(truth.heading_rad + error.value()) as f32;
        let tilt = |[roll, pitch]: &[Wander; 2]| {
            (
                (truth.roll_rad + roll.value()) as f32,
                (truth.pitch_rad + pitch.value()) as f32,
            )
        };
        let altitude = |error: &Walk| (truth.altitude_ratio * (1.0 + error.value())) as f32;
        Readings {
            heading_rad: self.heading.as_ref().map(heading),
            tilt_rad: self.tilt.as_ref().map(tilt),
            altitude_ratio: self.altitude.as_ref().map(altitude),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth() -> Truth {
        Truth {
            velocity_m_s: [1.0, 0.0],
            heading_rad: 3.1,
            altitude_ratio: 1.1,
            roll_rad: 0.05,
            pitch_rad: -0.04,
            ..Truth::still([5.0, 6.0])
        }
    }

    #[test]
    fn ideal_instruments_tell_the_truth_and_absent_ones_nothing() {
        let ideal = Panel::new(&Instruments::ideal(), 1, 0.01).read(&truth());
        let expected = Readings {
            heading_rad: Some(3.1),
            tilt_rad: Some((0.05, -0.04)),
            altitude_ratio: Some(1.1),
        };
        assert_eq!(ideal, expected);
        let none = Panel::new(&Instruments::none(), 1, 0.01).read(&truth());
        assert_eq!(none, Readings::default());
    }

    #[test]
    fn errors_keep_their_bounds_begin_anywhere_and_change_slowly() {
        let (mut first, mut largest, mut tilts) = (Vec::new(), 0.0_f64, 0.0_f64);
        let n = 200;
        for seed in 0..n {
            let mut panel = Panel::new(&Instruments::default(), seed, 0.01);
            let errors = |panel: &Panel| {
                let read = panel.read(&truth());
                let heading = wrapped(f64::from(read.heading_rad.expect("read")) - 3.1);
                let altitude = f64::from(read.altitude_ratio.expect("read")) / 1.1 - 1.0;
                let roll = f64::from(read.tilt_rad.expect("read").0) - 0.05;
                (heading.to_degrees(), altitude, roll.to_degrees())
            };
            first.push(errors(&panel).0);
            for _ in 0..20 {
                let before = errors(&panel).0;
                (0..100).for_each(|_| panel.step());
                let (heading, altitude, roll) = errors(&panel);
                assert!((heading - before).abs() < 1.0, "a degree in a second");
                assert!(altitude.abs() <= 0.03 + 1e-6, "{altitude}");
                largest = largest.max(heading.abs());
                tilts += roll * roll / f64::from(20 * n as u32);
            }
        }
        assert!(largest > 9.5 && largest <= 10.0 + 1e-4, "{largest}");
        let beyond_half = first.iter().filter(|error| error.abs() > 5.0).count();
        assert!(
            (70..130).contains(&beyond_half),
            "uniform at the start: {beyond_half} of 200"
        );
        assert!((tilts.sqrt() - 1.0).abs() < 0.1, "{}", tilts.sqrt());
    }
}
