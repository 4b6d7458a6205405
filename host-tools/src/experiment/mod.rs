//! The report's experiments on any map: sections 3 and 4, appendices A and C; what its `make.m` did.

mod cache;
mod cell;
pub mod claims;
mod clusters;
mod localization;
mod methods;
mod pictures;
pub mod reliability;
mod run;
pub mod segmentation;
mod segmented;
mod shown;
mod tables;

use eigenmark_core::atlas::Blur;

pub use cell::{Cell, MethodTable, SEED, Spread};
pub use clusters::{Clusters, Cut, Joined, Means};
pub use localization::Localized;
pub use methods::{Method, START_LISTS, StartList};
pub use pictures::{Eigenimages, Recovered};
pub use run::{Asked, Grid, run};
pub use segmented::{Segmented, Shade, Tolerates};
pub use shown::{SEVEN, round, seven};
pub use tables::write_tables;

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

/// Why an experiment cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The map has no such candidates.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// Candidates cannot be used.
    #[error(transparent)]
    Candidates(#[from] CandidatesError),
    /// They have no eigenspace.
    #[error(transparent)]
    Pca(#[from] PcaError),
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
        let found = settings.grid(map)?.count();
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
