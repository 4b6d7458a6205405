//! Whether the fast kernels give the bits of their portable twins, on pseudo-random input of every shape.

use super::{BATCH, Cuts, Greatest, PAIRS_PER_GROUP, Pair, Pixels, Weights, Width, portable};

/// The longest run of pixels that is tried, in groups.
const MAX_GROUPS: usize = 128;

/// Words that are enough for the weights of as many groups, and for some rows of coefficients.
const MAX_PAIRS: usize = MAX_GROUPS * PAIRS_PER_GROUP;

/// The longest row of coefficients that is tried, in words.
const MAX_ROW: usize = 64;

/// A kernel whose twins disagree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Disagreement {
    /// Sums of blocks of a row.
    AddBlocks,
    /// Sums of fractional columns of a row.
    SumCuts,
    /// Reduction by a whole ratio of six.
    ReduceSixfold,
    /// Projection on a block of rows.
    BlockDots,
    /// Projection on the mean row.
    MeanDot,
    /// Sums of a view.
    Statistics,
    /// Matching with 16-bit coefficients.
    DotsI16,
    /// Matching with 8-bit coefficients.
    DotsI8,
    /// Products and differences of pairs.
    Pairs,
    /// Comparing landmarks by fractions.
    KeepGreatest,
    /// Comparing landmarks by squares.
    FindSquare,
    /// Square roots.
    SquareRoot,
}

/// Numerical Recipes' generator: any sequence will do.
pub(super) struct Random(pub(super) u32);

impl Random {
    pub(super) fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.0 >> 8
    }

    pub(super) fn below(&mut self, limit: usize) -> usize {
        self.next() as usize % limit
    }

    /// Extreme values are frequent: sums overflow where they can.
    pub(super) fn byte(&mut self) -> u8 {
        match self.next() % 8 {
            0 => 0,
            1 => 255,
            _ => self.next() as u8,
        }
    }

    pub(super) fn pair(&mut self) -> Pair {
        Pair([self.number(), self.number()])
    }

    fn number(&mut self) -> i16 {
        match self.next() % 16 {
            0 => i16::MIN,
            1 => i16::MAX,
            _ => self.next() as i16,
        }
    }
}

/// Compares every kernel with its twin in `cases` cases that follow from `seed`.
///
/// # Errors
/// The first kernel whose twins disagree.
#[inline(never)] // its cases are not the caller's
pub fn compare(seed: u32, cases: u32) -> Result<(), Disagreement> {
    let mut random = Random(seed);
    let (mut pairs, mut view) = ([Pair::default(); MAX_PAIRS], [Pair::default(); 2 * MAX_ROW]);
    let (mut pixels, mut weights) = (
        [Pixels::default(); MAX_GROUPS],
        [Weights::default(); MAX_GROUPS],
    );
    pairs.fill_with(|| random.pair());
    for _ in 0..cases {
        // A few fresh ones per case: to fill everything would take most of the time.
        for _ in 0..8 {
            pairs[random.below(MAX_PAIRS)] = random.pair();
        }
        pixels.fill_with(|| Pixels(core::array::from_fn(|_| random.byte())));
        weights.fill_with(|| Weights(core::array::from_fn(|_| random.byte() as i8)));
        view.fill_with(|| random.pair());
        let groups = random.below(MAX_GROUPS + 1);
        compare_reduction(bytemuck::cast_slice(&pixels), &mut random)?;
        compare_projection(&pixels[..groups], &pairs, &weights)?;
        let words = match random.below(4) {
            0 => 8,
            _ => random.below(MAX_ROW + 1),
        };
        // Sometimes one more than there are.
        let count = random.below(MAX_PAIRS / words.max(1) + 2);
        for (width, view) in [
            (Width::I16, &view[..words]),
            (Width::I8, &view[..2 * words]),
        ] {
            compare_dots(width, view, &pairs, count)?;
        }
        compare_pairs(&pairs)?;
        compare_greatest(&mut random)?;
        compare_roots(&mut random)?;
    }
    Ok(())
}

