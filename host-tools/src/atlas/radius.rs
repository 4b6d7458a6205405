//! How near a view must be for its landmark to be guaranteed.
//!
//! ε_i = ½·min_{j≠i} d(g_i, g_j) in a metric d that keeps the triangle inequality (report (2.38) and (2.39), which
//! are lost and reconstructed): a view nearer than ε_i to landmark i is farther than ε_i from every other. For
//! nSSD d is √nSSD, so that the radius in nSSD is a quarter of the smallest nSSD.
//!
//! On board, both the view and the landmark carry a quantization error of at most η. The radius is narrowed by what
//! that can change: 2η for the Euclidean distance; for √nSSD at most 2δ/(‖z‖ − δ) with z = (g_i, g), ‖z‖ ≥ ‖g_i‖,
//! δ = √2·η, because √nSSD = ‖L·z‖/(√2·‖z‖) with ‖L‖ = √2 and √nSSD ≤ 1.
//!
//! For angles, a vector wrong by η turns by at most asin(η/‖g‖) ≤ (π/2)·η/‖g‖. The landmark's turn narrows the radius
//! here; the view's depends on the view, so the board takes it off ([`Header::error`](eigenmark_core::atlas::Header)).

use std::f64::consts::FRAC_PI_2;

use eigenmark_core::landmark::Metric;

use crate::select::nearest_others;

/// A radius must not grow by rounding, nor a distance on board shrink: a few of 2⁻²⁴ each.
const FLOAT_MARGIN: f64 = 1.0 - 1.0 / (1 << 20) as f64;

/// Radii of `landmarks` (candidate numbers) among each other, in the metric's unit, for coordinates that on board are
/// wrong by at most `error`. A single landmark is guaranteed everywhere.
#[must_use]
pub fn radii(
    metric: Metric,
    coordinates: &[f64],
    dimensions: usize,
    landmarks: &[u32],
    error: f64,
) -> Vec<f32> {
    let points: Vec<f64> = landmarks
        .iter()
        .flat_map(|&view| &coordinates[(view as usize - 1) * dimensions..][..dimensions])
        .copied()
        .collect();
    points
        .chunks_exact(dimensions)
        .zip(nearest_others(metric, &points, dimensions))
        .map(|(point, nearest)| {
            let norm = point.iter().map(|g| g * g).sum::<f64>().sqrt();
            narrowed(metric, nearest / 2.0, norm, error)
        })
        .collect()
}

fn narrowed(metric: Metric, radius: f64, norm: f64, error: f64) -> f32 {
    let loss = match metric {
        Metric::Euclid => 2.0 * error,
        Metric::Cosine if norm > error => FRAC_PI_2 * error / norm,
        Metric::Cosine => f64::INFINITY,
        Metric::Nssd => {
            let error = std::f64::consts::SQRT_2 * error;
            if norm > error {
                2.0 * error / (norm - error)
            } else {
                f64::INFINITY
            }
        }
    };
    let narrowed = if loss.is_finite() {
        (radius - loss).max(0.0)
    } else {
        0.0
    };
    let narrowed = match metric {
        Metric::Euclid | Metric::Cosine => narrowed,
        Metric::Nssd => narrowed * narrowed,
    };
    (narrowed.min(f64::from(f32::MAX)) * FLOAT_MARGIN) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_are_half_of_the_distance_to_the_nearest_other() {
        let coordinates = [0.0, 10.0, 16.0];
        let radii = radii(Metric::Euclid, &coordinates, 1, &[1, 2, 3], 0.5);
        for (radius, expected) in radii.iter().zip([4.0, 2.0, 2.0]) {
            assert!(
                (radius - expected).abs() < 1e-5 && *radius < expected,
                "{radius} {expected}"
            );
        }
    }

    #[test]
    fn nssd_radii_are_a_quarter() {
        // nSSD of (3, 0) and (0, 4) is 1/2.
        let radii = radii(Metric::Nssd, &[3.0, 0.0, 0.0, 4.0], 2, &[1, 2], 0.0);
        assert!(radii.iter().all(|radius| (radius - 0.125).abs() < 1e-6));
    }

    #[test]
    fn one_landmark_is_nearest_everywhere() {
        assert!(radii(Metric::Nssd, &[3.0], 1, &[1], 0.1)[0] > 1.0);
    }

    #[test]
    fn errors_larger_than_the_landmark_leave_nothing() {
        assert_eq!(radii(Metric::Nssd, &[0.1, 9.0], 1, &[1, 2], 5.0)[0], 0.0);
    }
}
