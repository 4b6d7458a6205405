//! Dense projection: weight rows times the view of the window at every pixel of a map.
//!
//! Catchment areas, localization matrices and dense tables need the coefficients of all windows, not of a grid of them.
//! What contrast normalization needs, Σy and Σy², comes along; the rest is affine in these numbers
//! ([`Preprocess::fold`](crate::learn::Preprocess::fold) turns filters into weights).
//!
//! **Notation.** q map pixels per side of a window ([`Dense::new`]'s `window_px`), v view pixels (`side`), s = q/v; y the
//! v² pixels of a view, area means rounded half up to 8 bits: the bits of [`Integral::reduce`] and of the core. w is one
//! of k weight rows, c = w·y.
//!
//! **Method.** When s is whole, a view pixel is the rounded mean of s×s map pixels. All windows whose corners are
//! congruent modulo s see the same picture of such means, at every pixel of it: s² pictures, and in each k correlations
//! by the Fourier transform. Pictures are cut into overlapping tiles that fit memory and cache; one transform size
//! serves all, and each kernel is transformed once. When s is not whole, rounding differs from one window to the next and
//! nothing is shared: every window is reduced and multiplied ([`Dense::project_directly`]), a block of them at once.
//!
//! **Cost.** For 15 rows of 200×200 on 1600×1200 pixels, s = 1: 0.6 s of processor time, a third of it for fresh
//! pages; the direct way takes 840 billion multiplications. Spectra take 8 bytes per weight times (L/v)², L the length of
//! a transform; results of a batch of tiles take as much at most, or 32 MiB. `layout.rs` has the limits.
//!
//! **Limits.** Fast and direct dots differ by rounding, by less than [`TOLERANCE`]·‖w‖·255·v; sums are exact. Results are
//! the same for any number of threads, but their last bits may differ between kinds of processors. The direct way takes
//! k·v² multiplications per window.

mod correlate;
mod layout;
mod part;
mod sums;

use eigenmark_core::frame::MAX_SIDE;
use faer::{Accum, MatMut, MatRef, Par, linalg::matmul::matmul};
use image::GrayImage;
use rayon::prelude::*;

use crate::map::Integral;
use correlate::{Correlator, Spectrum};
use layout::{Layout, Task, Tile};

pub use part::Part;
pub use sums::Sums;

/// How far dots may be from the direct ones, relative to the most that weights of the same norm make of any view,
/// ‖w‖·255·v. Measured: up to 3·10⁻¹⁶ for random weights of both signs; for positive ones 10⁻¹⁵ for views of 20×20 and
/// 1.2·10⁻¹⁴ for 200×200, which grows with the view as the rounding of the direct sum does: whole weights, whose direct
/// sum is exact, stay below 2·10⁻¹⁶.
pub const TOLERANCE: f64 = 1e-13;

/// Dots that are kept at once: 32 MiB. A tile with more is a batch of its own.
const RESULTS: usize = 4 << 20;

/// Rows of windows that are handed over at once.
const BAND: usize = 64;

/// Windows that are multiplied at once, directly.
const BLOCK: usize = 64;

/// A map and the weight rows that the view of every window is multiplied with.
#[derive(Clone, Debug)]
pub struct Dense<'a> {
    integral: Integral,
    positions: (u32, u32),
    window_px: u32,
    side: usize,
    rows: &'a [f64],
    /// Largest transform along an axis.
    largest: usize,
}

/// A tile's picture and spectrum, and its sums.
struct Prepared<'a> {
    tile: &'a Tile,
    spectrum: Spectrum,
    sums: Vec<Sums>,
}

