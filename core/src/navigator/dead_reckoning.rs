//! How a vehicle goes on that nobody sees move.

use crate::{
    math::heading_of,
    track::{Covariance, Displacement},
};

/// Without frames, the belief is moved after this time, in seconds.
const OVERDUE_S: f32 = 0.5;

/// Speeds are means over about this time, in seconds: longer than the camera swings.
const SMOOTH_S: f32 = 2.0;

/// How fast the vehicle was seen to move, and where it must have got to since.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DeadReckoning {
    /// Forward and right, in sides per second: a mean over about [`SMOOTH_S`].
    smooth: [f32; 2],
    /// Turn, in radians per second.
    yaw_rate: f32,
    /// Since the vehicle was last taken to be elsewhere, in seconds.
    since_s: f32,
    /// How long it has gone on unseen before that, in seconds, and how far.
    unseen_s: f32,
    unseen: Moved,
}

/// A displacement in the vehicle's axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moved {
    /// In sides.
    pub forward: f32,
    /// In sides.
    pub right: f32,
    /// In radians.
    pub yaw_rad: f32,
}

/// Standard deviation of turns (in radians) and climbs (in shares of the altitude) that were not seen, per second.
const UNSEEN_PER_S: f32 = 0.1;

impl Moved {
    /// Both; or one less the other, with a sign of −1. Turns in between are small.
    fn plus(self, other: Self, sign: f32) -> Self {
        Self {
            forward: self.forward + sign * other.forward,
            right: self.right + sign * other.right,
            yaw_rad: self.yaw_rad + sign * other.yaw_rad,
        }
    }
}

impl DeadReckoning {
    /// Time passes.
    pub fn wait(&mut self, step_s: f32) {
        if step_s > 0.0 && step_s < f32::MAX {
            self.since_s += step_s;
        }
    }

    /// No displacement was seen for long.
    pub fn is_overdue(&self) -> bool {
        self.since_s >= OVERDUE_S
    }

    /// Learns from a displacement that was seen, and says what of it the vehicle is not yet taken to have moved.
    pub fn learn(&mut self, displacement: &Displacement) -> Moved {
        let moved = Moved {
            forward: displacement.forward,
            right: displacement.right,
            yaw_rad: displacement.yaw_rad,
        };
        let elapsed_s = self.unseen_s + self.since_s;
        if elapsed_s > 0.0 {
            let share = (elapsed_s / SMOOTH_S).min(1.0);
            for (smooth, way) in self.smooth.iter_mut().zip([moved.forward, moved.right]) {
                *smooth += share * (way / elapsed_s - *smooth);
            }
            self.yaw_rate = moved.yaw_rad / elapsed_s;
            // After numbers that are none it begins anew.
            if !(self.smooth[0].is_finite() && self.smooth[1].is_finite()) {
                self.smooth = [0.0; 2];
            }
            if !self.yaw_rate.is_finite() {
                self.yaw_rate = 0.0;
            }
        }
        self.since_s = 0.0;
        moved.plus(self.forget_unseen(), -1.0)
    }

    /// Course over ground less heading, in radians.
    pub fn drift_rad(&self) -> f32 {
        let [forward, right] = self.smooth;
        heading_of(right, -forward)
    }

    /// How the vehicle moved since the last time that it was asked, on as before. A displacement that is seen later may
    /// correct it.
    pub fn go_on(&mut self) -> Moved {
        let [forward, right] = self.smooth.map(|rate| rate * self.since_s);
        let moved = Moved {
            forward,
            right,
            yaw_rad: self.yaw_rate * self.since_s,
        };
        self.unseen_s += core::mem::take(&mut self.since_s);
        self.unseen = self.unseen.plus(moved, 1.0);
        moved
    }

    /// All that it has gone on since the last displacement, when nothing of it will be seen any more: half of it may be
    /// wrong.
    pub fn settle(&mut self) -> Displacement {
        let unseen_s = self.unseen_s;
        let moved = self.forget_unseen();
        let way = moved.forward * moved.forward + moved.right * moved.right;
        let turn = UNSEEN_PER_S * UNSEEN_PER_S * unseen_s * unseen_s;
        let variances = [way / 4.0, way / 4.0, turn, turn];
        Displacement {
            forward: moved.forward,
            right: moved.right,
            yaw_rad: moved.yaw_rad,
            scale: 1.0,
            covariance: Covariance::from_diagonal(&variances.into()),
            tracked: 0,
            inliers: 0,
        }
    }

    fn forget_unseen(&mut self) -> Moved {
        self.unseen_s = 0.0;
        core::mem::take(&mut self.unseen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_seen_goes_on_at_the_same_rate() {
        let mut reckoning = DeadReckoning::default();
        reckoning.wait(1.0);
        reckoning.wait(1.0);
        let seen = |forward| Displacement {
            forward,
            right: -0.02,
            yaw_rad: 0.1,
            scale: 1.0,
            covariance: Covariance::zeros(),
            tracked: 20,
            inliers: 20,
        };
        assert_eq!(reckoning.learn(&seen(0.04)).forward, 0.04);
        reckoning.wait(0.3);
        assert!(!reckoning.is_overdue());
        reckoning.wait(0.2);
        assert!(reckoning.is_overdue());
        let moved = reckoning.go_on();
        for (found, expected) in [
            (moved.forward, 0.01),
            (moved.right, -0.005),
            (moved.yaw_rad, 0.025),
        ] {
            assert!((found - expected).abs() < 1e-6);
        }
        assert!(!reckoning.is_overdue());
        // What is seen then is counted once, and at the rate of all that time.
        reckoning.wait(1.5);
        let rest = reckoning.learn(&seen(0.06));
        assert!((rest.forward - 0.05).abs() < 1e-6, "{rest:?}");
        reckoning.wait(1.0);
        assert!((reckoning.go_on().forward - 0.03).abs() < 1e-6);
        let unseen = reckoning.settle();
        assert!((unseen.forward - 0.03).abs() < 1e-6);
        assert!((unseen.covariance.m33 - 0.01).abs() < 1e-6);
        assert_eq!(reckoning.settle().forward, 0.0);
    }
}
