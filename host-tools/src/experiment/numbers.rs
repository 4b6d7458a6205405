//! Numbers as files and pages show them.

use crate::evaluate::reliability::{MeanReliability, Measure};

/// Names of what [`seven`] gives, with units.
pub(crate) const SEVEN: [&str; 7] = [
    "orientation_from_deg",
    "orientation_to_deg",
    "altitude_from_ratio",
    "altitude_to_ratio",
    "gamma_from",
    "gamma_to",
    "catchment_percent",
];

/// Orientation, altitude and gamma from and to, and the catchment in percent of the map.
pub(crate) fn seven(mean: &MeanReliability) -> [Option<f64>; 7] {
    let limit = |measure: usize, side: usize| {
        let limits = mean.limits.get(&Measure::REPORT[measure]);
        limits.map(|limits| round(limits[side]))
    };
    [
        limit(0, 0),
        limit(0, 1),
        limit(1, 0),
        limit(1, 1),
        limit(2, 0),
        limit(2, 1),
        Some(round(100.0 * mean.catchment_share)),
    ]
}

/// To five significant digits: more than a picture shows.
pub(crate) fn round(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let digits = 4 - x.abs().log10().floor() as i32;
    let scale = 10.0_f64.powi(digits.abs());
    if digits < 0 {
        (x / scale).round() * scale
    } else {
        (x * scale).round() / scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_five_digits() {
        assert_eq!(round(123.456_78), 123.46);
        assert_eq!(round(-0.000_123_456_78), -0.000_123_46);
        assert_eq!(round(1_234_567.0), 1_234_600.0);
        assert_eq!(round(0.0), 0.0);
    }
}