/// Also runs that start between words, and blocks that the pixels do not hold.
fn compare_reduction(pixels: &[u8], random: &mut Random) -> Result<(), Disagreement> {
    let (start, len, block) = (random.below(8), random.below(400), random.below(18));
    let run = &pixels[start..start + len];
    let (mut fast, mut plain) = ([7; 40], [7; 40]);
    super::add_blocks(run, block, &mut fast);
    portable::add_blocks(run, block, &mut plain);
    agree(fast == plain, Disagreement::AddBlocks)?;
    let cuts = Cuts::new(random.below(400) as u16, random.below(40) as u8);
    let run = &pixels[start..];
    super::sum_cuts(run, &cuts, &mut fast);
    portable::sum_cuts(run, &cuts, &mut plain);
    agree(fast == plain, Disagreement::SumCuts)?;
    // Half of the cases as a camera has them: even, and mostly at whole words.
    let (stride, count) = match random.below(2) {
        0 => (4 * random.below(25), 2 * random.below(9)),
        _ => (random.below(100), random.below(17)),
    };
    let start = start & !(3 * random.below(2));
    let (mut fast, mut plain) = ([0; 16], [0; 16]);
    super::reduce_sixfold(&pixels[start..], stride, &mut fast[..count]);
    portable::reduce_sixfold(&pixels[start..], stride, &mut plain[..count]);
    agree(fast == plain, Disagreement::ReduceSixfold)
}

fn compare_projection(
    pixels: &[Pixels],
    pairs: &[Pair],
    weights: &[Weights],
) -> Result<(), Disagreement> {
    let block = super::block_dots(pixels, pairs) == portable::block_dots(pixels, pairs);
    agree(block, Disagreement::BlockDots)?;
    let mean = super::mean_dot(pixels, weights) == portable::mean_dot(pixels, weights);
    agree(mean, Disagreement::MeanDot)?;
    let sums = super::statistics(pixels) == portable::statistics(pixels);
    agree(sums, Disagreement::Statistics)
}

fn compare_dots(
    width: Width,
    view: &[Pair],
    rows: &[Pair],
    count: usize,
) -> Result<(), Disagreement> {
    let (mut fast, mut plain) = (super::Dots::new(), portable::Dots::new());
    let is_same = fast.of(width, view, rows, count) == plain.of(width, view, rows, count);
    agree(
        is_same,
        match width {
            Width::I16 => Disagreement::DotsI16,
            Width::I8 => Disagreement::DotsI8,
        },
    )
}

fn compare_pairs(pairs: &[Pair]) -> Result<(), Disagreement> {
    let words: &[u32] = bytemuck::cast_slice(pairs);
    let (mut fast, mut plain) = (0, 0);
    for two in words.windows(2).take(64) {
        let &[a, b] = two else { continue };
        fast = super::dot_pair(a, b, fast);
        plain = portable::dot_pair(a, b, plain);
        let is_same = super::subtract_pairs(a, b) == portable::subtract_pairs(a, b);
        agree(is_same && fast == plain, Disagreement::Pairs)?;
    }
    Ok(())
}

fn compare_greatest(random: &mut Random) -> Result<(), Disagreement> {
    // Dot products and squared norms are smaller than what random rows give.
    let (mut dots, mut norms) = ([0; BATCH], [0; BATCH]);
    let shift = random.below(6);
    let mut offset = random.next() as i32;
    if random.below(4) == 0 {
        // Few values: fractions tie.
        dots.fill_with(|| random.below(4) as i32 - 1);
        norms.fill_with(|| random.below(3) as u32 + 1);
        offset = random.below(2) as i32;
    } else {
        dots.fill_with(|| (random.next() as i32 - (1 << 23)) << shift);
        norms.fill_with(|| (random.next() + 1) << shift);
    }
    let (mut fast, mut plain) = (Greatest::NONE, Greatest::NONE);
    for start in [0, 1000] {
        let len = random.below(BATCH + 1);
        super::keep_greatest(&dots[..len], &norms, offset, start, &mut fast);
        portable::keep_greatest(&dots[..len], &norms, offset, start, &mut plain);
        dots.rotate_left(len);
    }
    agree(fast == plain, Disagreement::KeepGreatest)?;
    let (len, least) = (random.below(BATCH + 1), random.next() as f32 * 64.0);
    let is_same = super::find_square(&dots[..len], &norms, least)
        == portable::find_square(&dots[..len], &norms, least);
    agree(is_same, Disagreement::FindSquare)
}

/// Of any bits; numbers that are none are all the same.
fn compare_roots(random: &mut Random) -> Result<(), Disagreement> {
    for _ in 0..16 {
        let x = f32::from_bits(random.next() << 8 ^ random.next());
        let (fast, plain) = (super::square_root(x), portable::square_root(x));
        let is_same = fast.to_bits() == plain.to_bits() || (fast.is_nan() && plain.is_nan());
        agree(is_same, Disagreement::SquareRoot)?;
    }
    Ok(())
}

pub(super) fn agree(holds: bool, otherwise: Disagreement) -> Result<(), Disagreement> {
    if holds { Ok(()) } else { Err(otherwise) }
}
