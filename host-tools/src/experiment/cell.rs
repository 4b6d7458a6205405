//! One cell of the grid: everything about one scale and one blur.

use std::collections::BTreeMap;

use eigenmark_core::atlas::Blur;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    Clusters, ExperimentError, LearnError, Plan,
    clusters::{self, Grouping},
    localization::{Localized, localize},
    methods::{Method, START_LISTS, Selector},
    pictures::{Eigenimages, Recovered},
    reliability::{self, ByCriterion, Table},
};
use crate::{
    evaluate::reliability::{MeanReliability, Measure, Steps},
    learn::{Candidates, Model, Preprocess, Settings, Space, blur_name},
    map::Map,
    output::Bar,
    select::dissimilarity,
};

/// Gamma is tried in steps of 0.1: the report's 0.5 is too coarse for guarantees.
pub(super) const STEPS: Steps = Steps { gamma: 0.1 };

/// Seed of everything that is drawn.
pub const SEED: u64 = 2004;

/// What was found at one scale and blur.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Map pixels per view pixel.
    pub scale: f64,
    /// Name of the blur.
    pub blur: String,
    /// Pixels per side of a view, v.
    pub side: usize,
    /// Numbers of dimensions that were computed, ascending: those asked for, as far as the candidates span them.
    pub dims: Vec<usize>,
    /// Share of the variance of every dimension that the candidates span.
    pub variance: Vec<f64>,
    /// Coordinates of the candidates: n rows of as many as the last of the dimensions.
    pub coordinates: Vec<f32>,
    /// Dissimilarities of all pairs of candidates, by dimensions.
    pub dissimilarities: Vec<Spread>,
    /// All candidates ranked by profile, by dimensions.
    pub profiles: Vec<Vec<u32>>,
    /// Figure 3.3.
    pub eigenimages: Eigenimages,
    /// Figure A.2.
    pub recovered: Recovered,
    /// By name of the method, by dimensions; `None` where it finds no such landmarks.
    pub tables: BTreeMap<String, Vec<Option<MethodTable>>>,
    /// Section 4.1; `None` when it was not asked for.
    pub clusters: Option<Clusters>,
    /// Figure 4.4.
    pub localization: Vec<Localized>,
}

/// Mean and standard deviation of some numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation.
    pub deviation: f64,
}

/// Landmarks, and what they tolerate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodTable {
    /// Candidate numbers (1-based), best first.
    pub landmarks: Vec<u32>,
    /// By landmark: as the strict nearest neighbor, and with a guarantee.
    pub tolerated: Vec<ByCriterion>,
}

impl Cell {
    /// Whether it can be the cell of a plan for `n` candidates: a file may say anything.
    #[must_use]
    pub fn is_sound(&self, plan: &Plan, settings: &Settings, n: usize) -> bool {
        let (Some(&k), count) = (self.dims.last(), self.dims.len()) else {
            return false;
        };
        let is_view = |view: &u32| (1..=n as u32).contains(view);
        let is_table = |table: &MethodTable| {
            table.landmarks.len() == plan.landmarks as usize
                && table.landmarks.iter().all(is_view)
                && table.tolerated.len() == table.landmarks.len()
                && table.tolerated.iter().flatten().all(|one| {
                    one.limits.keys().eq(&Measure::REPORT) && one.ends.keys().eq(&Measure::REPORT)
                })
        };
        self.dims[0] > 0
            && self.scale == settings.scale
            && self.blur == blur_name(settings.blur)
            && self.clusters.is_some() == plan.is_clustered
            && (plan.methods.iter()).all(|method| self.tables.contains_key(method.name()))
            && self.dims.is_sorted_by(|a, b| a < b)
            && self.variance.len() >= k
            && self.coordinates.len() == n * k
            && self.dissimilarities.len() == count
            && self.profiles.len() == count
            && self
                .profiles
                .iter()
                .all(|profile| profile.len() == n && profile.iter().all(is_view))
            && self
                .clusters
                .as_ref()
                .is_none_or(|clusters| clusters.is_sound(n, count))
            && self
                .tables
                .values()
                .all(|by_dims| by_dims.len() == count && by_dims.iter().flatten().all(is_table))
    }

