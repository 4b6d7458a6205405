//! A landmark for every cluster.
//!
//! The report (4.1.3) warns of the view at the centroid's place on the map, which may be far from every view of the
//! cluster; here it is a view of the cluster that is nearest to the centroid in the eigenspace.

use std::cmp::Reverse;

use super::{ClusterError, Partition, check};
use crate::select::Dissimilarity;

/// Of every cluster the view nearest to its mean point, 1-based, the first of several; largest clusters first, and of
/// clusters of the same size the one with the lowest number.
///
/// # Errors
/// When there is no point, rows are not whole, numbers are not finite or too large, or the partition is of another number
/// of views.
pub fn representatives(
    points: &[f64],
    dimensions: usize,
    partition: &Partition,
) -> Result<Vec<u32>, ClusterError> {
    let n = check(points, dimensions)?;
    if partition.of().len() != n {
        return Err(ClusterError::OtherViews {
            expected: n,
            found: partition.of().len(),
        });
    }
    let centroids = partition.centroids(points, dimensions);
    let mut nearest = vec![(f64::INFINITY, 0); partition.count() as usize];
    let rows = points.chunks_exact(dimensions).zip(partition.of());
    for ((point, &cluster), view) in rows.zip(1..) {
        let centroid = &centroids[cluster as usize * dimensions..][..dimensions];
        let distance = Dissimilarity::Ssd.between(point, centroid);
        let nearest = &mut nearest[cluster as usize];
        if distance < nearest.0 {
            *nearest = (distance, view);
        }
    }
    let sizes = partition.sizes();
    let mut clusters: Vec<usize> = (0..sizes.len()).collect();
    clusters.sort_by_key(|&cluster| Reverse(sizes[cluster]));
    Ok(clusters
        .into_iter()
        .map(|cluster| nearest[cluster].1)
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_cluster_comes_first() {
        // {20, 24}, {0, 1, 5}, {50}, {80, 82}: of two, the first is as near as the second.
        let points = [20.0, 0.0, 1.0, 50.0, 5.0, 24.0, 80.0, 82.0];
        let partition = Partition::new(&[0, 1, 1, 2, 1, 0, 3, 3]);
        assert_eq!(
            representatives(&points, 1, &partition),
            Ok(vec![3, 1, 7, 4])
        );
    }

    #[test]
    fn partitions_of_other_views_are_refused() {
        let found = representatives(&[1.0, 2.0], 1, &Partition::new(&[0]));
        let expected = ClusterError::OtherViews {
            expected: 2,
            found: 1,
        };
        assert_eq!(found, Err(expected));
    }
}
