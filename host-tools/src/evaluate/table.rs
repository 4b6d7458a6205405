//! What was found about a table as a whole, and how far two judges agree.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};

use super::{
    evaluation::Evaluated,
    judge::Criterion,
    reliability::{End, MeanReliability, Measure, Reliability, mean},
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

/// How two judges of the same landmarks differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgeDifference {
    /// As the strict nearest neighbor.
    pub nearest: CriterionDifference,
    /// With a guarantee.
    pub guaranteed: CriterionDifference,
    /// The first's score of the set minus the second's, of the same draws.
    pub score: Option<f64>,
}

/// How two judges differ by one criterion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CriterionDifference {
    /// Landmarks that agree in everything.
    pub equal: usize,
    /// Mean magnitudes of the differences of lower and upper limits that end in a failure by both; `None` without any.
    pub mean: BTreeMap<Measure, [Option<f64>; 2]>,
    /// How many those are.
    pub compared: BTreeMap<Measure, [usize; 2]>,
    /// The largest magnitudes; zero without any.
    pub largest: BTreeMap<Measure, [f64; 2]>,
    /// Mean magnitude of the difference of the areas of catchments, in map pixels.
    pub catchment_px: f64,
    /// The largest, in map pixels.
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

impl EvaluatedMean {
    /// The means by one criterion.
    #[must_use]
    pub fn by(&self, criterion: Criterion) -> &MeanReliability {
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
    pub fn against(&self, other: &Self) -> JudgeDifference {
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
        let mut found = Self {
            equal: pairs.iter().filter(|(one, two)| one == two).count(),
            mean: BTreeMap::new(),
            compared: BTreeMap::new(),
            largest: BTreeMap::new(),
            catchment_px: 0.0,
            largest_catchment_px: 0,
        };
        for &measure in measures {
            let differences = [0, 1].map(|side| {
                let failed = |one: &Reliability| one.ends[&measure][side] == End::Failed;
                let both = pairs.iter().filter(|(one, two)| failed(one) && failed(two));
                let difference = |(one, two): &(&Reliability, &Reliability)| {
                    (one.limits[&measure][side] - two.limits[&measure][side]).abs()
                };
                both.map(difference).collect::<Vec<f64>>()
            });
            let each = differences.each_ref();
            found
                .mean
                .insert(measure, each.map(|all| mean(all.iter().copied())));
            found.compared.insert(measure, each.map(Vec::len));
            let largest = each.map(|all| all.iter().copied().fold(0.0, f64::max));
            found.largest.insert(measure, largest);
        }
        let apart = || {
            pairs
                .iter()
                .map(|(one, two)| one.catchment_px.abs_diff(two.catchment_px))
        };
        found.catchment_px = mean(apart().map(|area| area as f64)).unwrap_or(0.0);
        found.largest_catchment_px = apart().max().unwrap_or(0);
        found
    }
}
