//! The sums over windows, two samples per word.
//!
//! Four pixels are one load. Masks unpack them into the pairs (p₀, p₂) and (p₁, p₃), halves of 16 bits; one multiplication
//! by a weight of at most 32 serves both halves, for neither can reach 2¹⁶: 255·32 going down, 2040·32 going across. All
//! of that are ordinary operations on words, so host and target run the same code; only the products of two pairs are
//! an instruction of their own on the target ([`dot_pair`]).

use super::{Errors, FRACTION, GROUPS, ROW, SIDE, Samples, Sums, WORDS};
use crate::{
    kernel::{dot_pair, subtract_pairs},
    track::level::Level,
};

/// Every other byte.
const BYTES: u32 = 0x00ff_00ff;

/// Both halves one.
const ONES: u32 = 0x0001_0001;

/// Rows of a template, and what its differences need.
const WIDE: usize = SIDE + 2;

/// Weights of a sample's right and lower neighbor, and of itself, in units of 1/32.
#[derive(Clone, Copy)]
struct Weights {
    u: u32,
    v: u32,
}

/// See [`reference::prepare`](super::reference::prepare).
#[inline(never)]
pub fn prepare(level: &Level<'_>, first: [i32; 2]) -> Option<Samples> {
    let (pixels, weights) = locate(level, first.map(|at| at - (1 << FRACTION)), WIDE)?;
    let mut samples = Samples {
        levels: [0; WORDS],
        across: [0; WORDS],
        down: [0; WORDS],
        sums: Sums::default(),
    };
    let mut wide = [[0; ROW]; WIDE];
    let mut sums = Sums::default();
    let mut start = 0;
    // Rows that differences to the right are wanted of: all but the first and the last.
    let targets = samples.across.chunks_exact_mut(ROW).map(Some);
    let targets = core::iter::once(None)
        .chain(targets)
        .chain(core::iter::once(None));
    for (wide, target) in wide.iter_mut().zip(targets) {
        let above = pixels.get(start..)?.first_chunk::<{ WIDE + 1 }>()?;
        start += level.stride;
        let below = pixels.get(start..)?.first_chunk::<{ WIDE + 1 }>()?;
        let [even, odd] = sample_wide(above, below, weights);
        let [e0, e1, e2, e3] = even;
        let [o0, o1, o2, o3] = odd;
        *wide = [o0, next(e0, e1), o1, next(e1, e2), o2, next(e2, e3)];
        if let Some([x0, x1, x2, x3, x4, x5]) = target {
            let [_, n0, _, n1, _, n2] = *wide;
            *x0 = subtract_pairs(n0, e0);
            *x1 = subtract_pairs(next(o0, o1), o0);
            *x2 = subtract_pairs(n1, e1);
            *x3 = subtract_pairs(next(o1, o2), o1);
            *x4 = subtract_pairs(n2, e2);
            *x5 = subtract_pairs(next(o2, o3), o2);
        }
    }
    let rows = wide
        .iter()
        .zip(wide.iter().skip(1))
        .zip(wide.iter().skip(2));
    let (levels, _) = samples.levels.as_chunks_mut::<ROW>();
    let (across, _) = samples.across.as_chunks::<ROW>();
    let (down, _) = samples.down.as_chunks_mut::<ROW>();
    let targets = levels.iter_mut().zip(across).zip(down);
    for (((above, row), below), ((levels, across), down)) in rows.zip(targets) {
        *levels = *row;
        for (((&above, &t), &below), (&x, down)) in above
            .iter()
            .zip(row)
            .zip(below)
            .zip(across.iter().zip(down))
        {
            let y = subtract_pairs(below, above);
            *down = y;
            sums.t = dot_pair(t, ONES, sums.t);
            sums.x = dot_pair(x, ONES, sums.x);
            sums.y = dot_pair(y, ONES, sums.y);
            sums.tt = dot_pair(t, t, sums.tt);
            sums.xt = dot_pair(x, t, sums.xt);
            sums.yt = dot_pair(y, t, sums.yt);
            sums.xx = dot_pair(x, x, sums.xx);
            sums.xy = dot_pair(x, y, sums.xy);
            sums.yy = dot_pair(y, y, sums.yy);
        }
    }
    samples.sums = sums;
    Some(samples)
}

