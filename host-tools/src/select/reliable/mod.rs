//! Selection for reliability: landmarks whose radii are as large as they can be.
//!
//! A landmark is certain as far as its radius reaches, ε_i = ½·min_{j≠i} d(g_i, g_j) (report (2.38), reconstructed; see
//! [`radii`](crate::atlas::radii)), so that one near twin is enough to spoil it. The profile (report 2.3.2) averages
//! over all candidates instead and may well select both twins. Here the radii themselves are the aim.
//!
//! **Notation.** d is [`metric_distance`](super::metric_distance): √nSSD, the Euclidean distance, or the angle. n
//! candidates of k dimensions, l landmarks. Candidates are numbered from 1. "Nearest" is the distance of a landmark
//! to the nearest other one, twice its radius.
//!
//! **Method.** [`farthest_points`] takes the candidate that is farthest from all selected ones, again and again
//! (Gonzalez, Clustering to minimize the maximum intercluster distance, 1985): without spacing, the smallest radius is
//! at least half of the best possible, because d keeps the triangle inequality. [`exchange`] then swaps landmarks for
//! better ones until no swap helps. [`most_reliable`] does both.
//!
//! **Cost.** n·k·l operations for all farthest points, and up to as many for each swap; some dozen bytes per
//! candidate. 50 landmarks among 100,000 candidates of 15 dimensions, on two cores: 0.1 to 0.4 s (nSSD, Euclid) or
//! 0.8 s (cosine) for farthest points, 0.5 to 1.3 s to raise the smallest radius (by 1 to 9 % on normal clouds), and 4
//! to 18 s to raise the mean.
//!
//! **Limits.** The best selection is NP-hard to find; exchanges end where no single one helps. Extreme views are
//! selected, and those may be odd ones: preselect with [`preselect`](super::preselect) where this matters.

mod exchange;
mod farthest;

use eigenmark_core::landmark::Metric;

pub use exchange::{Objective, exchange};
pub use farthest::farthest_points;

use super::{Eligible, metric_distance};

/// The most reliable `landmarks` of the eligible candidates, as far as [`farthest_points`] and [`exchange`] find
/// them, best first: every beginning of the selection is a good selection. Fewer when spacing leaves no more.
///
/// `coordinates` are rows of `dimensions` numbers, candidate 1 first.
///
/// ```
/// use eigenmark::select::{Eligible, Objective, most_reliable};
/// use eigenmark_core::landmark::Metric;
/// let coordinates = [0.0, 0.1, 3.0, 5.0, 10.0];
/// let all = Eligible::all(5);
/// let selected = most_reliable(Metric::Euclid, &coordinates, 1, &all, 3, Objective::Smallest);
/// assert_eq!(selected, [5, 1, 4]); // 10, 0 and 5: radii of 2.5
/// ```
///
/// # Panics
/// When an eligible candidate has no coordinates.
#[must_use]
pub fn most_reliable(
    metric: Metric,
    coordinates: &[f64],
    dimensions: usize,
    eligible: &Eligible,
    landmarks: usize,
    objective: Objective,
) -> Vec<u32> {
    let first = farthest_points(metric, coordinates, dimensions, eligible, landmarks);
    exchange(metric, coordinates, dimensions, eligible, &first, objective)
}

/// Candidates as points of a metric space.
#[derive(Clone, Copy)]
struct Space<'a> {
    metric: Metric,
    coordinates: &'a [f64],
    dimensions: usize,
}

impl Space<'_> {
    /// d of two candidates (1-based), the same to the last bit whichever comes first.
    fn distance(&self, one: u32, other: u32) -> f64 {
        let (low, high) = (one.min(other), one.max(other));
        metric_distance(self.metric, self.point(low), self.point(high))
    }

    fn point(&self, candidate: u32) -> &[f64] {
        &self.coordinates[(candidate as usize - 1) * self.dimensions..][..self.dimensions]
    }
}

#[cfg(test)]
mod tests {
    use eigenmark_core::landmark::Point;
    use rand::RngExt;

    use super::*;
    use crate::simulate::seeded;

    pub(super) const METRICS: [Metric; 3] = [Metric::Nssd, Metric::Euclid, Metric::Cosine];

    /// Clusters and duplicates are what selections stumble over, so that coordinates are small whole numbers.
    pub(super) fn random_coordinates(count: usize, dimensions: usize, seed: u64) -> Vec<f64> {
        let mut random = seeded(seed, 21);
        (0..count * dimensions)
            .map(|_| f64::from(random.random_range(-4..=4_i32)))
            .collect()
    }

    /// Places on a line, and how far apart landmarks must be.
    pub(super) fn spaced(count: u32, seed: u64) -> Eligible {
        let mut random = seeded(seed, 22);
        let places = (0..count)
            .map(|_| Point {
                x_px: random.random_range(0.0..100.0),
                y_px: 0.0,
            })
            .collect();
        Eligible::all(count).spaced(places, 20.0)
    }

    /// Nearest of every landmark, literally.
    pub(super) fn nearest(space: &Space, selection: &[u32]) -> Vec<f64> {
        let to_nearest = |&one: &u32| {
            let others = selection.iter().filter(|&&other| other != one);
            others
                .map(|&other| space.distance(one, other))
                .fold(f64::INFINITY, f64::min)
        };
        selection.iter().map(to_nearest).collect()
    }

    pub(super) fn smallest(space: &Space, selection: &[u32]) -> f64 {
        nearest(space, selection)
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }

