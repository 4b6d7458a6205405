//! Rounding and roots whose results have the same bits on every machine.
//!
//! `core` has no `f32::sqrt` or `f32::round`, and a platform's own may differ in the last bit. The root comes from
//! `libm` (correctly rounded); rounding is written out here because it also has to saturate.

/// Square root, correctly rounded. Negative input gives NaN, as in IEEE 754.
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// The angle of the vector (`along`, `across`) with the first axis, in radians in 0..=π for `across` ≥ 0.
#[must_use]
pub fn angle(across: f32, along: f32) -> f32 {
    libm::atan2f(across, along)
}

/// The heading of a way on the map: `right` and `down` in map axes, radians clockwise from map-up, in −π..=π; 0 for no
/// way at all.
///
/// ```
/// use eigenmark_core::math::heading_of;
/// assert_eq!(heading_of(0.0, -3.0), 0.0);
/// assert!((heading_of(2.0, 0.0) - core::f32::consts::FRAC_PI_2).abs() < 1e-6);
/// ```
#[must_use]
pub fn heading_of(right: f32, down: f32) -> f32 {
    if right == 0.0 && down == 0.0 {
        return 0.0;
    }
    libm::atan2f(right, -down)
}

/// An angle in −π..=π that is a whole number of turns away; 0 for what is not finite.
#[must_use]
pub fn wrapped(angle_rad: f32) -> f32 {
    let turns = angle_rad / core::f32::consts::TAU;
    let rest = angle_rad - libm::roundf(turns) * core::f32::consts::TAU;
    if rest.is_finite() { rest } else { 0.0 }
}

/// The whole number nearest to `x` (halves away from zero), clamped to `-limit..=limit`, and whether it was clamped.
/// NaN gives 0. The limit is not negative.
///
/// ```
/// use eigenmark_core::math::round_clamped;
/// assert_eq!(round_clamped(-2.5, 100), (-3, false));
/// assert_eq!(round_clamped(123.4, 100), (100, true));
/// ```
#[must_use]
#[inline]
pub fn round_clamped(x: f32, limit: i16) -> (i16, bool) {
    // `as` truncates towards zero, saturates, and maps NaN to 0.
    let whole = (x + 0.5_f32.copysign(x)) as i32;
    // Unlike `clamp` this does not panic.
    let clamped = whole.max(-i32::from(limit)).min(limit.into());
    (clamped as i16, clamped != whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_round_away_from_zero() {
        assert_eq!(round_clamped(0.5, 9), (1, false));
        assert_eq!(round_clamped(-0.5, 9), (-1, false));
        assert_eq!(round_clamped(0.49, 9), (0, false));
    }

    #[test]
    fn values_that_do_not_fit_are_clamped_and_reported() {
        assert_eq!(round_clamped(9.4, 9), (9, false));
        assert_eq!(round_clamped(9.5, 9), (9, true));
        assert_eq!(round_clamped(f32::NEG_INFINITY, 9), (-9, true));
        assert_eq!(round_clamped(f32::NAN, 9), (0, false));
    }

    #[test]
    fn roots_are_correctly_rounded() {
        for x in [0.0_f32, 1.0, 2.0, 3.0, 1e-20, 65_025.0, 1.0e11] {
            assert_eq!(sqrt(x).to_bits(), x.sqrt().to_bits());
        }
    }
}
