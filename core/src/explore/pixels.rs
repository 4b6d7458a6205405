//! The loops over the pixels: all that grows with m.
//!
//! **Layout.** One row of `SLOTS` numbers per pixel: the pixel's values in the k eigenimages, zeros up to the last
//! slot, and there what is being worked on, first x − x̄, then the residual. So every loop walks memory once, forward,
//! and a rotation of the basis happens in place.
//!
//! **Method.** Sums run over pixels, or over slots, from first to last, one rounding per multiplication and one per
//! addition, whatever the compiler makes of it. A rotation works on [`PIXELS_PER_BLOCK`] × [`COLUMNS_PER_BLOCK`] sums
//! at a time: with a column of pixels and a row of the rotation they fit the 32 registers of a Cortex-M4F's
//! floating-point unit. Rejected: 4 × 5, which spills and costs 17,000 instructions more per update of 400 pixels and
//! 15 dimensions.
//!
//! **Cost.** On a Cortex-M4F 2.0 instructions per multiply-add of a rotation, 2.5 of a subtraction, 2.7 of a
//! correlation.

/// Pixels rotated together.
const PIXELS_PER_BLOCK: usize = 3;

/// Columns of a rotation applied together.
const COLUMNS_PER_BLOCK: usize = 5;

/// Fills the last slots with x − x̄. Returns ‖x − x̄‖² and ‖x̄‖².
pub fn load<P: Copy + Into<f32>, const SLOTS: usize>(
    rows: &mut [[f32; SLOTS]],
    mean: &[f32],
    view: &[P],
) -> (f32, f32) {
    let (mut energy, mut mean_energy) = (0.0, 0.0);
    for ((row, &mean), &pixel) in rows.iter_mut().zip(mean).zip(view) {
        let deviation = pixel.into() - mean;
        row[SLOTS - 1] = deviation;
        energy += deviation * deviation;
        mean_energy += mean * mean;
    }
    (energy, mean_energy)
}

/// Σ over the pixels of each eigenimage times what is in `slot`. The last sum stays 0.
#[inline(never)]
pub fn correlate<const SLOTS: usize>(rows: &[[f32; SLOTS]], slot: usize) -> [f32; SLOTS] {
    let (mut sums, slot) = ([0.0; SLOTS], slot.min(SLOTS - 1));
    for row in rows {
        let value = row[slot];
        for (sum, eigenimage) in sums[..SLOTS - 1].iter_mut().zip(row) {
            *sum += eigenimage * value;
        }
    }
    sums
}

/// Takes Tg from the last slots. Returns the energy of what is left.
#[inline(never)]
pub fn subtract<const SLOTS: usize>(rows: &mut [[f32; SLOTS]], coordinates: &[f32; SLOTS]) -> f32 {
    let mut energy = 0.0;
    for row in rows {
        let mut sum = 0.0;
        for (eigenimage, coordinate) in row[..SLOTS - 1].iter().zip(coordinates) {
            sum += eigenimage * coordinate;
        }
        row[SLOTS - 1] -= sum;
        energy += row[SLOTS - 1] * row[SLOTS - 1];
    }
    energy
}

/// Replaces every row by row · `rotation`, all columns but the last; the last slots stay as they are.
///
/// `rotation` is row-major: one array per slot of the input.
#[inline(never)]
pub fn rotate<const SLOTS: usize>(rows: &mut [[f32; SLOTS]], rotation: &[[f32; SLOTS]; SLOTS]) {
    let (blocks, rest) = rows.as_chunks_mut::<PIXELS_PER_BLOCK>();
    for block in blocks {
        rotate_block(block, rotation);
    }
    for row in rest {
        rotate_block(core::array::from_mut(row), rotation);
    }
}

fn rotate_block<const PIXELS: usize, const SLOTS: usize>(
    rows: &mut [[f32; SLOTS]; PIXELS],
    rotation: &[[f32; SLOTS]; SLOTS],
) {
    // Transposed, which also keeps the compiler from calling `memcpy`.
    let mut input = [[0.0; PIXELS]; SLOTS];
    for (slot, column) in input.iter_mut().enumerate() {
        for (value, row) in column.iter_mut().zip(rows.iter()) {
            *value = row[slot];
        }
    }
    let mut first = 0;
    while first + COLUMNS_PER_BLOCK < SLOTS {
        rotate_columns::<PIXELS, COLUMNS_PER_BLOCK, SLOTS>(&input, rotation, first, rows);
        first += COLUMNS_PER_BLOCK;
    }
    while first + 1 < SLOTS {
        rotate_columns::<PIXELS, 1, SLOTS>(&input, rotation, first, rows);
        first += 1;
    }
}

/// Columns `first`… of the product, `COLUMNS` of them.
#[inline(always)]
fn rotate_columns<const PIXELS: usize, const COLUMNS: usize, const SLOTS: usize>(
    input: &[[f32; PIXELS]; SLOTS],
    rotation: &[[f32; SLOTS]; SLOTS],
    first: usize,
    output: &mut [[f32; SLOTS]; PIXELS],
) {
    let mut sums = [[0.0; COLUMNS]; PIXELS];
    for (pixels, weights) in input.iter().zip(rotation) {
        for (sums, pixel) in sums.iter_mut().zip(pixels) {
            for (sum, weight) in sums.iter_mut().zip(&weights[first..first + COLUMNS]) {
                *sum += pixel * weight;
            }
        }
    }
    for (sums, row) in sums.iter().zip(output) {
        row[first..first + COLUMNS].copy_from_slice(sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rotated<const SLOTS: usize>(
        rows: &[[f32; SLOTS]],
        rotation: &[[f32; SLOTS]; SLOTS],
    ) -> std::vec::Vec<[f32; SLOTS]> {
        let product = |row: &[f32; SLOTS], column: usize| {
            (0..SLOTS).fold(0.0, |sum, slot| sum + row[slot] * rotation[slot][column])
        };
        rows.iter()
            .map(|row| {
                let kept = row[SLOTS - 1];
                core::array::from_fn(|c| if c + 1 < SLOTS { product(row, c) } else { kept })
            })
            .collect()
    }

    fn rotate_is_the_product<const SLOTS: usize>(values: &[f32], pixels: usize) {
        let mut values = values.iter().copied().cycle();
        let mut next = || core::array::from_fn(|_| values.next().expect("endless"));
        let mut rows: std::vec::Vec<[f32; SLOTS]> = (0..pixels).map(|_| next()).collect();
        let rotation = core::array::from_fn(|_| next());
        let expected = rotated(&rows, &rotation);
        rotate(&mut rows, &rotation);
        assert_eq!(rows, expected);
    }

    proptest! {
        #[test]
        fn rotate_matches_reference(
            values in prop::collection::vec(-1.0_f32..1.0, 1..200),
            pixels in 0_usize..8,
        ) {
            rotate_is_the_product::<2>(&values, pixels);
            rotate_is_the_product::<6>(&values, pixels);
            rotate_is_the_product::<9>(&values, pixels);
            rotate_is_the_product::<16>(&values, pixels);
        }
    }

    #[test]
    fn a_view_in_the_basis_leaves_nothing() {
        // Two eigenimages of three pixels, along the first two axes.
        let mut rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]];
        assert_eq!(
            load(&mut rows, &[1.0, 1.0, 1.0], &[4_u8, 5, 1]),
            (25.0, 3.0)
        );
        let coordinates = correlate(&rows, 2);
        assert_eq!(coordinates, [3.0, 4.0, 0.0]);
        assert_eq!(subtract(&mut rows, &coordinates), 0.0);
    }
}
