//! A pilot that knows the truth: flies a given way, whatever another pilot thinks meanwhile.

use eigenmark_core::landmark::Point;

use super::{Pilot, Report, Sight};
use crate::simulate::{Command, Truth};

/// How far ahead on its way it aims, in seconds of flight.
const LOOK_AHEAD_S: f64 = 4.0;

/// How near to a point of the way it turns to the next, in seconds of flight: what a turn takes.
const TURN_S: f64 = 3.0;

/// How near to the last point counts as there, in seconds of flight.
const NEAR_S: f64 = 0.75;

/// What it slows down to before the last point: slow enough to turn toward it at once.
const SLOWEST: f64 = 0.3;

/// Share of each look at the wind that its estimate takes on: slowly, because slip in a turn looks like wind.
const WIND_SHARE: f64 = 0.015;

/// Flies through points by the truth, and lets another pilot look on: its reports are kept, its commands are not.
#[derive(Clone, Debug)]
pub struct Guided<P> {
    way: Vec<Point>,
    next: usize,
    meters_per_px: f64,
    cruise_m_s: f64,
    wind_m_s: [f64; 2],
    command: Command,
    passenger: P,
}

impl<P: Pilot> Guided<P> {
    /// Through `way`, at full speed of a blimp that cruises at `cruise_m_s`; arrives at the last point, or at once.
    #[must_use]
    pub fn new(way: Vec<Point>, meters_per_px: f64, cruise_m_s: f64, passenger: P) -> Self {
        Self {
            way,
            next: 0,
            meters_per_px,
            cruise_m_s,
            wind_m_s: [0.0; 2],
            command: Command::default(),
            passenger,
        }
    }

    /// The way from the vehicle to a point, in meters.
    fn toward(&self, truth: &Truth, point: Point) -> [f64; 2] {
        let [x, y] = truth.position_px;
        [f64::from(point.x_px) - x, f64::from(point.y_px) - y].map(|px| px * self.meters_per_px)
    }

    /// A point some seconds ahead on the line from the point before to the next.
    fn aim(&self, truth: &Truth) -> Option<[f64; 2]> {
        let end = self.toward(truth, *self.way.get(self.next)?);
        let Some(before) = self
            .next
            .checked_sub(1)
            .and_then(|index| self.way.get(index))
        else {
            return Some(end);
        };
        let start = self.toward(truth, *before);
        let leg = [end[0] - start[0], end[1] - start[1]];
        let length = leg[0].hypot(leg[1]).max(1e-6);
        let done = -(start[0] * leg[0] + start[1] * leg[1]) / length;
        let aim = (done + LOOK_AHEAD_S * self.cruise_m_s).clamp(0.0, length) / length;
        Some([start[0] + aim * leg[0], start[1] + aim * leg[1]])
    }
}

impl<P: Pilot> Pilot for Guided<P> {
    fn decide(&mut self, sight: &Sight<'_>) -> Command {
        self.passenger.decide(sight);
        self.command
    }

    fn report(&self) -> Report {
        Report {
            arrived: self.next >= self.way.len(),
            ..self.passenger.report()
        }
    }

    fn told(&mut self, truth: &Truth) {
        self.passenger.told(truth);
        let mut speed = 1.0;
        while let Some(&point) = self.way.get(self.next) {
            let is_last = self.next + 1 == self.way.len();
            let near_m = if is_last {
                NEAR_S * self.cruise_m_s
            } else {
                TURN_S * truth.velocity_m_s[0].hypot(truth.velocity_m_s[1])
            };
            let [x, y] = self.toward(truth, point);
            let distance = x.hypot(y);
            if distance > near_m {
                if is_last {
                    speed = (distance / (TURN_S * self.cruise_m_s)).clamp(SLOWEST, 1.0);
                }
                break;
            }
            self.next += 1;
        }
        let Some([x, y]) = self.aim(truth) else {
            self.command.speed = 0.0;
            return;
        };
        // What the vehicle moves by beyond what it commands is wind.
        let (sin, cos) = truth.heading_rad.sin_cos();
        let air = [sin, -cos].map(|share| share * self.cruise_m_s * f64::from(self.command.speed));
        let seen = [0, 1].map(|axis| truth.velocity_m_s[axis] - air[axis]);
        for (wind, seen) in self.wind_m_s.iter_mut().zip(seen) {
            *wind += WIND_SHARE * (seen - *wind);
        }
        // Into the wind by as much as it carries aside.
        let distance = x.hypot(y).max(1e-6);
        let aside = (x * self.wind_m_s[1] - y * self.wind_m_s[0]) / distance;
        let into = (-aside / (self.cruise_m_s * speed)).clamp(-0.9, 0.9).asin();
        self.command = Command {
            heading_rad: (x.atan2(-y) + into) as f32,
            speed: speed as f32,
        };
    }
}
