//! What a flight is flown with.

use eigenmark_core::landmark::Point;
use serde::{Deserialize, Serialize};

use super::FlightError;
use crate::simulate::{Blimp, Instruments, Light, Sensor, Wind, World};

/// The most frames of a flight: a day at ten frames a second.
const MAX_FRAMES: f64 = 864_000.0;

/// Everything about a flight but the world and the pilot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlightSettings {
    /// Seed of all chance.
    pub seed: u64,
    /// Where it begins.
    pub start: Point,
    /// Heading at the start, in radians clockwise from map-up.
    pub start_heading_rad: f64,
    /// Where it should end; without a goal it ends when the time is up.
    pub goal: Option<Point>,
    /// How near to the goal an arrival must be, in map pixels.
    pub arrival_px: f64,
    /// When and where to it is carried off.
    pub kidnapping: Option<Kidnapping>,
    /// When it ends at the latest, in seconds.
    pub time_limit_s: f64,
    /// Frames per second.
    pub frame_rate_hz: f64,
    /// The vehicle.
    pub blimp: Blimp,
    /// The wind.
    pub wind: Wind,
    /// The light.
    pub light: Light,
    /// The camera's sensor.
    pub sensor: Sensor,
    /// The instruments.
    pub instruments: Instruments,
}

/// A vehicle that is suddenly elsewhere, and is not told.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kidnapping {
    /// When, in seconds since the start.
    pub time_s: f64,
    /// Where to.
    pub to: Point,
}

impl FlightSettings {
    /// A flight from `start`, heading map-up, with all the effects at their defaults: ten frames a second for at most
    /// ten minutes.
    #[must_use]
    pub fn new(seed: u64, start: Point) -> Self {
        Self {
            seed,
            start,
            start_heading_rad: 0.0,
            goal: None,
            arrival_px: 50.0,
            kidnapping: None,
            time_limit_s: 600.0,
            frame_rate_hz: 10.0,
            blimp: Blimp::default(),
            wind: Wind::default(),
            light: Light::default(),
            sensor: Sensor::default(),
            instruments: Instruments::default(),
        }
    }

    /// The same flight without any effect: calm air, steady light, a level vehicle, ideal sensor and instruments.
    #[must_use]
    pub fn ideal(seed: u64, start: Point) -> Self {
        Self {
            blimp: Blimp::level(),
            wind: Wind::calm(),
            light: Light::steady(),
            sensor: Sensor::ideal(),
            instruments: Instruments::ideal(),
            ..Self::new(seed, start)
        }
    }

