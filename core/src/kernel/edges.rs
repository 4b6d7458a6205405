//! Whether the fast kernels stay within what they are given: each of their slices in turn lies at an edge of a room that
//! the caller guards, so that to read or write beyond it is a fault.

use super::{
    BATCH, Cuts, Disagreement, Greatest, PAIRS_PER_GROUP, PIXELS_PER_GROUP, Pair, Pixels, SIX,
    Weights, Width, portable,
    twins::{Random, agree},
};
use bytemuck::Pod;

/// Groups of pixels that are enough for every unrolled loop and its remainder.
const MAX_GROUPS: usize = 24;

/// Words of coefficients per row, likewise.
const MAX_ROW: usize = 20;

/// Words of the largest slice: the weights of all groups.
const MAX_WORDS: usize = MAX_GROUPS * PAIRS_PER_GROUP;

/// The room that [`compare_at_edges`] needs, in words.
pub const EDGE_WORDS: usize = 256;

const _: () = assert!(MAX_WORDS <= EDGE_WORDS && BATCH <= EDGE_WORDS);

/// Compares every kernel with its twin in `cases` cases that follow from `seed`, with what it reads, and then what it
/// writes, at an edge of `room`.
///
/// # Errors
/// The first kernel whose twins disagree.
#[inline(never)] // its arrays are not the caller's
pub fn compare_at_edges(
    seed: u32,
    cases: u32,
    room: &mut [u32; EDGE_WORDS],
) -> Result<(), Disagreement> {
    let mut random = Random(seed);
    for _ in 0..cases {
        compare_pixels(&mut random, room)?;
        compare_rows(&mut random, room)?;
        compare_fractions(&mut random, room)?;
    }
    Ok(())
}

/// A copy of `values` at the start or at the end of the room.
fn at_edge<'r, T: Pod>(
    room: &'r mut [u32; EDGE_WORDS],
    random: &mut Random,
    values: &[T],
) -> &'r mut [T] {
    let room: &mut [T] = bytemuck::cast_slice_mut(room);
    let start = match random.next() % 4 {
        0 => 0,
        _ => room.len() - values.len(),
    };
    let place = &mut room[start..start + values.len()];
    place.copy_from_slice(values);
    place
}

fn compare_pixels(random: &mut Random, room: &mut [u32; EDGE_WORDS]) -> Result<(), Disagreement> {
    let pixels: [Pixels; MAX_GROUPS] =
        core::array::from_fn(|_| Pixels(core::array::from_fn(|_| random.byte())));
    let weights: [Weights; MAX_GROUPS] =
        core::array::from_fn(|_| Weights(core::array::from_fn(|_| random.byte() as i8)));
    let pairs: [Pair; MAX_WORDS] = core::array::from_fn(|_| random.pair());
    let groups = random.below(MAX_GROUPS + 1);
    let (pixels, weights) = (&pixels[..groups], &weights[..groups]);
    let pairs = &pairs[..groups * PAIRS_PER_GROUP];

    let expected = portable::block_dots(pixels, pairs);
    let block = super::block_dots(at_edge(room, random, pixels), pairs) == expected
        && super::block_dots(pixels, at_edge(room, random, pairs)) == expected;
    agree(block, Disagreement::BlockDots)?;

    let expected = portable::mean_dot(pixels, weights);
    let mean = super::mean_dot(at_edge(room, random, pixels), weights) == expected
        && super::mean_dot(pixels, at_edge(room, random, weights)) == expected;
    agree(mean, Disagreement::MeanDot)?;

    let sums = super::statistics(at_edge(room, random, pixels)) == portable::statistics(pixels);
    agree(sums, Disagreement::Statistics)?;

    let bytes: &[u8] = bytemuck::cast_slice(pixels);
    let run = &bytes[random.below(PIXELS_PER_GROUP).min(bytes.len())..];
    let block = random.below(13);
    let (mut plain, mut fast) = ([7; 8], [7; 8]);
    portable::add_blocks(run, block, &mut plain);
    super::add_blocks(at_edge(room, random, run), block, &mut fast);
    let sums = at_edge(room, random, &[7; 8]);
    super::add_blocks(run, block, sums);
    agree(fast == plain && *sums == plain, Disagreement::AddBlocks)?;

    let cuts = Cuts::new(run.len() as u16, random.below(9) as u8);
    portable::sum_cuts(run, &cuts, &mut plain);
    super::sum_cuts(at_edge(room, random, run), &cuts, &mut fast);
    let sums = at_edge(room, random, &fast);
    super::sum_cuts(run, &cuts, sums);
    agree(fast == plain && *sums == plain, Disagreement::SumCuts)?;

    // Rows of `blocks` blocks, packed so that the last one ends where the source does.
    let blocks = random.below(3);
    let stride = blocks * SIX + random.below(2) * 4;
    let mut source = [0; (2 * SIX + 4) * SIX];
    source.fill_with(|| random.byte());
    let source = &source[..stride * (SIX - 1) + blocks * SIX];
    let (mut plain, mut fast) = ([0; 2], [0; 2]);
    portable::reduce_sixfold(source, stride, &mut plain[..blocks]);
    super::reduce_sixfold(at_edge(room, random, source), stride, &mut fast[..blocks]);
    let view = at_edge(room, random, &[0; 2][..blocks]);
    super::reduce_sixfold(source, stride, view);
    let is_same = fast == plain && *view == plain[..blocks];
    agree(is_same, Disagreement::ReduceSixfold)
}

