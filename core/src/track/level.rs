//! Squares of pixels, and their halves by exact 2×2 means.

use crate::frame::Frame;

/// The longest side of the square that is tracked in, in pixels, where nothing else is said: of larger frames the middle
/// is looked at.
pub const MAX_SIDE_PX: u16 = 200;

/// Levels of a pyramid, the frame itself included.
pub const LEVELS: usize = 3;

/// Sides below this have no half: windows would not fit.
const MIN_HALVED_SIDE_PX: u16 = 48;

/// Bytes that an odometry needs for frames whose square has that side, in pixels: the frame that is tracked from, and the
/// coarser levels of that and of the present one.
#[must_use]
pub const fn frames_len(side_px: u16) -> usize {
    let base = side_px as usize * side_px as usize;
    base + 2 * halves_len(side_px)
}

/// Bytes of the coarser levels of one frame.
pub const fn halves_len(side_px: u16) -> usize {
    let (half, quarter) = (side_px as usize / 2, side_px as usize / 4);
    half * half + quarter * quarter
}

/// A square of pixels, borrowed: `side` rows of `side` pixels, `stride` bytes apart.
#[derive(Clone, Copy, Debug)]
pub struct Level<'a> {
    pub pixels: &'a [u8],
    pub stride: usize,
    pub side: u16,
}

/// Levels from fine to coarse; those that do not exist have side 0.
pub type Pyramid<'a> = [Level<'a>; LEVELS];

impl<'a> Level<'a> {
    const NONE: Self = Self {
        pixels: &[],
        stride: 0,
        side: 0,
    };

    /// The middle of a frame, at most that wide and high.
    pub fn of(frame: &Frame<'a>, max_side_px: u16) -> Self {
        let square = frame.square_side();
        let side = square.min(max_side_px);
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

/// Fills in the coarser levels of `base`.
pub fn halve_all(base: &Level<'_>, halves: &mut [u8]) {
    let side = usize::from(base.half_side());
    let Some((half, quarter)) = halves.split_at_mut_checked(side * side) else {
        return;
    };
    halve(base, half);
    halve(&square(half, base.half_side()), quarter);
}

/// The pyramid on `base`, whose coarser levels these are.
pub fn pyramid<'a>(base: Level<'a>, halves: &'a [u8]) -> Pyramid<'a> {
    let side = usize::from(base.half_side());
    let (half, quarter) = halves.split_at_checked(side * side).unwrap_or_default();
    let half = square(half, base.half_side());
    [base, half, square(quarter, half.half_side())]
}

/// Copies a square, without gaps between its rows.
pub fn copy(from: &Level<'_>, target: &mut [u8]) {
    let side = usize::from(from.side.max(1));
    for (y, target) in target.chunks_exact_mut(side).enumerate().take(side) {
        let row = from.row(y);
        if row.len() == target.len() {
            target.copy_from_slice(row);
        }
    }
}

/// The square of that side without gaps between its rows.
pub fn square(pixels: &[u8], side: u16) -> Level<'_> {
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
    use std::vec::Vec;

    #[test]
    fn the_middle_of_a_large_frame_is_looked_at() {
        let mut pixels: Vec<u8> = std::vec![0; 320 * 240];
        pixels[20 * 320 + 60] = 1; // first pixel of the 200×200 in the middle
        pixels[219 * 320 + 259] = 2; // its last pixel
        let frame = Frame::new(&pixels, 320, 240, 320).expect("valid");
        let level = Level::of(&frame, MAX_SIDE_PX);
        assert_eq!(level.side, 200);
        assert_eq!((level.row(0)[0], level.row(199)[199]), (1, 2));
        assert!(level.row(200).is_empty());
    }

    #[test]
    fn halves_are_exact_means() {
        let pixels: Vec<u8> = (0..50 * 49).map(|i| (i * 7 % 251) as u8).collect();
        let frame = Frame::new(&pixels, 50, 49, 50).expect("valid");
        let base = Level::of(&frame, MAX_SIDE_PX);
        let mut halves = [0; halves_len(50)];
        halve_all(&base, &mut halves);
        let [_, half, quarter] = pyramid(base, &halves);
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
