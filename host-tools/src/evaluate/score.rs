//! One number for a landmark, and for a set of them: the probability of a right fix; report section 3.5.3 asks for it.
//!
//! **What.** A vehicle that believes to be at a landmark is off by some error of pose, and light has changed. Errors are
//! drawn from a stated distribution, a [`Deviation`], all at once; the score is the share of views that are localized at
//! the landmark. Unlike the limits of single measures it knows how errors add up, needs no weights between degrees,
//! percent and pixels, and says what a user wants to know. Unlike them it depends on the distribution that is stated.
//!
//! **Notation.** s successes in n draws; z = 1.96 for 95 %.
//!
//! **Method.** Views are rendered by the camera that flies; draws that show anything beyond the map are drawn again. The
//! interval is Wilson's (E. B. Wilson, *Probable inference*, 1927), which holds near 0 and 1, too. A set's score is that of
//! all its landmarks' draws together: as many of each, but for landmarks without room on the map.

use serde::{Deserialize, Serialize};

use super::{
    Deviation,
    deviation::TRIES,
    judge::{Criterion, Judge},
    reliability::Observer,
};
use crate::{
    map::Map,
    simulate::{Camera, Scene, seeded},
};

/// Standard deviations to either side that 95 % of a normal distribution lie within.
const Z: f64 = 1.959_963_984_540_054;

/// What happened to the views that were drawn around a landmark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Draws {
    /// Views drawn that show nothing beyond the map, n.
    pub views: u64,
    /// Those and the others: a landmark at the edge of the map is judged by a part of the distribution only.
    pub tries: u64,
    /// Localized at the landmark as the strict nearest, s.
    pub right: u64,
    /// The same with a guarantee.
    pub guaranteed: u64,
    /// Guaranteed for another landmark.
    pub guaranteed_wrong: u64,
}

/// The probability of a right fix.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Score {
    /// Share of views that are localized right, s/n.
    pub right: f64,
    /// Its 95 % interval.
    pub right_interval: [f64; 2],
    /// Share of views that are localized right with a guarantee.
    pub guaranteed: f64,
    /// Its 95 % interval.
    pub guaranteed_interval: [f64; 2],
    /// Share of views that are guaranteed for another landmark.
    pub guaranteed_wrong: f64,
    /// Share of the distribution that shows nothing beyond the map.
    pub room: f64,
    /// Views drawn, n.
    pub views: u64,
}

impl Draws {
    /// The score, if there was room for a view at all.
    #[must_use]
    pub fn score(&self) -> Option<Score> {
        let share = |count: u64, of: u64| count as f64 / of as f64;
        (self.views > 0).then(|| Score {
            right: share(self.right, self.views),
            right_interval: wilson_interval(self.right, self.views),
            guaranteed: share(self.guaranteed, self.views),
            guaranteed_interval: wilson_interval(self.guaranteed, self.views),
            guaranteed_wrong: share(self.guaranteed_wrong, self.views),
            room: share(self.views, self.tries),
            views: self.views,
        })
    }
}

impl std::iter::Sum for Draws {
    fn sum<I: Iterator<Item = Self>>(draws: I) -> Self {
        draws.fold(Self::default(), |sum, one| Self {
            views: sum.views + one.views,
            tries: sum.tries + one.tries,
            right: sum.right + one.right,
            guaranteed: sum.guaranteed + one.guaranteed,
            guaranteed_wrong: sum.guaranteed_wrong + one.guaranteed_wrong,
        })
    }
}

/// The 95 % interval of the probability of what happened `successes` times in `trials`, Wilson's.
///
/// # Panics
/// When there were no trials, or fewer than successes.
#[must_use]
pub fn wilson_interval(successes: u64, trials: u64) -> [f64; 2] {
    assert!(trials > 0 && successes <= trials);
    let (s, n) = (successes as f64, trials as f64);
    let z2 = Z * Z;
    let center = (s + z2 / 2.0) / (n + z2);
    let half = Z / (n + z2) * (s * (n - s) / n + z2 / 4.0).sqrt();
    [(center - half).max(0.0), (center + half).min(1.0)]
}

/// Draws `views` views around landmark `landmark` (0-based), whose nominal scene is given, for every judge.
#[must_use]
pub(super) fn draw(
    map: &Map,
    camera: Camera,
    judges: &[&dyn Judge],
    deviation: &Deviation,
    (landmark, nominal): (u32, &Scene),
    views: u64,
    seed: u64,
) -> Vec<Draws> {
    let mut observer = Observer::new(map, camera, &judges);
    let mut random = seeded(seed, u64::from(landmark));
    let mut draws = vec![Draws::default(); judges.len()];
    for _ in 0..views {
        let Some((scene, tries)) = deviation.draw(map, &camera, nominal, &mut random) else {
            draws
                .iter_mut()
                .for_each(|draws| draws.tries += TRIES as u64);
            break;
        };
        let verdicts = observer.verdicts(landmark, &scene, &mut random);
        for (draws, verdict) in draws.iter_mut().zip(verdicts) {
            let is_guaranteed = verdict.is_some_and(|verdict| verdict.is_guaranteed);
            let is_guaranteed_right = Criterion::Guaranteed.holds(verdict, landmark);
            draws.views += 1;
            draws.tries += tries as u64;
            draws.right += u64::from(Criterion::Nearest.holds(verdict, landmark));
            draws.guaranteed += u64::from(is_guaranteed_right);
            draws.guaranteed_wrong += u64::from(is_guaranteed && !is_guaranteed_right);
        }
    }
    draws
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_wilsons() {
        for (s, n, expected) in [
            (2, 10, [0.056_682_2, 0.509_837_5]),
            (200, 1000, [0.176_377_1, 0.225_919_0]),
            (0, 10, [0.0, 0.277_532_8]),
            (10, 10, [0.722_467_2, 1.0]),
        ] {
            let found = wilson_interval(s, n);
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 1e-6,
                    "{s} of {n}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say() {
        use rand::RngExt;
        let mut random = seeded(5, 5);
        for truth in [0.03, 0.5, 0.9] {
            let held = (0..2000).filter(|_| {
                let successes = (0..200).filter(|_| random.random_bool(truth)).count();
                let [low, high] = wilson_interval(successes as u64, 200);
                (low..=high).contains(&truth)
            });
            let share = held.count() as f64 / 2000.0;
            assert!((0.92..0.98).contains(&share), "{truth}: {share}");
        }
    }
}
