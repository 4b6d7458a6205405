//! Chance, by cause: every effect of a flight draws from a generator of its own, so that switching one off changes no
//! other.

mod cause;
mod walk;
mod wander;

use rand::Rng;

pub(crate) use cause::Cause;
pub use cause::flight_seed;
pub(crate) use walk::Walk;
pub(crate) use wander::Wander;

/// Nearly normal with unit variance: the sum of four bytes. Reaches 3.45 standard deviations, which noise of a sensor
/// hardly exceeds, and costs one random number.
#[inline]
pub(crate) fn gaussian(random: &mut impl Rng) -> f64 {
    // Each byte has the variance (256² − 1)/12; four of them a standard deviation of 147.8.
    let bytes = random.next_u32();
    let pairs = (bytes & 0x00ff_00ff) + (bytes >> 8 & 0x00ff_00ff);
    let sum = (pairs & 0xffff) + (pairs >> 16);
    (f64::from(sum) - 510.0) / 147.8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::seeded;

    #[test]
    fn noise_has_the_stated_deviation() {
        let mut random = seeded(3, 3);
        let n = 100_000;
        let squares: f64 = (0..n).map(|_| gaussian(&mut random).powi(2)).sum();
        assert!(
            (squares / f64::from(n) - 1.0).abs() < 0.02,
            "{}",
            squares / f64::from(n)
        );
    }
}
