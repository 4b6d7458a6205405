//! Rounding, roots and angles whose results have the same bits on every machine.
//!
//! `core` has no `f32::sqrt` or `f32::round`, and a platform's own may differ in the last bit. The root is
//! correctly rounded, by `libm` or by the core's own instruction; rounding is written out here because it also has to saturate.

mod trigonometry;

use core::f32::consts::TAU;

use crate::kernel;

pub use trigonometry::{MAX_ANGLE_RAD, sin_cos, tan};

/// Square root, correctly rounded. Negative input gives NaN, as in IEEE 754.
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    kernel::square_root(x)
}

/// The angle of the vector (`along`, `across`) with the first axis, in radians in 0..=π for `across` ≥ 0.
#[must_use]
#[inline(never)] // once in flash
pub fn angle(across: f32, along: f32) -> f32 {
    libm::atan2f(across, along)
}

/// The angle from `from` to `to` the shorter way round, in radians: −π to π, but for rounding. What is more than
/// 2³¹ turns, or no number, gives no angle in that range.
///
/// ```
/// use eigenmark_core::math::turn;
/// assert!((turn(0.5, 6.5) - (6.0 - core::f32::consts::TAU)).abs() < 1e-6);
/// ```
#[must_use]
#[inline(never)] // once in flash
pub fn turn(from: f32, to: f32) -> f32 {
    let angle = to - from;
    let turns = angle / TAU;
    // `as` truncates towards zero and saturates.
    angle - TAU * (turns + 0.5_f32.copysign(turns)) as i32 as f32
}

/// The same direction as `angle`, in radians: 0 to below 2π; what [`turn`] has no angle for
/// has none here.
///
/// ```
/// use eigenmark_core::math::whole_turn;
/// assert_eq!(whole_turn(-0.25), core::f32::consts::TAU - 0.25);
/// assert_eq!(whole_turn(-1e-9), 0.0);
/// ```
#[must_use]
#[inline(never)] // once in flash
pub fn whole_turn(angle: f32) -> f32 {
    let angle = turn(0.0, angle);
    let positive = if angle < 0.0 { angle + TAU } else { angle };
    if positive == TAU { 0.0 } else { positive }
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
#[inline(never)] // once in flash
pub fn heading_of(right: f32, down: f32) -> f32 {
    if right == 0.0 && down == 0.0 {
        return 0.0;
    }
    libm::atan2f(right, -down)
}

/// What [`turn`] gives beyond this is no angle: π, and room for rounding.
pub(crate) const MAX_TURN_RAD: f32 = 4.0;

/// The same direction as `angle_rad`, in radians: −π to π; 0 for what [`turn`] has no angle for.
#[must_use]
#[inline(never)] // once in flash
pub fn wrapped(angle_rad: f32) -> f32 {
    let angle = turn(0.0, angle_rad);
    if angle.abs() < MAX_TURN_RAD {
        angle
    } else {
        0.0
    }
}

/// The smaller of two numbers, and the limit for NaN. `f32::min` is a call on a Cortex-M4F; this is for hot loops.
///
/// ```
/// use eigenmark_core::math::at_most;
/// assert_eq!([1.0, 3.0, f32::NAN].map(|x| at_most(x, 2.0)), [1.0, 2.0, 2.0]);
/// ```
#[must_use]
#[inline]
pub fn at_most(x: f32, limit: f32) -> f32 {
    if x < limit { x } else { limit }
}

/// The larger of two numbers, and the limit for NaN, as [`at_most`].
///
/// ```
/// use eigenmark_core::math::at_least;
/// assert_eq!([1.0, 3.0, f32::NAN].map(|x| at_least(x, 2.0)), [2.0, 3.0, 2.0]);
/// ```
#[must_use]
#[inline]
pub fn at_least(x: f32, limit: f32) -> f32 {
    if x > limit { x } else { limit }
}

/// eˣ for x ≤ 0, and 1 above; 0 below −87. Off by at most 2·10⁻⁴ of it.
///
/// ```
/// use eigenmark_core::math::exp_of_negative;
/// assert_eq!([0.0, 3.0, -100.0, f32::NAN].map(exp_of_negative), [1.0, 1.0, 0.0, 0.0]);
/// assert!((exp_of_negative(-1.0) - 0.36788).abs() < 1e-4);
/// ```
#[must_use]
#[inline]
pub fn exp_of_negative(x: f32) -> f32 {
    // 2ⁿ·2ᶠ with a whole n ≤ 0 and 0 ≤ f < 1; 2ᶠ by the cubic that is exact at both ends and off equally little
    // between them.
    if x.is_nan() || x <= -87.0 {
        return 0.0;
    }
    let power = at_most(x, 0.0) * core::f32::consts::LOG2_E;
    let whole = power as i32 - i32::from(power < 0.0);
    let part = power - whole as f32;
    let cubic = 1.0 + part * (0.695_976 + part * (0.224_94 + part * 0.079_084));
    cubic * f32::from_bits(((whole + 127) as u32) << 23)
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
    fn exponentials_are_as_exact_as_stated() {
        for step in 0..80_000 {
            let x = -f32::from(step as u16) / 1000.0 - f32::from((step >> 16) as u16);
            let (found, exact) = (f64::from(exp_of_negative(x)), f64::from(x).exp());
            assert!((found / exact - 1.0).abs() < 2e-4, "{x}: {found} {exact}");
        }
    }

    #[test]
    fn angles_are_wrapped_into_half_a_turn() {
        use core::f32::consts::PI;
        for (angle, expected) in [(0.5, 0.5), (4.0, 4.0 - 2.0 * PI), (-7.0, 2.0 * PI - 7.0)] {
            assert!((wrapped(angle) - expected).abs() < 1e-6);
        }
        assert_eq!(wrapped(f32::INFINITY), 0.0);
        assert_eq!(wrapped(f32::NAN), 0.0);
    }

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
    fn turns_are_the_shorter_way_round() {
        for degrees in -720..=720_i16 {
            for from in [-300.0_f32, 0.0, 45.0, 359.0] {
                let to = from + f32::from(degrees);
                let found = turn(from.to_radians(), to.to_radians()).to_degrees();
                let expected = f32::from((degrees + 900).rem_euclid(360) - 180);
                // Half a turn goes either way.
                let error = (found - expected).abs();
                assert!(
                    error < 1e-3 || (error - 360.0).abs() < 1e-3,
                    "{from} {degrees} {found}"
                );
                let whole = whole_turn(f32::from(degrees).to_radians());
                assert!((0.0..TAU).contains(&whole));
                let expected = f32::from(degrees.rem_euclid(360)).to_radians();
                assert!(turn(whole, expected).abs() < 1e-4);
            }
        }
        for none in [f32::NAN, f32::INFINITY, -1e20] {
            assert!(
                !(-4.0..=4.0).contains(&turn(0.0, none)) && !(0.0..TAU).contains(&whole_turn(none))
            );
        }
    }

    #[test]
    fn roots_are_correctly_rounded() {
        for x in [0.0_f32, 1.0, 2.0, 3.0, 1e-20, 65_025.0, 1.0e11] {
            assert_eq!(sqrt(x).to_bits(), x.sqrt().to_bits());
        }
    }
}