    /// Where a number of dimensions stands among those that were computed.
    #[must_use]
    pub fn index_of(&self, dimensions: usize) -> Option<usize> {
        self.dims.binary_search(&dimensions).ok()
    }

    /// The table of a method in some dimensions.
    #[must_use]
    pub fn table(&self, method: Method, dimensions: usize) -> Option<&MethodTable> {
        let by_dims = self.tables.get(method.name())?;
        by_dims[self.index_of(dimensions)?].as_ref()
    }
}

impl MethodTable {
    /// What the landmarks tolerate on average, by criterion.
    #[must_use]
    pub fn mean(&self) -> [MeanReliability; 2] {
        [0, 1].map(|by| {
            let of_all: Vec<_> = self.tolerated.iter().map(|one| &one[by]).collect();
            MeanReliability::of(&of_all)
        })
    }
}

/// How many parts of progress a scale with some cells has.
pub(super) fn parts(cells: usize, candidates: u32) -> u64 {
    u64::from(candidates) + 4 * cells as u64
}

/// Computes the cells of one scale: views are rendered once for all blurs.
pub(super) fn compute(
    map: &Map,
    plan: &Plan,
    cells: &[Settings],
    bar: &Bar,
) -> Result<Vec<Cell>, ExperimentError> {
    let most = plan.dimensions.last().copied().unwrap_or(1);
    let spaces = cells
        .par_iter()
        .map(|settings| {
            let space = learn(map, settings, most);
            bar.inc(1);
            space
        })
        .collect::<Result<Vec<Space>, LearnError>>()?;
    let names: Vec<Name> = cells
        .iter()
        .map(|settings| (settings.scale, settings.blur))
        .collect();
    of_spaces(map, plan, &names, &spaces, bar)
}

/// Scale and blur.
pub(super) type Name = (f64, Blur);

/// The candidates that the settings ask for, of any side, in up to `most` dimensions.
pub(super) fn learn(map: &Map, settings: &Settings, most: usize) -> Result<Space, LearnError> {
    let preprocess = Preprocess::new(
        settings.view_side() as usize,
        settings.normalize,
        settings.blur,
        settings.highpass_px,
    );
    let candidates = Candidates::new(map, &settings.grid(map)?, &preprocess)?;
    let model = Model::learn_spanned(&candidates, most)?;
    Ok(Space::new(
        candidates,
        model,
        settings.whiten,
        settings.metric,
    ))
}

/// The cells of spaces of the same map and scale.
pub(super) fn of_spaces(
    map: &Map,
    plan: &Plan,
    names: &[Name],
    spaces: &[Space],
    bar: &Bar,
) -> Result<Vec<Cell>, ExperimentError> {
    let selected = spaces
        .par_iter()
        .map(|space| {
            let selected = select(plan, space);
            bar.inc(1);
            selected
        })
        .collect::<Result<Vec<Selected>, ExperimentError>>()?;
    let asked: Vec<(&Space, &[Table])> = spaces
        .iter()
        .zip(&selected)
        .map(|(space, selected)| (space, selected.distinct.as_slice()))
        .collect();
    let tolerated = reliability::measure(map, &asked, STEPS, bar);
    let found = names
        .iter()
        .zip(spaces)
        .zip(selected.into_iter().zip(tolerated));
    Ok(found
        .map(|((&name, space), (selected, tolerated))| {
            let cell = finish(map, plan, name, space, selected, &tolerated);
            bar.inc(1);
            cell
        })
        .collect())
}

/// What is selected in a space.
struct Selected {
    dims: Vec<usize>,
    clusters: Option<Clusters>,
    profiles: Vec<Vec<u32>>,
    dissimilarities: Vec<Spread>,
    /// By method, by dimensions.
    landmarks: Vec<(Method, Vec<Option<Vec<u32>>>)>,
    /// The different tables among them, ascending.
    distinct: Vec<Table>,
}

