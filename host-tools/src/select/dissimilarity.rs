//! Dissimilarity of two points of an eigenspace, in f64: the twin of the core's integer matching.

use eigenmark_core::landmark::Metric;

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
    let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    match metric {
        Metric::Euclid => squared.sqrt(),
        Metric::Cosine => {
            let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            let norms = [a, b].map(|x| x.iter().map(|x| x * x).sum::<f64>());
            if norms[0] * norms[1] > 0.0 {
                let across = (norms[0] * norms[1] - dot * dot).max(0.0);
                across.sqrt().atan2(dot)
            } else {
                std::f64::consts::FRAC_PI_2
            }
        }
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

/// The same as something that keeps the triangle inequality: √nSSD, or the Euclidean distance and the angle
/// themselves.
#[must_use]
pub fn metric_distance(metric: Metric, a: &[f64], b: &[f64]) -> f64 {
    match metric {
        Metric::Euclid | Metric::Cosine => dissimilarity(metric, a, b),
        Metric::Nssd => dissimilarity(metric, a, b).sqrt(),
    }
}
