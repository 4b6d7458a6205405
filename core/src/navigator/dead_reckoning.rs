//! How a vehicle goes on that nobody sees move.

use crate::{
    math::heading_of,
    track::{Covariance, Displacement},
};

/// Without frames, the belief is moved after this time, in seconds.
const OVERDUE_S: f32 = 0.5;

/// Speeds are means over about this time, in seconds: longer than the camera swings.
const SMOOTH_S: f32 = 2.0;

/// The speed of the last displacement, and the time since.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DeadReckoning {
    /// Forward and right, in sides per second: a mean over about [`SMOOTH_S`].
    smooth: [f32; 2],
    /// Turn, in radians per second.
    yaw_rate: f32,
    /// Since the last displacement that was taken, in seconds.
    since_s: f32,
    /// What was seen, and not taken yet.
    seen: Option<Moved>,
}

/// A displacement in the vehicle's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moved {
    /// In sides.
    pub forward: f32,
    /// In sides.
    pub right: f32,
    /// In radians.
    pub yaw_rad: f32,
}

/// Variance of a turn that was not seen, in squared radians: 3°.
const UNSEEN_TURN_RAD2: f32 = 0.05 * 0.05;

impl Moved {
    /// As a displacement that nobody saw: half of it may be wrong.
    pub fn unseen(&self) -> Displacement {
        let way = self.forward * self.forward + self.right * self.right;
        let variances = [way / 4.0, way / 4.0, UNSEEN_TURN_RAD2, UNSEEN_TURN_RAD2];
        Displacement {
            forward: self.forward,
            right: self.right,
            yaw_rad: self.yaw_rad,
            scale: 1.0,
            covariance: Covariance::from_diagonal(&variances.into()),
            tracked: 0,
            inliers: 0,
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

    /// A displacement was seen since the last one that was taken.
    pub fn learn(&mut self, displacement: &Displacement) {
        let moved = Moved {
            forward: displacement.forward,
            right: displacement.right,
            yaw_rad: displacement.yaw_rad,
        };
        if self.since_s > 0.0 {
            let share = (self.since_s / SMOOTH_S).min(1.0);
            for (smooth, way) in self.smooth.iter_mut().zip([moved.forward, moved.right]) {
                *smooth += share * (way / self.since_s - *smooth);
            }
            self.yaw_rate = moved.yaw_rad / self.since_s;
            // After numbers that are none it begins anew.
            if !(self.smooth[0].is_finite() && self.smooth[1].is_finite()) {
                self.smooth = [0.0; 2];
            }
            if !self.yaw_rate.is_finite() {
                self.yaw_rate = 0.0;
            }
        }
        self.seen = Some(moved);
    }

    /// Course over ground less heading, in radians.
    pub fn drift_rad(&self) -> f32 {
        let [forward, right] = self.smooth;
        heading_of(right, -forward)
    }

    /// How the vehicle moved since the last time: as it was seen to, or on as before.
    pub fn take(&mut self) -> Moved {
        let [forward, right] = self.smooth.map(|rate| rate * self.since_s);
        let yaw_rad = self.yaw_rate * self.since_s;
        self.since_s = 0.0;
        self.seen.take().unwrap_or(Moved {
            forward,
            right,
            yaw_rad,
        })
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
        reckoning.learn(&Displacement {
            forward: 0.04,
            right: -0.02,
            yaw_rad: 0.1,
            scale: 1.0,
            covariance: Covariance::zeros(),
            tracked: 20,
            inliers: 20,
        });
        assert_eq!(reckoning.take().forward, 0.04);
        reckoning.wait(0.3);
        assert!(!reckoning.is_overdue());
        reckoning.wait(0.2);
        assert!(reckoning.is_overdue());
        let moved = reckoning.take();
        for (found, expected) in [
            (moved.forward, 0.01),
            (moved.right, -0.005),
            (moved.yaw_rad, 0.025),
        ] {
            assert!((found - expected).abs() < 1e-6);
        }
        assert!(!reckoning.is_overdue());
    }
}
