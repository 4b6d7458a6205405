//! How windows are cut into tiles, and how large a tile is transformed.
//!
//! **Notation.** q map pixels per window, v view pixels, s = q/v. Windows whose corners are congruent modulo s are one
//! phase: windows of v×v pixels at every pixel of a picture of block means.
//!
//! **Method.** A transform of L numbers holds L − v + 1 windows along an axis. Larger ones waste less on the overlap of
//! v − 1, smaller ones are cheaper per number and stay in the cache; every pair of fast lengths is tried on paper. Tiles
//! of an axis are as equal as can be.
//!
//! **Cost.** The work of a length is what was measured with rustfft 6.4 (AVX, f64; 400 to 1800 numbers): per number,
//! a factor of 3 takes twice as long as a factor of 2, a factor of 5 three and a half times.

/// The largest transform along an axis, except for views more than half as large.
pub(super) const LARGEST: usize = 2048;

/// Complex numbers in the spectra of all kernels: 256 MiB. Exceeded only when the smallest transforms do.
const SPECTRA: usize = 16 << 20;

/// What is to be projected.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task {
    /// Columns and rows of window positions, in map pixels.
    pub(super) positions: (u32, u32),
    /// Map pixels per view pixel, s.
    pub(super) block_px: u32,
    /// Pixels per side of a view, v.
    pub(super) side: usize,
    /// Kernels, k.
    pub(super) kernels: usize,
}

/// Windows of one phase that are transformed together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tile {
    /// Corner of the first window, in map pixels.
    pub(super) corner: (u32, u32),
    /// Windows per row.
    pub(super) columns: usize,
    /// Rows of windows.
    pub(super) rows: usize,
}

/// A transform for all tiles, and the tiles.
#[derive(Debug)]
pub(super) struct Layout {
    /// Width and height of the transform.
    pub(super) transform: (usize, usize),
    /// The most windows that a tile has.
    pub(super) windows: usize,
    /// Every window is in one of them.
    pub(super) tiles: Vec<Tile>,
}

impl Layout {
    /// The cheapest layout of all phases, with transforms of up to `largest` numbers along an axis.
    pub(super) fn new(task: &Task, largest: usize) -> Self {
        let count = |positions: u32| positions.min(task.block_px);
        let (columns, rows) = (count(task.positions.0), count(task.positions.1));
        let phases = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
        Self::of_phases(task, phases, largest)
    }

    /// The same of some phases: the corners of their first windows.
    pub(super) fn of_phases(
        task: &Task,
        phases: impl IntoIterator<Item = (u32, u32)>,
        largest: usize,
    ) -> Self {
        let (columns, rows) = task.positions;
        // The first phase has the most windows.
        let most = [columns, rows].map(|count| count.div_ceil(task.block_px) as usize);
        let transform = task.transform(most, largest);
        let spans = [transform.0, transform.1].map(|length| length - task.side + 1);
        let mut tiles = Vec::new();
        for (x, y) in phases {
            let across = cuts((columns - x).div_ceil(task.block_px) as usize, spans[0]);
            for (top, rows) in cuts((rows - y).div_ceil(task.block_px) as usize, spans[1]) {
                tiles.extend(across.iter().map(|&(left, columns)| {
                    let corner = [(x, left), (y, top)];
                    let [x, y] = corner.map(|(phase, at)| phase + at as u32 * task.block_px);
                    Tile {
                        corner: (x, y),
                        columns,
                        rows,
                    }
                }));
            }
        }
        let windows = tiles.iter().map(|tile| tile.columns * tile.rows).max();
        Self {
            transform,
            windows: windows.unwrap_or(0),
            tiles,
        }
    }
}

impl Task {
    /// The cheapest transform for phases of `most` columns and rows of windows.
    fn transform(&self, most: [usize; 2], largest: usize) -> (usize, usize) {
        let [widths, heights] = most.map(|count| self.lengths(count, largest));
        let pairs = widths
            .iter()
            .flat_map(|&width| heights.iter().map(move |&height| (width, height)));
        // Too large for memory is worse than any work, and the smallest of those is the best.
        let cost = |&(width, height): &(usize, usize)| {
            let spectra = self.kernels * (width / 2 + 1) * height;
            (spectra.max(SPECTRA), self.work((width, height), most))
        };
        pairs.min_by_key(cost).expect("a power of two is fast")
    }

