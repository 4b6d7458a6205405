//! Profile-based ranking: candidates that are most dissimilar to all others come first; report section 2.3.2.
//!
//! **What and why.** The profile of a candidate is its mean [`Dissimilarity`] to all others,
//! p_j = 1/(n−1) · Σ_{i≠j} ρ(g_i, g_j) (report (2.37)). Algorithm 2.3 compares every pair. Here the mean is found
//! without doing so where that is possible, with a bound on how far each value can be from that of the algorithm, and
//! wherever the bound leaves a ranking open the algorithm itself decides: every route gives the same ranking.
//!
//! **Notation.** n points of k numbers, row after row; A = ‖a‖²; u is half of [`f64::EPSILON`].
//!
//! **Method.** `literal` is algorithm 2.3; `blocked` compares every pair by matrix products; `closed_form` (SSD) and
//! `smooth_kernel` (nSSD) need one sum over all points. [`Profile::rank`] sorts and decides.
//!
//! **Cost.** Literal n²·k steps; blocked as many, a little to four times faster; fast n·k for SSD, 2·P·n·k for nSSD
//! with P nodes: 32 where norms differ by a factor of 10, 82 for 10³, 162 for 10⁶, 327 for 10¹². A point that is
//! decided literally costs n·k.
//!
//! **Limits.** Bounds hold for elements that are zero or between 1e-70 and 1e70 in size: sets with others are compared
//! literally.

mod blocked;
mod chebyshev;
mod closed_form;
mod literal;
mod points;
mod ranking;
mod smooth_kernel;

use std::borrow::Cow;

use rayon::prelude::*;

use super::{Dissimilarity, dissimilarity::centered};
use points::Points;
pub use ranking::{Order, Ranking};

/// Up to here every pair is compared literally: a millisecond or two, and nothing to bound.
const LITERAL_UP_TO: usize = 256;

/// Sizes of elements whose fourth powers, as the angle needs them, neither overflow nor underflow.
const TAME: std::ops::RangeInclusive<f64> = 1e-70..=1e70;

/// The rounding of one operation, relative: u.
const ROUNDING: f64 = f64::EPSILON / 2.0;

/// Bounds count roundings to the first order. What is left out is smaller by n·u, below 1e-6; this covers it, and the
/// rounding of the bounds.
const HIGHER_ORDERS: f64 = 1.125;

/// How a profile is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// Algorithm 2.3 of the report: every pair, one after the other.
    Literal,
    /// Every pair, by products of matrices.
    Blocked,
    /// Without pairs: SSD and nSSD only. Others are [`Route::Blocked`], and nSSD too where norms differ too much.
    Fast,
}

impl Route {
    /// The quickest for `count` points.
    ///
    /// ```
    /// use eigenmark::select::{Dissimilarity, Route};
    /// assert_eq!(Route::automatic(Dissimilarity::Nssd, 83), Route::Literal);
    /// assert_eq!(Route::automatic(Dissimilarity::Nssd, 100_000), Route::Fast);
    /// assert_eq!(Route::automatic(Dissimilarity::Euclid, 100_000), Route::Blocked);
    /// ```
    #[must_use]
    pub fn automatic(dissimilarity: Dissimilarity, count: usize) -> Self {
        match dissimilarity {
            _ if count <= LITERAL_UP_TO => Self::Literal,
            Dissimilarity::Ssd | Dissimilarity::Nssd | Dissimilarity::NssdCentered => Self::Fast,
            Dissimilarity::Euclid | Dissimilarity::Angle => Self::Blocked,
        }
    }
}

/// The distance profile of a set of points, with the points: they decide what the values leave open.
#[derive(Clone, Debug)]
pub struct Profile<'a> {
    /// As they are compared: centered already where the dissimilarity says so.
    coefficients: Cow<'a, [f64]>,
    dimensions: usize,
    /// Of the centered points, where they are.
    dissimilarity: Dissimilarity,
    route: Route,
    averages: Averages,
}

/// Profile values, and how far each can be from the value of the literal route.
#[derive(Clone, Debug)]
struct Averages {
    values: Vec<f64>,
    errors: Vec<f64>,
}