fn select(plan: &Plan, space: &Space) -> Result<Selected, ExperimentError> {
    let mut dims: Vec<usize> = plan
        .dimensions
        .iter()
        .map(|&k| k.min(space.dimensions()))
        .collect();
    dims.dedup();
    let count = plan.landmarks as usize;
    let mut selector = Selector::new(space, count);
    let coordinates: Vec<(usize, Vec<f64>)> = dims.iter().map(|&k| (k, space.first(k))).collect();
    let profiles: Vec<Vec<u32>> = coordinates
        .iter()
        .map(|(k, points)| selector.profile(points, *k))
        .collect();
    let mut in_dims = |method: Method| -> Vec<Option<Vec<u32>>> {
        let grouped = |by, k: usize, points: &[f64]| clusters::landmarks(by, points, k, count);
        coordinates
            .iter()
            .zip(&profiles)
            .map(|((k, points), profile)| match method {
                Method::Profile => profile.get(..count).map(<[u32]>::to_vec),
                Method::IpcaProfile => selector.ipca(profile),
                Method::IpcaStart(index) => selector.ipca(&START_LISTS[index].views),
                Method::Fixed | Method::Atlas => Some(plan.fixed.clone()),
                Method::Linkage => grouped(Grouping::Linkage, *k, points),
                Method::KMeans => grouped(Grouping::KMeans, *k, points),
            })
            .collect()
    };
    let landmarks: Vec<(Method, Vec<Option<Vec<u32>>>)> = plan
        .methods
        .iter()
        .map(|&method| (method, in_dims(method)))
        .collect();
    let tables = landmarks
        .iter()
        .flat_map(|(_, by_dims)| dims.iter().zip(by_dims));
    let mut distinct: Vec<Table> = tables
        .filter_map(|(&k, landmarks)| Some(table(k, landmarks.as_ref()?)))
        .collect();
    distinct.sort();
    distinct.dedup();
    let dissimilarities = coordinates
        .iter()
        .map(|(k, points)| spread_of_pairs(space, points, *k))
        .collect();
    let clusters = plan
        .is_clustered
        .then(|| Clusters::of(&coordinates))
        .transpose()?;
    Ok(Selected {
        dims,
        clusters,
        profiles,
        dissimilarities,
        landmarks,
        distinct,
    })
}

/// The same landmarks in another order are the same table.
fn table(dimensions: usize, landmarks: &[u32]) -> Table {
    let mut landmarks = landmarks.to_vec();
    landmarks.sort_unstable();
    Table {
        dimensions,
        landmarks,
    }
}

fn spread_of_pairs(space: &Space, coordinates: &[f64], k: usize) -> Spread {
    let points: Vec<&[f64]> = coordinates.chunks_exact(k).collect();
    let mut values = Vec::with_capacity(points.len() * points.len() / 2);
    for (index, one) in points.iter().enumerate() {
        let others = points[..index].iter();
        values.extend(others.map(|other| dissimilarity(space.metric, one, other)));
    }
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
    Spread {
        mean,
        deviation: variance.sqrt(),
    }
}

fn finish(
    map: &Map,
    plan: &Plan,
    (scale, blur): Name,
    space: &Space,
    selected: Selected,
    tolerated: &[Vec<ByCriterion>],
) -> Cell {
    let of_landmarks = |k: usize, landmarks: &[u32]| {
        let table = table(k, landmarks);
        let index = selected.distinct.binary_search(&table).expect("asked for");
        let of_one = |view: &u32| {
            let at = table.landmarks.binary_search(view).expect("a landmark");
            tolerated[index][at].clone()
        };
        landmarks.iter().map(of_one).collect()
    };
    let tables = selected.landmarks.iter().map(|(method, by_dims)| {
        let in_dims = selected.dims.iter().zip(by_dims).map(|(&k, landmarks)| {
            let landmarks = landmarks.clone()?;
            Some(MethodTable {
                tolerated: of_landmarks(k, &landmarks),
                landmarks,
            })
        });
        (method.name().to_owned(), in_dims.collect())
    });
    let total = space.model.total_variance.max(f64::MIN_POSITIVE);
    Cell {
        scale,
        blur: blur_name(blur).to_owned(),
        side: space.side(),
        tables: tables.collect(),
        variance: space
            .model
            .eigenvalues
            .iter()
            .map(|value| value / total)
            .collect(),
        coordinates: space.coordinates.iter().map(|&x| x as f32).collect(),
        eigenimages: Eigenimages::of(space),
        recovered: Recovered::of(space),
        localization: localize(map, space, &plan.fixed),
        clusters: selected.clusters,
        dims: selected.dims,
        dissimilarities: selected.dissimilarities,
        profiles: selected.profiles,
    }
}
