//! Exchanges: one landmark leaves, a candidate enters, as long as this makes the selection more reliable.
//!
//! **Notation.** Of a selection S, nearest(s) is the distance of s to the nearest other landmark, second(s) that to the
//! second nearest; without r, the nearest of s is second(s) if r was its nearest, otherwise nearest(s).
//!
//! **Method.** Of all swaps of a landmark r for a candidate c the best is made, until none improves the objective.
//! All l swaps of one candidate are judged together, in O(l) after its l distances to S, as FastPAM does for medoids
//! (Schubert and Rousseeuw, 2019): with c, the sum of nearests is Σ_s min(nearest(s), d(s, c)); taking r away changes
//! only the terms of r and of those whose nearest r was. An improvement is strict: larger by more than rounding, so
//! that no selection comes twice and exchanges end; [`ROUNDS`] bounds them all the same. At last the selection is
//! put in farthest-first order, so that every beginning of it is a good selection.
//!
//! Most candidates are out of the question: one that two landmarks exclude by spacing, or, for
//! [`Objective::Smallest`], one that is nearer to two landmarks than the smallest distance there is. As that never
//! shrinks, such a candidate stays out as long as both landmarks stay, and is not looked at until then.
//!
//! **Cost.** n·l·(k + 1) operations per swap, n for the candidates that are out of the question.
//!
//! **Limits.** No single exchange improves the result, unless [`ROUNDS`] ended it; two at once might.

use std::cmp::Ordering;

use eigenmark_core::landmark::Metric;
use rayon::prelude::*;

use super::{super::Eligible, Space, farthest::farthest_first};

/// Exchanges at most: selections of 50 among 100,000 came nowhere near it.
const ROUNDS: usize = 1000;

/// What counts as larger, relatively: more than the rounding of a sum over a table of landmarks.
const GAIN: f64 = 1e-9;

/// Candidates that a thread takes at once.
const CHUNK: usize = 256;

/// What exchanges improve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Objective {
    /// The smallest radius; as long as it does not shrink, the mean radius.
    Smallest,
    /// The mean radius; as long as it does not shrink, the smallest.
    Mean,
}

/// How good a selection is; radii are doubled, and added up.
#[derive(Clone, Copy)]
struct Reliability {
    smallest: f64,
    sum: f64,
}

/// A candidate that may enter.
struct Outsider {
    number: u32,
    /// Two landmarks that keep it out unless one of them leaves: no single swap can let it in.
    kept_out_by: Option<[u32; 2]>,
}

/// The landmark at index `leaving` of a selection makes way for `entering`.
#[derive(Clone, Copy)]
struct Swap {
    leaving: usize,
    entering: u32,
    makes: Reliability,
}

/// Improves a selection of eligible candidates by exchanging landmarks one at a time, until no exchange improves the
/// objective; best first. There are as many landmarks as before.
///
/// `coordinates` are rows of `dimensions` numbers, candidate 1 first.
///
/// # Panics
/// When an eligible or selected candidate has no coordinates.
#[must_use]
pub fn exchange(
    metric: Metric,
    coordinates: &[f64],
    dimensions: usize,
    eligible: &Eligible,
    selection: &[u32],
    objective: Objective,
) -> Vec<u32> {
    let space = Space {
        metric,
        coordinates,
        dimensions,
    };
    let mut selected = Eligible::among(selection.to_vec()).candidates().to_vec();
    // A single landmark has no other to be far from.
    if selected.len() < 2 {
        return selected;
    }
    let outsider = |&number: &u32| Outsider {
        number,
        kept_out_by: None,
    };
    let mut outsiders: Vec<Outsider> = eligible.candidates().iter().map(outsider).collect();
    for _ in 0..ROUNDS {
        let Some(swap) = best_swap(&space, eligible, &selected, &mut outsiders, objective) else {
            break;
        };
        selected[swap.leaving] = swap.entering;
        selected.sort_unstable();
    }
    let count = selected.len();
    farthest_first(&space, &Eligible::among(selected), count)
}

/// The swap that improves a selection (ascending) most, if any does; of equals the one of the lowest numbers.
fn best_swap(
    space: &Space,
    eligible: &Eligible,
    selected: &[u32],
    outsiders: &mut [Outsider],
    objective: Objective,
) -> Option<Swap> {
    let neighbors = Neighbors::of(space, selected);
    let now = neighbors.reliability();
    let is_selected = |number: u32| selected.binary_search(&number).is_ok();
    outsiders
        .par_iter_mut()
        .with_min_len(CHUNK)
        .filter(|outsider| {
            let stays_out = |pair: [u32; 2]| pair.into_iter().all(is_selected);
            !is_selected(outsider.number) && !outsider.kept_out_by.is_some_and(stays_out)
        })
        .filter_map(|outsider| {
            let swap = neighbors.best_for(space, eligible, outsider.number, objective, now);
            outsider.kept_out_by = swap.err();
            swap.ok()
                .filter(|swap| swap.makes.is_better(now, objective))
        })
        .max_by(|a, b| {
            let by_value = a.makes.compare(b.makes, objective);
            by_value.then(b.entering.cmp(&a.entering))
        })
}

