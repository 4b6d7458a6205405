//! How a vehicle goes on that nobody sees move.

use crate::track::Displacement;

/// Without frames, the belief is moved after this time, in seconds.
const OVERDUE_S: f32 = 0.5;

/// The speed of the last displacement, and the time since.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DeadReckoning {
    /// Forward, right (sides per second) and turn (radians per second).
    rates: [f32; 3],
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
            let rates = [moved.forward, moved.right, moved.yaw_rad].map(|way| way / self.since_s);
            if rates.iter().all(|rate| rate.is_finite()) {
                self.rates = rates;
            }
        }
        self.seen = Some(moved);
    }

    /// How the vehicle moved since the last time: as it was seen to, or on as before.
    pub fn take(&mut self) -> Moved {
        let [forward, right, yaw_rad] = self.rates.map(|rate| rate * self.since_s);
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
    use crate::track::Covariance;

    #[test]
    fn what_is_not_seen_goes_on_at_the_same_rate() {
        let mut reckoning = DeadReckoning::default();
        reckoning.wait(0.1);
        reckoning.wait(0.1);
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
            (moved.forward, 0.1),
            (moved.right, -0.05),
            (moved.yaw_rad, 0.25),
        ] {
            assert!((found - expected).abs() < 1e-6);
        }
        assert!(!reckoning.is_overdue());
    }
}
