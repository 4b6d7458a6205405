//! Windows of a level at positions between pixels, and how one has to move to look like another.
//!
//! **Notation.** A window has 12×12 samples one pixel apart; its position is that of its middle, in pixels from the
//! level's top-left corner, rounded to 1/32. T are the samples of the window that is looked for, the *template*, g
//! their central differences; I those where it is looked for. Samples have three fraction bits.
//!
//! **Method.** With I(p) ≈ a·T(p + d) + b, the shift d solves Σ g′·g′ᵀ·d/2 = Σ g′·(I − T), where g′ is what of g is
//! orthogonal to 1 and to T: brightness b and contrast a drop out exactly, and need not be estimated. This is inverse
//! compositional tracking (Baker and Matthews 2004) with the appearance projected out (Hager and Belhumeur 1998). The
//! matrix belongs to the template: it is inverted once, and an iteration is a pass over 144 samples. g′ itself is
//! never stored: the sums of g, 1 and T times I − T, all exact integers, are combined afterwards.

mod packed;
#[cfg(test)]
mod reference;

use nalgebra::{Matrix2, Vector2};

use super::level::Level;

use packed::{compare, prepare};

/// Samples of a window per direction.
pub const SIDE: usize = 12;

/// Samples of a window.
pub const SAMPLES: usize = SIDE * SIDE;

/// Samples of a window that are unpacked together, per row.
const GROUPS: usize = SIDE / 4;

/// Words of two samples in a row, and in a window.
const ROW: usize = SIDE / 2;
const WORDS: usize = SAMPLES / 2;

/// Fraction bits of positions.
const FRACTION: u32 = 5;

/// Fraction bits of samples.
const SAMPLE_FRACTION: u32 = 3;

/// The smaller eigenvalue of what is inverted: a mean squared slope in gray levels per pixel.
const MIN_SLOPE: f32 = 0.5;

/// Largest position that is sampled, in pixels; what is beyond, or not a number, is nowhere.
const MAX_POSITION_PX: f32 = 1024.0;

/// Samples of a template and their central differences, row by row, and their sums. A word holds two samples: of every
/// four, 0 and 2, then 1 and 3.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    pub levels: [u32; WORDS],
    pub across: [u32; WORDS],
    pub down: [u32; WORDS],
    pub sums: Sums,
}

/// Sums over a template: of samples t and differences x, y, and of their products. All fit: 144·2040² < 2³¹.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sums {
    pub t: i32,
    pub x: i32,
    pub y: i32,
    pub tt: i32,
    pub xt: i32,
    pub yt: i32,
    pub xx: i32,
    pub xy: i32,
    pub yy: i32,
}

/// Sums of the error e = I − T of a window: itself, squared, and times the template's samples and differences.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Errors {
    pub e: i32,
    pub ee: i32,
    pub et: i32,
    pub ex: i32,
    pub ey: i32,
}

/// A window that is looked for.
#[derive(Clone, Debug)]
pub struct Template {
    samples: Samples,
    /// Where it is, as sampled, minus where it was asked for.
    rounding_px: [f32; 2],
    /// What of the differences goes along with the samples.
    along: Vector2<f32>,
    /// From Σ g′·e to a shift.
    solve: Matrix2<f32>,
    variance: f32,
}

/// A window compared with a template.
#[derive(Clone, Copy, Debug)]
pub struct Match {
    /// Where the window looks like the template's, in pixels.
    pub at_px: [f32; 2],
    /// How far that is from where it was compared, squared.
    pub step_squared: f32,
    /// The correlation of both where they were compared, −1 to 1.
    pub correlation: f32,
}

