//! Which selection is better for a map, and how much do they agree? `compare_ranks` of the report (table C.3).
//!
//! **What.** The same candidates are ranked by profile, by IPCA from two start lists, and for reliability. Landmarks are
//! certain as far as their radii reach, so that a selection is better when its radii are larger.
//!
//! **Notation.** l landmarks, k dimensions, ε radii (report (2.38), reconstructed), in the metric's unit and not narrowed
//! by quantization. Candidates are numbered from 1.
//!
//! **Method.** One eigenspace serves every number of dimensions in [`REPORT_DIMENSIONS`]: coordinates of fewer are the
//! first of those of more. Rankings of neighboring numbers of dimensions are compared as a whole (profile) and by their
//! first l (profile and reliable). An IPCA ranking compares views, not coordinates: it depends on the dimensions only
//! through its start list (report 3.4.2), and is not compared across them.
//!
//! **Cost.** One PCA, and two selections per number of dimensions.
//!
//! **Limits.** Radii say what is guaranteed, not how often the nearest landmark is the right one;
//! [`deviated_fixes`](super::deviated_fixes) measures that.

use serde::Serialize;

use crate::{
    atlas::radii,
    learn::{Candidates, Model, Settings, first_columns},
    map::Map,
    output::Progress,
    select::{
        Best, Chooser, CompareError, Eligible, Method, SelectionError, Stability, Start, eligible,
        kendall_tau, spearman_rho, stability,
    },
};

/// Numbers of dimensions that the report compares: E of (3.2).
pub const REPORT_DIMENSIONS: [usize; 15] = [1, 2, 3, 5, 7, 10, 12, 15, 18, 20, 25, 35, 50, 65, 83];

/// Names of the methods that are compared in every number of dimensions.
const PROFILE: &str = "profile";
const RELIABLE: &str = "reliable";

/// Selections of the same candidates, side by side.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Number of candidates, n.
    pub candidates: u32,
    /// How many of them preselection keeps.
    pub kept: usize,
    /// Dimensions of the eigenspace, k.
    pub dims: usize,
    /// Dimensions that the candidates span.
    pub spanned: usize,
    /// Share of the variance that the k dimensions cover.
    pub covered_variance: f64,
    /// Number of landmarks, l.
    pub landmarks: u32,
    /// Every selection, in k dimensions.
    pub selections: Vec<JudgedSelection>,
    /// Share of landmarks that every selection (row) has in common with every other (column).
    pub overlaps: Vec<Vec<f64>>,
    /// The same method in different dimensions.
    pub across: AcrossDimensions,
}

/// A selection and its radii.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgedSelection {
    /// `profile`, `ipca` (from the best three of the profile ranking), `ipca-random` or `reliable`.
    pub method: &'static str,
    /// Candidate numbers, best first.
    pub landmarks: Vec<u32>,
    /// The smallest radius, in the metric's unit.
    pub smallest_radius: f64,
    /// The mean radius, in the metric's unit.
    pub mean_radius: f64,
}

/// How much selections change with the number of dimensions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AcrossDimensions {
    /// Numbers of dimensions: [`REPORT_DIMENSIONS`] as far as the candidates span them.
    pub dims: Vec<usize>,
    /// Kendall's τ of the whole profile ranking and the next.
    pub kendall_tau: Vec<f64>,
    /// Spearman's ρ of the whole profile ranking and the next.
    pub spearman_rho: Vec<f64>,
    /// How much the first l by profile agree; `None` when there is only one number of dimensions.
    pub profile: Option<Stability>,
    /// How much the most reliable l agree.
    pub reliable: Option<Stability>,
}

/// Why selections cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ComparisonError {
    /// One of them cannot be made.
    #[error("{method} in {dims} dimensions: {error}")]
    Selection {
        /// Its method.
        method: &'static str,
        /// Number of dimensions.
        dims: usize,
        /// Why not.
        error: SelectionError,
    },
    /// A single landmark is nearest everywhere, however it was selected.
    #[error("a comparison of radii needs at least 2 landmarks, and 1 is asked for")]
    SingleLandmark,
    /// Their rankings do not compare.
    #[error(transparent)]
    Rankings(#[from] CompareError),
}

