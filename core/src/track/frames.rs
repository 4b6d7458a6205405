//! The two frames that are compared: the reference, kept, and the present one, of which only the halves are.

use super::level::{Base, Halves, Level, Pyramid};

/// The frame that corners are tracked from, and the halves of the present one.
#[derive(Clone, Debug)]
pub struct Frames {
    base: Base,
    /// Of the reference and of the present frame, in this order or the other.
    halves: [Halves; 2],
    is_swapped: bool,
    /// Side of the reference's square and of the part that is tracked, in pixels; 0 before the first frame.
    square_px: u16,
    side_px: u16,
}

impl Frames {
    /// None yet: all zeros.
    pub const fn new() -> Self {
        Self {
            base: Base::new(),
            halves: [Halves::new(), Halves::new()],
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
        let [first, second] = &mut self.halves;
        let present = if self.is_swapped { first } else { second };
        present.halve(base);
        (square_px, base.side) == (self.square_px, self.side_px)
    }

    /// The reference and the present frame.
    pub fn pyramids<'a>(&'a self, base: &Level<'a>) -> (Pyramid<'a>, Pyramid<'a>) {
        let [first, second] = &self.halves;
        let (reference, present) = if self.is_swapped {
            (second, first)
        } else {
            (first, second)
        };
        let kept = self.base.level(self.side_px);
        (reference.under(kept), present.under(*base))
    }

    /// Makes the present frame the reference, and gives its finest two levels.
    pub fn keep<'a>(&'a mut self, base: &Level<'a>, square_px: u16) -> [Level<'a>; 2] {
        self.base.copy(base);
        self.is_swapped = !self.is_swapped;
        (self.square_px, self.side_px) = (square_px, base.side);
        let [fine, half, _] = self.pyramids(base).0;
        [fine, half]
    }
}
