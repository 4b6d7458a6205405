//! A value that is pushed about and returns: an Ornstein-Uhlenbeck process.
//!
//! Over a step of Δ seconds the value keeps the share e^(−Δ/T) and gains normal noise of such a deviation that the
//! stationary deviation is the stated one: the exact solution, whatever the step.

use rand_pcg::Pcg64;

use super::gaussian;

/// A value with mean zero that forgets where it was within a stated time.
#[derive(Clone, Debug)]
pub(crate) struct Wander {
    value: f64,
    kept: f64,
    kick: f64,
    random: Pcg64,
}

impl Wander {
    /// Of that standard deviation, forgetting within `time_s`, in steps of `step_s`; begins anywhere.
    pub(crate) fn new(deviation: f64, time_s: f64, step_s: f64, mut random: Pcg64) -> Self {
        let kept = (-step_s / time_s).exp();
        Self {
            value: deviation * gaussian(&mut random),
            kept,
            kick: deviation * (1.0 - kept * kept).sqrt(),
            random,
        }
    }

    /// Begins near a value instead, as far off as one unit of normal noise.
    pub(crate) fn start_near(&mut self, value: f64) {
        self.value = value + gaussian(&mut self.random);
    }

    /// Goes on by one step.
    pub(crate) fn step(&mut self) {
        self.value = self.kept * self.value + self.kick * gaussian(&mut self.random);
    }

    /// Where it is.
    pub(crate) fn value(&self) -> f64 {
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::seeded;

    #[test]
    fn it_has_the_stated_deviation_and_memory() {
        // 4,000 times its memory: the deviation of the estimate is about 2 %.
        let mut wander = Wander::new(3.0, 0.5, 0.01, seeded(5, 1));
        let values: Vec<f64> = (0..200_000)
            .map(|_| {
                wander.step();
                wander.value()
            })
            .collect();
        let mean_product = |lag: usize| {
            let pairs = values.iter().zip(&values[lag..]);
            pairs.map(|(a, b)| a * b).sum::<f64>() / (values.len() - lag) as f64
        };
        let variance = mean_product(0);
        assert!((variance / 9.0 - 1.0).abs() < 0.1, "{variance}");
        let after_its_time = mean_product(50) / variance;
        assert!((after_its_time - (-1.0_f64).exp()).abs() < 0.06);
    }
}
