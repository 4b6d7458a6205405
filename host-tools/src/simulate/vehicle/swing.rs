//! Roll and pitch: the hull swings like a pendulum, pushed by turbulence and by its own acceleration.
//!
//! For each axis φ″ = −ω²(φ − φ₀) − 2ζωφ′ + noise, where φ₀ is a share of the inclination of the plumb line. Noise of
//! intensity 4ζω³σ² gives the stated deviation σ. Beyond small angles the swing is bent by L·tanh(φ/L): it never
//! reaches L, and its rate stays smooth.

use std::f64::consts::TAU;

use rand_pcg::Pcg64;

use super::Blimp;
use crate::simulate::chance::{Cause, gaussian};

/// Standard gravity, in meters per second squared.
const GRAVITY_M_S2: f64 = 9.806_65;

/// One axis of the swing.
#[derive(Clone, Debug)]
pub(super) struct Swing {
    angle_rad: f64,
    rate_rad_s: f64,
    limit_rad: f64,
    random: Pcg64,
}

impl Swing {
    /// Axis 0 is roll, 1 is pitch.
    pub(super) fn new(blimp: &Blimp, seed: u64, axis: u64) -> Self {
        let mut random = Cause::Swing.random(seed, axis);
        let omega = TAU / blimp.swing_period_s;
        Self {
            angle_rad: blimp.swing_rad * gaussian(&mut random),
            rate_rad_s: omega * blimp.swing_rad * gaussian(&mut random),
            limit_rad: blimp.tilt_limit_rad,
            random,
        }
    }

    /// Goes on by one step under an acceleration (meters per second squared) that leans the hull to the positive side.
    pub(super) fn step(&mut self, blimp: &Blimp, acceleration_m_s2: f64, step_s: f64) {
        let omega = TAU / blimp.swing_period_s;
        let rest_rad = blimp.lean * (acceleration_m_s2 / GRAVITY_M_S2).atan();
        let intensity = 4.0 * blimp.swing_damping * omega.powi(3) * blimp.swing_rad.powi(2);
        let noise = (intensity / step_s).sqrt() * gaussian(&mut self.random);
        let pull = omega * omega * (rest_rad - self.angle_rad);
        let damping = 2.0 * blimp.swing_damping * omega * self.rate_rad_s;
        // The rate first: this keeps the energy of an undamped swing.
        self.rate_rad_s += (pull - damping + noise) * step_s;
        self.angle_rad += self.rate_rad_s * step_s;
    }

    /// The angle in radians and its rate in radians per second.
    pub(super) fn state(&self) -> (f64, f64) {
        if self.limit_rad == 0.0 {
            return (0.0, 0.0);
        }
        let bent = (self.angle_rad / self.limit_rad).tanh();
        (self.limit_rad * bent, (1.0 - bent * bent) * self.rate_rad_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_turbulence_it_swings_as_stated() {
        let blimp = Blimp {
            swing_rad: 0.01,
            tilt_limit_rad: 1.0,
            ..Blimp::default()
        };
        let mut swing = Swing::new(&blimp, 1, 0);
        let steps = 400_000; // 1,000 periods
        let mut squares = 0.0;
        for _ in 0..steps {
            swing.step(&blimp, 0.0, 0.01);
            squares += swing.state().0.powi(2);
        }
        let deviation = (squares / f64::from(steps)).sqrt();
        assert!((deviation / 0.01 - 1.0).abs() < 0.1, "{deviation}");
    }

    #[test]
    fn under_steady_acceleration_it_leans() {
        let blimp = Blimp {
            swing_rad: 0.0,
            tilt_limit_rad: 1.0,
            ..Blimp::default()
        };
        let mut swing = Swing::new(&blimp, 1, 0);
        (0..10_000).for_each(|_| swing.step(&blimp, 2.0, 0.01));
        let expected = blimp.lean * (2.0 / GRAVITY_M_S2).atan();
        assert!((swing.state().0.atanh() - expected).abs() < 1e-4);
    }

    #[test]
    fn its_rate_is_the_slope_of_its_angle() {
        let blimp = Blimp::default();
        let mut swing = Swing::new(&blimp, 2, 0);
        for _ in 0..2_000 {
            let before = swing.state();
            swing.step(&blimp, 0.0, 0.001);
            let after = swing.state();
            let (slope, rate) = ((after.0 - before.0) / 0.001, (before.1 + after.1) / 2.0);
            assert!((slope - rate).abs() < 0.01, "{slope} {rate}");
        }
    }
}