impl<'a> Dense<'a> {
    /// Windows of `window_px` pixels per side on `picture`, their views of `side`×`side` pixels, and `rows` of `side`²
    /// weights, one after the other.
    ///
    /// # Panics
    /// When a window is empty, not on the picture or larger than a frame may be, a view is empty, or there is no whole
    /// number of rows, at least one.
    #[must_use]
    pub fn new(picture: &GrayImage, window_px: u32, side: usize, rows: &'a [f64]) -> Self {
        assert!(
            window_px > 0 && window_px <= picture.width().min(picture.height()),
            "windows of {window_px} pixels on a map of {}×{}",
            picture.width(),
            picture.height()
        );
        assert!(
            window_px <= u32::from(MAX_SIDE),
            "windows of {window_px} pixels"
        );
        assert!(side > 0, "views without pixels");
        assert!(
            !rows.is_empty() && rows.len().is_multiple_of(side * side),
            "{} weights for views of {side}×{side} pixels",
            rows.len()
        );
        let positions = [picture.width(), picture.height()].map(|length| length - window_px + 1);
        Self {
            integral: Integral::new(picture),
            positions: (positions[0], positions[1]),
            window_px,
            side,
            rows,
            largest: layout::LARGEST,
        }
    }

    /// Columns and rows of window positions.
    #[must_use]
    pub fn positions(&self) -> (u32, u32) {
        self.positions
    }

