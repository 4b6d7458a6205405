//! The wind: a mean and gusts.
//!
//! Gusts are two Ornstein-Uhlenbeck processes, one per axis of the map: the first-order Dryden model at a fixed
//! altitude, with a memory in seconds instead of a length scale over the airspeed.

use std::f64::consts::TAU;

use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::simulate::chance::{Cause, Wander};

/// How the wind blows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wind {
    /// Mean speed, in meters per second.
    pub speed_m_s: f64,
    /// Where the mean blows to, in radians clockwise from map-up; drawn from the seed when absent.
    pub toward_rad: Option<f64>,
    /// Standard deviation of the gusts along each axis, in meters per second.
    pub gust_m_s: f64,
    /// How long a gust lasts, in seconds.
    pub gust_time_s: f64,
}

impl Wind {
    /// No wind at all.
    #[must_use]
    pub fn calm() -> Self {
        Self {
            speed_m_s: 0.0,
            gust_m_s: 0.0,
            ..Self::default()
        }
    }
}

impl Default for Wind {
    /// A light breeze from anywhere: a quarter of a blimp's airspeed, with gusts of half as much.
    fn default() -> Self {
        Self {
            speed_m_s: 1.5,
            toward_rad: None,
            gust_m_s: 0.7,
            gust_time_s: 5.0,
        }
    }
}

/// The wind of one flight.
#[derive(Clone, Debug)]
pub(crate) struct Air {
    mean_m_s: [f64; 2],
    gusts: [Wander; 2],
}

impl Air {
    pub(crate) fn new(wind: &Wind, seed: u64, step_s: f64) -> Self {
        let drawn = Cause::Wind.random(seed, 0).random_range(0.0..TAU);
        let (sin, cos) = wind.toward_rad.unwrap_or(drawn).sin_cos();
        let gust = |axis| {
            let random = Cause::Gusts.random(seed, axis);
            Wander::new(wind.gust_m_s, wind.gust_time_s, step_s, random)
        };
        Self {
            mean_m_s: [wind.speed_m_s * sin, -wind.speed_m_s * cos],
            gusts: [gust(0), gust(1)],
        }
    }

    /// Goes on by one step.
    pub(crate) fn step(&mut self) {
        self.gusts.iter_mut().for_each(Wander::step);
    }

    /// The mean velocity of the air over the ground, in meters per second.
    pub(crate) fn mean_m_s(&self) -> [f64; 2] {
        self.mean_m_s
    }

    /// The velocity of the air over the ground now, in meters per second.
    pub(crate) fn velocity_m_s(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.mean_m_s[axis] + self.gusts[axis].value())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_mean_blows_where_it_should() {
        let wind = Wind {
            speed_m_s: 2.0,
            toward_rad: Some(TAU / 4.0),
            ..Wind::calm()
        };
        let [x, y] = Air::new(&wind, 1, 0.01).velocity_m_s();
        assert!((x - 2.0).abs() < 1e-12 && y.abs() < 1e-12, "{x} {y}");
    }

    #[test]
    fn gusts_come_on_top_of_the_mean() {
        let wind = Wind::default();
        let mut air = Air::new(&wind, 1, 0.01);
        let mut sums = [0.0; 2];
        let steps = 500_000; // 1,000 times the memory of a gust
        for _ in 0..steps {
            air.step();
            for (axis, sum) in sums.iter_mut().enumerate() {
                *sum += (air.velocity_m_s()[axis] - air.mean_m_s()[axis]).powi(2);
            }
        }
        for sum in sums {
            let deviation = (sum / f64::from(steps)).sqrt();
            assert!((deviation / wind.gust_m_s - 1.0).abs() < 0.1, "{deviation}");
        }
    }
}
