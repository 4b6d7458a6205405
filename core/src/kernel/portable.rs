//! The kernels as their definitions say them.

use super::{
    BATCH, Cuts, Greatest, PAIRS_PER_GROUP, Pair, Pixels, ROWS_PER_BLOCK, Ranked, SIX, Weights,
    Width,
};

/// Adds every run of `block` pixels of a row to the sum of the same number.
#[inline]
pub fn add_blocks(row: &[u8], block: usize, sums: &mut [u32]) {
    for (sum, run) in sums.iter_mut().zip(row.chunks_exact(block.max(1))) {
        *sum = run
            .iter()
            .fold(*sum, |sum, &y| sum.wrapping_add(u32::from(y)));
    }
}

/// Sums of a row's pixels over columns, each pixel weighted by the units that the column takes of it. A row that is
/// shorter than the cuts leaves the sums as they were.
#[inline]
pub fn sum_cuts(row: &[u8], cuts: &Cuts, sums: &mut [u32]) {
    if row.len() < cuts.pixels() {
        return;
    }
    let mut rest = row;
    let mut pixel = 0;
    for (sum, cut) in sums.iter_mut().zip(cuts.as_slice()) {
        let Some((run, after)) = rest.split_at_checked(cut.whole.into()) else {
            return;
        };
        let whole: u32 = run.iter().map(|&y| u32::from(y)).sum();
        *sum = u32::from(cut.first) * pixel + cuts.unit() * whole;
        rest = after;
        if let (1.., Some((&next, after))) = (cut.last, after.split_first()) {
            pixel = u32::from(next);
            *sum += u32::from(cut.last) * pixel;
            rest = after;
        }
    }
}

/// Means of 6×6 blocks, rounded half up: one row of `view`, from rows of `stride` bytes.
///
/// Blocks that `source` does not hold entirely are left out.
#[inline]
pub fn reduce_sixfold(source: &[u8], stride: usize, view: &mut [u8]) {
    for (block, pixel) in view.iter_mut().enumerate() {
        let rows = (0..SIX).map_while(|row| source.get(row * stride + block * SIX..)?.get(..SIX));
        if rows.clone().count() == SIX {
            let sum: u32 = rows.flatten().map(|&y| u32::from(y)).sum();
            *pixel = ((sum + 18) / 36) as u8;
        }
    }
}

/// Dot products of the pixels with the [`ROWS_PER_BLOCK`] rows of one block of weights.
#[inline]
pub fn block_dots(pixels: &[Pixels], weights: &[Pair]) -> [i32; ROWS_PER_BLOCK] {
    let mut dots = [0_i32; ROWS_PER_BLOCK];
    let groups = weights.chunks_exact(PAIRS_PER_GROUP);
    for (&Pixels(pixels), weights) in pixels.iter().zip(groups) {
        let [y0, y1, y2, y3] = pixels.map(i32::from);
        for (dot, weights) in dots.iter_mut().zip(weights.chunks_exact(2)) {
            if let &[Pair([w0, w2]), Pair([w1, w3])] = weights {
                let [w0, w1, w2, w3] = [w0, w1, w2, w3].map(i32::from);
                *dot = dot.wrapping_add(w0 * y0 + w1 * y1 + w2 * y2 + w3 * y3);
            }
        }
    }
    dots
}

/// Dot product of the pixels with one row of 8-bit weights.
#[inline]
pub fn mean_dot(pixels: &[Pixels], weights: &[Weights]) -> i32 {
    let groups = pixels.iter().zip(weights);
    groups
        .flat_map(|(pixels, weights)| pixels.0.iter().zip(&weights.0))
        .map(|(&y, &w)| i32::from(y) * i32::from(w))
        .fold(0, i32::wrapping_add)
}

/// `sum` plus the products of the halves of two words, low with low and high with high, as signed numbers.
#[inline(always)]
pub fn dot_pair(a: u32, b: u32, sum: i32) -> i32 {
    let low = i32::from(a as i16) * i32::from(b as i16);
    let high = ((a as i32) >> 16) * ((b as i32) >> 16);
    sum.wrapping_add(low).wrapping_add(high)
}

/// The halves of a word minus those of another.
#[inline(always)]
pub fn subtract_pairs(a: u32, b: u32) -> u32 {
    let low = (a as u16).wrapping_sub(b as u16);
    let high = ((a >> 16) as u16).wrapping_sub((b >> 16) as u16);
    u32::from(low) | u32::from(high) << 16
}

/// Σy and Σy².
#[inline]
pub fn statistics(pixels: &[Pixels]) -> (u32, u32) {
    let pixels = pixels.iter().flat_map(|pixels| pixels.0);
    pixels.fold((0, 0), |(sum, squares), y| {
        let y = u32::from(y);
        (u32::wrapping_add(sum, y), u32::wrapping_add(squares, y * y))
    })
}

/// Room for the dot products of a batch.
#[derive(Debug)]
pub struct Dots([i32; BATCH]);

impl Dots {
    pub fn new() -> Self {
        Self([0; BATCH])
    }

    /// The dot products of `view` and the first `count` rows, [`BATCH`] at most; none when there
    /// are not as many rows.
    #[inline]
    pub fn of(&mut self, width: Width, view: &[Pair], rows: &[Pair], count: usize) -> &[i32] {
        let (len, count) = (width.words(view), count.min(BATCH));
        let Some(rows) = rows.get(..count * len) else {
            return &[];
        };
        let dots = &mut self.0[..count];
        for (index, dot) in dots.iter_mut().enumerate() {
            let row = &rows[index * len..(index + 1) * len];
            *dot = match width {
                Width::I16 => dot_i16(view, row),
                Width::I8 => dot_i8(view, row),
            };
        }
        dots
    }
}

