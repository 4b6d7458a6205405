//! What a sensor makes of light.

use rand::Rng;

use crate::simulate::chance::gaussian;

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

/// What every level becomes without noise, unrounded.
pub(crate) fn gamma_table(gamma: f64) -> Vec<f64> {
    (0..=255)
        .map(|level| 255.0 * (f64::from(level) / 255.0).powf(gamma))
        .collect()
}

/// The same, rounded.
pub(crate) fn gamma_levels(gamma: f64) -> Vec<u8> {
    let levels = gamma_table(gamma);
    levels.iter().map(|level| (level + 0.5) as u8).collect() // truncates
}
