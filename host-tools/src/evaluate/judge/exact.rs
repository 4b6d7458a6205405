//! The eigenspace in f64: what the report evaluates.
//!
//! **Notation.** a the view's coordinates, b a landmark's; A = ‖a‖², B = ‖b‖².
//!
//! **Method.** One product a·b per landmark says which are near, dimension by dimension over all landmarks at once; see
//! `nearest` for the rest.

use eigenmark_core::landmark::Metric;

use super::{Judge, Verdict, nearest_of};
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
    /// The same, k rows of l.
    by_dimension: Vec<f64>,
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
        let by_dimension = (0..k)
            .flat_map(|dimension| points.iter().skip(dimension).step_by(k))
            .copied()
            .collect();
        Self {
            by_dimension,
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

    /// ρ of two points of the eigenspace, in the metric's unit.
    #[must_use]
    pub fn dissimilarity(&self, a: &[f64], b: &[f64]) -> f64 {
        dissimilarity(self.metric, a, b)
    }

    /// What it says about a view with these k coordinates.
    #[must_use]
    pub fn judge_point(&self, coordinates: &[f64]) -> Verdict {
        let squared_norm = dot(coordinates, coordinates);
        let mut nearnesses = vec![0.0; self.squared_norms.len()];
        let rows = self.by_dimension.chunks_exact(nearnesses.len());
        for (g, row) in coordinates.iter().zip(rows) {
            for (product, h) in nearnesses.iter_mut().zip(row) {
                *product += g * h;
            }
        }
        for (product, &other_norm) in nearnesses.iter_mut().zip(&self.squared_norms) {
            *product = nearness(self.metric, *product, squared_norm, other_norm);
        }

        let distance = |landmark| self.dissimilarity(coordinates, self.point(landmark));
        let nearest = nearest_of(nearnesses.iter().copied(), squared_norm, distance);
        Verdict {
            landmark: nearest.index as u32,
            is_strict: nearest.is_strict,
            is_guaranteed: nearest.distance < f64::from(self.radii[nearest.index]),
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
        if view.len() != self.basis.pixels() {
            return None;
        }
        Some(self.judge_point(&self.basis.project(view)?))
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use eigenmark_core::atlas::Blur;
    use rand::RngExt;

    use super::*;
    use crate::{
        learn::{Matrix, Model, Preprocess},
        select::metric_distance,
        simulate::seeded,
    };

    /// Landmarks among 30 random views in 6 dimensions, and the views' coordinates.
    fn exact(metric: Metric) -> (Exact, Vec<f64>) {
        let mut random = seeded(8, 8);
        let vectors: Vec<f32> = (0..30 * 16)
            .map(|_| random.random_range(0.0..255.0))
            .collect();
        let rows = Matrix::new(&vectors, 16);
        let model = Model::learn(&rows, 6).expect("learns");
        let preprocess = Preprocess::new(
            4,
            eigenmark_core::eigenspace::Normalize::None,
            Blur::None,
            0.0,
        );
        let coordinates = model.project(&rows);
        let basis = PixelBasis::new(&model, &preprocess, 0.0);
        (
            Exact::new(basis, metric, &coordinates, &[3, 9, 17, 30, 9, 9]),
            coordinates,
        )
    }

    #[test]
    fn verdicts_are_those_of_all_distances() {
        for metric in [Metric::Nssd, Metric::Euclid, Metric::Cosine] {
            let (exact, coordinates) = exact(metric);
            for point in coordinates.chunks_exact(6) {
                let distances: Vec<f64> = (0..6)
                    .map(|index| metric_distance(metric, point, exact.point(index)))
                    .collect();
                let least = distances.iter().copied().fold(f64::MAX, f64::min);
                let nearest = distances
                    .iter()
                    .filter(|&&distance| distance == least)
                    .count();
                let verdict = exact.judge_point(point);
                assert_eq!(distances[verdict.landmark as usize], least, "{metric:?}");
                assert_eq!(verdict.is_strict, nearest == 1, "{metric:?} {distances:?}");
                // View 9 is there three times: what is nearest there is never guaranteed.
                let is_double = [1, 4, 5].contains(&verdict.landmark);
                assert!(!verdict.is_guaranteed || !is_double);
            }
        }
    }

    #[test]
    fn a_landmark_is_guaranteed_at_itself_and_strict() {
        let (exact, _) = exact(Metric::Nssd);
        let verdict = exact.judge_point(exact.point(2));
        assert_eq!(
            verdict,
            Verdict {
                landmark: 2,
                is_strict: true,
                is_guaranteed: true
            }
        );
    }
}
