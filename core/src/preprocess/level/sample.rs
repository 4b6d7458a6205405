//! The mean level of a patch of the frame.

use core::num::NonZeroU32;

use super::homography::{FRACTION, ONE, Patch};
use crate::frame::Frame;

/// Bits of a bilinear weight in one direction.
const WEIGHT: u32 = 5;

/// Bits of a packed coordinate.
const PACKED: u32 = 16;

/// Distance between samples in frame pixels, at most.
const SPACING: f32 = 1.6;

/// The same for view pixels whose middle lies beyond the frame's border.
const GUESS_SPACING: f32 = 2.0 * SPACING;

/// Samples per view pixel and direction, at most.
const MAX_SAMPLES: u32 = 128;

/// Samples per view pixel and direction whose positions are packed, at most.
const MAX_PACKED: u32 = 19;

/// Sides of a view pixel in the frame, in pixels: larger ones are not followed. A camera that looks straight down
/// stays below (4096/2)/¼.
const MAX_SIDE_PX: f32 = 16_384.0;

// White samples, and half a unit for rounding, fit into the sum of a view pixel.
const _: () = assert!(
    ((MAX_SAMPLES * MAX_SAMPLES) as u64) << (2 * WEIGHT) <= u32::MAX as u64 * 2 / (2 * 255 + 1)
);
// A patch of n samples per direction extends over 2·n·SPACING at most in x or y (its squared sides add up to
// 2·(n·SPACING)²); with a pixel more for where its corner lies, packed coordinates fit.
const _: () = assert!(2.0 * SPACING * MAX_PACKED as f32 + 1.0 < (1 << (PACKED - FRACTION)) as f32);

/// The frame, how densely it is sampled, and how many patches it showed.
pub struct Sampler<'a> {
    pixels: &'a [u8],
    stride: usize,
    /// Just before the middle of the last pixel.
    last: [i32; 2],
    density: Density,
    guess: Density,
    /// Patches whose middle lay in the frame.
    seen: u16,
}

impl<'a> Sampler<'a> {
    pub fn new(frame: &Frame<'a>) -> Self {
        let last = |side: u16| (i32::from(side - 1) << FRACTION) - 1;
        Self {
            pixels: frame.pixels(),
            stride: frame.stride(),
            last: [last(frame.width()), last(frame.height())],
            density: Density::new(SPACING),
            guess: Density::new(GUESS_SPACING),
            seen: 0,
        }
    }

    /// Patches so far whose middle lay in the frame.
    pub fn seen(&self) -> u16 {
        self.seen
    }

    /// The level of a patch; that of the one `before` it when it cannot be followed.
    #[inline(always)]
    pub fn level(&mut self, patch: &Patch, before: u8) -> u8 {
        let low = [0, 1].map(|axis| (patch.middle[axis] - patch.reach(axis)) as i32);
        let high = [0, 1].map(|axis| (patch.middle[axis] + patch.reach(axis)) as i32);
        let is_inside =
            (low[0] | low[1]) >= 0 && high[0] <= self.last[0] && high[1] <= self.last[1];
        if is_inside
            && let Some(raster) = self.density.raster(patch)
            && raster.count <= MAX_PACKED
        {
            self.seen += 1;
            let corner = low.map(|at| at >> FRACTION);
            let sum = sum_packed(self.pixels, self.stride, corner, &raster);
            return self.density.mean(sum);
        }
        self.level_at_border(*patch, before)
    }

    /// The same, wherever the patch lies.
    #[cold]
    #[inline(never)]
    fn level_at_border(&mut self, patch: Patch, before: u8) -> u8 {
        let is_in = |axis: usize| {
            let at = patch.middle[axis] + ONE / 2.0; // from the border
            at >= 0.0 && at < (self.last[axis] + 1) as f32 + ONE
        };
        let is_seen = is_in(0) && is_in(1);
        let density = if is_seen {
            &mut self.density
        } else {
            &mut self.guess
        };
        let Some(raster) = density.raster(&patch) else {
            return before;
        };
        self.seen += u16::from(is_seen);
        density.mean(sum_clamped(self.pixels, self.stride, self.last, &raster))
    }
}

