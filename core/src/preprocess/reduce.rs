//! Exact area averaging, one pass over the source rows.
//!
//! **Method.** The frame's centred square has q pixels per side, the view v. In units of 1/(q·v) of the side a source
//! pixel is v units long and a view pixel q, so every overlap is a whole number and the weights of a view pixel add up
//! to q². The mean is rounded half up. Nothing is approximated for ratios that are not whole.
//!
//! When q is a multiple of v, every view pixel is the plain mean of a block of whole pixels: the same number, by
//! additions only. A ratio of six, which makes 20×20 pixels of a 160×120 frame, has a kernel of its own.
//!
//! **Cost.** An addition per source pixel; v sums on the stack. Fractional ratios add rows at the border of two view
//! rows twice.
//!
//! **Limits.** Sums stay below 255.5·q² < 2³² for q ≤ [`MAX_SIDE`](crate::frame::MAX_SIDE).

use super::{MAX_VIEW_SIDE, View};
use crate::{frame::Frame, kernel};

/// Reduces the frame's centred square to the pixels of `view`, whose side is kept.
///
/// # Examples
/// ```
/// use eigenmark_core::{frame::Frame, preprocess::{View, reduce}};
/// let mut pixels = [0; 32 * 32];
/// pixels[..16].fill(100); // half of the top row
/// let mut view = View::black(2);
/// reduce(&Frame::new(&pixels, 32, 32, 32)?, &mut view);
/// assert_eq!(view.pixels(), [6, 0, 0, 0]); // 16·100 / 256 = 6.25
/// # Ok::<(), eigenmark_core::frame::FrameError>(())
/// ```
pub fn reduce(frame: &Frame<'_>, view: &mut View) {
    let (q, v) = (usize::from(frame.square_side()), usize::from(view.side()));
    view.fill(|pixels| {
        let v = v.max(1); // no view is empty, but the compiler has to see it
        let rows = pixels.chunks_exact_mut(v).zip(0..);
        if q == kernel::SIX * v {
            for (row, index) in rows {
                let source = frame.square_from(index * kernel::SIX as u16);
                kernel::reduce_sixfold(source, frame.stride(), row);
            }
        } else if q.is_multiple_of(v) {
            for (row, index) in rows {
                reduce_blocks(frame, index, row);
            }
        } else {
            reduce_fractions(frame, pixels, q as u32, v as u32);
        }
    });
}

/// Whole ratios: one row of view pixels that are means of blocks.
fn reduce_blocks(frame: &Frame<'_>, index: u16, row: &mut [u8]) {
    let block = (usize::from(frame.square_side()) / row.len().max(1)).max(1);
    let area = ((block * block) as u32).max(1);
    let mut sums = [0_u32; MAX_VIEW_SIDE as usize];
    for y in 0..block as u16 {
        let source = frame.square_row(index * block as u16 + y);
        for (sum, run) in sums.iter_mut().zip(source.chunks_exact(block)) {
            *sum += kernel::sum(run);
        }
    }
    for (pixel, sum) in row.iter_mut().zip(sums) {
        *pixel = ((sum + area / 2) / area) as u8;
    }
}

/// Any ratio.
fn reduce_fractions(frame: &Frame<'_>, pixels: &mut [u8], q: u32, v: u32) {
    let mut sums = [0_u32; MAX_VIEW_SIDE as usize];
    let sums = sums.get_mut(..v as usize).unwrap_or_default();
    let mut rows = pixels.chunks_exact_mut(v as usize);
    let mut filled = 0; // units of the current view row already covered
    for y in 0..q {
        let source = frame.square_row(y as u16);
        let mut left = v; // units of this source row not yet used
        while left > 0 {
            let used = left.min(q - filled);
            add_row(source, q, v, used, sums);
            left -= used;
            filled += used;
            if filled == q {
                if let Some(row) = rows.next() {
                    emit_row(sums, q, row);
                }
                filled = 0;
            }
        }
    }
}

/// Adds `weight` times the horizontally averaged source row to the sums of the view's columns.
///
/// A column takes what is left of the pixel that it begins in, whole pixels, and part of the one that it ends in.
fn add_row(source: &[u8], q: u32, v: u32, weight: u32, sums: &mut [u32]) {
    let mut rest = source;
    let (mut pixel, mut left) = (0, 0); // the pixel that the column begins in, and its units not yet used
    for sum in sums {
        let used = left.min(q);
        let needed = q - used;
        let Some((run, after)) = rest.split_at_checked((needed / v) as usize) else {
            return;
        };
        let mut row_sum = used * pixel + v * kernel::sum(run);
        (left, rest) = (left - used, after);
        let part = needed % v;
        if let (1.., Some((&next, after))) = (part, after.split_first()) {
            row_sum += part * u32::from(next);
            (pixel, left, rest) = (u32::from(next), v - part, after);
        }
        *sum += weight * row_sum;
    }
}

/// Turns the finished sums into a row of pixels and clears them.
fn emit_row(sums: &mut [u32], q: u32, row: &mut [u8]) {
    let area = (q * q).max(1);
    for (pixel, sum) in row.iter_mut().zip(sums) {
        *pixel = ((*sum + area / 2) / area) as u8;
        *sum = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::super::reduce_reference;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn reduce_matches_reference(
            width in 32_u16..90, height in 32_u16..90, pad in 0_usize..5, side in 2_u8..=50, seed in any::<u32>(),
            is_whole in any::<bool>(),
        ) {
            let blocks = width.div_ceil(side.into()) * u16::from(side);
            let (width, height) = if is_whole { (blocks, blocks) } else { (width, height) };
            let stride = usize::from(width) + pad;
            let mut state = seed;
            let pixels: Vec<u8> = (0..stride * usize::from(height))
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (state >> 24) as u8
                })
                .collect();
            let frame = Frame::new(&pixels, width, height, stride).expect("valid");
            let (mut fast, mut plain) = (View::black(side), View::black(side));
            reduce(&frame, &mut fast);
            reduce_reference(&frame, &mut plain);
            prop_assert_eq!(fast, plain);
        }
    }

    #[test]
    fn a_white_frame_gives_a_white_view_at_the_largest_size() {
        let pixels = std::vec![255; 4096 * 4096];
        let frame = Frame::new(&pixels, 4096, 4096, 4096).expect("valid");
        let mut view = View::black(50);
        reduce(&frame, &mut view);
        assert!(view.pixels().iter().all(|&p| p == 255));
    }

    #[test]
    fn whole_ratios_are_plain_means() {
        let pixels: Vec<u8> = (0..64 * 64).map(|i| (i % 64 * 4) as u8).collect();
        let mut view = View::black(4);
        reduce(&Frame::new(&pixels, 64, 64, 64).expect("valid"), &mut view);
        assert_eq!(view.pixels()[..4], [30, 94, 158, 222]);
    }
}