impl<'a> Profile<'a> {
    /// The profile of `coefficients` (n rows of `dimensions` finite numbers; what is left over at the end is not used).
    ///
    /// ```
    /// use eigenmark::select::{Dissimilarity, Order, Profile, Route};
    /// let points = [1.0, 3.0, 7.0];
    /// let profile = Profile::new(Dissimilarity::Euclid, &points, 1, Route::Literal);
    /// assert_eq!(profile.values(), [4.0, 3.0, 5.0]);
    /// assert_eq!(profile.rank(Order::MostDissimilar, 2).candidates, [3, 1]);
    /// ```
    ///
    /// # Panics
    /// When `dimensions` is zero.
    #[must_use]
    pub fn new(
        dissimilarity: Dissimilarity,
        coefficients: &'a [f64],
        dimensions: usize,
        route: Route,
    ) -> Self {
        assert!(dimensions > 0, "a point has at least one dimension");
        let whole = coefficients.len() / dimensions * dimensions;
        let coefficients = Cow::Borrowed(&coefficients[..whole]);
        let (coefficients, dissimilarity) = match dissimilarity {
            Dissimilarity::NssdCentered => (
                coefficients
                    .par_chunks_exact(dimensions)
                    .flat_map_iter(centered)
                    .collect::<Vec<f64>>()
                    .into(),
                Dissimilarity::Nssd,
            ),
            _ => (coefficients, dissimilarity),
        };
        let points = Points::new(&coefficients, dimensions);
        let (route, averages) = averages(dissimilarity, points, route);
        Self {
            coefficients,
            dimensions,
            dissimilarity,
            route,
            averages,
        }
    }

    /// The profile value of every point.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.averages.values
    }

    /// For every point, how far its value can be from that of [`Route::Literal`], which itself has none.
    #[must_use]
    pub fn errors(&self) -> &[f64] {
        &self.averages.errors
    }

    /// The largest of the [`errors`](Self::errors).
    #[must_use]
    pub fn largest_error(&self) -> f64 {
        self.errors().iter().copied().fold(0.0, f64::max)
    }

    /// The route that was taken.
    #[must_use]
    pub fn route(&self) -> Route {
        self.route
    }

    fn points(&self) -> Points<'_> {
        Points::new(&self.coefficients, self.dimensions)
    }
}

