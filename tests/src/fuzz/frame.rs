//! A frame's descriptor → frame → view.

use eigenmark_core::{
    frame::{Frame, FrameError, MAX_SIDE, MIN_SIDE},
    preprocess::{View, reduce, reduce_reference},
};

use super::input::Input;

/// The longest run of pixels that is offered: those of a frame of 72×72.
const MAX_LEN: usize = 72 * 72;

/// Steps of the reference, which looks at every pixel for every pixel, that are worth their time.
const MAX_STEPS: u64 = 1 << 15;

/// Takes the input as sides, stride, length and pixels: it is a frame exactly when the definition says so, and its view
/// is that of the reference.
///
/// # Panics
/// When a promise is broken.
pub fn frame(input: &[u8]) {
    let mut input = Input(input);
    let (shape, side) = (input.byte(), input.byte());
    let (mut width, mut height) = (input.number(), input.number());
    if shape & 1 != 0 {
        // Most sides are no side of a small frame.
        (width, height) = (MIN_SIDE - 1 + width % 42, MIN_SIDE - 1 + height % 42);
    }
    let stride = match shape >> 1 & 3 {
        0 => u64::from_le_bytes(input.array()) as usize,
        1 => usize::from(input.number()),
        _ => usize::from(width) + usize::from(input.byte() % 4),
    };
    let needed = stride as u128 * u128::from(height.saturating_sub(1)) + u128::from(width);
    let len = match shape >> 3 & 3 {
        0 => usize::from(input.number()),
        1 => (needed.min(MAX_LEN as u128) as usize).saturating_sub(1),
        _ => needed.min(MAX_LEN as u128) as usize,
    };
    let pixels = input.repeated(len);

    let sides = MIN_SIDE..=MAX_SIDE;
    let saturated = |number: u128| u32::try_from(number).unwrap_or(u32::MAX);
    let expected = if !sides.contains(&width) || !sides.contains(&height) {
        Err(FrameError::Size { width, height })
    } else if stride < usize::from(width) {
        let stride = saturated(stride as u128);
        Err(FrameError::Stride { stride, width })
    } else if needed > len as u128 {
        Err(FrameError::TooShort {
            needed: saturated(needed),
            have: len as u32,
        })
    } else {
        Ok(())
    };
    let frame = match Frame::new(&pixels, width, height, stride) {
        Ok(frame) => frame,
        Err(error) => return assert_eq!(Err(error), expected),
    };
    assert_eq!(expected, Ok(()));

    let q = frame.square_side();
    assert!((0..q).all(|row| frame.square_row(row).len() == usize::from(q)));
    assert!(frame.square_row(q).is_empty());
    let mut view = View::black(side);
    reduce(&frame, &mut view);
    let total: u32 = view.pixels().iter().map(|&pixel| u32::from(pixel)).sum();
    assert_eq!(view.sum(), total);
    let steps = u64::from(q) * u64::from(view.side());
    // It takes longer than all the rest: one input in eight asks for it.
    if shape >> 5 == 7 && steps * steps <= MAX_STEPS {
        let mut plain = View::black(side);
        reduce_reference(&frame, &mut plain);
        assert_eq!(view, plain);
    }
}