    /// Number of weight rows, k.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows.len() / (self.side * self.side)
    }

    /// Projects the view of every window. `consume` gets each window in exactly one part; it is called from several
    /// threads, and parts come in any order.
    pub fn project(&self, consume: impl Fn(Part<'_>) + Sync) {
        match self.whole_ratio() {
            Some(block_px) => {
                let layout = Layout::new(&self.task(block_px), self.largest);
                self.project_tiles(&layout, block_px, consume);
            }
            None => self.project_directly(consume),
        }
    }

    /// The same for the windows whose corners are `step_px` apart along both axes, from `first` on: fast when that is s, as
    /// where the map itself is reduced and cut, and directly otherwise.
    ///
    /// # Panics
    /// When the step is zero.
    pub fn project_lattice(
        &self,
        first: (u32, u32),
        step_px: u32,
        consume: impl Fn(Part<'_>) + Sync,
    ) {
        match self.whole_ratio() {
            Some(block_px) if block_px == step_px && first.0.max(first.1) < block_px => {
                let task = self.task(block_px);
                let layout = Layout::of_phases(&task, [first], self.largest);
                self.project_tiles(&layout, block_px, consume);
            }
            _ => self.project_lattice_directly(first, step_px, consume),
        }
    }

    /// What [`project`](Self::project) does, directly: every window is cut, reduced and multiplied.
    pub fn project_directly(&self, consume: impl Fn(Part<'_>) + Sync) {
        self.project_lattice_directly((0, 0), 1, consume);
    }

    /// s, when it is whole.
    #[must_use]
    pub fn whole_ratio(&self) -> Option<u32> {
        let side = self.side as u32;
        (self.window_px.is_multiple_of(side)).then(|| self.window_px / side)
    }

    fn project_lattice_directly(
        &self,
        first: (u32, u32),
        step_px: u32,
        consume: impl Fn(Part<'_>) + Sync,
    ) {
        let count = |positions: u32, first: u32| positions.saturating_sub(first).div_ceil(step_px);
        let columns = count(self.positions.0, first.0) as usize;
        let (pixels, rows) = (self.side * self.side, self.rows());
        let weights = MatRef::from_row_major_slice(self.rows, rows, pixels);
        let blocks: Vec<(u32, usize)> = (0..count(self.positions.1, first.1))
            .flat_map(|row| (0..columns).step_by(BLOCK).map(move |column| (row, column)))
            .collect();
        let buffers = || (vec![0; pixels], Vec::new(), vec![0.0; rows * BLOCK]);
        blocks
            .into_par_iter()
            .for_each_init(buffers, |(view, views, dots), (row, column)| {
                let windows = BLOCK.min(columns - column);
                let corner = (first.0 + column as u32 * step_px, first.1 + row * step_px);
                let mut sums = Vec::with_capacity(windows);
                views.clear();
                for window in 0..windows as u32 {
                    let at = (corner.0 + window * step_px, corner.1);
                    self.integral.reduce(at, self.window_px, self.side, view);
                    sums.push(Sums::of(view));
                    views.extend(view.iter().map(|&y| f64::from(y)));
                }
                matmul(
                    MatMut::from_row_major_slice_mut(&mut dots[..rows * windows], rows, windows),
                    Accum::Replace,
                    weights,
                    MatRef::from_column_major_slice(views, pixels, windows),
                    1.0,
                    Par::Seq,
                );
                consume(Part {
                    first: corner,
                    step_px,
                    columns: windows,
                    rows: 1,
                    dots,
                    stride: windows,
                    sums: &sums,
                });
            });
    }

    /// Projects by tiles, a few at a time.
    fn project_tiles(&self, layout: &Layout, block_px: u32, consume: impl Fn(Part<'_>) + Sync) {
        let correlator = Correlator::new(layout.transform);
        let kernels: Vec<Spectrum> = self
            .rows
            .par_chunks_exact(self.side * self.side)
            .map(|weights| correlator.kernel(weights, self.side))
            .collect();
        let room = kernels.len() * layout.windows;
        let batches = layout.tiles.len().div_ceil((RESULTS / room).max(1));
        let batch = layout.tiles.len().div_ceil(batches);
        let mut dots = vec![0.0; batch * room];
        for tiles in layout.tiles.chunks(batch) {
            let prepared: Vec<Prepared> = tiles
                .par_iter()
                .map(|tile| self.prepare(tile, block_px, &correlator))
                .collect();
            dots.par_chunks_exact_mut(layout.windows)
                .take(tiles.len() * kernels.len())
                .enumerate()
                .for_each(|(index, plane)| {
                    let Prepared { tile, spectrum, .. } = &prepared[index / kernels.len()];
                    let kernel = &kernels[index % kernels.len()];
                    let plane = &mut plane[..tile.columns * tile.rows];
                    correlator.correlate(spectrum, kernel, tile.columns, plane);
                });
            prepared
                .par_iter()
                .zip(dots.par_chunks_exact(room))
                .for_each(|(prepared, dots)| {
                    prepared.hand_over((dots, layout.windows), block_px, &consume);
                });
        }
    }

    /// What is shared by the kernels of a tile.
    fn prepare<'t>(&self, tile: &'t Tile, block_px: u32, correlator: &Correlator) -> Prepared<'t> {
        let [width, height] = [tile.columns, tile.rows].map(|windows| windows + self.side - 1);
        let mut pixels = Vec::with_capacity(width * height);
        for row in 0..height as u32 {
            let y = tile.corner.1 + row * block_px;
            let xs = (tile.corner.0..).step_by(block_px as usize).take(width);
            pixels.extend(xs.map(|x| self.integral.mean((x, y), block_px)));
        }
        let (spectrum, sums) = rayon::join(
            || correlator.picture(&pixels, width),
            || sums::of_windows(&pixels, width, self.side),
        );
        Prepared {
            tile,
            spectrum,
            sums,
        }
    }

    fn task(&self, block_px: u32) -> Task {
        Task {
            positions: self.positions,
            block_px,
            side: self.side,
            kernels: self.rows(),
        }
    }
}

impl Prepared<'_> {
    /// Gives `consume` the tile, some rows at a time; planes of dots are `stride` apart.
    fn hand_over(
        &self,
        (dots, stride): (&[f64], usize),
        step_px: u32,
        consume: &(impl Fn(Part<'_>) + Sync),
    ) {
        let (left, top) = self.tile.corner;
        let length = BAND * self.tile.columns;
        let bands = self.sums.par_chunks(length).enumerate();
        bands.for_each(|(band, sums)| {
            consume(Part {
                first: (left, top + (band * BAND) as u32 * step_px),
                step_px,
                columns: self.tile.columns,
                rows: sums.len() / self.tile.columns,
                dots: &dots[band * length..],
                stride,
                sums,
            });
        });
    }
}

#[cfg(test)]
mod tests;
