//! Agglomerative hierarchical clustering; report section 2.2.1, algorithm 2.1.
//!
//! Every view is a cluster at first; the two that are nearest to each other are merged, until one is left. What was
//! merged, and how far apart it was, is the dendrogram.
//!
//! **Method.** By the crate kodama, which follows D. Müllner, *Modern hierarchical, agglomerative clustering algorithms*,
//! 2011. Deviation: (2.31) has the distance of mean vectors by any dissimilarity; it follows from those of the views for
//! Euclidean distances (and their squares) only, and others are refused.
//!
//! **Cost.** O(n²) time and memory; O(n³) time at worst with centroids.
//!
//! **Limits.** The centroid of a merger may be nearer to a third than the two were to each other: heights then fall
//! (inversions). Merges are in the order they were made, and cuts undo the last of them.

use kodama::{Method, linkage};
use serde::{Deserialize, Serialize};

use super::{ClusterError, Pairwise, Partition};
use crate::select::Dissimilarity;

/// How far apart two clusters are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Linkage {
    /// As the nearest two of their views; report (2.28).
    Single,
    /// As the farthest two; report (2.29).
    Complete,
    /// The mean over all pairs; report (2.30).
    Average,
    /// As their mean points; report (2.31).
    Centroid,
}

/// Two clusters become one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Merge {
    /// Which: 0…n − 1 are the views 1…n, n + i is what merge i made. Ascending.
    pub clusters: [u32; 2],
    /// How far apart they were, in the unit of the views' dissimilarity.
    pub height: f64,
}

/// Everything merged.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Dendrogram {
    merges: Vec<Merge>,
}

impl Linkage {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Single, Self::Complete, Self::Average, Self::Centroid];

    fn method(self) -> Method {
        match self {
            Self::Single => Method::Single,
            Self::Complete => Method::Complete,
            Self::Average => Method::Average,
            Self::Centroid => Method::Centroid,
        }
    }
}

impl Dendrogram {
    /// Merges all views.
    ///
    /// # Errors
    /// When linkage is by centroid, and views are compared by neither Euclidean distance nor its square.
    pub fn new(by: Linkage, pairwise: &Pairwise) -> Result<Self, ClusterError> {
        let dissimilarity = pairwise.dissimilarity();
        let mut values = pairwise.values().to_vec();
        // kodama takes distances, squares them itself where it needs squares, and gives distances back.
        let is_squared = match (by, dissimilarity) {
            (Linkage::Centroid, Dissimilarity::Ssd) => true,
            (Linkage::Single | Linkage::Complete | Linkage::Average, _)
            | (Linkage::Centroid, Dissimilarity::Euclid) => false,
            (Linkage::Centroid, _) => return Err(ClusterError::NoCentroids { dissimilarity }),
        };
        if is_squared {
            values.iter_mut().for_each(|value| *value = value.sqrt());
        }
        let steps = linkage(&mut values, pairwise.count(), by.method());
        let merge = |step: &kodama::Step<f64>| Merge {
            clusters: [step.cluster1 as u32, step.cluster2 as u32],
            height: match step.dissimilarity {
                // Rounding can leave less than nothing between the centroids of the same points, and a root of that.
                height if height.is_nan() => 0.0,
                height if is_squared => height * height,
                height => height,
            },
        };
        Ok(Self {
            merges: steps.steps().iter().map(merge).collect(),
        })
    }

    /// All merges, in the order they were made: n − 1.
    #[must_use]
    pub fn merges(&self) -> &[Merge] {
        &self.merges
    }

    /// Number of views, n.
    #[must_use]
    pub fn views(&self) -> usize {
        self.merges.len() + 1
    }