/// Dot product of a view and a row of 16-bit coefficients.
fn dot_i16(view: &[Pair], row: &[Pair]) -> i32 {
    let products = view.iter().zip(row).map(|(&Pair([g, h]), &Pair([a, b]))| {
        let even = i32::from(g).wrapping_mul(i32::from(a));
        even.wrapping_add(i32::from(h).wrapping_mul(i32::from(b)))
    });
    products.fold(0, i32::wrapping_add)
}

/// Dot product of a view that is [`split`](super::split) and a row of 8-bit coefficients, stored in pairs: the i16
/// number j of a row is 256·b + a with its coefficients a (2j) and b (2j + 1).
fn dot_i8(view: &[Pair], row: &[Pair]) -> i32 {
    let low = |pair: i16| i16::from(pair as i8);
    let words = view.chunks_exact(2).zip(row);
    let scaled = words.fold(0_i32, |sum, (view, &Pair([p, q]))| {
        sum.wrapping_add(dot_i16(view, &[Pair([p, q]), Pair([low(p), low(q)])]))
    });
    scaled >> 8
}

/// Takes in the rows from `start` on, by the fractions dot/(offset + norm).
///
/// Denominators are positive and below 2³⁰, numerators within ±2³⁰.
pub fn keep_greatest(
    dots: &[i32],
    norms: &[u32],
    offset: i32,
    start: u32,
    greatest: &mut Greatest,
) {
    for ((&dot, &norm), row) in dots.iter().zip(norms).zip(start..) {
        let ranked = Ranked {
            row,
            numerator: dot,
            denominator: offset.wrapping_add(norm as i32),
        };
        if ranked.is_greater(&greatest.second) {
            greatest.take(ranked, Ranked::is_greater);
        }
    }
}

/// The first row of which dot² is at least `least` times its norm, both in single precision; how many rows there are
/// when there is none.
pub fn find_square(dots: &[i32], norms: &[u32], least: f32) -> usize {
    let mut rows = dots.iter().zip(norms);
    let found =
        rows.position(|(&dot, &norm)| dot as f32 * dot as f32 >= (norm as i32) as f32 * least);
    found.unwrap_or(dots.len().min(norms.len()))
}

/// Square root, correctly rounded; no number below zero.
pub fn square_root(x: f32) -> f32 {
    libm::sqrtf(x)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::super::{PIXELS_PER_GROUP, split};
    use super::*;
    use crate::eigenspace::{padded_pixels, weight_count, weight_index};

    fn groups(bytes: &[u8]) -> Vec<Pixels> {
        let four =
            |four: &[u8]| Pixels(core::array::from_fn(|i| four.get(i).copied().unwrap_or(0)));
        bytes.chunks(PIXELS_PER_GROUP).map(four).collect()
    }

    fn pairs(numbers: &[i16]) -> Vec<Pair> {
        let two = |two: &[i16]| Pair([two[0], two.get(1).copied().unwrap_or(0)]);
        numbers.chunks(2).map(two).collect()
    }

    proptest! {
        #[test]
        fn block_dots_matches_reference(
            side in 2_u8..12, row in 0_usize..10, seed in any::<u32>(),
        ) {
            let mut state = seed;
            let mut random = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                state >> 16
            };
            let pixels: Vec<u8> = (0..side * side).map(|_| random() as u8).collect();
            let stored: Vec<i16> = (0..weight_count(side, 10)).map(|_| random() as i16).collect();
            let expected: i32 = pixels.iter().enumerate()
                .map(|(p, &y)| i32::from(y) * i32::from(stored[weight_index(side, row, p)]))
                .sum();
            let block = &stored[row / ROWS_PER_BLOCK * ROWS_PER_BLOCK * padded_pixels(side)..];
            prop_assert_eq!(block_dots(&groups(&pixels), &pairs(block))[row % ROWS_PER_BLOCK], expected);
        }

        #[test]
        fn statistics_match_reference(pixels in prop::collection::vec(any::<u8>(), 0..100)) {
            let sum: u32 = pixels.iter().map(|&y| u32::from(y)).sum();
            let squares: u32 = pixels.iter().map(|&y| u32::from(y) * u32::from(y)).sum();
            prop_assert_eq!(statistics(&groups(&pixels)), (sum, squares));
        }

        #[test]
        fn dots_of_8_bit_pairs_match_reference(
            numbers in prop::collection::vec((-127_i16..=127, -127_i16..=127), 1..128),
        ) {
            let (view, row): (Vec<i16>, Vec<i16>) = numbers.into_iter().unzip();
            let expected: i32 = view.iter().zip(&row).map(|(&g, &a)| i32::from(g) * i32::from(a)).sum();
            let packed: Vec<i16> = row.chunks(2).map(|ab| 256 * ab.get(1).unwrap_or(&0) + ab[0]).collect();
            let mut words = pairs(&view);
            words.resize(words.len().next_multiple_of(2), Pair([0; 2]));
            let mut halves = std::vec![Pair([0; 2]); words.len()];
            split(&words, &mut halves);
            let mut dots = Dots::new();
            prop_assert_eq!(dots.of(Width::I8, &halves, &pairs(&packed), 1), [expected]);
        }
    }

    #[test]
    fn the_mean_of_a_block_is_rounded_half_up() {
        let mut pixels = [0; 36];
        pixels[..18].fill(1);
        let mut view = [9];
        reduce_sixfold(&pixels, 6, &mut view);
        assert_eq!(view, [1]);
        pixels[0] = 0;
        reduce_sixfold(&pixels, 6, &mut view);
        assert_eq!(view, [0]);
    }
}