    /// Fast lengths for an axis of `count` windows, up to the first that holds them all.
    fn lengths(&self, count: usize, largest: usize) -> Vec<usize> {
        let largest = largest.max(2 * self.side);
        let mut lengths = Vec::new();
        for length in (self.side..=largest).filter(|&length| is_fast(length)) {
            lengths.push(length);
            if length >= count + self.side - 1 {
                break;
            }
        }
        lengths
    }

    /// What all transforms take: of kernels, of tiles, and back.
    fn work(&self, (width, height): (usize, usize), most: [usize; 2]) -> usize {
        let span = [width, height].map(|length| length - self.side + 1);
        let tiles = most[0].div_ceil(span[0]) * most[1].div_ceil(span[1]);
        let tiles = tiles * (self.block_px * self.block_px) as usize;
        let columns = (width / 2 + 1) * work(height);
        // A real row takes half of a complex one, and as much as a quarter to split.
        let row = work(width) * 3 / 4;
        let kernel = columns + self.side * row;
        let picture = columns + height * row;
        let back = columns + span[1].min(most[1]) * row;
        self.kernels * kernel + tiles * (picture + self.kernels * back)
    }
}

/// `count` windows in parts of up to `span`, as equal as can be: the first window of each, and how many.
fn cuts(count: usize, span: usize) -> Vec<(usize, usize)> {
    let parts = count.div_ceil(span);
    let borders = (0..=parts).map(|part| count * part / parts);
    let starts: Vec<usize> = borders.collect();
    starts
        .windows(2)
        .map(|pair| (pair[0], pair[1] - pair[0]))
        .collect()
}

/// Whether a length is even and has no prime factors but 2, 3 and 5.
fn is_fast(length: usize) -> bool {
    let ([twos, ..], rest) = factors(length);
    twos > 0 && rest == 1
}

/// Twice the work of a complex transform, in units of a factor of 2 of one number.
fn work(length: usize) -> usize {
    let ([twos, threes, fives], _) = factors(length);
    length * (2 * twos + 4 * threes + 7 * fives)
}

/// How often 2, 3 and 5 divide a number, and what is left of it.
fn factors(mut number: usize) -> ([usize; 3], usize) {
    let counts = [2, 3, 5].map(|prime| {
        let mut count = 0;
        while number > 0 && number.is_multiple_of(prime) {
            number /= prime;
            count += 1;
        }
        count
    });
    (counts, number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_window_is_in_one_tile() {
        for (positions, block_px, side, largest) in [
            ((1, 1), 1, 1, 8),
            ((41, 1), 1, 7, 16),
            ((30, 53), 3, 5, 16),
            ((2, 9), 4, 6, 2),
        ] {
            let task = Task {
                positions,
                block_px,
                side,
                kernels: 3,
            };
            let layout = Layout::new(&task, largest);
            let mut seen = vec![0; (positions.0 * positions.1) as usize];
            for tile in &layout.tiles {
                assert!(tile.columns + side - 1 <= layout.transform.0);
                assert!(tile.rows + side - 1 <= layout.transform.1);
                assert!(tile.columns * tile.rows <= layout.windows);
                for at in 0..tile.columns * tile.rows {
                    let x = tile.corner.0 + (at % tile.columns) as u32 * block_px;
                    let y = tile.corner.1 + (at / tile.columns) as u32 * block_px;
                    seen[(y * positions.0 + x) as usize] += 1;
                }
            }
            assert!(seen.iter().all(|&times| times == 1), "{task:?}");
        }
    }

    #[test]
    fn fast_lengths_are_even_and_smooth() {
        let lengths: Vec<usize> = (0..41).filter(|&length| is_fast(length)).collect();
        assert_eq!(
            lengths,
            [2, 4, 6, 8, 10, 12, 16, 18, 20, 24, 30, 32, 36, 40]
        );
    }

    #[test]
    fn many_large_kernels_take_smaller_transforms() {
        let task = |kernels| Task {
            positions: (4000, 4000),
            block_px: 1,
            side: 100,
            kernels,
        };
        let size = |kernels| {
            let (width, height) = Layout::new(&task(kernels), LARGEST).transform;
            kernels * (width / 2 + 1) * height
        };
        assert!(size(10) <= SPECTRA && size(300) <= SPECTRA);
    }
}
