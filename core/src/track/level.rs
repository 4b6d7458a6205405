//! Squares of pixels, and their halves by exact 2×2 means.

use crate::frame::Frame;

/// The longest side of the square that is tracked in, in pixels: of larger frames the middle is looked at.
pub const MAX_SIDE_PX: u16 = 200;

/// Levels of a pyramid, the frame itself included.
pub const LEVELS: usize = 3;

/// Sides below this have no half: windows would not fit.
const MIN_HALVED_SIDE_PX: u16 = 48;

/// Pixels of the largest square, of its half and of its quarter.
const BASE: usize = MAX_SIDE_PX as usize * MAX_SIDE_PX as usize;
const HALF: usize = BASE / 4;
const QUARTER: usize = BASE / 16;

/// A square of pixels, borrowed: `side` rows of `side` pixels, `stride` bytes apart.
#[derive(Clone, Copy, Debug)]
pub struct Level<'a> {
    pub pixels: &'a [u8],
    pub stride: usize,
    pub side: u16,
}

/// The coarser levels of a frame, of half and of a quarter its side.
#[derive(Clone, Debug)]
pub struct Halves {
    half: [u8; HALF],
    quarter: [u8; QUARTER],
}

/// A frame's square, copied, without gaps between its rows.
#[derive(Clone, Debug)]
pub struct Base {
    pixels: [u8; BASE],
}

/// Levels from fine to coarse; those that do not exist have side 0.
pub type Pyramid<'a> = [Level<'a>; LEVELS];

impl<'a> Level<'a> {
    const NONE: Self = Self {
        pixels: &[],
        stride: 0,
        side: 0,
    };

    /// The middle of a frame, at most [`MAX_SIDE_PX`] wide and high.
    pub fn of(frame: &Frame<'a>) -> Self {
        let square = frame.square_side();
        let side = square.min(MAX_SIDE_PX);
        let margin = (square - side) / 2;
        let pixels = frame.square_from(margin);
        Self {
            pixels: pixels.get(usize::from(margin)..).unwrap_or_default(),
            stride: frame.stride(),
            side,
        }
    }

    /// Row `y`, all its `side` pixels; none below the square.
    pub fn row(&self, y: usize) -> &'a [u8] {
        if y >= usize::from(self.side) {
            return &[];
        }
        let start = y.wrapping_mul(self.stride);
        let row = self.pixels.get(start..).unwrap_or_default();
        row.get(..usize::from(self.side)).unwrap_or_default()
    }

    /// Side of the next coarser level; 0 when there is none.
    pub fn half_side(&self) -> u16 {
        if self.side < MIN_HALVED_SIDE_PX {
            return 0;
        }
        self.side / 2
    }

    /// Whether there is no such level.
    pub fn is_none(&self) -> bool {
        self.side == 0
    }
}

impl Halves {
    /// Black pixels.
    pub const fn new() -> Self {
        Self {
            half: [0; HALF],
            quarter: [0; QUARTER],
        }
    }

    /// Fills in the halves of `base`.
    pub fn halve(&mut self, base: &Level<'_>) {
        halve(base, &mut self.half);
        let half = square(&self.half, base.half_side());
        halve(&half, &mut self.quarter);
    }

    /// The pyramid on `base`, whose halves these are.
    pub fn under<'a>(&'a self, base: Level<'a>) -> Pyramid<'a> {
        let half = square(&self.half, base.half_side());
        [base, half, square(&self.quarter, half.half_side())]
    }
}

impl Base {
    /// Black pixels.
    pub const fn new() -> Self {
        Self { pixels: [0; BASE] }
    }

    /// Copies a square.
    pub fn copy(&mut self, from: &Level<'_>) {
        let side = usize::from(from.side.max(1));
        for (y, target) in self.pixels.chunks_exact_mut(side).enumerate().take(side) {
            let row = from.row(y);
            if row.len() == target.len() {
                target.copy_from_slice(row);
            }
        }
    }

    /// The square of that side that was copied.
    pub fn level(&self, side: u16) -> Level<'_> {
        square(&self.pixels, side)
    }
}

fn square(pixels: &[u8], side: u16) -> Level<'_> {
    if side == 0 {
        return Level::NONE;
    }
    Level {
        pixels,
        stride: side.into(),
        side,
    }
}

/// Means of 2×2 pixels, rounded half up; an odd row or column at the end is left out.
fn halve(from: &Level<'_>, target: &mut [u8]) {
    let side = usize::from(from.half_side());
    if side == 0 {
        return;
    }
    for (y, target) in target.chunks_exact_mut(side).enumerate().take(side) {
        let (above, below) = (from.row(2 * y), from.row(2 * y + 1));
        let pairs = above.chunks_exact(2).zip(below.chunks_exact(2));
        for (target, (above, below)) in target.iter_mut().zip(pairs) {
            let sum: u16 = above.iter().chain(below).map(|&p| u16::from(p)).sum();
            *target = ((sum + 2) / 4) as u8;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{boxed::Box, vec::Vec};

    #[test]
    fn the_middle_of_a_large_frame_is_looked_at() {
        let mut pixels: Vec<u8> = std::vec![0; 320 * 240];
        pixels[20 * 320 + 60] = 1; // first pixel of the 200×200 in the middle
        pixels[219 * 320 + 259] = 2; // its last pixel
        let frame = Frame::new(&pixels, 320, 240, 320).expect("valid");
        let level = Level::of(&frame);
        assert_eq!(level.side, 200);
        assert_eq!((level.row(0)[0], level.row(199)[199]), (1, 2));
        assert!(level.row(200).is_empty());
    }

    #[test]
    fn halves_are_exact_means() {
        let pixels: Vec<u8> = (0..50 * 49).map(|i| (i * 7 % 251) as u8).collect();
        let frame = Frame::new(&pixels, 50, 49, 50).expect("valid");
        let base = Level::of(&frame);
        let mut halves = Box::new(Halves::new());
        halves.halve(&base);
        let [_, half, quarter] = halves.under(base);
        assert_eq!((half.side, quarter.side), (24, 0));
        for y in 0..24 {
            for x in 0..24 {
                let four = [(0, 0), (1, 0), (0, 1), (1, 1)]
                    .map(|(dx, dy)| f32::from(pixels[(2 * y + dy) * 50 + 2 * x + dx]));
                let mean = four.iter().sum::<f32>() / 4.0;
                assert_eq!(f32::from(half.row(y)[x]), (mean + 0.5).floor());
            }
        }
    }
}
