//! Sines and cosines in single precision throughout.
//!
//! **What and why.** A Cortex-M4F has no double precision, which `libm` reduces angles in: that takes 7 KiB of flash.
//!
//! **Method.** Whole quarters of a turn are taken off in three parts that leave the products exact; polynomials do the
//! rest (both as in Cephes' `sinf.c`, Moshier 1989, there for eighths).
//!
//! **Cost.** 260 bytes of flash.
//!
//! **Limits.** Angles beyond [`MAX_ANGLE_RAD`] are none.

use core::f32::consts::FRAC_2_PI;

/// Angles beyond it, to either side, have neither sine nor cosine here: there single precision knows them to 2⁻¹¹ only.
pub const MAX_ANGLE_RAD: f32 = 8192.0;

/// π/2 in parts; the first two have so few bits that they stay exact times a count of quarters.
const QUARTER: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];

/// Sine and cosine of an angle in radians, off by at most 1.3·10⁻⁷ up to ±2π and by 5·10⁻⁷ up to ±8192; beyond that,
/// both are NaN.
///
/// ```
/// use eigenmark_core::math::sin_cos;
/// assert_eq!(sin_cos(0.0), (0.0, 1.0));
/// let (sin, cos) = sin_cos(core::f32::consts::FRAC_PI_6);
/// assert!((sin - 0.5).abs() < 1e-7 && (cos - 0.866_025_4).abs() < 1e-7);
/// ```
#[must_use]
#[inline(never)] // once in flash
pub fn sin_cos(angle_rad: f32) -> (f32, f32) {
    let is_angle = angle_rad.abs() <= MAX_ANGLE_RAD;
    if !is_angle {
        return (f32::NAN, f32::NAN);
    }
    let turns = angle_rad * FRAC_2_PI;
    let quarters = (turns + 0.5_f32.copysign(turns)) as i32;
    let rest = QUARTER
        .iter()
        .fold(angle_rad, |rest, part| rest - quarters as f32 * part);
    let square = rest * rest;
    let sin = ((-1.951_529_6e-4 * square + 8.332_161e-3) * square - 0.166_666_55) * square * rest;
    let cos = ((2.443_315_7e-5 * square - 1.388_731_6e-3) * square + 4.166_664_6e-2) * square;
    let (sin, cos) = (sin + rest, (cos - 0.5) * square + 1.0);
    match quarters & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Tangent of an angle in radians: the quotient of its sine and cosine, and NaN where they are.
#[must_use]
pub fn tan(angle_rad: f32) -> f32 {
    let (sin, cos) = sin_cos(angle_rad);
    sin / cos
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the documentation says.
    const NEAR: f64 = 1.3e-7;
    const FAR: f64 = 5e-7;

    #[test]
    fn sines_and_cosines_are_as_exact_as_stated() {
        let (mut near, mut far) = (0.0_f64, 0.0_f64);
        for step in -800_000..=800_000 {
            let angle = step as f32 * (core::f32::consts::TAU / 800_000.0);
            for (angle, worst) in [(angle, &mut near), (angle * 1303.7, &mut far)] {
                let (sin, cos) = sin_cos(angle);
                let (exact_sin, exact_cos) = f64::from(angle).sin_cos();
                let error = (f64::from(sin) - exact_sin).abs();
                *worst = worst.max(error.max((f64::from(cos) - exact_cos).abs()));
            }
        }
        assert!(near <= NEAR && far <= FAR, "{near} {far}");
    }

    #[test]
    fn what_is_no_angle_has_neither() {
        for none in [f32::NAN, f32::INFINITY, -MAX_ANGLE_RAD.next_up(), f32::MAX] {
            let (sin, cos) = sin_cos(none);
            assert!(sin.is_nan() && cos.is_nan() && tan(none).is_nan());
        }
        assert!(tan(-MAX_ANGLE_RAD).is_finite());
    }

    #[test]
    fn tangents_are_quotients() {
        for (angle, expected) in [(0.0_f32, 0.0), (0.5, 0.546_302_5), (-1.2, -2.572_151_6)] {
            assert!((tan(angle) - expected).abs() < 5e-7);
        }
    }
}
