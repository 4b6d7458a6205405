//! The candidates of a map as views, made by the same reduction that runs on board.

use eigenmark_core::{
    eigenspace::Normalize,
    frame::Frame,
    preprocess::{MAX_VIEW_SIDE, MIN_VIEW_SIDE, View, reduce},
};
use rayon::prelude::*;

use super::{Preprocess, TrainError};
use crate::map::{Grid, Map};

/// Memory that the training views may take, as the f64 matrix PCA works on.
pub const MAX_TRAINING_BYTES: u64 = 2 << 30;

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
    ) -> Result<Self, TrainError> {
        let range = u32::from(MIN_VIEW_SIDE)..=u32::from(MAX_VIEW_SIDE);
        let side = u8::try_from(side)
            .ok()
            .filter(|&side| range.contains(&u32::from(side)))
            .ok_or(TrainError::ViewSide {
                side,
                window_px: grid.window_px(),
            })?;
        let pixels = usize::from(side) * usize::from(side);
        let bytes = u64::from(grid.count()) * pixels as u64 * size_of::<f64>() as u64;
        if bytes > MAX_TRAINING_BYTES {
            return Err(TrainError::TooManyViews {
                candidates: grid.count(),
                bytes,
            });
        }

        let reduced: Result<Vec<View>, TrainError> = (1..=grid.count())
            .into_par_iter()
            .map(|view| reduced_window(map, grid, view, side))
            .collect();
        let reduced = reduced?;
        let (mut normalized, mut filtered) = (Vec::new(), Vec::new());
        for (view, number) in reduced.iter().zip(1..) {
            let n = preprocess
                .normalized(view.pixels())
                .ok_or(TrainError::FlatView { view: number })?;
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

fn reduced_window(map: &Map, grid: &Grid, view: u32, side: u8) -> Result<View, TrainError> {
    let (x, y) = grid.corner(view);
    let window = u16::try_from(grid.window_px()).unwrap_or(u16::MAX);
    let stride = map.width() as usize;
    let pixels = &map.luminance().as_raw()[y as usize * stride + x as usize..];
    let frame = Frame::new(pixels, window, window, stride).map_err(TrainError::Window)?;
    let mut reduced = View::black(side);
    reduce(&frame, &mut reduced);
    Ok(reduced)
}
