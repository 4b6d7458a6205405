//! Farthest points: every next landmark is the candidate whose nearest landmark is farthest.
//!
//! **Method.** The first two are an approximate diameter: from the first candidate to the one farthest from it, from
//! there to the farthest again, until that is no farther. Of equals the lower number is taken. A candidate that
//! spacing excludes is passed over for good. Whatever comes first, l farthest points are at least half as far apart
//! as the best l: two of l points within r of fewer than l landmarks share one, and are at most 2r apart.
//!
//! **Cost.** k operations per candidate and landmark, in parallel.

use std::cmp::Ordering;

use eigenmark_core::landmark::Metric;
use rayon::prelude::*;

use super::{super::Eligible, Space};

/// Sweeps from end to end that look for the diameter. Two or three are usual.
const SWEEPS: usize = 8;

/// Candidates that a thread takes at once: some dozen microseconds' worth.
const CHUNK: usize = 1024;

/// Up to `landmarks` eligible candidates, each as far as possible from all before it; fewer when spacing leaves no
/// more.
///
/// `coordinates` are rows of `dimensions` numbers, candidate 1 first. Without spacing, the smallest distance between
/// the first l is at least half of the largest that any l candidates can have, for every l from 2 on.
///
/// # Panics
/// When an eligible candidate has no coordinates.
#[must_use]
pub fn farthest_points(
    metric: Metric,
    coordinates: &[f64],
    dimensions: usize,
    eligible: &Eligible,
    landmarks: usize,
) -> Vec<u32> {
    let space = Space {
        metric,
        coordinates,
        dimensions,
    };
    farthest_first(&space, eligible, landmarks)
}

/// [`farthest_points`] of a space.
pub(super) fn farthest_first(space: &Space, eligible: &Eligible, landmarks: usize) -> Vec<u32> {
    let Some(first) = end_of_diameter(space, eligible) else {
        return Vec::new();
    };
    let mut open = Open::all(eligible);
    let mut selected = Vec::with_capacity(landmarks.min(eligible.candidates().len()));
    let mut next = Some(first);
    while let Some(candidate) = next.filter(|_| selected.len() < landmarks) {
        selected.push(candidate);
        next = open.select(space, eligible, candidate);
    }
    selected
}

/// One end of the longest distance found by sweeping.
fn end_of_diameter(space: &Space, eligible: &Eligible) -> Option<u32> {
    let mut end = *eligible.candidates().first()?;
    let mut length = f64::NEG_INFINITY;
    for _ in 0..SWEEPS {
        let Some(far) = Open::all(eligible).farthest(space, eligible, end) else {
            break;
        };
        if far.nearest <= length {
            break;
        }
        (end, length) = (far.number, far.nearest);
    }
    Some(end)
}

/// A candidate that may still be selected.
#[derive(Clone, Copy)]
struct Candidate {
    number: u32,
    /// Distance to the nearest selected one.
    nearest: f64,
}

struct Open(Vec<Candidate>);

impl Open {
    fn all(eligible: &Eligible) -> Self {
        let open = |&number: &u32| Candidate {
            number,
            nearest: f64::INFINITY,
        };
        Self(eligible.candidates().iter().map(open).collect())
    }

    /// Takes note that `selected` is a landmark, and says which candidate is next.
    fn select(&mut self, space: &Space, eligible: &Eligible, selected: u32) -> Option<u32> {
        self.farthest(space, eligible, selected)
            .map(|candidate| candidate.number)
    }

    /// Drops `selected` and what it excludes, and finds the candidate that is then farthest from all selected ones.
    fn farthest(&mut self, space: &Space, eligible: &Eligible, selected: u32) -> Option<Candidate> {
        self.0.retain(|candidate| {
            candidate.number != selected && eligible.admits_both(candidate.number, selected)
        });
        self.0
            .par_iter_mut()
            .with_min_len(CHUNK)
            .map(|candidate| {
                let distance = space.distance(candidate.number, selected);
                candidate.nearest = candidate.nearest.min(distance);
                *candidate
            })
            .max_by(farther)
    }
}

/// Farther is greater; of equals the lower number is.
fn farther(one: &Candidate, other: &Candidate) -> Ordering {
    let by_distance = one.nearest.total_cmp(&other.nearest);
    by_distance.then(other.number.cmp(&one.number))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{METRICS, random_coordinates, smallest, spaced};
    use super::*;

    #[test]
    fn farthest_points_match_reference() {
        for metric in METRICS {
            for seed in 0..20 {
                let coordinates = random_coordinates(40, 3, seed);
                let space = Space {
                    metric,
                    coordinates: &coordinates,
                    dimensions: 3,
                };
                for eligible in [Eligible::all(40), spaced(40, seed)] {
                    let found = farthest_points(metric, &coordinates, 3, &eligible, 12);
                    for (index, &next) in found.iter().enumerate().skip(1) {
                        let selected = &found[..index];
                        let distance = |c: u32| {
                            selected
                                .iter()
                                .map(|&s| space.distance(c, s))
                                .fold(f64::INFINITY, f64::min)
                        };
                        let admitted = (1..=40)
                            .filter(|c| !selected.contains(c) && eligible.admits(*c, selected));
                        let farthest = admitted.map(distance).fold(0.0, f64::max);
                        assert_eq!(
                            distance(next),
                            farthest,
                            "{metric:?} {seed}: {found:?} at {index}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn two_points_of_a_line_are_its_ends() {
        let coordinates = [3.0, 4.0, 9.0, -2.0, 5.0];
        assert_eq!(
            farthest_points(Metric::Euclid, &coordinates, 1, &Eligible::all(5), 3),
            [4, 3, 1] // −2 and 9; then 3 and 4 are equally far, 5 from the nearer end
        );
    }

    #[test]
    fn every_beginning_is_a_selection_of_its_own() {
        let coordinates = random_coordinates(50, 3, 2);
        let select = |landmarks| {
            farthest_points(Metric::Nssd, &coordinates, 3, &Eligible::all(50), landmarks)
        };
        let all = select(10);
        let space = Space {
            metric: Metric::Nssd,
            coordinates: &coordinates,
            dimensions: 3,
        };
        for landmarks in 2..10 {
            assert_eq!(select(landmarks), all[..landmarks]);
            assert!(smallest(&space, &all[..landmarks]) >= smallest(&space, &all[..=landmarks]));
        }
    }
}