impl Template {
    /// The window at a position; `None` when it does not lie in the level, or has no texture in both directions.
    pub fn new(level: &Level<'_>, at_px: [f32; 2]) -> Option<Self> {
        let (first, rounding_px) = first_sample(at_px)?;
        let samples = prepare(level, first)?;
        let s = samples.sums;
        let variance = covariance(s.tt, s.t, s.t);
        let along = Vector2::new(covariance(s.xt, s.x, s.t), covariance(s.yt, s.y, s.t));
        let along = along / variance.max(1.0);
        let xx = covariance(s.xx, s.x, s.x) - along.x * along.x * variance;
        let xy = covariance(s.xy, s.x, s.y) - along.x * along.y * variance;
        let yy = covariance(s.yy, s.y, s.y) - along.y * along.y * variance;
        // The smaller eigenvalue is above a limit when the matrix minus the limit is positive definite.
        let unit = (4 << (2 * SAMPLE_FRACTION)) as f32;
        let limit = MIN_SLOPE * unit * SAMPLES as f32;
        let (x, y) = (xx - limit, yy - limit);
        if x <= 0.0 || y <= 0.0 || x * y <= xy * xy {
            return None;
        }
        let scale = 2.0 / (xx * yy - xy * xy);
        Some(Self {
            samples,
            rounding_px,
            along,
            solve: Matrix2::new(yy * scale, -xy * scale, -xy * scale, xx * scale),
            variance,
        })
    }

    /// Compares with the window at a position; `None` when that does not lie in the level.
    pub fn compare(&self, level: &Level<'_>, at_px: [f32; 2]) -> Option<Match> {
        let (first, rounding_px) = first_sample(at_px)?;
        let errors = compare(&self.samples, level, first)?;
        let s = self.samples.sums;
        let et = covariance(errors.et, errors.e, s.t);
        let ee = covariance(errors.ee, errors.e, errors.e);
        let (ex, ey) = (
            covariance(errors.ex, errors.e, s.x),
            covariance(errors.ey, errors.e, s.y),
        );
        let step = self.solve * (Vector2::new(ex, ey) - self.along * et);
        // Both windows lie a little beside where they were asked for.
        let of = |axis: usize, step: f32| {
            at_px[axis] + rounding_px[axis] - self.rounding_px[axis] - step
        };
        let both = self.variance * (self.variance + 2.0 * et + ee);
        Some(Match {
            at_px: [of(0, step.x), of(1, step.y)],
            step_squared: step.dot(&step),
            correlation: if both > 0.0 {
                (self.variance + et) / crate::math::sqrt(both)
            } else {
                0.0
            },
        })
    }
}

/// Σ ab − Σ a·Σ b/n, exact until it is rounded once.
fn covariance(ab: i32, a: i32, b: i32) -> f32 {
    let n = SAMPLES as i64;
    (n * i64::from(ab) - i64::from(a) * i64::from(b)) as f32 / SAMPLES as f32
}

/// Where the first sample of the window at a position lies, counted from the middle of the level's first pixel in
/// units of 1/32 pixel, and how far rounding moved it.
fn first_sample(at_px: [f32; 2]) -> Option<([i32; 2], [f32; 2])> {
    const ONE: f32 = (1 << FRACTION) as f32;
    if !at_px.iter().all(|at| (0.0..MAX_POSITION_PX).contains(at)) {
        return None;
    }
    let rounded = at_px.map(|at| (at * ONE + 0.5) as i32);
    let moved = [0, 1].map(|axis| rounded[axis] as f32 / ONE - at_px[axis]);
    Some((
        rounded.map(|at| at - (SIDE as i32 / 2 * (1 << FRACTION))),
        moved,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        #[test]
        fn packed_sums_match_reference(
            side in 14_u16..40, pad in 0_usize..5, seed in any::<u32>(),
            at in prop::array::uniform2(-40_i32..40 * 32), moved in prop::array::uniform2(-40_i32..40),
            is_extreme in any::<bool>(),
        ) {
            let stride = usize::from(side) + pad;
            let mut state = seed;
            let pixels: Vec<u8> = (0..stride * usize::from(side))
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    let level = (state >> 24) as u8;
                    if is_extreme { (level & 1) * 255 } else { level }
                })
                .collect();
            let level = Level { pixels: &pixels, stride, side };
            let samples = prepare(&level, at);
            prop_assert_eq!(&samples, &reference::prepare(&level, at));
            if let Some(samples) = samples {
                let at = [at[0] + moved[0], at[1] + moved[1]];
                prop_assert_eq!(
                    compare(&samples, &level, at),
                    reference::compare(&samples, &level, at)
                );
            }
        }
    }
}