/// Compares the ways to select what `best` asks for, whatever its method; random start lists are drawn by `seed`.
///
/// `model` has the dimensions of the settings at least. More of them, up to the last of [`REPORT_DIMENSIONS`], are used
/// for the comparison across dimensions.
///
/// # Errors
/// When a method does not find as many landmarks, in any number of dimensions.
///
/// # Panics
/// When the model has fewer dimensions than the settings.
pub fn compare_selections(
    map: &Map,
    candidates: &Candidates,
    model: &Model,
    settings: &Settings,
    best: &Best,
    seed: u64,
    progress: &Progress,
) -> Result<Comparison, ComparisonError> {
    if best.landmarks < 2 {
        return Err(ComparisonError::SingleLandmark);
    }
    let step = progress.step("projecting views");
    let coordinates = model.whitened(model.project(candidates), settings.whiten);
    drop(step);
    let eligible = eligible(map, candidates.grid(), settings.scale, best);
    let selector = Selector {
        candidates,
        settings,
        best,
        eligible: &eligible,
    };
    let in_space = |dimensions| Space {
        dimensions,
        coordinates: first_columns(&coordinates, model.dimensions, dimensions),
    };

    let step = progress.step("selecting landmarks");
    let dims = usize::from(settings.dimensions);
    let space = in_space(dims);
    let ipca = |start| Method::Ipca {
        start,
        stop_residual: None,
    };
    let methods = [
        (PROFILE, Method::Profile),
        ("ipca", ipca(Start::Profile)),
        ("ipca-random", ipca(Start::Random { seed })),
        (RELIABLE, Method::Reliable),
    ];
    let selections = methods
        .into_iter()
        .map(|(name, method)| {
            let landmarks = selector.select(&space, name, method)?;
            Ok(selector.judged(&space, name, landmarks))
        })
        .collect::<Result<Vec<_>, ComparisonError>>()?;
    let overlaps = stability(
        &selections.iter().map(|s| &s.landmarks).collect::<Vec<_>>(),
        best.landmarks as usize,
    )?
    .overlaps;
    drop(step);

    // ERRATA of the report: more dimensions than the views span are all of them.
    let mut all_dims = REPORT_DIMENSIONS
        .map(|dims| dims.min(model.dimensions))
        .to_vec();
    all_dims.dedup();
    let spaces = all_dims.into_iter().map(in_space);
    Ok(Comparison {
        candidates: candidates.grid().count(),
        kept: eligible.candidates().len(),
        dims,
        spanned: model.eigenvalues.len(),
        covered_variance: model.eigenvalues[..dims].iter().sum::<f64>() / model.total_variance,
        landmarks: best.landmarks,
        selections,
        overlaps,
        across: selector.across(spaces, progress)?,
    })
}

/// The candidates in some number of dimensions.
struct Space {
    dimensions: usize,
    coordinates: Vec<f64>,
}

/// Selects from the same candidates in different spaces.
struct Selector<'a> {
    candidates: &'a Candidates,
    settings: &'a Settings,
    best: &'a Best,
    eligible: &'a Eligible,
}

