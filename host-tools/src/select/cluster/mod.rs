//! Views grouped by where they lie in the eigenspace, and landmarks from the groups; report sections 2.2 and 4.1.
//!
//! | file | does |
//! | --- | --- |
//! | `pairwise` | the dissimilarity of every pair |
//! | `hierarchical` | what is merged with what, at which height (report 2.2.1) |
//! | `cophenetic` | how far a dendrogram distorts distances (report (4.1), corrected) |
//! | `k_means` | as many groups as asked for, small in themselves (report 2.2.2) |
//! | `silhouette` | how well views fit into their groups (report (4.2), corrected) |
//! | `representatives` | a landmark for every group |
//!
//! **Notation.** n points of k coordinates, one row per view; views are numbered from 1, clusters and rows from 0.
//!
//! **Limits.** The report found no natural number of clusters on its map, and views of one cluster all over the map: this
//! is here to look at, and to compare other selections with.

mod cophenetic;
mod hierarchical;
mod k_means;
mod pairwise;
mod representatives;
mod silhouette;

pub use hierarchical::{Dendrogram, Linkage, Merge};
pub use k_means::{KMeans, k_means};
pub use pairwise::Pairwise;
pub use representatives::representatives;
pub use silhouette::{Silhouettes, silhouette_curve, silhouettes};

use super::Dissimilarity;

/// The largest coordinate and dissimilarity: the square of as many as there may be stays finite.
const LARGEST: f64 = 1e140;

/// Every view in one cluster of some.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Partition {
    of: Vec<u32>,
    count: u32,
}

/// Why points cannot be clustered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ClusterError {
    /// There is no point.
    #[error("expected at least one view, found none")]
    Empty,
    /// The coordinates are not whole rows.
    #[error("expected rows of {dimensions} coordinates, found {numbers} numbers")]
    Ragged {
        /// Coordinates per point, k.
        dimensions: usize,
        /// Numbers there are.
        numbers: usize,
    },
    /// A coordinate or a dissimilarity is not a number, or is too large.
    #[error("expected coordinates up to 1e140, found others in view {view}")]
    NotFinite {
        /// The view, 1-based.
        view: usize,
    },
    /// There are not as many clusters.
    #[error("expected 1 to {views} clusters of {views} views, found {clusters}")]
    Clusters {
        /// Clusters asked for.
        clusters: usize,
        /// Views there are, n.
        views: usize,
    },
    /// Clusters have centroids in Euclidean space only.
    #[error("centroid linkage needs Euclidean distances or their squares, found {dissimilarity:?}")]
    NoCentroids {
        /// What the views were compared by.
        dissimilarity: Dissimilarity,
    },
    /// Two things that belong together are of different numbers of views.
    #[error("expected a partition of {expected} views, found one of {found}")]
    OtherViews {
        /// Views there are, n.
        expected: usize,
        /// Views of the partition.
        found: usize,
    },
}

impl Partition {
    /// Views with the same label, whatever it is, are a cluster. Clusters are numbered by their first views.
    ///
    /// ```
    /// use eigenmark::select::cluster::Partition;
    /// let partition = Partition::new(&[7, 2, 7, 9]);
    /// assert_eq!(partition.of(), [0, 1, 0, 2]);
    /// assert_eq!(partition.members(0), [1, 3]);
    /// ```
    #[must_use]
    pub fn new(labels: &[usize]) -> Self {
        let mut numbers = std::collections::HashMap::new();
        let of = labels.iter().map(|label| {
            let next = numbers.len() as u32;
            *numbers.entry(label).or_insert(next)
        });
        Self {
            of: of.collect(),
            count: numbers.len() as u32,
        }
    }

    /// The cluster of every view: n numbers from 0.
    #[must_use]
    pub fn of(&self) -> &[u32] {
        &self.of
    }

    /// Number of clusters, c.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Views of every cluster: c numbers.
    #[must_use]
    pub fn sizes(&self) -> Vec<u32> {
        let mut sizes = vec![0; self.count as usize];
        for &cluster in &self.of {
            sizes[cluster as usize] += 1;
        }
        sizes
    }

    /// The views of a cluster, 1-based, ascending; none when there is no such cluster.
    #[must_use]
    pub fn members(&self, cluster: u32) -> Vec<u32> {
        let views = (1..).zip(&self.of);
        let members = views.filter(|(_, of)| **of == cluster);
        members.map(|(view, _)| view).collect()
    }

    /// Mean points of the clusters: c rows of k.
    fn centroids(&self, points: &[f64], dimensions: usize) -> Vec<f64> {
        let mut centroids = vec![0.0; self.count as usize * dimensions];
        for (point, &cluster) in points.chunks_exact(dimensions).zip(&self.of) {
            let centroid = &mut centroids[cluster as usize * dimensions..][..dimensions];
            for (sum, g) in centroid.iter_mut().zip(point) {
                *sum += g;
            }
        }
        let rows = centroids.chunks_exact_mut(dimensions);
        for (centroid, size) in rows.zip(self.sizes()) {
            for sum in centroid {
                *sum /= f64::from(size);
            }
        }
        centroids
    }
}

/// The number of points, n.
fn check(points: &[f64], dimensions: usize) -> Result<usize, ClusterError> {
    if points.is_empty() {
        return Err(ClusterError::Empty);
    }
    if dimensions == 0 || !points.len().is_multiple_of(dimensions) {
        return Err(ClusterError::Ragged {
            dimensions,
            numbers: points.len(),
        });
    }
    // Not the same as being larger: no comparison holds for what is not a number.
    let is_sound = |g: &f64| g.abs() <= LARGEST;
    match points.iter().position(|g| !is_sound(g)) {
        Some(index) => Err(ClusterError::NotFinite {
            view: index / dimensions + 1,
        }),
        None => Ok(points.len() / dimensions),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unusable_points_are_refused() {
        assert_eq!(check(&[], 2), Err(ClusterError::Empty));
        for dimensions in [0, 2] {
            let expected = ClusterError::Ragged {
                dimensions,
                numbers: 3,
            };
            assert_eq!(check(&[1.0; 3], dimensions), Err(expected));
        }
        for bad in [f64::NAN, f64::INFINITY, -1e141] {
            let found = check(&[1.0, 2.0, 3.0, bad], 2);
            assert_eq!(found, Err(ClusterError::NotFinite { view: 2 }));
        }
        assert_eq!(check(&[1.0; 6], 2), Ok(3));
    }

    #[test]
    fn centroids_are_means() {
        let partition = Partition::new(&[5, 5, 1]);
        let centroids = partition.centroids(&[0.0, 2.0, 4.0, 4.0, 9.0, 9.0], 2);
        assert_eq!(centroids, [2.0, 3.0, 9.0, 9.0]);
    }
}