/// Who is near whom in a selection.
struct Neighbors<'a> {
    selected: &'a [u32],
    /// Per landmark: the index of the nearest other, and the distances to that and to the second nearest.
    nearest: Vec<(usize, f64, f64)>,
    /// Per landmark: the smallest distance of any two when it is gone.
    smallest_without: Vec<f64>,
}

impl<'a> Neighbors<'a> {
    fn of(space: &Space, selected: &'a [u32]) -> Self {
        let nearest: Vec<(usize, f64, f64)> = (0..selected.len())
            .into_par_iter()
            .map(|one| {
                let others = (0..selected.len()).filter(|&other| other != one);
                let (mut index, mut first, mut second) = (one, f64::INFINITY, f64::INFINITY);
                for other in others {
                    let distance = space.distance(selected[one], selected[other]);
                    if distance < first {
                        (index, second, first) = (other, first, distance);
                    } else if distance < second {
                        second = distance;
                    }
                }
                (index, first, second)
            })
            .collect();
        let without = |gone: usize| {
            let staying = nearest.iter().enumerate().filter(|&(one, _)| one != gone);
            let distances = staying
                .map(|(_, &(index, first, second))| if index == gone { second } else { first });
            distances.fold(f64::INFINITY, f64::min)
        };
        let smallest_without = (0..selected.len()).map(without).collect();
        Self {
            selected,
            nearest,
            smallest_without,
        }
    }

    fn reliability(&self) -> Reliability {
        let distances = || self.nearest.iter().map(|&(_, first, _)| first);
        Reliability {
            smallest: distances().fold(f64::INFINITY, f64::min),
            sum: distances().sum(),
        }
    }

    /// The best swap that lets `entering` in, whether or not it improves anything.
    ///
    /// # Errors
    /// Two landmarks that would both have to leave.
    fn best_for(
        &self,
        space: &Space,
        eligible: &Eligible,
        entering: u32,
        objective: Objective,
        now: Reliability,
    ) -> Result<Swap, [u32; 2]> {
        let mut excluding = (0..self.selected.len())
            .filter(|&index| !eligible.admits_both(self.selected[index], entering));
        let only_leaving = excluding.next();
        if let (Some(one), Some(other)) = (only_leaving, excluding.next()) {
            return Err([one, other].map(|index| self.selected[index]));
        }
        let distances = self.distances(space, entering, objective, now)?;
        let (mut index, mut first, mut second) = (0, f64::INFINITY, f64::INFINITY);
        let mut sum = 0.0;
        // What the sum over those that stay gains when a landmark leaves that was their nearest.
        let mut gains = vec![0.0; distances.len()];
        for (landmark, (&distance, &(nearest, to_nearest, to_second))) in
            distances.iter().zip(&self.nearest).enumerate()
        {
            if distance < first {
                (index, second, first) = (landmark, first, distance);
            } else if distance < second {
                second = distance;
            }
            let with = distance.min(to_nearest);
            sum += with;
            gains[nearest] += distance.min(to_second) - with;
        }
        let swap = |leaving: usize| {
            let to_entering = if leaving == index { second } else { first };
            let of_leaving = distances[leaving].min(self.nearest[leaving].1);
            Swap {
                leaving,
                entering,
                makes: Reliability {
                    smallest: to_entering.min(self.smallest_without[leaving]),
                    sum: sum - of_leaving + gains[leaving] + to_entering,
                },
            }
        };
        match only_leaving {
            Some(leaving) => Ok(swap(leaving)),
            // Of equals the first.
            None => Ok((1..distances.len()).map(swap).fold(swap(0), |best, swap| {
                match swap.makes.compare(best.makes, objective) {
                    Ordering::Greater => swap,
                    _ => best,
                }
            })),
        }
    }

