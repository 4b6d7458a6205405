//! Exact area averaging, one pass over the source rows.
//!
//! **Method.** The frame's centered square has q pixels per side, the view v. In units of 1/(q·v) of the side a source
//! pixel is v units long and a view pixel q, so every overlap is a whole number and the weights of a view pixel add up
//! to q². The mean is rounded half up. Nothing is approximated for ratios that are not whole.
//!
//! When q is a multiple of v, every view pixel is the plain mean of a block of whole pixels: the same number, by
//! additions only. A ratio of six, which makes 20×20 pixels of a 160×120 frame, has a kernel of its own.
//!
//! **Cost.** An addition per source pixel, two multiplications per view column and source row for fractional ratios;
//! twice v sums on the stack.
//!
//! **Limits.** Sums stay below 255.5·q² < 2³² for q ≤ [`MAX_SIDE`](crate::frame::MAX_SIDE).

use super::{MAX_VIEW_SIDE, View};
use crate::{
    frame::Frame,
    kernel::{self, Cuts},
};

/// Room for the columns of the largest view.
const SIDE: usize = MAX_VIEW_SIDE as usize;

/// Reduces the frame's centered square to the pixels of `view`, whose side is kept.
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
    let mut sums = [0_u32; SIDE];
    let sums = sums.get_mut(..row.len()).unwrap_or_default();
    for y in 0..block as u16 {
        let source = frame.square_row(index * block as u16 + y);
        kernel::add_blocks(source, block, sums);
    }
    for (pixel, sum) in row.iter_mut().zip(sums) {
        *pixel = ((*sum + area / 2) / area) as u8;
    }
}

/// Any ratio.
fn reduce_fractions(frame: &Frame<'_>, pixels: &mut [u8], q: u32, v: u32) {
    let cuts = Cuts::new(q as u16, v as u8);
    let (mut row_sums, mut sums) = ([0_u32; SIDE], [0_u32; SIDE]);
    let mut rows = pixels.chunks_exact_mut(v as usize);
    let mut filled = 0; // units of the current view row already covered
    for y in 0..q {
        kernel::sum_cuts(frame.square_row(y as u16), &cuts, &mut row_sums);
        let mut left = v; // units of this source row not yet used
        while left > 0 {
            let used = left.min(q - filled);
            for (sum, row_sum) in sums.iter_mut().zip(&row_sums).take(v as usize) {
                *sum += used * row_sum;
            }
            left -= used;
            filled += used;
            if filled == q {
                if let Some(row) = rows.next() {
                    emit_row(&mut sums, q, row);
                }
                filled = 0;
            }
        }
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
