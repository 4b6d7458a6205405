//! Algorithm 2.3 of the report: each point is compared with every point, in order.
//!
//! Deviations: (1) no distance matrix is kept, memory is O(n); (2) a sum is divided by n − 1 once, not term by term;
//! (3) the dissimilarity of a point and itself is 0 even where the angle of two zero points is π/2. Rows are computed
//! in parallel, each by one thread, so that the bits do not depend on their number.
//!
//! **Rounding.** The sum of n terms, none of them negative, is off by up to (n−1)·u of itself, the quotient by u, and
//! the terms by what [`term_error`] says.

use rayon::prelude::*;

use super::{Averages, HIGHER_ORDERS, ROUNDING, points::Points};
use crate::select::Dissimilarity;

/// The whole profile; nothing is off.
pub(super) fn averages(dissimilarity: Dissimilarity, points: Points<'_>) -> Averages {
    let values = (0..points.count())
        .into_par_iter()
        .map(|index| average(dissimilarity, points, index))
        .collect();
    Averages {
        values,
        errors: vec![0.0; points.count()],
    }
}

/// The profile value of one point.
pub(super) fn average(dissimilarity: Dissimilarity, points: Points<'_>, index: usize) -> f64 {
    let own = points.point(index);
    let sum_with = |sum: f64, other: &[f64]| sum + dissimilarity.between(own, other);
    let before = points.iter().take(index).fold(0.0, sum_with);
    points.iter().skip(index + 1).fold(before, sum_with) / points.others()
}

/// Whether points with the same bits have the same profile bits: where ρ(g, g) is 0, their sums differ only in where
/// a zero is added, and those of zero points have equal terms.
pub(super) fn copies_share(dissimilarity: Dissimilarity, point: &[f64]) -> bool {
    dissimilarity.between(point, point) == 0.0 || point.iter().all(|x| *x == 0.0)
}

/// How far the literal value can be from the exact one, whose approximation is `value`.
pub(super) fn error(dissimilarity: Dissimilarity, points: Points<'_>, value: f64) -> f64 {
    let (relative, absolute) = term_error(dissimilarity, points.dimensions());
    let summing = points.count() as f64 + 1.0;
    HIGHER_ORDERS * ROUNDING * ((relative + summing) * value + absolute)
}

/// How many u a computed ρ(a, b) of k dimensions can be off, relative to itself and absolutely.
///
/// Differences, squares and their sum: k + 2 of ‖a − b‖². nSSD adds k + 1 of the norms and their sum, and a quotient.
/// The root halves. The angle is that of pairs at least [`NEARLY_PARALLEL`](super::blocked::NEARLY_PARALLEL) apart,
/// sine ≥ 1/8: AB − (a·b)² is off by (4k+3)·AB, the sine by half of that over 1/8, the cosine by k, the arc tangent by
/// 4.
fn term_error(dissimilarity: Dissimilarity, dimensions: usize) -> (f64, f64) {
    let k = dimensions as f64;
    match dissimilarity {
        Dissimilarity::Ssd => (k + 2.0, 0.0),
        Dissimilarity::Euclid => (k / 2.0 + 2.0, 0.0),
        Dissimilarity::Nssd | Dissimilarity::NssdCentered => (2.0 * k + 4.0, 0.0),
        Dissimilarity::Angle => (0.0, 17.0 * k + 20.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_profile_is_the_mean_of_a_row_of_the_distance_matrix() {
        let points = Points::new(&[0.0, 0.0, 3.0, 4.0, 0.0, 8.0], 2);
        let found = averages(Dissimilarity::Euclid, points);
        assert_eq!(found.values, [6.5, 5.0, 6.5]);
    }

    #[test]
    fn one_point_has_no_others() {
        let found = averages(Dissimilarity::Ssd, Points::new(&[5.0], 1));
        assert_eq!(found.values, [0.0]);
    }
}
