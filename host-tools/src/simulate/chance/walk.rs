//! A slow, smooth walk between two bounds, everywhere about equally often.
//!
//! A normal process of unit variance, smoothed so that it has a rate, is bent through the logistic curve that is
//! nearest to the normal distribution function, σ(1.702·y): the result is nearly uniform between the bounds, at the
//! start as at any later time.
//!
//! With x an Ornstein-Uhlenbeck process of time T and variance 2, and y following it, y′ = (x − y)/T, the variance of y
//! is 1 and so is its covariance with x; x = y + n, with n normal and independent of y, starts both.

use rand_pcg::Pcg64;

use super::{Wander, gaussian};

/// The logistic curve's steepness that comes nearest to the normal distribution function.
const STEEPNESS: f64 = 1.702;

/// A value between two bounds.
#[derive(Clone, Debug)]
pub(crate) struct Walk {
    low: f64,
    high: f64,
    time_s: f64,
    step_s: f64,
    ahead: Wander,
    value: f64,
}

impl Walk {
    /// Between `low` and `high`, forgetting where it was within some `time_s`, in steps of `step_s`; begins anywhere.
    pub(crate) fn new([low, high]: [f64; 2], time_s: f64, step_s: f64, mut random: Pcg64) -> Self {
        let value = gaussian(&mut random);
        let mut ahead = Wander::new(2.0_f64.sqrt(), time_s, step_s, random);
        ahead.start_near(value);
        Self {
            low,
            high,
            time_s,
            step_s,
            ahead,
            value,
        }
    }

    /// Goes on by one step.
    pub(crate) fn step(&mut self) {
        self.value += (self.ahead.value() - self.value) * (self.step_s / self.time_s).min(1.0);
        self.ahead.step();
    }

    /// Where it is.
    pub(crate) fn value(&self) -> f64 {
        self.low + (self.high - self.low) * self.share()
    }

    /// How fast it goes, per second.
    pub(crate) fn rate(&self) -> f64 {
        let share = self.share();
        let slope = STEEPNESS * share * (1.0 - share);
        (self.high - self.low) * slope * (self.ahead.value() - self.value) / self.time_s
    }

    fn share(&self) -> f64 {
        1.0 / (1.0 + (-STEEPNESS * self.value).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::seeded;

    #[test]
    fn it_begins_anywhere_between_the_bounds_and_stays_there() {
        let mut starts = [0_u32; 4];
        let mut later = [0_u32; 4];
        for seed in 0..4_000 {
            let mut walk = Walk::new([2.0, 6.0], 1.0, 0.1, seeded(seed, 1));
            starts[(walk.value() - 2.0) as usize] += 1;
            (0..30).for_each(|_| walk.step());
            later[(walk.value() - 2.0) as usize] += 1;
        }
        // A quarter each; the deviation of a count of 1,000 in 4,000 is 27.
        for quarter in starts.into_iter().chain(later) {
            assert!(quarter.abs_diff(1_000) < 120, "{starts:?} {later:?}");
        }
    }

    #[test]
    fn its_rate_is_the_slope_of_its_value() {
        let mut walk = Walk::new([-1.0, 1.0], 5.0, 0.01, seeded(9, 1));
        for _ in 0..1_000 {
            let (before, rate) = (walk.value(), walk.rate());
            walk.step();
            let slope = (walk.value() - before) / 0.01;
            assert!((slope - rate).abs() < 1e-3, "{slope} {rate}");
        }
    }
}
