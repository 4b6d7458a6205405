//! The whole way from a map to an atlas: cut views, learn, select, quantize, calibrate.

use eigenmark_core::atlas::{Atlas, AtlasError, Training};

use crate::{
    atlas::{AtlasBuffer, CalibrationError, Folded, calibrate, radii},
    learn::{Candidates, CandidatesError, Model, PcaError, Preprocess, Selection, Settings},
    map::{GridError, Map},
    output::Progress,
    select::{MAX_PROFILED, profile, rank_by_profile},
};

/// Everything training makes; the atlas is what flies, the rest is for judging and exporting.
#[derive(Debug)]
pub struct Trained {
    /// The candidates.
    pub candidates: Candidates,
    /// The eigenspace in f64.
    pub model: Model,
    /// The candidates' coordinates as matched: whitened, n rows of k.
    pub coordinates: Vec<f64>,
    /// The distance profile and its ranking (candidate numbers, best first); only when it was asked for, or needed.
    pub profile: Option<(Vec<f64>, Vec<u32>)>,
    /// The selected candidates, best first.
    pub landmarks: Vec<u32>,
    /// The atlas.
    pub atlas: AtlasBuffer,
}

/// Why a map could not be trained.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// The map is too small for the view size, or the stride too fine.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The candidates cannot be cut into views.
    #[error(transparent)]
    Candidates(#[from] CandidatesError),
    /// More landmarks are asked for than there are candidates.
    #[error("{landmarks} landmarks are asked for, but the map has {candidates} views")]
    TooManyLandmarks {
        /// Landmarks asked for.
        landmarks: u32,
        /// Number of candidates.
        candidates: u32,
    },
    /// There are too many candidates to compare every pair of them.
    #[error(
        "{candidates} views are too many for the distance profile, which compares up to {MAX_PROFILED}; \
         raise --stride or choose --select all"
    )]
    TooManyProfiled {
        /// Number of candidates.
        candidates: u32,
    },
    /// There is no eigenspace of that size.
    #[error(transparent)]
    Pca(#[from] PcaError),
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
    let grid = settings.grid(map)?;
    if let Selection::Profile { landmarks } = settings.selection
        && landmarks > grid.count()
    {
        return Err(TrainError::TooManyLandmarks {
            landmarks,
            candidates: grid.count(),
        });
    }
    let is_needed = with_profile || settings.selection != Selection::All;
    if is_needed && grid.count() > MAX_PROFILED {
        return Err(TrainError::TooManyProfiled {
            candidates: grid.count(),
        });
    }
    let side = settings.view_side();
    Candidates::check_side(side, settings.view_size_px)?;
    let preprocess = Preprocess::new(
        side as usize,
        settings.normalize,
        settings.blur,
        settings.highpass_px,
    );

    let step = progress.step("learning the eigenspace");
    let candidates = Candidates::new(map, &grid, &preprocess)?;
    let dimensions = usize::from(settings.dimensions);
    let model = Model::learn(&candidates, dimensions)?;
    let coordinates = model.whitened(model.project(&candidates), settings.whiten);

    drop(step);
    let step = progress.step("selecting landmarks");
    let profile = is_needed.then(|| {
        let profile = profile(settings.metric, &coordinates, dimensions);
        let ranking = rank_by_profile(&profile);
        (profile, ranking)
    });
    let landmarks: Vec<u32> = match (settings.selection, &profile) {
        (Selection::Profile { landmarks }, Some((_, ranking))) => {
            ranking[..landmarks as usize].to_vec()
        }
        _ => (1..=grid.count()).collect(),
    };

    drop(step);
    let step = progress.step("quantizing");
    let folded = Folded::new(&model, &coordinates, &candidates, settings);
    let radii = radii(
        settings.metric,
        &coordinates,
        dimensions,
        &landmarks,
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
    let open = folded.atlas(map, &candidates, &landmarks, &radii, training)?;
    drop(step);
    let atlas = calibrate(map, &open, progress)?;
    Ok(Trained {
        candidates,
        model,
        coordinates,
        profile,
        landmarks,
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
