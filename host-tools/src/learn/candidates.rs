//! The candidates of a map: cut, reduced, normalized and filtered when they are asked for, so that their number does not
//! matter for memory.
//!
//! **Cost.** What is kept is the map's summed-area table; a candidate of 20×20 pixels takes two to three microseconds
//! each time it is read.

use eigenmark_core::{
    eigenspace::Normalize,
    frame::{Frame, FrameError},
    preprocess::{MAX_VIEW_SIDE, MIN_VIEW_SIDE, View},
};
use rayon::prelude::*;

use super::{Preprocess, Rows};
use crate::map::{Grid, Integral, Map};

/// Candidates whose sums are added up before they join the others': fixed, so that results are the same for any number
/// of threads.
const BLOCK: usize = 1024;

/// All candidates of a map, as the vectors that PCA sees. Row i is candidate i + 1.
#[derive(Clone, Debug)]
pub struct Candidates {
    integral: Integral,
    grid: Grid,
    preprocess: Preprocess,
    side: usize,
}

/// Why a map has no such candidates.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CandidatesError {
    /// The side of a view is outside what a board can hold.
    #[error(
        "views of {side}×{side} pixels (a {window_px} pixel window at this scale); \
         a board holds {MIN_VIEW_SIDE} to {MAX_VIEW_SIDE} per side"
    )]
    ViewSide {
        /// Pixels per side of a view.
        side: u32,
        /// Side of a window, in map pixels.
        window_px: u32,
    },
    /// A window is not a frame.
    #[error("view size: {0}")]
    Window(FrameError),
    /// A candidate has no contrast to normalize.
    #[error("view {view} is flat, and unit variance is asked for; choose --normalize mean")]
    FlatView {
        /// The candidate.
        view: u32,
    },
}

impl Candidates {
    /// The windows of `grid` on `map`, reduced to the side of `preprocess`.
    ///
    /// # Errors
    /// When windows are not frames, or a candidate is flat and contrast is normalized.
    pub fn new(map: &Map, grid: &Grid, preprocess: &Preprocess) -> Result<Self, CandidatesError> {
        let window = u16::try_from(grid.window_px()).unwrap_or(u16::MAX);
        let pixels = map.luminance().as_raw();
        Frame::new(pixels, window, window, map.width() as usize)
            .map_err(CandidatesError::Window)?;
        let candidates = Self {
            integral: Integral::new(map.luminance()),
            grid: grid.clone(),
            preprocess: preprocess.clone(),
            side: preprocess.side(),
        };
        if preprocess.normalize() == Normalize::Std {
            let is_flat = |&view: &u32| {
                let pixels = candidates.reduced(view);
                pixels.iter().all(|&y| y == pixels[0])
            };
            let flat = (1..=grid.count()).into_par_iter().find_first(is_flat);
            if let Some(view) = flat {
                return Err(CandidatesError::FlatView { view });
            }
        }
        Ok(candidates)
    }

    /// Checks that a board can hold views of `side`×`side` pixels.
    ///
    /// # Errors
    /// When it cannot.
    pub fn check_side(side: u32, window_px: u32) -> Result<(), CandidatesError> {
        if (u32::from(MIN_VIEW_SIDE)..=u32::from(MAX_VIEW_SIDE)).contains(&side) {
            Ok(())
        } else {
            Err(CandidatesError::ViewSide { side, window_px })
        }
    }

    /// The layout.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// What happens to their pixels.
    #[must_use]
    pub fn preprocess(&self) -> &Preprocess {
        &self.preprocess
    }

    /// The v² pixels of candidate `view` (1-based), before anything is done to them.
    ///
    /// # Panics
    /// When there is no such candidate.
    #[must_use]
    pub fn reduced(&self, view: u32) -> Vec<u8> {
        let mut pixels = vec![0; self.side * self.side];
        let window_px = self.grid.window_px();
        self.integral
            .reduce(self.grid.corner(view), window_px, self.side, &mut pixels);
        pixels
    }

    /// Candidate `view` (1-based) as the board sees it; `None` when views of this side are too large for a board.
    ///
    /// # Panics
    /// When there is no such candidate.
    #[must_use]
    pub fn view(&self, view: u32) -> Option<View> {
        View::from_pixels(&self.reduced(view))
    }

    /// ȳ: the mean of n(y) over the candidates.
    #[must_use]
    pub fn normalized_mean(&self) -> Vec<f64> {
        let starts: Vec<u32> = (1..=self.grid.count()).step_by(BLOCK).collect();
        let sums: Vec<Vec<f64>> = starts
            .into_par_iter()
            .map(|start| {
                let mut sum = vec![0.0; self.pixels()];
                for view in (start..=self.grid.count()).take(BLOCK) {
                    let normalized = self.preprocess.normalized(&self.reduced(view));
                    // Flat views were refused where they have no n(y).
                    for (sum, y) in sum.iter_mut().zip(normalized.unwrap_or_default()) {
                        *sum += y;
                    }
                }
                sum
            })
            .collect();
        let mut mean = vec![0.0; self.pixels()];
        for sum in sums {
            mean.iter_mut()
                .zip(sum)
                .for_each(|(mean, sum)| *mean += sum);
        }
        let count = f64::from(self.grid.count());
        mean.iter_mut().for_each(|mean| *mean /= count);
        mean
    }
}

impl Rows for Candidates {
    fn count(&self) -> usize {
        self.grid.count() as usize
    }

    fn pixels(&self) -> usize {
        self.side * self.side
    }

    fn read(&self, first: usize, out: &mut [f32]) {
        let views = first as u32 + 1..;
        for (row, view) in out.chunks_exact_mut(self.pixels()).zip(views) {
            // Flat views were refused where they have no n(y).
            let filtered = self.preprocess.of_pixels(&self.reduced(view));
            for (out, x) in row.iter_mut().zip(filtered.unwrap_or_default()) {
                *out = x as f32;
            }
        }
    }
}