/// See [`reference::compare`](super::reference::compare).
#[inline(never)]
pub fn compare(samples: &Samples, level: &Level<'_>, first: [i32; 2]) -> Option<Errors> {
    let (pixels, weights) = locate(level, first, SIDE)?;
    let mut errors = Errors::default();
    let (levels, _) = samples.levels.as_chunks::<2>();
    let (across, _) = samples.across.as_chunks::<2>();
    let (down, _) = samples.down.as_chunks::<2>();
    let mut groups = levels.iter().zip(across).zip(down);
    let mut start = 0;
    for _ in 0..SIDE {
        let above = pixels.get(start..)?.first_chunk::<{ SIDE + 1 }>()?;
        start += level.stride;
        let below = pixels.get(start..)?.first_chunk::<{ SIDE + 1 }>()?;
        let [mut even, mut odd] = mix(group(above, 0), group(below, 0), weights.v);
        for index in 1..=GROUPS {
            // Of the last one, only the first pixel is needed.
            let [next_even, next_odd] = if index < GROUPS {
                mix(group(above, index), group(below, index), weights.v)
            } else {
                let last = |row: &[u8; SIDE + 1]| u32::from(row[SIDE]);
                mix(last(above), last(below), weights.v)
            };
            let ((&[t0, t1], &[x0, x1]), &[y0, y1]) = groups.next()?;
            let first = blend(even, odd, weights.u);
            let second = blend(odd, next(even, next_even), weights.u);
            for (level, t, x, y) in [(first, t0, x0, y0), (second, t1, x1, y1)] {
                let e = subtract_pairs(level, t);
                errors.e = dot_pair(e, ONES, errors.e);
                errors.ee = dot_pair(e, e, errors.ee);
                errors.et = dot_pair(e, t, errors.et);
                errors.ex = dot_pair(e, x, errors.ex);
                errors.ey = dot_pair(e, y, errors.ey);
            }
            [even, odd] = [next_even, next_odd];
        }
    }
    Some(errors)
}

/// The pixels from the first one on that a window of `side` samples needs, and the weights of all its samples; `None`
/// when one lies outside the level.
fn locate<'a>(level: &Level<'a>, first: [i32; 2], side: usize) -> Option<(&'a [u8], Weights)> {
    let last = i32::from(level.side) - 1 - side as i32;
    let [left, top] = first.map(|at| at >> FRACTION);
    if left < 0 || top < 0 || left > last || top > last {
        return None;
    }
    let [u, v] = first.map(|at| at as u32 & ((1 << FRACTION) - 1));
    let start = top as usize * level.stride + left as usize;
    Some((level.pixels.get(start..)?, Weights { u, v }))
}

/// The four pixels of a group in a row of a window.
#[inline(always)]
fn group<const N: usize>(row: &[u8; N], index: usize) -> u32 {
    let (groups, _) = row.as_chunks::<4>();
    groups
        .get(index)
        .map_or(0, |&group| u32::from_le_bytes(group))
}

/// Pixels of two rows, weighted: even and odd ones, in units of 1/8 gray level.
#[inline(always)]
fn mix(above: u32, below: u32, v: u32) -> [u32; 2] {
    let mix = |above: u32, below: u32| ((above * (32 - v) + below * v) >> 2) & 0x3fff_3fff;
    [
        mix(above & BYTES, below & BYTES),
        mix(above >> 8 & BYTES, below >> 8 & BYTES),
    ]
}

/// Neighbors of one row, weighted.
#[inline(always)]
fn blend(left: u32, right: u32, u: u32) -> u32 {
    ((left * (32 - u) + right * u) >> 5) & 0x07ff_07ff
}

/// The second of a pair and the first of the next.
#[inline(always)]
fn next(pair: u32, next: u32) -> u32 {
    pair >> 16 | next << 16
}

/// Fourteen samples, and what comes of two that do not exist: even and odd ones.
#[inline(always)]
fn sample_wide(
    above: &[u8; WIDE + 1],
    below: &[u8; WIDE + 1],
    Weights { u, v }: Weights,
) -> [[u32; 4]; 2] {
    let last = |row: &[u8; WIDE + 1]| u32::from_le_bytes([row[12], row[13], row[14], 0]);
    let [e0, o0] = mix(group(above, 0), group(below, 0), v);
    let [e1, o1] = mix(group(above, 1), group(below, 1), v);
    let [e2, o2] = mix(group(above, 2), group(below, 2), v);
    let [e3, o3] = mix(last(above), last(below), v);
    [
        [
            blend(e0, o0, u),
            blend(e1, o1, u),
            blend(e2, o2, u),
            blend(e3, o3, u),
        ],
        [
            blend(o0, next(e0, e1), u),
            blend(o1, next(e1, e2), u),
            blend(o2, next(e2, e3), u),
            blend(o3, next(e3, 0), u),
        ],
    ]
}
