//! The integer loops that everything else waits for.
//!
//! Each kernel exists twice, in files that mirror each other: `portable.rs` is the plain definition, and runs wherever
//! there is nothing faster; `armv7em.rs` is the same function for Cortex-M4 and M7, in their packed-byte and
//! dual-multiply instructions. Both give the same bits for every input: property tests compare the portable kernels
//! with literal formulas on the host, and the self-test compares the twins with each other on the target, also with what
//! they read and write at the edges of guarded memory: no checker of the compiler sees what assembly does.
//!
//! **Notation.** A *group* is four pixels, one 32-bit word, y₀…y₃. UXTB16 unpacks it into the pairs (y₀, y₂) and
//! (y₁, y₃), which is why weights are stored in the order 0, 2, 1, 3.
//!
//! **Words.** What kernels read comes in types of one aligned 32-bit word: [`Pixels`], [`Weights`], [`Pair`].
//!
//! One is not of integers: the square root, which IEEE 754 leaves only one way to round.
//!
//! **Limits.** Kernels know nothing of overflow: whoever stores weights and coefficients keeps sums below 2³¹. What
//! they are not given in whole groups or rows they leave out.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

#[cfg(armv7em)]
mod armv7em;
mod cuts;
mod edges;
mod portable;
mod twins;

#[cfg(armv7em)]
pub(crate) use armv7em::{
    Dots, add_blocks, block_dots, dot_pair, find_square, keep_greatest, mean_dot, reduce_sixfold,
    square_root, statistics, subtract_pairs, sum_cuts,
};
#[cfg(not(armv7em))]
pub(crate) use portable::{
    Dots, add_blocks, block_dots, dot_pair, find_square, keep_greatest, mean_dot, reduce_sixfold,
    square_root, statistics, subtract_pairs, sum_cuts,
};

pub(crate) use cuts::{Cuts, MAX_COLUMNS};
pub use edges::{EDGE_WORDS, compare_at_edges};
pub use twins::{Disagreement, compare};

/// Basis rows that are stored, and multiplied, together.
///
/// Five accumulators are what the registers of a Cortex-M4 leave room for beside pixels, weights and pointers.
pub const ROWS_PER_BLOCK: usize = 5;

/// Pixels that are stored, and multiplied, together: one 32-bit load.
pub const PIXELS_PER_GROUP: usize = 4;

/// Words of weights of one group of pixels in a block.
const PAIRS_PER_GROUP: usize = ROWS_PER_BLOCK * PIXELS_PER_GROUP / 2;

/// Side of a block that has a kernel of its own: 120 pixels of a camera's frame to 20 of a view.
pub(crate) const SIX: usize = 6;

/// Rows of a table whose dot products are computed together.
pub(crate) const BATCH: usize = 128;

/// A group of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C, align(4))]
pub struct Pixels(pub [u8; PIXELS_PER_GROUP]);

/// The 8-bit weights of a group of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C, align(4))]
pub struct Weights(pub [i8; PIXELS_PER_GROUP]);

/// Two weights or coefficients of 16 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C, align(4))]
pub struct Pair(pub [i16; 2]);

/// Width of a stored coefficient.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Width {
    /// 16 bits.
    I16,
    /// 8 bits, in pairs.
    I8,
}

/// A row of a table and its fraction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ranked {
    /// The row; `u32::MAX` for none.
    pub row: u32,
    /// Numerator.
    pub numerator: i32,
    /// Denominator; positive.
    pub denominator: i32,
}

/// The two greatest of some fractions, the greatest first; of equals the earlier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Greatest {
    /// The greatest.
    pub first: Ranked,
    /// The second greatest.
    pub second: Ranked,
}

impl Greatest {
    /// No row, and a fraction less than that of any.
    pub const NONE: Self = {
        let none = Ranked {
            row: u32::MAX,
            numerator: i32::MIN,
            denominator: 1,
        };
        Self {
            first: none,
            second: none,
        }
    };

    /// Takes in a row, by whatever `is_greater` says.
    #[inline]
    pub fn take(&mut self, ranked: Ranked, is_greater: impl Fn(&Ranked, &Ranked) -> bool) {
        if is_greater(&ranked, &self.first) {
            self.second = self.first;
            self.first = ranked;
        } else if is_greater(&ranked, &self.second) {
            self.second = ranked;
        }
    }
}

impl Ranked {
    /// Whether this fraction is greater than another, exactly.
    #[inline]
    #[must_use]
    pub fn is_greater(&self, than: &Self) -> bool {
        i64::from(than.numerator) * i64::from(self.denominator)
            < i64::from(self.numerator) * i64::from(than.denominator)
    }
}

impl Width {
    /// Words per row for a view of as many as `view`.
    fn words(self, view: &[Pair]) -> usize {
        match self {
            Self::I16 => view.len(),
            Self::I8 => view.len() / 2,
        }
    }
}

/// Prepares a view's coefficients g for a table of 8-bit ones: for every four of them (g1, g3) and (256·g0 − g1,
/// 256·g2 − g3).
///
/// A stored pair is 256·b + a, so g1·(256·b + a) + (256·g0 − g1)·a = 256·(g0·a + g1·b): two multiplications, and only
/// a has to be extracted. The products fit for coefficients within ±127.
pub(crate) fn split(coefficients: &[Pair], target: &mut [Pair]) {
    let low = |even: i16, odd: i16| even.wrapping_mul(256).wrapping_sub(odd);
    for (g, target) in coefficients.chunks_exact(2).zip(target.chunks_exact_mut(2)) {
        if let (&[Pair([g0, g1]), Pair([g2, g3])], [odd, even]) = (g, target) {
            *odd = Pair([g1, g3]);
            *even = Pair([low(g0, g1), low(g2, g3)]);
        }
    }
}
