//! The two frames that are compared: the reference, kept, and the present one, of which only the halves are.

use super::level::{Level, Pyramid, copy, frames_len, halve_all, halves_len, pyramid, square};

/// The frame that corners are tracked from, and the halves of the present one, in `LEN` bytes.
#[derive(Clone, Debug)]
pub struct Frames<const LEN: usize> {
    /// The reference, then the halves of both, each as if squares were as large as can be.
    bytes: [u8; LEN],
    /// The halves of the present frame lie first.
    is_swapped: bool,
    /// Side of the reference's square and of the part that is tracked, in pixels; 0 before the first frame.
    square_px: u16,
    side_px: u16,
}

impl<const LEN: usize> Frames<LEN> {
    /// The longest side of the square that is tracked in, in pixels.
    pub const MAX_SIDE_PX: u16 = {
        let mut side = 0;
        while frames_len(side + 1) <= LEN {
            side += 1;
        }
        side
    };

    /// None yet: all zeros.
    pub const fn new() -> Self {
        Self {
            bytes: [0; LEN],
            is_swapped: false,
            square_px: 0,
            side_px: 0,
        }
    }

    /// Forgets the reference. Pixels stay, and are not looked at: nothing of no side can be compared.
    pub fn reset(&mut self) {
        self.is_swapped = false;
        (self.square_px, self.side_px) = (0, 0);
    }

    /// Takes in the present frame, whose square has that side, and says whether it can be compared with the reference.
    pub fn present(&mut self, base: &Level<'_>, square_px: u16) -> bool {
        let is_swapped = self.is_swapped;
        let [first, second] = self.halves_mut();
        halve_all(base, if is_swapped { first } else { second });
        (square_px, base.side) == (self.square_px, self.side_px)
    }

    /// The reference and the present frame.
    pub fn pyramids<'a>(&'a self, base: &Level<'a>) -> (Pyramid<'a>, Pyramid<'a>) {
        let (kept, halves) = self.bytes.split_at_checked(Self::BASE).unwrap_or_default();
        let (first, second) = halves.split_at_checked(Self::HALVES).unwrap_or_default();
        let (reference, present) = if self.is_swapped {
            (second, first)
        } else {
            (first, second)
        };
        let kept = square(kept, self.side_px);
        (pyramid(kept, reference), pyramid(*base, present))
    }

    /// Makes the present frame the reference, and gives its finest two levels.
    pub fn keep<'a>(&'a mut self, base: &Level<'a>, square_px: u16) -> [Level<'a>; 2] {
        copy(base, self.bytes.get_mut(..Self::BASE).unwrap_or_default());
        self.is_swapped = !self.is_swapped;
        (self.square_px, self.side_px) = (square_px, base.side);
        let [fine, half, _] = self.pyramids(base).0;
        [fine, half]
    }

    const BASE: usize = Self::MAX_SIDE_PX as usize * Self::MAX_SIDE_PX as usize;
    const HALVES: usize = halves_len(Self::MAX_SIDE_PX);

    fn halves_mut(&mut self) -> [&mut [u8]; 2] {
        let halves = self.bytes.get_mut(Self::BASE..).unwrap_or_default();
        let halves = halves.split_at_mut_checked(Self::HALVES);
        halves.map_or([&mut [], &mut []], |(first, second)| [first, second])
    }
}