    /// All admissible subsets of `landmarks` of the candidates.
    fn subsets(eligible: &Eligible, landmarks: usize) -> Vec<Vec<u32>> {
        let mut subsets = vec![Vec::new()];
        for _ in 0..landmarks {
            subsets = subsets
                .iter()
                .flat_map(|subset: &Vec<u32>| {
                    let larger = eligible
                        .candidates()
                        .iter()
                        .filter(|&&c| subset.last().is_none_or(|&last| c > last));
                    let admitted = larger.filter(|&&c| eligible.admits(c, subset));
                    admitted
                        .map(|&c| [subset.as_slice(), &[c]].concat())
                        .collect::<Vec<_>>()
                })
                .collect();
        }
        subsets
    }

    #[test]
    fn farthest_points_reach_half_of_the_best_and_exchanges_only_add() {
        /// Rounding of the distances compared.
        const TOLERANCE: f64 = 1e-12;
        for metric in METRICS {
            for seed in 0..60 {
                let count = 5 + seed as usize % 6;
                let coordinates = random_coordinates(count, 3, seed);
                let space = Space {
                    metric,
                    coordinates: &coordinates,
                    dimensions: 3,
                };
                let eligible = Eligible::all(count as u32);
                for landmarks in 2..=4 {
                    let best = subsets(&eligible, landmarks);
                    let best = best
                        .iter()
                        .map(|subset| smallest(&space, subset))
                        .fold(0.0, f64::max);
                    let farthest = farthest_points(metric, &coordinates, 3, &eligible, landmarks);
                    let reached = smallest(&space, &farthest);
                    assert!(
                        reached >= best / 2.0 - TOLERANCE,
                        "{metric:?} {seed}: {reached} of {best}"
                    );
                    let exchanged = most_reliable(
                        metric,
                        &coordinates,
                        3,
                        &eligible,
                        landmarks,
                        Objective::Smallest,
                    );
                    assert_eq!(exchanged.len(), landmarks);
                    let exchanged = smallest(&space, &exchanged);
                    assert!(
                        (reached..=best).contains(&exchanged),
                        "{metric:?} {seed}: {reached} {exchanged} {best}"
                    );
                }
            }
        }
    }

    #[test]
    fn spacing_is_kept_and_ends_the_selection() {
        for seed in 0..40 {
            let count = 8 + seed as u32 % 20;
            let coordinates = random_coordinates(count as usize, 2, seed);
            let eligible = spaced(count, seed);
            for objective in [Objective::Smallest, Objective::Mean] {
                let selected =
                    most_reliable(Metric::Euclid, &coordinates, 2, &eligible, 10, objective);
                // At most six places of 0 to 100 are 20 apart.
                assert!((1..=6).contains(&selected.len()), "{selected:?}");
                for (index, &one) in selected.iter().enumerate() {
                    assert!(eligible.admits(one, &selected[..index]), "{selected:?}");
                }
            }
        }
    }

    #[test]
    fn twins_are_not_both_selected_unless_nothing_else_is_left() {
        for metric in METRICS {
            for objective in [Objective::Smallest, Objective::Mean] {
                // Five points, three times each; no two of them have the same direction.
                let five = [1.0, 2.0, -3.0, 1.0, 0.5, -2.0, 4.0, 0.0, -1.0, -1.5];
                let coordinates = five.repeat(3);
                let space = Space {
                    metric,
                    coordinates: &coordinates,
                    dimensions: 2,
                };
                for landmarks in 2..=5 {
                    let selected = most_reliable(
                        metric,
                        &coordinates,
                        2,
                        &Eligible::all(15),
                        landmarks,
                        objective,
                    );
                    assert!(smallest(&space, &selected) > 0.0, "{metric:?} {selected:?}");
                }
                let all = most_reliable(metric, &coordinates, 2, &Eligible::all(15), 20, objective);
                assert_eq!(all.len(), 15);
                assert!(smallest(&space, &all[..5]) > 0.0, "{metric:?} {all:?}");
            }
        }
    }

    #[test]
    fn only_eligible_candidates_are_selected() {
        let coordinates = random_coordinates(30, 2, 5);
        let eligible = Eligible::among(vec![3, 4, 9, 20, 21, 30]);
        for objective in [Objective::Smallest, Objective::Mean] {
            let mut selected =
                most_reliable(Metric::Nssd, &coordinates, 2, &eligible, 4, objective);
            assert!(
                selected
                    .iter()
                    .all(|view| eligible.candidates().contains(view))
            );
            selected.sort_unstable();
            selected.dedup();
            assert_eq!(selected.len(), 4);
        }
    }

    #[test]
    fn any_number_of_threads_selects_the_same() {
        let coordinates = random_coordinates(9000, 4, 8);
        let select = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("threads");
            pool.install(|| {
                let eligible = Eligible::all(9000);
                most_reliable(
                    Metric::Nssd,
                    &coordinates,
                    4,
                    &eligible,
                    12,
                    Objective::Smallest,
                )
            })
        };
        assert_eq!(select(1), select(3));
    }

    #[test]
    fn few_candidates_and_few_landmarks_are_no_special_case() {
        for objective in [Objective::Smallest, Objective::Mean] {
            let select = |count, landmarks| {
                most_reliable(
                    Metric::Euclid,
                    &[5.0, 1.0],
                    1,
                    &Eligible::all(count),
                    landmarks,
                    objective,
                )
            };
            assert!(select(0, 3).is_empty());
            assert_eq!(select(1, 3), [1]);
            assert!(select(2, 0).is_empty());
            assert_eq!(select(2, 1).len(), 1);
            assert_eq!(select(2, 3).len(), 2);
        }
    }
}
