//! Dissimilarity of two points of an eigenspace, in f64: the twin of the core's integer matching.

use eigenmark_core::landmark::Metric;

/// ρ(a, b) in the metric's unit; report (2.35), corrected, or the Euclidean distance.
///
/// ```
/// use eigenmark::select::dissimilarity;
/// use eigenmark_core::landmark::Metric;
/// assert_eq!(dissimilarity(Metric::Euclid, &[3.0, 0.0], &[0.0, 4.0]), 5.0);
/// assert_eq!(dissimilarity(Metric::Nssd, &[3.0, 0.0], &[0.0, 4.0]), 0.5);
/// assert_eq!(dissimilarity(Metric::Nssd, &[1.0, 2.0], &[-1.0, -2.0]), 1.0);
/// assert_eq!(dissimilarity(Metric::Nssd, &[0.0, 0.0], &[0.0, 0.0]), 0.0);
/// ```
#[must_use]
pub fn dissimilarity(metric: Metric, a: &[f64], b: &[f64]) -> f64 {
    let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    match metric {
        Metric::Euclid => squared.sqrt(),
        Metric::Nssd => {
            let energy: f64 = a.iter().chain(b).map(|x| x * x).sum();
            if energy > 0.0 {
                squared / (2.0 * energy)
            } else {
                0.0
            }
        }
    }
}

/// The same as something that keeps the triangle inequality: √nSSD, or the Euclidean distance itself.
#[must_use]
pub fn metric_distance(metric: Metric, a: &[f64], b: &[f64]) -> f64 {
    match metric {
        Metric::Euclid => dissimilarity(metric, a, b),
        Metric::Nssd => dissimilarity(metric, a, b).sqrt(),
    }
}
