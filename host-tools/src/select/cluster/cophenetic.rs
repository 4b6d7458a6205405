//! Distances in a dendrogram, and how far they distort those of the views; report (4.1), corrected.
//!
//! **Notation.** O distances of pairs of views, C the heights at which they are merged, ō and c̄ their means over i < j.

use super::{Dendrogram, Pairwise, pairwise::index};

impl Dendrogram {
    /// The height of the merge that joins them, for every pair of views: n·(n − 1)/2 numbers, as in [`Pairwise`].
    #[must_use]
    pub fn cophenetic_distances(&self) -> Vec<f64> {
        let n = self.views();
        let mut heights = vec![0.0; n * (n - 1) / 2];
        let mut members: Vec<Vec<usize>> = (0..n).map(|view| vec![view]).collect();
        for merge in self.merges() {
            let [a, b] = merge
                .clusters
                .map(|part| std::mem::take(&mut members[part as usize]));
            for &one in &a {
                for &other in &b {
                    heights[index(n, one.min(other), one.max(other))] = merge.height;
                }
            }
            members.push([a, b].concat());
        }
        heights
    }

    /// The cophenetic correlation coefficient with the distances that were `observed`, which need not be those that the
    /// views were merged by: Σ(O − ō)(C − c̄) / √(Σ(O − ō)² · Σ(C − c̄)²); report (4.1), corrected. 1 where the dendrogram
    /// distorts nothing. `None` where it is undefined: all distances or all heights are equal, or `observed` is of another
    /// number of views.
    #[must_use]
    pub fn cophenetic_correlation(&self, observed: &Pairwise) -> Option<f64> {
        if observed.count() != self.views() {
            return None;
        }
        let heights = self.cophenetic_distances();
        let observed = centered(observed.values())?;
        let heights = centered(&heights)?;
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let norms = product(&observed, &observed).sqrt() * product(&heights, &heights).sqrt();
        let correlation = product(&observed, &heights) / norms;
        correlation
            .is_finite()
            .then_some(correlation.clamp(-1.0, 1.0))
    }
}

/// Numbers without their mean; `None` when they are all equal.
fn centered(numbers: &[f64]) -> Option<Vec<f64>> {
    let first = numbers.first()?;
    if numbers.iter().all(|number| number == first) {
        return None;
    }
    let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
    Some(numbers.iter().map(|number| number - mean).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::select::{Dissimilarity, cluster::Linkage};

    fn euclidean(points: &[f64]) -> Pairwise {
        Pairwise::new(Dissimilarity::Euclid, points, 1).expect("finite")
    }

    #[test]
    fn distances_are_heights_of_the_first_common_merge() {
        // 0 and 1 merge at 1, then 4 at 3 by its nearest.
        let pairwise = euclidean(&[0.0, 4.0, 1.0]);
        let dendrogram = Dendrogram::new(Linkage::Single, &pairwise).expect("any");
        assert_eq!(dendrogram.cophenetic_distances(), [3.0, 1.0, 3.0]);
        // O = (4, 1, 3), C = (3, 1, 3): centered (4, −5, 1)/3 and (2, −4, 2)/3.
        let expected = 30.0 / (42.0_f64 * 24.0).sqrt();
        let found = dendrogram
            .cophenetic_correlation(&pairwise)
            .expect("defined");
        assert!((found - expected).abs() < 1e-15, "{found} {expected}");
    }

    #[test]
    fn other_distances_can_be_observed() {
        let points = [0.0, 4.0, 1.0];
        let dendrogram = Dendrogram::new(Linkage::Single, &euclidean(&points)).expect("any");
        let squares = Pairwise::new(Dissimilarity::Ssd, &points, 1).expect("finite");
        // O = (16, 1, 9), C = (3, 1, 3): centered (22, −23, 1)/3 and (2, −4, 2)/3.
        let expected = 138.0 / (1014.0_f64 * 24.0).sqrt();
        let found = dendrogram
            .cophenetic_correlation(&squares)
            .expect("defined");
        assert!((found - expected).abs() < 1e-15, "{found} {expected}");
    }

    #[test]
    fn the_correlation_of_constants_is_undefined() {
        for points in [&[1.0][..], &[1.0, 5.0], &[2.0, 2.0, 2.0]] {
            let pairwise = euclidean(points);
            let dendrogram = Dendrogram::new(Linkage::Average, &pairwise).expect("any");
            assert_eq!(dendrogram.cophenetic_correlation(&pairwise), None);
        }
        // 0, 1, 2: both merge at 1 by the nearest, distances differ.
        let pairwise = euclidean(&[0.0, 1.0, 2.0]);
        let dendrogram = Dendrogram::new(Linkage::Single, &pairwise).expect("any");
        assert_eq!(dendrogram.cophenetic_correlation(&pairwise), None);
        assert_eq!(
            dendrogram.cophenetic_correlation(&euclidean(&[1.0, 2.0])),
            None
        );
    }
}
