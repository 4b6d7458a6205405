//! The whole way from a map to an atlas: lay out candidates, learn, select, quantize, calibrate.
//!
//! Learning can be shared: [`fold_shard`] makes a [`Part`] of some of the candidates, and [`merge()`] goes on with all
//! parts as [`train`] does with the whole.

mod headings;
mod merge;
mod part;
mod relearn;

use eigenmark_core::atlas::{Atlas, AtlasError, Training};

use crate::{
    atlas::{AtlasBuffer, CalibrationError, Folded, calibrate, radii},
    learn::{Candidates, CandidatesError, Fold, Model, PcaError, Preprocess, Rows, Settings},
    map::{Grid, GridError, Map},
    output::Progress,
    select::{Selected, Selection, SelectionError, select},
};

pub use headings::{MeasuredHeadings, measure_headings};
pub use merge::{MergeError, fold_shard, joined, merge};
pub use part::{Part, PartError, Shard};
pub use relearn::{RelearnError, Relearned};

/// Memory that the coordinates of all candidates may take, copies included: all that grows with their number.
const MAX_COORDINATE_BYTES: u64 = 4 << 30;

/// Of each: the coordinate itself, and what ranking makes of it.
const COORDINATE_BYTES: u64 = 3 * size_of::<f64>() as u64;

/// Everything training makes; the atlas is what flies, the rest is for judging and exporting.
#[derive(Debug)]
pub struct Trained {
    /// What it was trained for.
    pub settings: Settings,
    /// The candidates.
    pub candidates: Candidates,
    /// The eigenspace in f64.
    pub model: Model,
    /// The candidates' coordinates as matched: whitened, n rows of k.
    pub coordinates: Vec<f64>,
    /// The selected candidates, and how they were ranked.
    pub selected: Selected,
    /// The atlas.
    pub atlas: AtlasBuffer,
}

/// Why a map could not be trained.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// The map is too small for the view size, or the stride too fine.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The candidates cannot be views.
    #[error(transparent)]
    Candidates(#[from] CandidatesError),
    /// The coordinates of all candidates would not fit into memory.
    #[error(
        "{candidates} views of {dimensions} dimensions need {} MiB, {} are allowed; raise --stride",
        bytes >> 20, MAX_COORDINATE_BYTES >> 20
    )]
    TooManyViews {
        /// Number of candidates.
        candidates: u32,
        /// Dimensions of each.
        dimensions: u8,
        /// Bytes they would need.
        bytes: u64,
    },
    /// There is no eigenspace of that size.
    #[error(transparent)]
    Pca(#[from] PcaError),
    /// There are no such landmarks.
    #[error(transparent)]
    Selection(#[from] SelectionError),
    /// The judgement of known views could not be calibrated.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// The atlas could not be written.
    #[error(transparent)]
    Atlas(#[from] AtlasError),
}

/// Trains an atlas. `with_profile` computes the distance profile even when the selection does not need it.
///
/// # Errors
/// See [`TrainError`].
pub fn train(
    map: &Map,
    settings: &Settings,
    with_profile: bool,
    progress: &Progress,
) -> Result<Trained, TrainError> {
    let step = progress.step("learning the eigenspace");
    let candidates = lay_out(map, settings)?;
    let model = Model::learn(&candidates, usize::from(settings.dimensions))?;
    drop(step);
    finish(map, settings, candidates, model, with_profile, progress)
}

/// The candidates, and an eigenspace of them with as many dimensions as they span, up to `dimensions`; but not fewer
/// than the settings ask for. Nothing is selected.
///
/// # Errors
/// See [`TrainError`].
pub fn learn(
    map: &Map,
    settings: &Settings,
    dimensions: usize,
    progress: &Progress,
) -> Result<(Candidates, Model), TrainError> {
    let _step = progress.step("learning the eigenspace");
    let candidates = lay_out(map, settings)?;
    let asked = usize::from(settings.dimensions);
    let fold = Fold::of(&candidates, 0, candidates.count());
    let model = match Model::of_fold(&fold, dimensions.max(asked)) {
        Err(PcaError::BeyondRank { rank, .. }) => Model::of_fold(&fold, rank.max(asked))?,
        result => result?,
    };
    Ok((candidates, model))
}

/// The candidates that the settings ask for, when a board can hold their views.
fn lay_out(map: &Map, settings: &Settings) -> Result<Candidates, TrainError> {
    let grid = settings.grid(map)?;
    if let Selection::Best(best) = &settings.selection {
        best.check(grid.count())?;
    }
    let side = settings.view_side();
    Candidates::check_side(side, settings.view_size_px)?;
    let preprocess = Preprocess::new(
        side as usize,
        settings.normalize,
        settings.blur,
        settings.highpass_px,
    );
    cut(map, &grid, &preprocess, settings.dimensions)
}

/// The candidates of a grid, when there is memory for their coordinates.
fn cut(
    map: &Map,
    grid: &Grid,
    preprocess: &Preprocess,
    dimensions: u8,
) -> Result<Candidates, TrainError> {
    let candidates = grid.count();
    let bytes = u64::from(candidates) * u64::from(dimensions) * COORDINATE_BYTES;
    if bytes > MAX_COORDINATE_BYTES {
        return Err(TrainError::TooManyViews {
            candidates,
            dimensions,
            bytes,
        });
    }
    Ok(Candidates::new(map, grid, preprocess)?)
}

/// From the eigenspace on.
fn finish(
    map: &Map,
    settings: &Settings,
    candidates: Candidates,
    model: Model,
    with_profile: bool,
    progress: &Progress,
) -> Result<Trained, TrainError> {
    let step = progress.step("projecting views");
    let coordinates = model.whitened(model.project(&candidates), settings.whiten);
    drop(step);
    let step = progress.step("selecting landmarks");
    let selected = select(map, &candidates, &coordinates, settings, with_profile)?;
    drop(step);

    let step = progress.step("quantizing");
    let landmarks = &selected.landmarks;
    let folded = Folded::new(&model, &coordinates, &candidates, settings);
    let radii = radii(
        settings.metric,
        &coordinates,
        model.dimensions,
        landmarks,
        folded.error(),
    );
    let training = Training {
        scale: settings.scale as f32,
        blur: settings.blur,
        highpass: settings.highpass_px as f32,
        whiten: settings.whiten as f32,
        covered_variance: model.covered_variance() as f32,
        map_crc: map.crc(),
    };
    let open = folded.atlas(map, &candidates, landmarks, &radii, training)?;
    drop(step);
    let atlas = calibrate(map, &open, progress)?;
    Ok(Trained {
        settings: settings.clone(),
        candidates,
        model,
        coordinates,
        selected,
        atlas,
    })
}

impl Trained {
    /// The atlas, parsed.
    #[must_use]
    pub fn atlas(&self) -> Atlas<'_> {
        self.atlas.atlas()
    }
}