    /// The clusters there were before the last `clusters` − 1 merges.
    ///
    /// # Errors
    /// When there were never as many.
    pub fn cut(&self, clusters: usize) -> Result<Partition, ClusterError> {
        let n = self.views();
        if !(1..=n).contains(&clusters) {
            return Err(ClusterError::Clusters { clusters, views: n });
        }
        let kept = &self.merges[..n - clusters];
        // What every cluster became part of; later ones are known first.
        let mut top: Vec<usize> = (0..n + kept.len()).collect();
        for (index, merge) in kept.iter().enumerate().rev() {
            for part in merge.clusters {
                top[part as usize] = top[n + index];
            }
        }
        Ok(Partition::new(&top[..n]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a line: 1 and 2 are 1 apart, 6 and 8 are 2 apart, 15 is far away.
    const LINE: [f64; 5] = [1.0, 6.0, 2.0, 15.0, 8.0];

    fn dendrogram(by: Linkage, dissimilarity: Dissimilarity, points: &[f64]) -> Dendrogram {
        let pairwise = Pairwise::new(dissimilarity, points, 1).expect("finite");
        Dendrogram::new(by, &pairwise).expect("Euclidean")
    }

    fn heights(dendrogram: &Dendrogram) -> Vec<f64> {
        dendrogram
            .merges()
            .iter()
            .map(|merge| merge.height)
            .collect()
    }

    #[test]
    fn heights_are_those_of_the_formulas() {
        // Of {1, 2} and {6, 8}, then of those four and 15.
        for (by, third, fourth) in [
            (Linkage::Single, 4.0, 7.0),
            (Linkage::Complete, 7.0, 14.0),
            (Linkage::Average, 5.5, 10.75),
            (Linkage::Centroid, 5.5, 10.75),
        ] {
            let dendrogram = dendrogram(by, Dissimilarity::Euclid, &LINE);
            let found: Vec<[u32; 2]> = dendrogram.merges().iter().map(|m| m.clusters).collect();
            assert_eq!(found, [[0, 2], [1, 4], [5, 6], [3, 7]], "{by:?}");
            for (found, expected) in heights(&dendrogram)
                .into_iter()
                .zip([1.0, 2.0, third, fourth])
            {
                assert!((found - expected).abs() < 1e-12, "{by:?} {found}");
            }
        }
    }

    #[test]
    fn squared_distances_have_squared_heights() {
        let squared = dendrogram(Linkage::Centroid, Dissimilarity::Ssd, &LINE);
        for (found, expected) in heights(&squared)
            .into_iter()
            .zip([1.0, 4.0, 30.25, 115.5625])
        {
            assert!((found - expected).abs() < 1e-9, "{found}");
        }
    }

    #[test]
    fn cuts_have_as_many_clusters_as_asked_for() {
        let dendrogram = dendrogram(Linkage::Average, Dissimilarity::Euclid, &LINE);
        for (clusters, expected) in [
            (1, [0, 0, 0, 0, 0]),
            (2, [0, 0, 0, 1, 0]),
            (3, [0, 1, 0, 2, 1]),
            (4, [0, 1, 0, 2, 3]),
            (5, [0, 1, 2, 3, 4]),
        ] {
            let cut = dendrogram.cut(clusters).expect("as many");
            assert_eq!(cut.of(), expected);
            assert_eq!(cut.count() as usize, clusters);
        }
        for clusters in [0, 6] {
            let expected = ClusterError::Clusters { clusters, views: 5 };
            assert_eq!(dendrogram.cut(clusters), Err(expected));
        }
    }

    /// The corners of a triangle with sides of 10, √106 and √106: the middle of the first side is 9 from the third corner,
    /// nearer than the two were to each other.
    #[test]
    fn inversions_are_cut_in_the_order_of_merges() {
        let points = [0.0, 0.0, 10.0, 0.0, 5.0, 9.0];
        let pairwise = Pairwise::new(Dissimilarity::Euclid, &points, 2).expect("finite");
        let dendrogram = Dendrogram::new(Linkage::Centroid, &pairwise).expect("Euclidean");
        assert_eq!(heights(&dendrogram), [10.0, 9.0]);
        assert_eq!(dendrogram.cut(2).expect("two").of(), [0, 0, 1]);
        assert_eq!(dendrogram.cut(3).expect("three").of(), [0, 1, 2]);
    }

    #[test]
    fn views_that_are_the_same_merge_at_nothing() {
        for by in Linkage::ALL {
            let dendrogram = dendrogram(by, Dissimilarity::Euclid, &[0.1; 7]);
            assert_eq!(heights(&dendrogram), [0.0; 6], "{by:?}");
            assert_eq!(dendrogram.cut(4).expect("as many").count(), 4);
        }
    }

    #[test]
    fn a_single_view_is_a_cluster() {
        for by in Linkage::ALL {
            let dendrogram = dendrogram(by, Dissimilarity::Euclid, &[3.0]);
            assert_eq!(dendrogram.views(), 1);
            assert_eq!(dendrogram.cut(1).expect("one").of(), [0]);
        }
    }

    #[test]
    fn centroids_need_euclidean_distances() {
        let pairwise = Pairwise::new(Dissimilarity::Nssd, &LINE, 1).expect("finite");
        let refused = Dendrogram::new(Linkage::Centroid, &pairwise);
        let dissimilarity = Dissimilarity::Nssd;
        assert_eq!(refused, Err(ClusterError::NoCentroids { dissimilarity }));
        assert!(Dendrogram::new(Linkage::Average, &pairwise).is_ok());
    }
}
