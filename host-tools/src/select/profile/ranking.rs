//! Sorting a profile, and deciding by the literal sum what its bounds leave open.
//!
//! Each value stands for an interval: itself, give or take its error. Sorted, they fall into clusters whose intervals
//! do not touch; between clusters the order is that of the literal values. Inside a cluster the literal values are
//! computed, once for all points with the same bits, and only in clusters that reach into the wanted part of the
//! ranking. The result is therefore the literal ranking. Of equals the lower number comes first.
//!
//! **Cost.** n·log n, and n·k per distinct point that is decided. A set with no order but rounding (all points alike)
//! is one cluster, and costs as much as the literal route; copies of one point cost nothing.

use std::cmp::Ordering;

use rayon::prelude::*;

use super::{Profile, literal};

/// Which end of the profile comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Largest value first: the report's algorithm, its best landmarks (`profile_rank_max` in table C.3).
    MostDissimilar,
    /// Smallest value first: its worst landmarks (`profile_rank_min`).
    LeastDissimilar,
}

/// The first candidates of a ranking.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ranking {
    /// Numbers of points, 1-based in the order they were given.
    pub candidates: Vec<u32>,
    /// Points whose literal value had to be computed.
    pub recomputed: usize,
}

impl Ranking {
    /// The same ranking where the points were only some of the candidates: `numbers` of those, ascending, as
    /// [`Eligible::candidates`](crate::select::Eligible::candidates) lists them.
    ///
    /// ```
    /// use eigenmark::select::Ranking;
    /// let ranking = Ranking { candidates: vec![3, 1, 2], recomputed: 0 };
    /// assert_eq!(ranking.among(&[10, 20, 30]).candidates, [30, 10, 20]);
    /// ```
    ///
    /// # Panics
    /// When there are fewer numbers than points.
    #[must_use]
    pub fn among(self, numbers: &[u32]) -> Self {
        let number = |index: u32| numbers[index as usize - 1];
        Self {
            candidates: self.candidates.into_iter().map(number).collect(),
            ..self
        }
    }
}

impl Profile<'_> {
    /// The first `wanted` points (all, if there are fewer), as the literal values order them.
    #[must_use]
    pub fn rank(&self, order: Order, wanted: usize) -> Ranking {
        let values = self.values();
        let mut sorted: Vec<usize> = (0..values.len()).collect();
        sorted.par_sort_unstable_by(|&a, &b| {
            order.compare(values[a], values[b]).then_with(|| a.cmp(&b))
        });
        let mut decided = vec![None; values.len()];
        let open: Vec<std::ops::Range<usize>> = self
            .clusters(order, &sorted)
            .into_iter()
            .take_while(|cluster| cluster.start < wanted)
            .filter(|cluster| !self.is_settled(&sorted[cluster.clone()]))
            .collect();
        let groups: Vec<Vec<usize>> = open
            .par_iter()
            .flat_map_iter(|cluster| self.copies(&sorted[cluster.clone()]))
            .collect();
        let sums: Vec<f64> = groups
            .par_iter()
            .map(|group| literal::average(self.dissimilarity, self.points(), group[0]))
            .collect();
        for (group, sum) in groups.iter().zip(&sums) {
            for &index in group {
                decided[index] = Some(*sum);
            }
        }
        for cluster in open {
            sorted[cluster].sort_unstable_by(|&a, &b| {
                let by_literal = decided[a].zip(decided[b]);
                by_literal
                    .map_or(Ordering::Equal, |(one, other)| order.compare(one, other))
                    .then_with(|| a.cmp(&b))
            });
        }
        sorted.truncate(wanted);
        Ranking {
            candidates: sorted.iter().map(|&index| index as u32 + 1).collect(),
            recomputed: groups.len(),
        }
    }

    /// Ranges of `sorted`, which has the best first, whose intervals do not touch those of others.
    fn clusters(&self, order: Order, sorted: &[usize]) -> Vec<std::ops::Range<usize>> {
        let ends = |sign: f64| {
            let end = move |&index: &usize| {
                let better = match order {
                    Order::MostDissimilar => 1.0,
                    Order::LeastDissimilar => -1.0,
                };
                better * self.values()[index] + sign * self.errors()[index]
            };
            sorted.iter().map(end)
        };
        // The least that any point before can be worth, and the most of any from here on.
        let least_before: Vec<f64> = ends(-1.0)
            .scan(f64::INFINITY, |least, end| {
                let before = *least;
                *least = least.min(end);
                Some(before)
            })
            .collect();
        let mut most = f64::NEG_INFINITY;
        let mut clusters = Vec::new();
        let mut stop = sorted.len();
        for (start, end) in ends(1.0).enumerate().rev() {
            most = most.max(end);
            if least_before[start] > most {
                clusters.push(start..stop);
                stop = start;
            }
        }
        clusters.reverse();
        clusters
    }

    /// Whether the order of a cluster stands: one point, or values that are literal.
    fn is_settled(&self, cluster: &[usize]) -> bool {
        cluster.len() == 1 || cluster.iter().all(|&index| self.errors()[index] == 0.0)
    }

    /// A cluster in groups of points that share their literal value, bit for bit; none if all of them do.
    fn copies(&self, cluster: &[usize]) -> Vec<Vec<usize>> {
        let points = self.points();
        let bits = |index: usize| points.point(index).iter().map(|x| x.to_bits());
        let mut cluster = cluster.to_vec();
        cluster.sort_unstable_by(|&a, &b| bits(a).cmp(bits(b)).then_with(|| a.cmp(&b)));
        let groups: Vec<Vec<usize>> = cluster
            .chunk_by(|&a, &b| {
                bits(a).eq(bits(b)) && literal::copies_share(self.dissimilarity, points.point(a))
            })
            .map(<[usize]>::to_vec)
            .collect();
        if groups.len() == 1 {
            Vec::new()
        } else {
            groups
        }
    }
}