    /// Checks that the settings make sense in a world.
    pub(super) fn check(&self, world: &World<'_>) -> Result<(), FlightError> {
        let goal = self.goal.map(|goal| ("a goal", goal));
        let kidnapping = self
            .kidnapping
            .map(|kidnapping| ("a kidnapping", kidnapping.to));
        for (name, place) in [Some(("a start", self.start)), goal, kidnapping]
            .into_iter()
            .flatten()
        {
            let found = [place.x_px, place.y_px];
            if !world.is_on_map(found.map(f64::from)) {
                let size = [world.map.width(), world.map.height()];
                return Err(FlightError::OffMap { name, found, size });
            }
        }
        let (blimp, sensor, light) = (&self.blimp, &self.sensor, &self.light);
        let [low, high] = blimp.altitude_ratio;
        let frames = self.time_limit_s * self.frame_rate_hz;
        let clouds = light.clouds.unwrap_or_default();
        let instruments = &self.instruments;
        let numbers: [(&str, f64, Sensible); _] = [
            ("meters per map pixel", world.meters_per_px, POSITIVE),
            ("frames per second", self.frame_rate_hz, POSITIVE),
            ("a time limit (s)", self.time_limit_s, NOT_NEGATIVE),
            (
                "frames in all",
                frames,
                ("0 to 864000", |x| (0.0..=MAX_FRAMES).contains(&x)),
            ),
            (
                "a start's heading (rad)",
                self.start_heading_rad,
                ("a number", f64::is_finite),
            ),
            ("a cruising speed (m/s)", blimp.cruise_m_s, POSITIVE),
            ("a surge time (s)", blimp.surge_time_s, POSITIVE),
            ("a sway time (s)", blimp.sway_time_s, POSITIVE),
            ("a rate of turn (rad/s)", blimp.turn_rad_s, NOT_NEGATIVE),
            ("a gain of turns (1/s)", blimp.turn_gain, NOT_NEGATIVE),
            ("a turn time (s)", blimp.turn_time_s, POSITIVE),
            ("a lowest altitude ratio", low, POSITIVE),
            ("an altitude range", high - low, NOT_NEGATIVE),
            ("an altitude time (s)", blimp.altitude_time_s, POSITIVE),
            ("a swing (rad)", blimp.swing_rad, NOT_NEGATIVE),
            ("a swing's period (s)", blimp.swing_period_s, POSITIVE),
            ("a swing's damping", blimp.swing_damping, NOT_NEGATIVE),
            ("a lean", blimp.lean, NOT_NEGATIVE),
            (
                "a limit of tilt (rad)",
                blimp.tilt_limit_rad,
                ("0 to 1", |x| (0.0..=1.0).contains(&x)),
            ),
            ("a wind (m/s)", self.wind.speed_m_s, NOT_NEGATIVE),
            ("gusts (m/s)", self.wind.gust_m_s, NOT_NEGATIVE),
            ("a gust's time (s)", self.wind.gust_time_s, POSITIVE),
            ("a lowest gamma", light.gamma[0], POSITIVE),
            ("a highest gamma", light.gamma[1], POSITIVE),
            ("a lowest gain", light.gain[0], POSITIVE),
            ("a highest gain", light.gain[1], POSITIVE),
            ("a light's time (s)", light.time_s, POSITIVE),
            ("a cover of clouds", clouds.cover, SHARE),
            ("a shade of clouds", clouds.shade, SHARE),
            ("a size of clouds (m)", clouds.size_m, POSITIVE),
            ("a softness of clouds", clouds.softness, NOT_NEGATIVE),
            ("a vignetting", sensor.vignetting, SHARE),
            ("a noise", sensor.noise, NOT_NEGATIVE),
            ("an exposure (s)", sensor.shutter.exposure_s, NOT_NEGATIVE),
            ("a readout (s)", sensor.shutter.readout_s, NOT_NEGATIVE),
            ("a share of dropped frames", sensor.dropped, SHARE),
            ("a share of torn frames", sensor.torn, SHARE),
            (
                "a heading's error (rad)",
                instruments.heading_rad.unwrap_or(0.0),
                NOT_NEGATIVE,
            ),
            (
                "a tilt's error (rad)",
                instruments.tilt_rad.unwrap_or(0.0),
                NOT_NEGATIVE,
            ),
            (
                "an altitude's error",
                instruments.altitude.unwrap_or(0.0),
                SHARE,
            ),
            ("an error's time (s)", instruments.walk_time_s, POSITIVE),
            ("a tilt error's time (s)", instruments.tilt_time_s, POSITIVE),
        ];
        for (name, found, (expected, is_sensible)) in numbers {
            if !is_sensible(found) {
                return Err(FlightError::Setting {
                    name,
                    found,
                    expected,
                });
            }
        }
        Ok(())
    }
}

/// A name for numbers, and whether a number is one of them; none of them holds what is no number, or infinite.
type Sensible = (&'static str, fn(f64) -> bool);

const POSITIVE: Sensible = ("a positive number", |x| x > 0.0 && x.is_finite());
const NOT_NEGATIVE: Sensible = ("a number, not negative", |x| x >= 0.0 && x.is_finite());
const SHARE: Sensible = ("a share, 0 to 1", |x| (0.0..=1.0).contains(&x));