fn compare_rows(random: &mut Random, room: &mut [u32; EDGE_WORDS]) -> Result<(), Disagreement> {
    let words = random.below(MAX_ROW + 1);
    let rows: [Pair; EDGE_WORDS] = core::array::from_fn(|_| random.pair());
    let count = random.below(EDGE_WORDS / words.max(1) + 1);
    let rows = &rows[..count * words];
    let view: [Pair; 2 * MAX_ROW] = core::array::from_fn(|_| random.pair());
    for (width, len, otherwise) in [
        (Width::I16, words, Disagreement::DotsI16),
        (Width::I8, 2 * words, Disagreement::DotsI8),
    ] {
        let view = &view[..len];
        let (mut fast, mut plain) = (super::Dots::new(), portable::Dots::new());
        let expected = plain.of(width, view, rows, count);
        let is_same = fast.of(width, at_edge(room, random, view), rows, count) == expected
            && fast.of(width, view, at_edge(room, random, rows), count) == expected;
        agree(is_same, otherwise)?;
    }
    Ok(())
}

fn compare_fractions(
    random: &mut Random,
    room: &mut [u32; EDGE_WORDS],
) -> Result<(), Disagreement> {
    let (mut dots, mut norms) = ([0_i32; BATCH], [0_u32; BATCH]);
    dots.fill_with(|| random.next() as i32 - (1 << 23));
    norms.fill_with(|| random.next() + 1);
    let len = random.below(BATCH + 1);
    let (dots, norms) = (&dots[..len], &norms[..len]);
    let (offset, least) = (random.next() as i32, random.next() as f32 * 64.0);

    let mut greatest = [Greatest::NONE; 3];
    let [plain, by_dots, by_norms] = &mut greatest;
    portable::keep_greatest(dots, norms, offset, 0, plain);
    super::keep_greatest(at_edge(room, random, dots), norms, offset, 0, by_dots);
    super::keep_greatest(dots, at_edge(room, random, norms), offset, 0, by_norms);
    agree(
        plain == by_dots && plain == by_norms,
        Disagreement::KeepGreatest,
    )?;

    let expected = portable::find_square(dots, norms, least);
    let is_same = super::find_square(at_edge(room, random, dots), norms, least) == expected
        && super::find_square(dots, at_edge(room, random, norms), least) == expected;
    agree(is_same, Disagreement::FindSquare)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twins_agree_at_the_edges() {
        let mut room = [0; EDGE_WORDS];
        assert_eq!(compare_at_edges(1, 50, &mut room), Ok(()));
    }
}