    /// Distances of `entering` to the landmarks, unless it is too near to two of them to be of use.
    fn distances(
        &self,
        space: &Space,
        entering: u32,
        objective: Objective,
        now: Reliability,
    ) -> Result<Vec<f64>, [u32; 2]> {
        let mut near = None;
        let mut distances = Vec::with_capacity(self.selected.len());
        for &landmark in self.selected {
            let distance = space.distance(entering, landmark);
            if objective == Objective::Smallest && distance < now.smallest {
                if let Some(other) = near {
                    return Err([other, landmark]);
                }
                near = Some(landmark);
            }
            distances.push(distance);
        }
        Ok(distances)
    }
}

impl Reliability {
    /// The objective's figures, the more important one first.
    fn figures(self, objective: Objective) -> [f64; 2] {
        match objective {
            Objective::Smallest => [self.smallest, self.sum],
            Objective::Mean => [self.sum, self.smallest],
        }
    }

    fn compare(self, other: Self, objective: Objective) -> Ordering {
        let ([a, b], [c, d]) = (self.figures(objective), other.figures(objective));
        a.total_cmp(&c).then(b.total_cmp(&d))
    }

    /// Whether this is larger than `now` by more than rounding in its first figure, or not smaller in the first and
    /// larger in the second.
    fn is_better(self, now: Self, objective: Objective) -> bool {
        let ([first, second], [first_now, second_now]) =
            (self.figures(objective), now.figures(objective));
        let is_larger = |value: f64, now: f64| value > now + GAIN * now.abs();
        is_larger(first, first_now) || (first >= first_now && is_larger(second, second_now))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{
        farthest_points,
        tests::{METRICS, nearest, random_coordinates, spaced},
    };
    use super::*;

    fn reliability(space: &Space, selection: &[u32]) -> Reliability {
        let nearest = nearest(space, selection);
        Reliability {
            smallest: nearest.iter().copied().fold(f64::INFINITY, f64::min),
            sum: nearest.iter().sum(),
        }
    }

    #[test]
    fn no_exchange_improves_what_exchanges_leave() {
        for (metric, objective) in METRICS
            .into_iter()
            .flat_map(|metric| [(metric, Objective::Smallest), (metric, Objective::Mean)])
        {
            for seed in 0..25 {
                let coordinates = random_coordinates(24, 3, seed);
                let space = Space {
                    metric,
                    coordinates: &coordinates,
                    dimensions: 3,
                };
                for eligible in [Eligible::all(24), spaced(24, seed)] {
                    let first = farthest_points(metric, &coordinates, 3, &eligible, 6);
                    let last = exchange(metric, &coordinates, 3, &eligible, &first, objective);
                    assert_eq!(last.len(), first.len());
                    let reached = reliability(&space, &last);
                    assert!(
                        !reliability(&space, &first).is_better(reached, objective),
                        "{metric:?} {seed}"
                    );
                    for leaving in 0..last.len() {
                        let mut swapped = last.clone();
                        let gone = swapped.swap_remove(leaving);
                        let entering =
                            (1..=24).filter(|c| !last.contains(c) && eligible.admits(*c, &swapped));
                        for entering in entering {
                            let other = [swapped.as_slice(), &[entering]].concat();
                            let other = reliability(&space, &other);
                            assert!(
                                !other.is_better(reached, objective),
                                "{metric:?} {objective:?} {seed}: {entering} for {gone}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn swaps_are_judged_as_their_selections_are() {
        /// Rounding of sums of six distances.
        const TOLERANCE: f64 = 1e-12;
        for metric in METRICS {
            for seed in 0..20 {
                let coordinates = random_coordinates(12, 2, seed);
                let space = Space {
                    metric,
                    coordinates: &coordinates,
                    dimensions: 2,
                };
                let selected = [1, 2, 3, 4, 5, 6];
                let neighbors = Neighbors::of(&space, &selected);
                let now = neighbors.reliability();
                for entering in 7..=12 {
                    let swap = neighbors
                        .best_for(&space, &Eligible::all(12), entering, Objective::Mean, now)
                        .expect("nothing is excluded");
                    let mut swapped = selected;
                    swapped[swap.leaving] = entering;
                    let expected = reliability(&space, &swapped);
                    assert!((swap.makes.sum - expected.sum).abs() < TOLERANCE);
                    assert_eq!(swap.makes.smallest, expected.smallest);
                }
            }
        }
    }

    #[test]
    fn a_bad_selection_becomes_a_good_one() {
        let coordinates = [0.0, 1.0, 2.0, 10.0, 20.0, 30.0];
        let all = Eligible::all(6);
        let found = exchange(
            Metric::Euclid,
            &coordinates,
            1,
            &all,
            &[1, 2, 3, 4],
            Objective::Smallest,
        );
        assert_eq!(found, [6, 1, 4, 5]);
    }
}
