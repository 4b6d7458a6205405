//! How well views fit into their clusters; report (4.2), corrected.
//!
//! **Notation.** a(i) is the mean dissimilarity of view i to the others of its cluster, without itself; b(i) the least
//! mean dissimilarity to the views of another cluster. SIL(i) = (b − a)/max(a, b), between −1 (misplaced) and 1.
//!
//! **Conventions** (P. J. Rousseeuw, *Silhouettes*, 1987): a view that is alone in its cluster has 0; so have all views
//! when there is one cluster only, where b is undefined; and 0/0 is 0.

use serde::Serialize;

use super::{ClusterError, Pairwise, Partition, check, k_means};
use crate::select::Dissimilarity;

/// The silhouettes of all views together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Silhouettes {
    /// Their mean.
    pub mean: f64,
    /// Their median; of an even number, the mean of the middle two.
    pub median: f64,
    /// Share of those below zero.
    pub negative: f64,
}

/// SIL of every view: n numbers.
///
/// # Errors
/// When the partition is of another number of views.
pub fn silhouettes(pairwise: &Pairwise, partition: &Partition) -> Result<Vec<f64>, ClusterError> {
    let (n, clusters) = (pairwise.count(), partition.count() as usize);
    if partition.of().len() != n {
        return Err(ClusterError::OtherViews {
            expected: n,
            found: partition.of().len(),
        });
    }
    // Of every view to every cluster.
    let mut sums = vec![0.0; n * clusters];
    let of = partition.of();
    let mut values = pairwise.values().iter();
    for a in 0..n {
        for (b, value) in (a + 1..n).zip(&mut values) {
            sums[a * clusters + of[b] as usize] += value;
            sums[b * clusters + of[a] as usize] += value;
        }
    }
    let sizes = partition.sizes();
    let silhouette = |(sums, &own): (&[f64], &u32)| {
        let own = own as usize;
        let others = (0..clusters).filter(|&other| other != own);
        let nearest = others
            .map(|other| sums[other] / f64::from(sizes[other]))
            .fold(f64::INFINITY, f64::min);
        if sizes[own] == 1 || clusters == 1 {
            return 0.0;
        }
        let within = sums[own] / f64::from(sizes[own] - 1);
        let larger = within.max(nearest);
        if larger > 0.0 {
            (nearest - within) / larger
        } else {
            0.0
        }
    };
    Ok(sums
        .chunks_exact(clusters)
        .zip(of)
        .map(silhouette)
        .collect())
}

/// Mean, median and share of negatives by k-means with SSD, as in the report, for 1…n clusters: what [`k_means()`] finds
/// with the same seed.
///
/// # Errors
/// When there is no point, rows are not whole, or numbers are not finite or too large.
pub fn silhouette_curve(
    points: &[f64],
    dimensions: usize,
    seed: u64,
) -> Result<Vec<Silhouettes>, ClusterError> {
    let n = check(points, dimensions)?;
    let pairwise = Pairwise::new(Dissimilarity::Ssd, points, dimensions)?;
    (1..=n)
        .map(|clusters| {
            let found = k_means(points, dimensions, clusters, seed)?;
            Ok(Silhouettes::of(&silhouettes(&pairwise, &found.partition)?))
        })
        .collect()
}

impl Silhouettes {
    /// Of all views; zeros without any.
    #[must_use]
    pub fn of(silhouettes: &[f64]) -> Self {
        let count = silhouettes.len().max(1) as f64;
        let mut sorted = silhouettes.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let half = sorted.len() / 2;
        let median = match sorted.get(half) {
            None => 0.0,
            Some(upper) if sorted.len() % 2 == 1 => *upper,
            Some(upper) => f64::midpoint(sorted[half - 1], *upper),
        };
        Self {
            mean: silhouettes.iter().sum::<f64>() / count,
            median,
            negative: silhouettes.iter().filter(|one| **one < 0.0).count() as f64 / count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(points: &[f64], labels: &[usize]) -> Vec<f64> {
        let pairwise = Pairwise::new(Dissimilarity::Euclid, points, 1).expect("finite");
        silhouettes(&pairwise, &Partition::new(labels)).expect("as many")
    }

    #[test]
    fn values_are_those_of_the_formula() {
        // {0, 2, 3} and {7, 11}: a = (5/2, 3/2, 2, 4, 4), b = (9, 7, 6, 16/3, 28/3).
        let found = of(&[0.0, 2.0, 3.0, 7.0, 11.0], &[0, 0, 0, 1, 1]);
        let expected = [6.5 / 9.0, 5.5 / 7.0, 4.0 / 6.0, 0.25, 16.0 / 28.0];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
    }

    #[test]
    fn misplaced_views_are_negative() {
        // 9 is put to 0: a = 9, b = 1.
        let found = of(&[0.0, 9.0, 10.0], &[0, 0, 1]);
        assert_eq!(found, [1.0 / 10.0, -8.0 / 9.0, 0.0]);
    }

    #[test]
    fn what_is_undefined_is_zero() {
        assert_eq!(of(&[1.0, 2.0, 5.0], &[0, 0, 0]), [0.0; 3]);
        assert_eq!(of(&[1.0, 2.0, 5.0], &[0, 1, 2]), [0.0; 3]);
        assert_eq!(of(&[4.0; 4], &[0, 0, 1, 1]), [0.0; 4]);
        assert_eq!(of(&[4.0], &[0]), [0.0]);
    }

    #[test]
    fn summaries_are_of_all_views() {
        let found = Silhouettes::of(&[0.5, -0.5, 0.0, 0.25]);
        let expected = Silhouettes {
            mean: 0.0625,
            median: 0.125,
            negative: 0.25,
        };
        assert_eq!(found, expected);
        assert_eq!(Silhouettes::of(&[0.5, -0.5, 0.25]).median, 0.25);
        assert_eq!(Silhouettes::of(&[]).mean, 0.0);
    }

    #[test]
    fn curves_have_a_point_per_number_of_clusters() {
        let points = [0.0, 1.0, 10.0, 11.0];
        let curve = silhouette_curve(&points, 1, 1).expect("finite");
        assert_eq!(curve.len(), 4);
        assert_eq!(curve[0].mean, 0.0);
        assert_eq!(curve[3].mean, 0.0);
        // SSD: a = 1 everywhere, b = (110.5, 90.5, 90.5, 110.5).
        let expected = 1.0 - (1.0 / 110.5 + 1.0 / 90.5) / 2.0;
        assert!((curve[1].mean - expected).abs() < 1e-12, "{:?}", curve[1]);
    }

    #[test]
    fn partitions_of_other_views_are_refused() {
        let pairwise = Pairwise::new(Dissimilarity::Ssd, &[1.0, 2.0], 1).expect("finite");
        let found = silhouettes(&pairwise, &Partition::new(&[0]));
        let expected = ClusterError::OtherViews {
            expected: 2,
            found: 1,
        };
        assert_eq!(found, Err(expected));
    }
}
