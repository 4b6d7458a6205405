//! What was found about a table as a whole, and how far two judges agree.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};

use super::{
    evaluation::Evaluated,
    judge::Criterion,
    reliability::{End, MeanReliability, Measure, Reliability},
    score::{Draws, Score},
};

/// Every landmark by one judge, and their means.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EvaluatedTable {
    /// By rank.
    pub landmarks: Vec<EvaluatedLandmark>,
    /// Means over the landmarks.
    pub mean: EvaluatedMean,
}

/// A landmark and its score.
#[derive(Clone, Debug, PartialEq)]
pub struct EvaluatedLandmark {
    /// What was found about it.
    pub evaluated: Evaluated,
    /// The probability of a right fix; `None` when none was asked for, or there is no room on the map.
    pub score: Option<Score>,
}

/// What scripts read about a landmark: limits stand beside each other, under the names of their measures.
#[derive(Serialize)]
struct LandmarkFields<'a> {
    landmark: u32,
    view: u32,
    place: [f32; 2],
    nearest: CriterionFields<'a>,
    guaranteed: CriterionFields<'a>,
    draws: Draws,
    score: Option<Score>,
}

/// What scripts read about a landmark by one criterion.
#[derive(Serialize)]
struct CriterionFields<'a> {
    #[serde(flatten)]
    limits: &'a BTreeMap<Measure, [f64; 2]>,
    ends: &'a BTreeMap<Measure, [End; 2]>,
    catchment_px: u64,
    catchment_share: f64,
    catchment_end: End,
}

impl Serialize for EvaluatedLandmark {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self { evaluated, score } = self;
        let by = |criterion| {
            let one = evaluated.by(criterion);
            CriterionFields {
                limits: &one.limits,
                ends: &one.ends,
                catchment_px: one.catchment_px,
                catchment_share: one.catchment_share,
                catchment_end: one.catchment_end,
            }
        };
        let fields = LandmarkFields {
            landmark: evaluated.landmark,
            view: evaluated.view,
            place: evaluated.place,
            nearest: by(Criterion::Nearest),
            guaranteed: by(Criterion::Guaranteed),
            draws: evaluated.draws,
            score: *score,
        };
        fields.serialize(serializer)
    }
}

/// Means over landmarks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EvaluatedMean {
    /// As the strict nearest neighbor.
    pub nearest: MeanReliability,
    /// With a guarantee.
    pub guaranteed: MeanReliability,
    /// The probability of a right fix.
    pub score: Option<Score>,
}

/// How two judges of the same landmarks differ: the first minus the second.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgeDifference {
    /// As the strict nearest neighbor.
    pub nearest: CriterionDifference,
    /// With a guarantee.
    pub guaranteed: CriterionDifference,
    /// Difference of the scores of the set, of the same draws.
    pub score: Option<f64>,
}

/// How two judges differ by one criterion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CriterionDifference {
    /// Landmarks that agree in everything.
    pub equal: usize,
    /// Mean differences of the lower and upper limits where both end in a failure.
    pub mean: BTreeMap<Measure, [f64; 2]>,
    /// Their largest magnitudes.
    pub largest: BTreeMap<Measure, [f64; 2]>,
    /// Mean difference of the areas of catchments, in map pixels.
    pub catchment_px: f64,
    /// Its largest magnitude.
    pub largest_catchment_px: u64,
}

impl Evaluated {
    /// What was found by one criterion.
    #[must_use]
    pub fn by(&self, criterion: Criterion) -> &Reliability {
        match criterion {
            Criterion::Nearest => &self.nearest,
            Criterion::Guaranteed => &self.guaranteed,
        }
    }
}

impl EvaluatedTable {
    /// The table of landmarks that were evaluated by the same measures.
    #[must_use]
    pub fn new(landmarks: impl IntoIterator<Item = Evaluated>) -> Self {
        let landmarks: Vec<Evaluated> = landmarks.into_iter().collect();
        let mean = |criterion| {
            let by: Vec<&Reliability> = landmarks.iter().map(|one| one.by(criterion)).collect();
            MeanReliability::of(&by)
        };
        let all: Draws = landmarks.iter().map(|one| one.draws).sum();
        Self {
            mean: EvaluatedMean {
                nearest: mean(Criterion::Nearest),
                guaranteed: mean(Criterion::Guaranteed),
                score: all.score(),
            },
            landmarks: landmarks
                .into_iter()
                .map(|evaluated| EvaluatedLandmark {
                    score: evaluated.draws.score(),
                    evaluated,
                })
                .collect(),
        }
    }

    /// How this differs from what another judge found about the same landmarks.
    #[must_use]
    pub fn minus(&self, other: &Self) -> JudgeDifference {
        let by = |criterion| {
            let pairs = self.landmarks.iter().zip(&other.landmarks);
            let pairs: Vec<_> = pairs
                .map(|(one, two)| (one.evaluated.by(criterion), two.evaluated.by(criterion)))
                .collect();
            CriterionDifference::of(&pairs)
        };
        let scores = self.mean.score.zip(other.mean.score);
        JudgeDifference {
            nearest: by(Criterion::Nearest),
            guaranteed: by(Criterion::Guaranteed),
            score: scores.map(|(one, two)| one.right - two.right),
        }
    }
}

impl CriterionDifference {
    fn of(pairs: &[(&Reliability, &Reliability)]) -> Self {
        let measures = pairs
            .first()
            .into_iter()
            .flat_map(|(one, _)| one.limits.keys());
        let (mut mean, mut largest) = (BTreeMap::new(), BTreeMap::new());
        for &measure in measures {
            let differences = [0, 1].map(|side| {
                let failed = |one: &Reliability| one.ends[&measure][side] == End::Failed;
                let both = pairs.iter().filter(|(one, two)| failed(one) && failed(two));
                let difference = |(one, two): &(&Reliability, &Reliability)| {
                    one.limits[&measure][side] - two.limits[&measure][side]
                };
                both.map(difference).collect::<Vec<f64>>()
            });
            mean.insert(measure, differences.each_ref().map(|d| mean_of(d)));
            largest.insert(
                measure,
                differences.map(|d| d.iter().fold(0.0_f64, |m, d| m.max(d.abs()))),
            );
        }
        let areas: Vec<f64> = pairs
            .iter()
            .map(|(one, two)| one.catchment_px as f64 - two.catchment_px as f64)
            .collect();
        let apart = pairs
            .iter()
            .map(|(one, two)| one.catchment_px.abs_diff(two.catchment_px));
        Self {
            equal: pairs.iter().filter(|(one, two)| one == two).count(),
            mean,
            largest,
            catchment_px: mean_of(&areas),
            largest_catchment_px: apart.max().unwrap_or(0),
        }
    }
}

/// The mean; zero of nothing.
fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