impl Selector<'_> {
    fn chooser<'a>(&'a self, space: &'a Space) -> Chooser<'a> {
        Chooser {
            candidates: self.candidates,
            coordinates: &space.coordinates,
            dimensions: space.dimensions,
            metric: self.settings.metric,
        }
    }

    fn select(
        &self,
        space: &Space,
        name: &'static str,
        method: Method,
    ) -> Result<Vec<u32>, ComparisonError> {
        let best = Best {
            method,
            ..self.best.clone()
        };
        let chosen = self.chooser(space).choose(&best, self.eligible);
        let (landmarks, _) = chosen.map_err(|error| ComparisonError::Selection {
            method: name,
            dims: space.dimensions,
            error,
        })?;
        Ok(landmarks)
    }

    fn judged(&self, space: &Space, method: &'static str, landmarks: Vec<u32>) -> JudgedSelection {
        let radii = radii(
            self.settings.metric,
            &space.coordinates,
            space.dimensions,
            &landmarks,
            0.0,
        );
        let radii = radii.iter().map(|&radius| f64::from(radius));
        JudgedSelection {
            method,
            smallest_radius: radii.clone().fold(f64::INFINITY, f64::min),
            mean_radius: radii.sum::<f64>() / landmarks.len() as f64,
            landmarks,
        }
    }

    fn across(
        &self,
        spaces: impl ExactSizeIterator<Item = Space>,
        progress: &Progress,
    ) -> Result<AcrossDimensions, ComparisonError> {
        let count = self.best.landmarks as usize;
        let bar = progress.bar("dimensions", spaces.len() as u64);
        let (mut rankings, mut profile, mut reliable) = (Vec::new(), Vec::new(), Vec::new());
        let mut dims = Vec::new();
        for space in spaces {
            dims.push(space.dimensions);
            let all = self.eligible.candidates().len();
            let ranking = self
                .chooser(&space)
                .profile_ranking(self.best, self.eligible, all);
            let first = self.eligible.best_of(&ranking, count);
            if first.len() < count {
                let error = self.best.too_few(&first, self.eligible);
                return Err(ComparisonError::Selection {
                    method: PROFILE,
                    dims: space.dimensions,
                    error,
                });
            }
            profile.push(first);
            rankings.push(ranking);
            reliable.push(self.select(&space, RELIABLE, Method::Reliable)?);
            bar.inc(1);
        }
        let neighbors = || rankings.iter().zip(rankings.iter().skip(1));
        let stable = |selections: &[Vec<u32>]| {
            (selections.len() > 1)
                .then(|| stability(selections, count))
                .transpose()
        };
        Ok(AcrossDimensions {
            dims,
            kendall_tau: neighbors()
                .map(|(one, next)| kendall_tau(one, next))
                .collect::<Result<_, _>>()?,
            spearman_rho: neighbors()
                .map(|(one, next)| spearman_rho(one, next))
                .collect::<Result<_, _>>()?,
            profile: stable(&profile)?,
            reliable: stable(&reliable)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        learn::Rows,
        select::{Attention, Preselection, Selection, dissimilarity, select},
        train::learn,
    };

    /// Radii are f32, and made smaller by up to 2⁻²⁰ so that they never grow by rounding.
    const ROUNDING: f64 = 2e-6;

    fn learned(settings: &Settings) -> (Candidates, Model) {
        learn(&Map::city(), settings, 83, &Progress::Hidden).expect("learns")
    }

    fn compared(settings: &Settings, best: &Best) -> Result<Comparison, ComparisonError> {
        let (candidates, model) = learned(settings);
        let progress = Progress::Hidden;
        compare_selections(
            &Map::city(),
            &candidates,
            &model,
            settings,
            best,
            7,
            &progress,
        )
    }

    #[test]
    fn the_compared_selections_are_those_that_training_makes() {
        let best = Best {
            spacing_px: 150.0,
            preselection: Some(Preselection {
                attention: Attention::Edges,
                keep: Some(60),
            }),
            ..Best::new(5, Method::Profile)
        };
        let settings = Settings {
            whiten: 0.5,
            ..Settings::default()
        };
        let comparison = compared(&settings, &best).expect("selects");
        assert_eq!((comparison.kept, comparison.spanned), (60, 82));

        let (candidates, _) = learned(&settings);
        let k = usize::from(settings.dimensions);
        let model = Model::learn(&candidates, k).expect("learns");
        assert_eq!(candidates.count(), 83);
        let coordinates = model.whitened(model.project(&candidates), settings.whiten);
        let point = |view: u32| &coordinates[(view as usize - 1) * k..][..k];
        let ipca = |start| Method::Ipca {
            start,
            stop_residual: None,
        };
        let methods = [
            best.method.clone(),
            ipca(Start::Profile),
            ipca(Start::Random { seed: 7 }),
            Method::Reliable,
        ];
        for (judged, method) in comparison.selections.iter().zip(methods) {
            let best = Best {
                method,
                ..best.clone()
            };
            let settings = Settings {
                selection: Selection::Best(best),
                ..settings.clone()
            };
            let selected = select(&Map::city(), &candidates, &coordinates, &settings, false);
            assert_eq!(judged.landmarks, selected.expect("selects").landmarks);
            let pairs = judged.landmarks.iter().flat_map(|&one| {
                let others = judged.landmarks.iter().filter(move |&&other| other != one);
                others.map(move |&other| (one, other))
            });
            // In nSSD, a quarter of the smallest distance.
            let smallest = pairs
                .map(|(one, other)| dissimilarity(settings.metric, point(one), point(other)) / 4.0)
                .fold(f64::INFINITY, f64::min);
            let difference = (judged.smallest_radius - smallest).abs();
            assert!(difference < ROUNDING * smallest, "{smallest} {judged:?}");
            assert!(judged.mean_radius >= judged.smallest_radius);
        }
    }

    #[test]
    fn dimensions_are_compared_as_far_as_the_views_span_them() {
        let comparison = compared(&Settings::default(), &Best::new(3, Method::Profile));
        let across = comparison.expect("selects").across;
        assert_eq!(across.dims[..14], REPORT_DIMENSIONS[..14]);
        assert_eq!(across.dims[14..], [82], "83 views span one dimension less");
        assert_eq!(
            (across.kendall_tau.len(), across.spearman_rho.len()),
            (14, 14)
        );
        assert_eq!(across.reliable.expect("many").overlaps.len(), 15);
    }

    #[test]
    fn a_single_landmark_cannot_be_compared() {
        let refused = compared(&Settings::default(), &Best::new(1, Method::Profile));
        assert_eq!(refused, Err(ComparisonError::SingleLandmark));
    }

    #[test]
    fn coordinates_of_fewer_dimensions_are_the_first() {
        assert_eq!(
            first_columns(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 3, 2),
            [1.0, 2.0, 4.0, 5.0]
        );
    }
}