fn averages(dissimilarity: Dissimilarity, points: Points<'_>, route: Route) -> (Route, Averages) {
    let is_tame = |x: &f64| *x == 0.0 || TAME.contains(&x.abs());
    if route == Route::Literal || !points.values().par_iter().all(is_tame) {
        return (Route::Literal, literal::averages(dissimilarity, points));
    }
    let fast = match (route, dissimilarity) {
        (Route::Fast, Dissimilarity::Ssd) => Some(closed_form::averages(points)),
        (Route::Fast, Dissimilarity::Nssd) => smooth_kernel::averages(points),
        _ => None,
    };
    match fast {
        Some(averages) => (Route::Fast, averages),
        None => (Route::Blocked, blocked::averages(dissimilarity, points)),
    }
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::simulate::seeded;

    const ALL: [Dissimilarity; 5] = [
        Dissimilarity::Ssd,
        Dissimilarity::Euclid,
        Dissimilarity::Nssd,
        Dissimilarity::NssdCentered,
        Dissimilarity::Angle,
    ];

    /// What a bound may be where norms differ by up to a million, of 1 or of the largest distance: three orders above
    /// the rounding of sums of some hundred terms.
    const USUAL_BOUND: f64 = 1e-10;

    /// `count` points whose norms spread over `decades` powers of ten, with copies, zeros and near copies among them.
    fn scattered(seed: u64, count: usize, dimensions: usize, decades: f64) -> Vec<f64> {
        let mut random = seeded(seed, 9);
        let mut points: Vec<f64> = Vec::new();
        for index in 0..count {
            let source = random.random_range(0..index.max(1));
            let (start, end) = (source * dimensions, (source + 1) * dimensions);
            match random.random_range(0..10) {
                0 if index > 0 => points.extend_from_within(start..end),
                1 if index > 0 => {
                    let near: Vec<f64> = points[start..end]
                        .iter()
                        .map(|x| x * (1.0 + 1e-13))
                        .collect();
                    points.extend(near);
                }
                2 => points.extend(std::iter::repeat_n(0.0, dimensions)),
                _ => {
                    let size = 10.0_f64.powf(random.random_range(0.0..=decades) - decades / 2.0);
                    points.extend((0..dimensions).map(|_| size * random.random_range(-1.0..1.0)));
                }
            }
        }
        points
    }

    fn check(points: &[f64], dimensions: usize, bound: f64, name: &str) {
        for dissimilarity in ALL {
            let literal = Profile::new(dissimilarity, points, dimensions, Route::Literal);
            let scale = match dissimilarity {
                Dissimilarity::Ssd | Dissimilarity::Euclid => {
                    literal.values().iter().copied().fold(0.0, f64::max)
                }
                _ => 1.0,
            };
            assert_eq!(literal.largest_error(), 0.0);
            for route in [Route::Blocked, Route::Fast] {
                let found = Profile::new(dissimilarity, points, dimensions, route);
                let pairs = found.values().iter().zip(literal.values());
                for (index, ((found, literal), error)) in pairs.zip(found.errors()).enumerate() {
                    assert!(
                        (found - literal).abs() <= *error,
                        "{name} {dissimilarity:?} {route:?} {index}: {found} {literal} {error}"
                    );
                }
                let largest = found.largest_error();
                assert!(
                    largest <= bound * scale,
                    "{name} {dissimilarity:?} {route:?}: bound {largest} of {scale}"
                );
            }
        }
    }

    #[test]
    fn every_route_matches_reference() {
        for decades in [0.0, 1.0, 3.0, 6.0, 12.0] {
            for (seed, (count, dimensions)) in [
                (1, 1),
                (2, 1),
                (3, 1),
                (3, 4),
                (40, 1),
                (65, 2),
                (200, 3),
                (700, 5),
                (513, 15),
                (600, 20),
            ]
            .into_iter()
            .enumerate()
            {
                let points = scattered(seed as u64, count, dimensions, decades);
                let bound = USUAL_BOUND * if decades > 6.0 { 10.0 } else { 1.0 };
                let name = format!("{count}×{dimensions}, {decades} decades");
                check(&points, dimensions, bound, &name);
            }
        }
    }

    #[test]
    fn clusters_far_from_the_origin_match_reference() {
        let mut random = seeded(4, 1);
        let points: Vec<f64> = (0..300)
            .flat_map(|index| [1e6 * f64::from(index % 3), 5e5, -3e5])
            .map(|x| x + random.random_range(-1e-3..1e-3))
            .collect();
        check(&points, 3, USUAL_BOUND, "clusters");
    }

    #[test]
    fn nothing_and_zeros_have_a_profile() {
        for route in [Route::Literal, Route::Blocked, Route::Fast] {
            for dissimilarity in ALL {
                assert!(
                    Profile::new(dissimilarity, &[], 3, route)
                        .values()
                        .is_empty()
                );
                let zeros = Profile::new(dissimilarity, &[0.0; 6], 2, route);
                let expected = match dissimilarity {
                    Dissimilarity::Angle => std::f64::consts::FRAC_PI_2,
                    _ => 0.0,
                };
                assert_eq!(zeros.values(), [expected; 3], "{dissimilarity:?} {route:?}");
            }
        }
    }

    #[test]
    fn each_route_is_the_one_that_was_asked_for() {
        let points = scattered(8, 300, 4, 1.0);
        for (dissimilarity, fastest) in [
            (Dissimilarity::Ssd, Route::Fast),
            (Dissimilarity::Nssd, Route::Fast),
            (Dissimilarity::NssdCentered, Route::Fast),
            (Dissimilarity::Euclid, Route::Blocked),
            (Dissimilarity::Angle, Route::Blocked),
        ] {
            assert_eq!(Route::automatic(dissimilarity, 300), fastest);
            let taken = |route| Profile::new(dissimilarity, &points, 4, route).route();
            assert_eq!(taken(Route::Fast), fastest);
            assert_eq!(taken(Route::Blocked), Route::Blocked);
            assert_eq!(taken(Route::Literal), Route::Literal);
        }
    }

    #[test]
    fn norms_that_differ_too_much_are_compared_in_pairs() {
        let points: Vec<f64> = (-60..=60).map(|power| 10.0_f64.powi(power)).collect();
        let profile = Profile::new(Dissimilarity::Nssd, &points, 1, Route::Fast);
        assert_eq!(profile.route(), Route::Blocked);
        let wild = [1e-200, 1.0, 1e200];
        let profile = Profile::new(Dissimilarity::Nssd, &wild, 1, Route::Fast);
        assert_eq!(profile.route(), Route::Literal);
    }

    #[test]
    fn the_number_of_threads_changes_no_bit() {
        let points = scattered(5, 3000, 6, 2.0);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a few threads").install(|| {
                ALL.map(|dissimilarity| {
                    let profile = Profile::new(dissimilarity, &points, 6, Route::Fast);
                    let bits = profile.values().iter().map(|value| value.to_bits());
                    bits.collect::<Vec<u64>>()
                })
            })
        };
        assert_eq!(on(1), on(3));
    }
}
