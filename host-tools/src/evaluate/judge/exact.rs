//! The eigenspace in f64: what the report evaluates.
//!
//! **Notation.** a the view's coordinates, b a landmark's; A = ‖a‖², B = ‖b‖².
//!
//! **Method.** One product a·b per landmark finds the two nearest; their distances are then computed from the
//! differences, because small ones drown in the rounding of large norms.

use eigenmark_core::landmark::Metric;

use super::{Judge, Verdict};
use crate::{
    atlas::radii,
    learn::PixelBasis,
    select::{dissimilarity, nearness},
};

/// Landmarks in f64, and the eigenspace that views are projected into.
#[derive(Clone, Debug)]
pub struct Exact {
    basis: PixelBasis,
    metric: Metric,
    /// l rows of k.
    points: Vec<f64>,
    squared_norms: Vec<f64>,
    radii: Vec<f32>,
}

impl Exact {
    /// Some `landmarks` (1-based candidate numbers) of candidates with these `coordinates` in `basis`, n rows of k.
    ///
    /// # Panics
    /// When there is no landmark, or no such candidate.
    #[must_use]
    pub fn new(basis: PixelBasis, metric: Metric, coordinates: &[f64], landmarks: &[u32]) -> Self {
        assert!(!landmarks.is_empty(), "at least one landmark");
        let k = basis.dimensions();
        let points: Vec<f64> = landmarks
            .iter()
            .flat_map(|&view| &coordinates[(view as usize - 1) * k..][..k])
            .copied()
            .collect();
        Self {
            squared_norms: points.chunks_exact(k).map(|b| dot(b, b)).collect(),
            radii: radii(metric, coordinates, k, landmarks, 0.0),
            basis,
            metric,
            points,
        }
    }

    /// The eigenspace, on the pixels of views.
    #[must_use]
    pub fn basis(&self) -> &PixelBasis {
        &self.basis
    }

    /// Coordinates of landmark `landmark` (0-based).
    ///
    /// # Panics
    /// When there is no such landmark.
    #[must_use]
    pub fn point(&self, landmark: usize) -> &[f64] {
        let k = self.basis.dimensions();
        &self.points[landmark * k..][..k]
    }

    /// ε_i of every landmark, report (2.38), reconstructed.
    #[must_use]
    pub fn radii(&self) -> &[f32] {
        &self.radii
    }

    /// ρ of two points of the eigenspace, in the metric's unit.
    #[must_use]
    pub fn dissimilarity(&self, a: &[f64], b: &[f64]) -> f64 {
        dissimilarity(self.metric, a, b)
    }

    /// What it says about a view with these k coordinates.
    #[must_use]
    pub fn judge_point(&self, coordinates: &[f64]) -> Verdict {
        let squared_norm = dot(coordinates, coordinates);
        // (nearness, landmark) of the two nearest.
        let (mut first, mut second) = ((f64::NEG_INFINITY, 0), None);
        let points = self.points.chunks_exact(coordinates.len());
        for (index, (b, &other_norm)) in points.zip(&self.squared_norms).enumerate() {
            let product = dot(coordinates, b);
            let near = nearness(self.metric, product, squared_norm, other_norm);
            if near > first.0 {
                second = (index > 0).then_some(first);
                first = (near, index);
            } else if second.is_none_or(|(other, _)| near > other) {
                second = Some((near, index));
            }
        }
        let (mut nearest, mut is_strict) = (first.1, true);
        let distance_to = |landmark| self.dissimilarity(coordinates, self.point(landmark));
        let mut distance = distance_to(nearest);
        if let Some((_, other)) = second {
            let other_distance = distance_to(other);
            if other_distance < distance {
                (nearest, distance) = (other, other_distance);
            } else {
                is_strict = distance < other_distance;
            }
        }
        Verdict {
            landmark: nearest as u32,
            is_strict,
            is_guaranteed: distance < f64::from(self.radii[nearest]),
        }
    }
}

impl Judge for Exact {
    fn side(&self) -> usize {
        self.basis.pixels().isqrt()
    }

    fn landmarks(&self) -> usize {
        self.radii.len()
    }

    fn judge(&self, view: &[u8]) -> Option<Verdict> {
        Some(self.judge_point(&self.basis.project(view)?))
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
