//! Every landmark, by every judge: limits, catchments and score.

use eigenmark_core::landmark::{Candidate, Point};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    Deviation,
    everywhere::Everywhere,
    journal::{Journal, JournalError},
    judge::{Criterion, Judge},
    reliability::{Measure, Observer, Reliability, Steps, catchment},
    score::{self, Draws},
};
use crate::{
    map::Map,
    output::Progress,
    simulate::{Camera, Scene},
};

/// What is evaluated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    /// Respects in which views deviate, beside position.
    pub measures: Vec<Measure>,
    /// How finely they are tried.
    pub steps: Steps,
    /// The distribution that scores are drawn from.
    pub deviation: Deviation,
    /// Views drawn per landmark for its score; 0 for none.
    pub views: u64,
    /// Seed of the draws.
    pub seed: u64,
}

/// A landmark to evaluate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Its candidate number, 1-based.
    pub view: u32,
    /// The center of its window.
    pub place: Point,
    /// Its heading in radians, clockwise from map-up to frame-up.
    pub heading_rad: f32,
    /// Its altitude over the nominal altitude.
    pub altitude_ratio: f32,
}

/// What was found about a landmark.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluated {
    /// Its rank in the table, 1-based.
    pub landmark: u32,
    /// Its candidate number, 1-based.
    pub view: u32,
    /// The center of its window, in map pixels.
    pub place: [f32; 2],
    /// As the strict nearest neighbor.
    pub nearest: Reliability,
    /// With a guarantee.
    pub guaranteed: Reliability,
    /// What happened to the views that were drawn around it.
    pub draws: Draws,
}

impl From<&Candidate> for Site {
    fn from(candidate: &Candidate) -> Self {
        Self {
            view: candidate.view,
            place: candidate.place(),
            heading_rad: candidate.layer.heading_rad,
            altitude_ratio: candidate.layer.altitude_ratio,
        }
    }
}

impl Site {
    /// What a camera sees there.
    #[must_use]
    pub fn scene(&self) -> Scene {
        Scene {
            heading_rad: self.heading_rad.into(),
            altitude_ratio: self.altitude_ratio.into(),
            ..Scene::nominal(self.place)
        }
    }

    /// The top-left pixel of its window.
    #[must_use]
    pub fn corner(&self, window_px: u32) -> [u32; 2] {
        let half = window_px as f32 / 2.0;
        [self.place.x_px, self.place.y_px].map(|at| (at - half) as u32)
    }
}

/// Evaluates the landmarks at `sites`, in the order of their rank, by the judges of `everywhere`, which say what they see
/// at every position of the map. What `journal` knows is not done again, and what is new is written to it. Per landmark
/// one result per judge; the same for any number of threads.
///
/// # Errors
/// When the journal cannot be written.
///
/// # Panics
/// When there is no judge.
pub fn evaluate(
    map: &Map,
    sites: &[Site],
    everywhere: &[Everywhere<'_>],
    plan: &Plan,
    journal: &Journal,
    progress: &Progress,
) -> Result<Vec<Vec<Evaluated>>, JournalError> {
    let bar = progress.bar("landmarks", sites.len() as u64);
    let evaluator = Evaluator {
        map,
        footprint_px: everywhere[0].window_px(),
        judges: &everywhere.iter().map(Everywhere::judge).collect::<Vec<_>>(),
        everywhere,
        plan,
    };
    (0..sites.len())
        .into_par_iter()
        .with_max_len(1)
        .map(|landmark| {
            let known = journal.known(landmark as u32);
            let evaluated = match known
                .filter(|known| evaluator.asked(landmark as u32, sites[landmark], known))
            {
                Some(known) => known.to_vec(),
                None => {
                    let evaluated = evaluator.landmark(landmark as u32, sites[landmark]);
                    journal.append(landmark as u32, &evaluated)?;
                    evaluated
                }
            };
            bar.inc(1);
            Ok(evaluated)
        })
        .collect()
}

struct Evaluator<'a> {
    map: &'a Map,
    footprint_px: u32,
    judges: &'a [&'a dyn Judge],
    everywhere: &'a [Everywhere<'a>],
    plan: &'a Plan,
}

impl Evaluator<'_> {
    /// Whether this is what is asked about a landmark: a journal may say anything.
    fn asked(&self, landmark: u32, site: Site, known: &[Evaluated]) -> bool {
        let mut measures = self.plan.measures.clone();
        measures.sort_unstable();
        measures.dedup();
        let is_whole =
            |one: &Reliability| one.limits.keys().eq(&measures) && one.ends.keys().eq(&measures);
        known.len() == self.judges.len()
            && known.iter().all(|one| {
                let Draws {
                    views,
                    tries,
                    right,
                    guaranteed,
                    guaranteed_wrong,
                } = one.draws;
                let is_sound =
                    right.max(guaranteed).max(guaranteed_wrong) <= views && views <= tries;
                (one.landmark, one.view) == (landmark + 1, site.view)
                    && is_whole(&one.nearest)
                    && is_whole(&one.guaranteed)
                    && is_sound
            })
    }

    /// By every judge.
    fn landmark(&self, landmark: u32, site: Site) -> Vec<Evaluated> {
        let camera = Camera::finest(self.footprint_px);
        let mut observer = Observer::new(self.map, camera, &self.judges);
        // By measure, by judge, by criterion.
        let limits: Vec<_> = self
            .plan
            .measures
            .iter()
            .map(|&measure| {
                let steps = self.plan.steps;
                (
                    measure,
                    observer.limits(measure, steps, landmark, site.scene()),
                )
            })
            .collect();
        let draws = score::draw(
            self.map,
            Camera::square_of(f64::from(self.footprint_px)),
            self.judges,
            &self.plan.deviation,
            (landmark, &site.scene()),
            self.plan.views,
            self.plan.seed,
        );
        let corner = site.corner(self.footprint_px);
        let map_px = u64::from(self.map.width()) * u64::from(self.map.height());
        self.everywhere
            .iter()
            .zip(draws)
            .enumerate()
            .map(|(judge, (everywhere, draws))| {
                let [nearest, guaranteed] = [0, 1].map(|criterion| {
                    let limits = limits
                        .iter()
                        .map(|(m, limits)| (*m, limits[judge][criterion]));
                    let by = Criterion::ALL[criterion];
                    let catchment = catchment(everywhere, landmark, corner.into(), by);
                    Reliability::new(limits, catchment, map_px)
                });
                Evaluated {
                    landmark: landmark + 1,
                    view: site.view,
                    place: [site.place.x_px, site.place.y_px],
                    nearest,
                    guaranteed,
                    draws,
                }
            })
            .collect()
    }
}
