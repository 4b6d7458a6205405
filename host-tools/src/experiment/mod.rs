//! The report's experiments on any map: sections 3 and 4, appendices A and C; what its `make.m` did.
//!
//! | file | does |
//! | --- | --- |
//! | `run`, `cache` | a grid of cells; what is known is not computed again |
//! | `cell` | everything about one scale and one blur |
//! | `methods` | the selections that are compared (3.3, 3.4, 4.1) |
//! | [`reliability`] | what the landmarks of many tables tolerate, all at once (3.5) |
//! | `clusters` | dendrograms, k-means, silhouettes (4.1) |
//! | `localization` | localization matrices (4.2) |
//! | `pictures` | eigenimages and recovered views (figures 3.3 and A.2) |
//! | [`segmentation`] | segmentation by color, and what it is worth (5.2.1) |
//! | [`claims`] | what the report claims, and whether it holds |
//! | `csv_files`, `numbers` | the numbers as files |
//!
//! **Notation.** n candidates, k dimensions, K the most of them, l landmarks per selection; scale s is map pixels per view
//! pixel.
//!
//! **Deviations.** (1) Views are cut from the map itself and reduced, not from a reduced map: their corners need not lie on
//! reduced pixels. (2) The eight landmarks that are the best by profile in the setting of figure 3.8 are evaluated in every
//! cell, so that claims about settings compare nothing else. (3) Gamma is tried in steps of 0.1, not 0.5. (4) Dimensions are
//! capped at the rank.
//!
//! **Cost.** The whole grid of 83 views on 1600×1200 pixels: some ten minutes of processor time, half of them at scales 1
//! and 2; a megabyte per cell on disk.

mod cache;
mod cell;
pub mod claims;
mod clusters;
mod csv_files;
mod localization;
mod methods;
mod numbers;
mod pictures;
pub mod reliability;
mod run;
pub mod segmentation;

use eigenmark_core::atlas::Blur;

pub use cell::{Cell, MethodTable, SEED, Spread};
pub use clusters::{Clusters, Cut, Joined, Means};
pub use csv_files::write_csv_files;
pub use localization::Localized;
pub use methods::{Method, START_LISTS, StartList};
pub(crate) use numbers::{SEVEN, round, seven};
pub use pictures::{Eigenimages, Recovered};
pub use run::{Asked, Grid, run};

use crate::{
    evaluate::REPORT_DIMENSIONS,
    learn::{CandidatesError, PcaError, Settings, Space},
    map::{GridError, Map},
    output::{OutputError, Progress},
    select::cluster::ClusterError,
};

/// Scale factors of table 3.1: map pixels per view pixel.
pub const REPORT_SCALES: [f64; 11] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0];

/// The blurs of table 3.2.
pub const REPORT_BLURS: [Blur; 4] = [Blur::None, Blur::Gauss1, Blur::Gauss2, Blur::Gauss3];

/// What is computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What all cells have in common.
    pub settings: Settings,
    /// Numbers of dimensions, ascending.
    pub dimensions: Vec<usize>,
    /// Ways to select landmarks.
    pub methods: Vec<Method>,
    /// Landmarks of each selection, l.
    pub landmarks: u32,
    /// The landmarks of [`Method::Fixed`] and [`Method::Atlas`].
    pub fixed: Vec<u32>,
    /// Whether views are clustered, too.
    pub is_clustered: bool,
}

/// Why candidates cannot be learned from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LearnError {
    /// The map has no such candidates.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// Candidates cannot be used.
    #[error(transparent)]
    Candidates(#[from] CandidatesError),
    /// They have no eigenspace.
    #[error(transparent)]
    Pca(#[from] PcaError),
}

/// Why an experiment cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// There is nothing to compare.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// They cannot be clustered.
    #[error(transparent)]
    Cluster(#[from] ClusterError),
    /// It cannot be segmented.
    #[error(transparent)]
    Segmentation(#[from] segmentation::SegmentationEffectError),
    /// There are more candidates than are compared.
    #[error(
        "expected at most {} views to compare, found {found}; choose a larger view size",
        reliability::MOST_CANDIDATES
    )]
    TooMany {
        /// How many there are.
        found: u32,
    },
    /// What was found cannot be kept.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl Plan {
    /// The report's grid on a map, with views of `view_size_px` and so many landmarks per selection, as far as there are views.
    ///
    /// # Errors
    /// When there is no such grid on the map.
    pub fn report(map: &Map, view_size_px: u32, landmarks: u32) -> Result<Self, ExperimentError> {
        let settings = Settings {
            view_size_px,
            ..Settings::default()
        };
        let found = settings.grid(map).map_err(LearnError::Grid)?.count();
        if found > reliability::MOST_CANDIDATES {
            return Err(ExperimentError::TooMany { found });
        }
        let k = usize::from(settings.dimensions);
        let space = cell::learn(map, &settings, k)?;
        let landmarks = (landmarks as usize).min(space.count());
        let mut fixed = methods::Selector::new(&space, landmarks)
            .profile(&space.coordinates, space.dimensions());
        fixed.truncate(landmarks);
        Ok(Self {
            settings,
            dimensions: REPORT_DIMENSIONS.to_vec(),
            methods: Method::GRID.to_vec(),
            landmarks: landmarks as u32,
            fixed,
            is_clustered: true,
        })
    }
}

/// The cell of landmarks that are there already, in the setting that they were selected in: what a grid says of one cell,
/// without clusters.
///
/// # Errors
/// When nothing can be measured.
pub fn of_landmarks(
    map: &Map,
    space: &Space,
    (scale, blur): (f64, Blur),
    landmarks: &[u32],
    progress: &Progress,
) -> Result<(Plan, Cell), ExperimentError> {
    let k = space.dimensions();
    let mut dimensions: Vec<usize> = REPORT_DIMENSIONS
        .into_iter()
        .filter(|&few| few < k)
        .collect();
    dimensions.push(k);
    let plan = Plan {
        settings: Settings {
            scale,
            blur,
            view_size_px: space.candidates.grid().window_px(),
            dimensions: k as u8,
            metric: space.metric,
            ..Settings::default()
        },
        dimensions,
        methods: vec![Method::Atlas],
        landmarks: landmarks.len() as u32,
        fixed: landmarks.to_vec(),
        is_clustered: false,
    };
    let bar = progress.bar("reliability", landmarks.len() as u64 + 3);
    let mut cells = cell::of_spaces(
        map,
        &plan,
        &[(scale, blur)],
        std::slice::from_ref(space),
        &bar,
    )?;
    Ok((plan, cells.swap_remove(0)))
}
