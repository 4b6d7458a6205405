//! From a user's [`Selection`] to landmarks: preselect, rank, keep the distance.

use eigenmark_core::landmark::Metric;
use rayon::prelude::*;

use super::{
    Best, Dissimilarity, Eligible, IpcaError, IpcaRanking, Method, Objective, Order, Profile,
    Route, START_LEN, Selection, Start, Stop, Until, most_reliable, preselect, random_start,
    rank_by_ipca, rank_by_ipca_literally,
};
use crate::{
    learn::{Candidates, Rows, Settings},
    map::{Grid, Map},
};

/// How many times more candidates are ranked when spacing skipped too many.
const RANKED_MORE: usize = 8;

/// The selected candidates, and how they were ranked.
#[derive(Clone, Debug)]
pub struct Selected {
    /// Candidate numbers (1-based), best first.
    pub landmarks: Vec<u32>,
    /// What each landmark of an IPCA ranking adds: the norm of its residual to those before it.
    pub residuals: Option<Vec<f64>>,
    /// The profile of all candidates; only when it was asked for.
    pub profiled: Option<Profiled>,
}

/// A distance profile and its ranking.
#[derive(Clone, Debug)]
pub struct Profiled {
    /// Mean dissimilarity of every candidate to all others, candidate 1 first.
    pub values: Vec<f64>,
    /// Candidate numbers (1-based), most dissimilar first.
    pub ranking: Vec<u32>,
}

/// Why there are no such landmarks.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SelectionError {
    /// More landmarks are asked for than there are candidates.
    #[error("{landmarks} landmarks are asked for, but the map has {candidates} views")]
    TooMany {
        /// Landmarks asked for.
        landmarks: u32,
        /// Number of candidates.
        candidates: u32,
    },
    /// More landmarks are asked for than candidates are kept.
    #[error("{landmarks} landmarks are asked for, but preselection keeps {keep} views")]
    TooManyKept {
        /// Landmarks asked for.
        landmarks: u32,
        /// Number of candidates kept.
        keep: u32,
    },
    /// The distance between landmarks leaves no room for as many.
    #[error(
        "{landmarks} landmarks are asked for, but after {found} no view is {spacing_px} map pixels away from all; \
         choose fewer, or a smaller --spacing"
    )]
    TooFar {
        /// Landmarks asked for.
        landmarks: u32,
        /// Landmarks found.
        found: usize,
        /// Map pixels between landmarks.
        spacing_px: f32,
    },
    /// The first landmarks represent every other candidate without a residual.
    #[error(
        "{landmarks} landmarks are asked for, but {found} represent every view exactly; choose up to {found}"
    )]
    Exhausted {
        /// Landmarks asked for.
        landmarks: u32,
        /// Landmarks found.
        found: usize,
    },
    /// The start list of an IPCA ranking is unusable.
    #[error(transparent)]
    Ipca(#[from] IpcaError),
}

impl Best {
    /// Checks it against a number of candidates.
    ///
    /// # Errors
    /// When there are fewer candidates, or fewer kept, than landmarks.
    pub fn check(&self, candidates: u32) -> Result<(), SelectionError> {
        let landmarks = self.landmarks;
        if landmarks > candidates {
            return Err(SelectionError::TooMany {
                landmarks,
                candidates,
            });
        }
        match self.keep(candidates) {
            Some(keep) if landmarks > keep => Err(SelectionError::TooManyKept { landmarks, keep }),
            _ => Ok(()),
        }
    }

    /// How many of the candidates preselection keeps.
    fn keep(&self, candidates: u32) -> Option<u32> {
        let preselection = self.preselection?;
        Some(preselection.keep.unwrap_or(candidates.div_ceil(4)))
    }

    /// What selecting says when it ends with `found`, while others could still be selected or not.
    pub(crate) fn too_few(&self, found: &[u32], eligible: &Eligible) -> SelectionError {
        let (landmarks, found_all) = (self.landmarks, found);
        let mut others = eligible.candidates().iter();
        let is_admitted =
            others.any(|&other| !found_all.contains(&other) && eligible.admits(other, found_all));
        let found = found.len();
        if self.spacing_px > 0.0 && !is_admitted {
            SelectionError::TooFar {
                landmarks,
                found,
                spacing_px: self.spacing_px,
            }
        } else {
            SelectionError::Exhausted { landmarks, found }
        }
    }
}

/// Selects landmarks as the settings say. `coordinates` are the candidates', as matched: rows of k.
///
/// # Errors
/// When there are not as many landmarks as asked for, or the start list is unusable.
pub fn select(
    map: &Map,
    candidates: &Candidates,
    coordinates: &[f64],
    settings: &Settings,
    with_profile: bool,
) -> Result<Selected, SelectionError> {
    let chooser = Chooser {
        candidates,
        coordinates,
        dimensions: usize::from(settings.dimensions),
        metric: settings.metric,
    };
    let best = match &settings.selection {
        Selection::All => {
            let profiled = with_profile.then(|| chooser.profile(settings.metric.into(), false));
            return Ok(Selected {
                landmarks: (1..=candidates.grid().count()).collect(),
                residuals: None,
                profiled,
            });
        }
        Selection::Best(best) => best,
    };
    let eligible = eligible(map, candidates.grid(), settings.scale, best);
    let (landmarks, residuals) = chooser.choose(best, &eligible)?;
    let profiled =
        with_profile.then(|| chooser.profile(chooser.dissimilarity(best), best.is_literal));
    Ok(Selected {
        landmarks,
        residuals,
        profiled,
    })
}

