//! Dissimilarity of two points of an eigenspace, in f64: the twin of the core's integer matching.

use eigenmark_core::landmark::Metric;
use serde::{Deserialize, Serialize};

/// What a distance profile averages: a number for two points, symmetrical, zero for two that are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Dissimilarity {
    /// ‖a − b‖², the sum of squared differences.
    Ssd,
    /// ‖a − b‖.
    Euclid,
    /// ‖a − b‖² / (2(‖a‖² + ‖b‖²)), between 0 and 1, 0/0 being 0; report (2.35), corrected.
    Nssd,
    /// The same after each point has lost the mean of its own elements, which is report (2.36) as printed. Points that
    /// differ by a constant in every element are then alike, and in one dimension all are.
    NssdCentered,
    /// The angle between a and b in radians; π/2 where one of them is zero.
    Angle,
}

impl From<Metric> for Dissimilarity {
    fn from(metric: Metric) -> Self {
        match metric {
            Metric::Euclid => Self::Euclid,
            Metric::Nssd => Self::Nssd,
            Metric::Cosine => Self::Angle,
        }
    }
}

impl Dissimilarity {
    /// ρ(a, b) of two points with the same number of elements.
    ///
    /// ```
    /// use eigenmark::select::Dissimilarity;
    /// assert_eq!(Dissimilarity::Ssd.between(&[3.0, 0.0], &[0.0, 4.0]), 25.0);
    /// assert_eq!(Dissimilarity::Nssd.between(&[3.0, 0.0], &[0.0, 4.0]), 0.5);
    /// // Centered, these are (−1, 1) and (1, −1).
    /// assert_eq!(Dissimilarity::NssdCentered.between(&[5.0, 7.0], &[9.0, 7.0]), 1.0);
    /// ```
    #[must_use]
    pub fn between(self, a: &[f64], b: &[f64]) -> f64 {
        match self {
            Self::Ssd => squared_difference(a, b),
            Self::Euclid => squared_difference(a, b).sqrt(),
            Self::Nssd => normalized(a, b),
            Self::NssdCentered => normalized(&centered(a), &centered(b)),
            Self::Angle => angle(a, b),
        }
    }
}

/// ρ(a, b) in the metric's unit; report (2.35), corrected, the Euclidean distance, or the angle.
///
/// ```
/// use eigenmark::select::dissimilarity;
/// use eigenmark_core::landmark::Metric;
/// assert_eq!(dissimilarity(Metric::Euclid, &[3.0, 0.0], &[0.0, 4.0]), 5.0);
/// assert_eq!(dissimilarity(Metric::Nssd, &[3.0, 0.0], &[0.0, 4.0]), 0.5);
/// assert_eq!(dissimilarity(Metric::Nssd, &[1.0, 2.0], &[-1.0, -2.0]), 1.0);
/// assert_eq!(dissimilarity(Metric::Nssd, &[0.0, 0.0], &[0.0, 0.0]), 0.0);
/// assert_eq!(dissimilarity(Metric::Cosine, &[3.0, 0.0], &[0.0, 4.0]), std::f64::consts::FRAC_PI_2);
/// ```
#[must_use]
pub fn dissimilarity(metric: Metric, a: &[f64], b: &[f64]) -> f64 {
    Dissimilarity::from(metric).between(a, b)
}

/// The same as something that keeps the triangle inequality: √nSSD, or the Euclidean distance and the angle
/// themselves.
#[must_use]
pub fn metric_distance(metric: Metric, a: &[f64], b: &[f64]) -> f64 {
    match metric {
        Metric::Euclid | Metric::Cosine => dissimilarity(metric, a, b),
        Metric::Nssd => dissimilarity(metric, a, b).sqrt(),
    }
}

/// What grows as b gets nearer to a, from a·b, ‖a‖² and ‖b‖² alone: for finding the nearest, not for measuring how near it
/// is, because small distances drown in the rounding of large norms.
pub(crate) fn nearness(metric: Metric, product: f64, squared_a: f64, squared_b: f64) -> f64 {
    match metric {
        Metric::Euclid => 2.0 * product - squared_b,
        Metric::Nssd if squared_a + squared_b > 0.0 => product / (squared_a + squared_b),
        Metric::Nssd => 0.5,
        Metric::Cosine if squared_b > 0.0 => product / squared_b.sqrt(),
        Metric::Cosine => 0.0,
    }
}

/// `point` without the mean of its elements. What is left of equal elements is rounding, and counts as nothing.
pub(super) fn centered(point: &[f64]) -> Vec<f64> {
    let count = point.len() as f64;
    let mean = point.iter().sum::<f64>() / count;
    let largest = point
        .iter()
        .fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let rounding = (count + 1.0) * f64::EPSILON * largest;
    if point.iter().all(|x| (x - mean).abs() <= rounding) {
        return vec![0.0; point.len()];
    }
    point.iter().map(|x| x - mean).collect()
}

fn squared_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// The norms are added last, so that the bits are symmetrical too.
fn normalized(a: &[f64], b: &[f64]) -> f64 {
    let energy = squared_norm(a) + squared_norm(b);
    if energy > 0.0 {
        squared_difference(a, b) / (2.0 * energy)
    } else {
        0.0
    }
}

fn angle(a: &[f64], b: &[f64]) -> f64 {
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let norms = squared_norm(a) * squared_norm(b);
    if norms > 0.0 {
        let across = (norms - dot * dot).max(0.0);
        across.sqrt().atan2(dot)
    } else {
        std::f64::consts::FRAC_PI_2
    }
}

fn squared_norm(point: &[f64]) -> f64 {
    point.iter().map(|x| x * x).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centering_takes_what_all_elements_share() {
        let (a, b) = ([1.0, 2.0, 6.0], [4.0, 5.0, 9.0]);
        assert_eq!(Dissimilarity::NssdCentered.between(&a, &b), 0.0);
        assert!(Dissimilarity::Nssd.between(&a, &b) > 0.0);
    }

    #[test]
    fn centering_leaves_nothing_of_equal_elements() {
        assert_eq!(centered(&[0.1; 3]), [0.0; 3]);
        assert_eq!(centered(&[7.0]), [0.0]);
        assert_eq!(
            Dissimilarity::NssdCentered.between(&[0.1; 3], &[0.7; 3]),
            0.0
        );
    }
}
