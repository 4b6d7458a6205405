//! The candidates of a map as views, made by the same reduction that runs on board.

use eigenmark_core::{
    eigenspace::Normalize,
    frame::{Frame, FrameError},
    preprocess::{MAX_VIEW_SIDE, MIN_VIEW_SIDE, View, reduce},
};
use rayon::prelude::*;

use super::Preprocess;
use crate::map::{Grid, Map};

/// Memory that the training views may take, all their forms included.
pub const MAX_TRAINING_BYTES: u64 = 4 << 30;

/// All candidates of a map: reduced, normalized, filtered.
#[derive(Clone, Debug)]
pub struct Views {
    /// The reduced views, candidate 1 first.
    pub reduced: Vec<View>,
    /// n(y): n rows of m.
    pub normalized: Vec<f64>,
    /// x, what PCA sees: n rows of m.
    pub filtered: Vec<f64>,
    /// Pixels per view, m.
    pub pixels: usize,
}

/// Why candidates cannot be cut into views.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ViewsError {
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
    /// The views would not fit into memory.
    #[error("{candidates} views need {} MiB for training, {} are allowed; raise --stride", bytes >> 20, MAX_TRAINING_BYTES >> 20)]
    TooManyViews {
        /// Number of candidates.
        candidates: u32,
        /// Bytes they would need.
        bytes: u64,
    },
    /// A candidate has no contrast to normalize.
    #[error("view {view} is flat, and unit variance is asked for; choose --normalize mean")]
    FlatView {
        /// The candidate.
        view: u32,
    },
}

impl Views {
    /// Cuts and reduces every candidate of the grid to views of `side`×`side` pixels.
    ///
    /// # Errors
    /// When views of that side do not exist on board, windows are too small to be frames, a candidate is flat and
    /// contrast is normalized, or the views would not fit into memory.
    pub fn cut(
        map: &Map,
        grid: &Grid,
        side: u32,
        preprocess: &Preprocess,
    ) -> Result<Self, ViewsError> {
        let range = u32::from(MIN_VIEW_SIDE)..=u32::from(MAX_VIEW_SIDE);
        let side = u8::try_from(side)
            .ok()
            .filter(|&side| range.contains(&u32::from(side)))
            .ok_or(ViewsError::ViewSide {
                side,
                window_px: grid.window_px(),
            })?;
        let pixels = usize::from(side) * usize::from(side);
        // The view itself, and its normalized, filtered and centred forms.
        let bytes_per_view = size_of::<View>() + 3 * pixels * size_of::<f64>();
        let bytes = u64::from(grid.count()) * bytes_per_view as u64;
        if bytes > MAX_TRAINING_BYTES {
            return Err(ViewsError::TooManyViews {
                candidates: grid.count(),
                bytes,
            });
        }

        let reduced: Result<Vec<View>, ViewsError> = (1..=grid.count())
            .into_par_iter()
            .map(|view| reduced_window(map, grid, view, side))
            .collect();
        let reduced = reduced?;
        let (mut normalized, mut filtered) = (Vec::new(), Vec::new());
        for (view, number) in reduced.iter().zip(1..) {
            let n = preprocess
                .normalized(view.pixels())
                .ok_or(ViewsError::FlatView { view: number })?;
            filtered.extend(preprocess.filtered(&n));
            // Without normalization n(y) is y itself, which `reduced` already holds.
            if preprocess.normalize() != Normalize::None {
                normalized.extend(n);
            }
        }
        Ok(Self {
            reduced,
            normalized,
            filtered,
            pixels,
        })
    }

    /// ȳ: the mean of n(y) over the candidates.
    #[must_use]
    pub fn normalized_mean(&self) -> Vec<f64> {
        let mut mean = vec![0.0; self.pixels];
        if self.normalized.is_empty() {
            for view in &self.reduced {
                mean.iter_mut()
                    .zip(view.pixels())
                    .for_each(|(sum, &y)| *sum += f64::from(y));
            }
        } else {
            for row in self.normalized.chunks_exact(self.pixels) {
                mean.iter_mut().zip(row).for_each(|(sum, y)| *sum += y);
            }
        }
        mean.iter_mut()
            .for_each(|sum| *sum /= self.reduced.len() as f64);
        mean
    }
}

fn reduced_window(map: &Map, grid: &Grid, view: u32, side: u8) -> Result<View, ViewsError> {
    let (x, y) = grid.corner(view);
    let window = u16::try_from(grid.window_px()).unwrap_or(u16::MAX);
    let stride = map.width() as usize;
    let pixels = &map.luminance().as_raw()[y as usize * stride + x as usize..];
    let frame = Frame::new(pixels, window, window, stride).map_err(ViewsError::Window)?;
    let mut reduced = View::black(side);
    reduce(&frame, &mut reduced);
    Ok(reduced)
}