/// The candidates that `best` ranks, and how far apart it wants landmarks; `scale` is in map pixels per view pixel.
pub(crate) fn eligible(map: &Map, grid: &Grid, scale: f64, best: &Best) -> Eligible {
    let eligible = match (best.preselection, best.keep(grid.count())) {
        (Some(preselection), Some(keep)) => Eligible::among(preselect(
            map,
            grid,
            preselection.attention,
            scale,
            keep as usize,
        )),
        _ => Eligible::all(grid.count()),
    };
    if best.spacing_px > 0.0 {
        let places = (1..=grid.count()).map(|view| grid.place(view)).collect();
        eligible.spaced(places, best.spacing_px)
    } else {
        eligible
    }
}

/// What every method of selection sees.
pub(crate) struct Chooser<'a> {
    pub candidates: &'a Candidates,
    /// As matched: rows of `dimensions`.
    pub coordinates: &'a [f64],
    pub dimensions: usize,
    pub metric: Metric,
}

impl Chooser<'_> {
    /// Landmarks by the method of `best`; those of an IPCA ranking with their residuals.
    pub fn choose(
        &self,
        best: &Best,
        eligible: &Eligible,
    ) -> Result<(Vec<u32>, Option<Vec<f64>>), SelectionError> {
        let landmarks = best.landmarks as usize;
        let selected = match &best.method {
            Method::Profile => self.by_profile(best, eligible, landmarks),
            Method::Reliable => most_reliable(
                self.metric,
                self.coordinates,
                self.dimensions,
                eligible,
                landmarks,
                Objective::Smallest,
            ),
            Method::Ipca {
                start,
                stop_residual,
            } => {
                let ranked = self.by_ipca(best, eligible, start, *stop_residual)?;
                if ranked.ranking.len() < landmarks && ranked.stop != Stop::Residual {
                    return Err(best.too_few(&ranked.ranking, eligible));
                }
                return Ok((ranked.ranking, Some(ranked.residuals)));
            }
        };
        if selected.len() < landmarks {
            return Err(best.too_few(&selected, eligible));
        }
        Ok((selected, None))
    }

    /// The first `count` of the profile ranking of the eligible candidates, however near each other they are.
    pub fn profile_ranking(&self, best: &Best, eligible: &Eligible, count: usize) -> Vec<u32> {
        let k = self.dimensions;
        let numbers = eligible.candidates();
        let points: Vec<f64> = numbers
            .par_iter()
            .flat_map_iter(|&view| &self.coordinates[(view as usize - 1) * k..][..k])
            .copied()
            .collect();
        let dissimilarity = self.dissimilarity(best);
        let route = route(dissimilarity, numbers.len(), best.is_literal);
        let profile = Profile::new(dissimilarity, &points, k, route);
        let ranking = profile.rank(Order::MostDissimilar, count).among(numbers);
        ranking.candidates
    }

    /// The first `count` of that ranking that keep their distance.
    fn by_profile(&self, best: &Best, eligible: &Eligible, count: usize) -> Vec<u32> {
        // Spacing skips some; deciding the order of all would cost more than ranking twice.
        let mut wanted = count;
        loop {
            let ranking = self.profile_ranking(best, eligible, wanted);
            let selected = eligible.best_of(&ranking, count);
            if selected.len() == count || wanted >= eligible.candidates().len() {
                return selected;
            }
            wanted = wanted.saturating_mul(RANKED_MORE);
        }
    }

    fn by_ipca(
        &self,
        best: &Best,
        eligible: &Eligible,
        start: &Start,
        stop_residual: Option<f64>,
    ) -> Result<IpcaRanking, IpcaError> {
        let landmarks = best.landmarks as usize;
        let start = match start {
            Start::Given(views) => views.clone(),
            Start::Profile => self.by_profile(best, eligible, START_LEN.min(landmarks)),
            Start::Random { seed } => random_start(eligible, START_LEN.min(landmarks), *seed)?,
        };
        let until = Until {
            landmarks,
            residual: stop_residual,
        };
        if best.is_literal {
            rank_by_ipca_literally(self.candidates, eligible, &start, until)
        } else {
            rank_by_ipca(self.candidates, eligible, &start, until)
        }
    }

    fn dissimilarity(&self, best: &Best) -> Dissimilarity {
        best.dissimilarity.unwrap_or(self.metric.into())
    }

    /// The profile of all candidates.
    fn profile(&self, dissimilarity: Dissimilarity, is_literal: bool) -> Profiled {
        let count = self.candidates.count();
        let route = route(dissimilarity, count, is_literal);
        let profile = Profile::new(dissimilarity, self.coordinates, self.dimensions, route);
        Profiled {
            values: profile.values().to_vec(),
            ranking: profile.rank(Order::MostDissimilar, count).candidates,
        }
    }
}

fn route(dissimilarity: Dissimilarity, count: usize, is_literal: bool) -> Route {
    if is_literal {
        Route::Literal
    } else {
        Route::automatic(dissimilarity, count)
    }
}
