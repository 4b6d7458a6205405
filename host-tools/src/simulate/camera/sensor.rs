//! What a sensor makes of light.

use rand::Rng;

/// What the sensor makes of a level.
#[inline]
pub(super) fn exposed(level: u8, levels: &[f64], noise: f64, random: &mut impl Rng) -> u8 {
    let level = levels[usize::from(level)];
    let level = if noise > 0.0 {
        level + noise * gaussian(random)
    } else {
        level
    };
    (level + 0.5).clamp(0.0, 255.0) as u8 // truncates
}

pub(super) fn gamma_table(gamma: f64) -> Vec<f64> {
    (0..=255)
        .map(|level| 255.0 * (f64::from(level) / 255.0).powf(gamma))
        .collect()
}

/// What every level becomes without noise.
pub(crate) fn gamma_levels(gamma: f64) -> Vec<u8> {
    let levels = gamma_table(gamma);
    levels.iter().map(|level| (level + 0.5) as u8).collect() // truncates
}

/// Nearly normal with unit variance: the sum of four bytes. Reaches 3.45 standard deviations, which noise of a sensor
/// hardly exceeds, and costs one random number.
#[inline]
fn gaussian(random: &mut impl Rng) -> f64 {
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