/// The samples of a patch: `count`² of them. Positions and steps are [x, y] in units of 1/[`ONE`] pixel.
struct Raster {
    first: [i32; 2],
    right: [i32; 2],
    down: [i32; 2],
    count: u32,
}

/// How many samples a patch takes in each direction: as few as the spacing allows, by the root mean square of its
/// sides. Neighbours mostly take as many, so the last answer is kept.
struct Density {
    spacing: f32,
    count: u32,
    /// One over the count.
    share: f32,
    /// From the first sample to the middle, as a share of the patch.
    half: f32,
    /// The weights of all samples.
    weight: NonZeroU32,
    /// The sums of squared sides that take so many samples: above the first, up to the second.
    squares: [f32; 2],
}

impl Density {
    fn new(spacing: f32) -> Self {
        Self {
            spacing: spacing * ONE,
            count: 0,
            share: 0.0,
            half: 0.0,
            weight: NonZeroU32::MIN,
            squares: [0.0, 0.0],
        }
    }

    /// The samples of a patch; `None` when it is a point or too large to be followed.
    #[inline(always)]
    fn raster(&mut self, patch: &Patch) -> Option<Raster> {
        let squares = patch.squares();
        let is_as_before = squares > self.squares[0] && squares <= self.squares[1];
        if !is_as_before && !self.search(squares) {
            return None;
        }
        let first = |axis: usize| {
            (patch.middle[axis] - (patch.right[axis] + patch.down[axis]) * self.half) as i32
        };
        let step = |size: f32| (size * self.share) as i32;
        Some(Raster {
            first: [first(0), first(1)],
            right: patch.right.map(step),
            down: patch.down.map(step),
            count: self.count,
        })
    }

    #[cold]
    #[inline(never)]
    fn search(&mut self, squares: f32) -> bool {
        let largest = 2.0 * (MAX_SIDE_PX * ONE) * (MAX_SIDE_PX * ONE);
        if !(squares > 0.0 && squares < largest) {
            return false; // or not a number
        }
        let of = |count: u32| {
            let side = count as f32 * self.spacing;
            2.0 * side * side
        };
        self.count = (1..MAX_SAMPLES)
            .find(|&count| squares <= of(count))
            .unwrap_or(MAX_SAMPLES);
        self.share = 1.0 / self.count as f32;
        self.half = (1.0 - self.share) / 2.0;
        self.weight =
            NonZeroU32::new((self.count * self.count) << (2 * WEIGHT)).unwrap_or(NonZeroU32::MIN);
        self.squares = [of(self.count - 1), of(self.count)];
        true
    }

    /// The mean of a raster's samples from their sum, rounded half up.
    fn mean(&self, sum: u32) -> u8 {
        ((sum + self.weight.get() / 2) / self.weight) as u8
    }
}

/// The sum of a raster's samples, 2¹⁰ times their levels. The pixel `corner` is left of and above all of them; x and
/// y from there are the halves of one word, and move together.
fn sum_packed(pixels: &[u8], stride: usize, corner: [i32; 2], raster: &Raster) -> u32 {
    let start = corner[1] as usize * stride + corner[0] as usize;
    let Some(pixels) = pixels.get(start..) else {
        return 0;
    };
    let pack = |[x, y]: [i32; 2]| ((y << PACKED) + x) as u32;
    let [x, y] = raster.first;
    let first = pack([x - (corner[0] << FRACTION), y - (corner[1] << FRACTION)]);
    let steps = [pack(raster.right), pack(raster.down)];
    sum_words(pixels, stride, first, steps, raster.count)
}

#[inline(never)] // with registers of its own
fn sum_words(pixels: &[u8], stride: usize, first: u32, [right, down]: [u32; 2], count: u32) -> u32 {
    let Some(taps) = Taps::new(pixels, stride) else {
        return 0;
    };
    let mut left = first;
    let mut sum = 0;
    for _ in 0..count {
        let mut at = left;
        for _ in 0..count {
            let x = at & ((1 << PACKED) - 1);
            let y = at >> PACKED;
            let Some(level) = taps.bilinear(x, y) else {
                return sum;
            };
            sum += level;
            at = at.wrapping_add(right);
        }
        left = left.wrapping_add(down);
    }
    sum
}