impl Order {
    /// Which of two values comes first.
    fn compare(self, one: f64, other: f64) -> Ordering {
        match self {
            Self::MostDissimilar => other.total_cmp(&one),
            Self::LeastDissimilar => one.total_cmp(&other),
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::{
        select::{Dissimilarity, Route},
        simulate::seeded,
    };

    const ORDERS: [Order; 2] = [Order::MostDissimilar, Order::LeastDissimilar];

    const ALL: [Dissimilarity; 5] = [
        Dissimilarity::Ssd,
        Dissimilarity::Euclid,
        Dissimilarity::Nssd,
        Dissimilarity::NssdCentered,
        Dissimilarity::Angle,
    ];

    fn random_points(seed: u64, count: usize, dimensions: usize) -> Vec<f64> {
        let mut random = seeded(seed, 3);
        (0..count * dimensions)
            .map(|_| random.random_range(-1.0..1.0))
            .collect()
    }

    /// Random points, each followed by copies of which every element is one rounding away.
    fn near_ties(seed: u64, count: usize, dimensions: usize) -> Vec<f64> {
        let mut random = seeded(seed, 4);
        random_points(seed, count, dimensions)
            .chunks_exact(dimensions)
            .flat_map(|point| {
                let mut family = point.to_vec();
                for _ in 0..3 {
                    let moved = point.iter().map(|x| match random.random_range(0..3) {
                        0 => x.next_up(),
                        1 => x.next_down(),
                        _ => *x,
                    });
                    family.extend(moved);
                }
                family
            })
            .collect()
    }

    /// The ranking of the literal values, sorted here.
    fn reference(dissimilarity: Dissimilarity, points: &[f64], k: usize, order: Order) -> Vec<u32> {
        let profile = Profile::new(dissimilarity, points, k, Route::Literal);
        let value = |number: u32| profile.values()[number as usize - 1];
        let mut numbers: Vec<u32> = (1..=profile.values().len() as u32).collect();
        numbers.sort_by(|&a, &b| match order {
            Order::MostDissimilar => value(b).total_cmp(&value(a)),
            Order::LeastDissimilar => value(a).total_cmp(&value(b)),
        });
        numbers
    }

    fn check(points: &[f64], dimensions: usize) {
        for dissimilarity in ALL {
            for order in ORDERS {
                let expected = reference(dissimilarity, points, dimensions, order);
                for route in [Route::Literal, Route::Blocked, Route::Fast] {
                    let profile = Profile::new(dissimilarity, points, dimensions, route);
                    for wanted in 0..=expected.len() + 1 {
                        let found = profile.rank(order, wanted).candidates;
                        let expected = &expected[..wanted.min(expected.len())];
                        assert_eq!(
                            found, expected,
                            "{dissimilarity:?} {order:?} {route:?} {wanted}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn the_odd_one_out_comes_first() {
        let points = [1.0, 0.0, 1.1, 0.0, -5.0, 0.1, 0.9, 0.0];
        let profile = Profile::new(Dissimilarity::Euclid, &points, 2, Route::Literal);
        let rank = |order| profile.rank(order, 4).candidates;
        assert_eq!(rank(Order::MostDissimilar), [3, 2, 4, 1]);
        assert_eq!(rank(Order::LeastDissimilar), [1, 4, 2, 3]);
    }

    #[test]
    fn rankings_match_reference_for_every_length() {
        for (seed, (count, dimensions)) in [(1, 1), (2, 3), (3, 1), (40, 2), (60, 15)]
            .into_iter()
            .enumerate()
        {
            check(&random_points(seed as u64, count, dimensions), dimensions);
        }
    }

    #[test]
    fn rankings_of_near_ties_match_reference() {
        for (seed, (count, dimensions)) in
            [(1, 1), (3, 2), (12, 4), (10, 15)].into_iter().enumerate()
        {
            check(&near_ties(seed as u64, count, dimensions), dimensions);
        }
    }

    #[test]
    fn rankings_of_copies_and_zeros_match_reference() {
        let mut points = random_points(7, 12, 3);
        points.extend_from_within(..);
        points.extend([0.0; 9]);
        points.extend_from_within(6..18);
        check(&points, 3);
        check(&[0.0; 8], 2);
        check(&[-0.0, 0.0, 1.0, 1.0], 1);
    }

    #[test]
    fn symmetrical_points_match_reference() {
        // Every point of a grid around the origin has up to seven others with the same exact profile value.
        let points: Vec<f64> = (-3..=3)
            .flat_map(|x| (-3..=3).flat_map(move |y| [f64::from(x), f64::from(y)]))
            .collect();
        check(&points, 2);
    }

    #[test]
    fn sorting_alone_would_not_rank_near_ties() {
        let points = near_ties(21, 200, 5);
        for (dissimilarity, route) in [
            (Dissimilarity::Ssd, Route::Fast),
            (Dissimilarity::Nssd, Route::Fast),
            (Dissimilarity::Nssd, Route::Blocked),
            (Dissimilarity::Euclid, Route::Blocked),
        ] {
            let profile = Profile::new(dissimilarity, &points, 5, route);
            let mut sorted: Vec<u32> = (1..=800).collect();
            sorted.sort_by(|&a, &b| {
                let [a, b] = [a, b].map(|number| profile.values()[number as usize - 1]);
                b.total_cmp(&a)
            });
            let expected = reference(dissimilarity, &points, 5, Order::MostDissimilar);
            assert_ne!(sorted, expected, "{dissimilarity:?} {route:?}");
            let found = profile.rank(Order::MostDissimilar, 800);
            assert_eq!(found.candidates, expected, "{dissimilarity:?} {route:?}");
            assert!(found.recomputed > 0);
        }
    }

    #[test]
    fn only_what_decides_the_wanted_part_is_recomputed() {
        let mut points = random_points(2, 400, 4);
        let profile = Profile::new(Dissimilarity::Nssd, &points, 4, Route::Fast);
        assert_eq!(profile.rank(Order::MostDissimilar, 400).recomputed, 0);
        let last = profile.rank(Order::LeastDissimilar, 1).candidates[0] as usize - 1;
        let near: Vec<f64> = points[last * 4..][..4]
            .iter()
            .map(|x| x.next_up())
            .collect();
        points.extend(near);
        let profile = Profile::new(Dissimilarity::Nssd, &points, 4, Route::Fast);
        assert_eq!(profile.rank(Order::MostDissimilar, 390).recomputed, 0);
        assert_eq!(profile.rank(Order::LeastDissimilar, 1).recomputed, 2);
        assert_eq!(profile.rank(Order::MostDissimilar, 401).recomputed, 2);
    }

    #[test]
    fn copies_are_computed_once_or_not_at_all() {
        let one = random_points(5, 300, 3);
        let copied: Vec<f64> = [&one[..], &one, &one].concat();
        let profile = Profile::new(Dissimilarity::Nssd, &copied, 3, Route::Fast);
        let ranking = profile.rank(Order::MostDissimilar, 900);
        assert_eq!(ranking.recomputed, 0);
        let expected = reference(Dissimilarity::Nssd, &copied, 3, Order::MostDissimilar);
        assert_eq!(ranking.candidates, expected);

        let (mut near, nearby): (Vec<f64>, Vec<f64>) =
            (copied, one[..3].iter().map(|x| x.next_up()).collect());
        near.extend(nearby);
        let profile = Profile::new(Dissimilarity::Nssd, &near, 3, Route::Fast);
        assert_eq!(profile.rank(Order::MostDissimilar, 901).recomputed, 2);
    }
}
