//! The candidates of a map: reduced, normalized and filtered when they are asked for, so that their number does not matter
//! for memory.
//!
//! Windows at the nominal heading and altitude are cut from the map. What turned or higher views show is rendered by the
//! simulated camera, once, and kept: m bytes each.
//!
//! **Cost.** Beside that, the map's summed-area table is kept; a nominal candidate of 20×20 pixels takes two to three
//! microseconds each time it is read. Rendering one takes about 150 microseconds of processor time.

use std::sync::Arc;

use eigenmark_core::{
    eigenspace::Normalize,
    frame::{Frame, FrameError},
    landmark::{Candidate, Layer},
    preprocess::{MAX_VIEW_SIDE, MIN_VIEW_SIDE, View},
};
use rayon::prelude::*;

use super::{Preprocess, Rows};
use crate::{
    map::{Grid, Integral, Map},
    simulate::{Camera, Scene},
};

/// Memory that rendered candidates may take.
const MAX_RENDERED_BYTES: u64 = 4 << 30;

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
    /// By layer, all its windows one after the other; nothing for the nominal layer.
    rendered: Arc<[Vec<u8>]>,
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
    /// The pixels of candidates that are not nominal would not fit into memory.
    #[error(
        "{candidates} views of {pixels} pixels at several headings or altitudes need {} MiB, {} are allowed; raise \
         --stride",
        bytes >> 20, MAX_RENDERED_BYTES >> 20
    )]
    TooManyRendered {
        /// Number of candidates, nominal ones included.
        candidates: u32,
        /// Pixels of each.
        pixels: usize,
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

impl Candidates {
    /// The windows of `grid` on `map`, reduced to the side of `preprocess`.
    ///
    /// # Errors
    /// When windows are not frames, there is no memory for all layers, or a candidate is flat and contrast is normalized.
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
            rendered: render(map, grid, preprocess.side())?,
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
        let layer = self.grid.candidate(view).layer;
        let mut pixels = vec![0; self.side * self.side];
        if is_nominal(layer) {
            let (corner, window_px) = (self.grid.corner(view), self.grid.window_px());
            self.integral
                .reduce(corner, window_px, self.side, &mut pixels);
        } else {
            let window = view - 1 - layer.index * self.grid.survey().windows();
            let of_layer = &self.rendered[layer.index as usize];
            let len = pixels.len();
            pixels.copy_from_slice(&of_layer[window as usize * len..][..len]);
        }
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

/// Whether the windows of a layer are squares of the map.
fn is_nominal(layer: Layer) -> bool {
    layer.heading_rad == 0.0 && layer.altitude_ratio == 1.0
}

/// What a camera sees of a candidate, before light and sensor.
pub(crate) fn scene_of(candidate: &Candidate) -> Scene {
    Scene {
        heading_rad: candidate.layer.heading_rad.into(),
        altitude_ratio: candidate.layer.altitude_ratio.into(),
        ..Scene::nominal(candidate.place())
    }
}

/// The views of all layers but the nominal one.
fn render(map: &Map, grid: &Grid, side: usize) -> Result<Arc<[Vec<u8>]>, CandidatesError> {
    let survey = grid.survey();
    let (windows, layers) = (survey.windows(), survey.layers());
    if layers == 1 && survey.layer(0).is_some_and(is_nominal) {
        return Ok(Arc::default());
    }
    let pixels = side * side;
    let bytes = u64::from(grid.count()) * pixels as u64;
    if bytes > MAX_RENDERED_BYTES {
        return Err(CandidatesError::TooManyRendered {
            candidates: grid.count(),
            pixels,
            bytes,
        });
    }
    let camera = Camera::square_of(f64::from(grid.window_px()));
    let of_layer = |index: u32| {
        if survey.layer(index).is_some_and(is_nominal) {
            return Vec::new();
        }
        let mut views = vec![0; windows as usize * pixels];
        let first = index * windows + 1;
        views
            .par_chunks_exact_mut(pixels)
            .zip(first..first + windows)
            .for_each_init(
                || camera.frame(),
                |frame, (pixels, view)| {
                    camera.see(map, &scene_of(&grid.candidate(view)), frame);
                    let frame_side = u32::from(frame.width);
                    Integral::of(&frame.pixels, usize::from(frame.width)).reduce(
                        (0, 0),
                        frame_side,
                        side,
                        pixels,
                    );
                },
            );
        views
    };
    Ok((0..layers).map(of_layer).collect())
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