/// The sum of a raster's samples, 2¹⁰ times their levels; positions beyond the border are moved there.
#[inline(never)]
fn sum_clamped(pixels: &[u8], stride: usize, last: [i32; 2], raster: &Raster) -> u32 {
    let Some(taps) = Taps::new(pixels, stride) else {
        return 0;
    };
    let [mut left, mut top] = raster.first;
    let mut sum = 0;
    for _ in 0..raster.count {
        let (mut x, mut y) = (left, top);
        for _ in 0..raster.count {
            let (column, row) = (x.min(last[0]).max(0), y.min(last[1]).max(0));
            let Some(level) = taps.bilinear(column as u32, row as u32) else {
                return sum;
            };
            sum += level;
            x += raster.right[0];
            y += raster.right[1];
        }
        left += raster.down[0];
        top += raster.down[1];
    }
    sum
}

/// The four pixels around every position: equally long slices that start with the first pixel, the one to its right,
/// the one below it, and the one below that. One comparison then does for four.
struct Taps<'a> {
    stride: usize,
    slices: [&'a [u8]; 4],
}

impl<'a> Taps<'a> {
    #[inline(always)]
    fn new(pixels: &'a [u8], stride: usize) -> Option<Self> {
        let len = pixels.len().checked_sub(stride + 1)?;
        let from = |start: usize| pixels.get(start..)?.get(..len);
        Some(Self {
            stride,
            slices: [from(0)?, from(1)?, from(stride)?, from(stride + 1)?],
        })
    }

    /// 2¹⁰ times the level at a position in units of 1/[`ONE`] pixel.
    #[inline(always)]
    fn bilinear(&self, x: u32, y: u32) -> Option<u32> {
        const ALL: u32 = 1 << WEIGHT;
        let at = (y >> FRACTION) as usize * self.stride + (x >> FRACTION) as usize;
        let [a, b, c, d] = self.slices;
        let [a, b, c, d] = [a.get(at)?, b.get(at)?, c.get(at)?, d.get(at)?].map(|&p| u32::from(p));
        let [u, v] = [x, y].map(|at| at >> (FRACTION - WEIGHT) & (ALL - 1));
        let (above, below) = (a * (ALL - u) + b * u, c * (ALL - u) + d * u);
        Some(above * (ALL - v) + below * v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        #[test]
        fn sum_packed_matches_sum_clamped(
            width in 40_u16..100, height in 40_u16..100, pad in 0_usize..5, seed in any::<u32>(),
            middle in [0.0_f32..1.0, 0.0_f32..1.0], right in [-20.0_f32..20.0, -20.0_f32..20.0],
            down in [-20.0_f32..20.0, -20.0_f32..20.0],
        ) {
            let stride = usize::from(width) + pad;
            let mut state = seed;
            let pixels: Vec<u8> = (0..stride * usize::from(height))
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (state >> 24) as u8
                })
                .collect();
            let frame = Frame::new(&pixels, width, height, stride).expect("valid");
            let (mut sampler, sides) = (Sampler::new(&frame), [f32::from(width), f32::from(height)]);
            let mut patch = Patch { middle: [0.0; 2], right: right.map(|a| a * ONE), down: down.map(|a| a * ONE) };
            // Anywhere between the middles of the frame's outer pixels.
            for axis in 0..2 {
                let room = (sides[axis] - 1.0) * ONE - 2.0 * patch.reach(axis);
                prop_assume!(room > 0.0);
                patch.middle[axis] = patch.reach(axis) + middle[axis] * 0.999 * room;
            }
            let raster = sampler.density.raster(&patch).expect("has a size");
            prop_assume!(raster.count <= MAX_PACKED);
            let corner = [0, 1].map(|axis| (patch.middle[axis] - patch.reach(axis)) as i32 >> FRACTION);
            prop_assert_eq!(
                sum_packed(frame.pixels(), stride, corner, &raster),
                sum_clamped(frame.pixels(), stride, sampler.last, &raster)
            );
        }
    }
}
