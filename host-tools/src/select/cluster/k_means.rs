//! K-means clustering with SSD; report section 2.2.2, algorithm 2.2.
//!
//! **Notation.** n points of k coordinates, c clusters with centroids μ, SSD the sum of squared distances of all points to
//! the centroids of their clusters.
//!
//! **Method.**
//! 1. *Seeds* are drawn among the points by k-means++ (D. Arthur, S. Vassilvitskii, *k-means++: the advantages of careful
//!    seeding*, 2007): each with a probability in proportion to its squared distance from those before. Of 2 + ⌊ln c⌋ drawn
//!    like that the one is taken that leaves the least SSD, as scikit-learn does.
//! 2. *Rounds* are those of linfa-clustering, until centroids hardly move. It counts the old centroid as a point of the
//!    cluster (m_k-means), so that no cluster is ever empty, and centroids get to the means of their clusters only little by
//!    little.
//! 3. *Last rounds* take the means themselves, until no view changes its cluster (algorithm 2.2, line 6). A cluster that
//!    loses its last view takes the one that is farthest from its centroid.
//!
//! Deviations from what linfa offers, by which 83 calls for 1…83 clusters of 83 points of 25 coordinates take 3.3 s of
//! processor time, optimized as tests are: seeds are drawn here, because linfa measures the distance to all earlier seeds
//! for every new one; and distances are summed here, because linfa's go through generic views of arrays.
//!
//! **Cost.** O(n·c·k) per round; the 83 calls take 0.11 s.
//!
//! **Limits.** As good as its seeds: a local minimum of SSD.

use linfa::{DatasetBase, traits::Fit};
use linfa_clustering::KMeansInit;
use linfa_nn::distance::Distance;
use ndarray::{Array2, ArrayView, ArrayView2, Dimension};
use rand::{Rng, RngExt};
use rand_xoshiro::{Xoshiro256Plus, rand_core::SeedableRng};

use super::{ClusterError, Partition, check};
use crate::simulate::seeded;

/// How far all centroids may move in linfa's last round, as a share of how far all points are from the first seed: a few
/// last rounds are cheaper than creeping nearer.
const TOLERANCE: f64 = 0.05;

/// Rounds of each kind, at most: in practice some ten.
const MAX_ROUNDS: u64 = 300;

/// Clusters around centroids.
#[derive(Clone, Debug, PartialEq)]
pub struct KMeans {
    /// The cluster of every view: of its nearest centroid.
    pub partition: Partition,
    /// Means of the clusters: c rows of k.
    pub centroids: Vec<f64>,
    /// Sum of squared distances of all points to the centroids of their clusters.
    pub ssd: f64,
}

/// SSD as linfa asks for it: points are rows, and rows are contiguous.
#[derive(Clone, Debug)]
struct Squared;

impl Distance<f64> for Squared {
    fn distance<D: Dimension>(&self, a: ArrayView<f64, D>, b: ArrayView<f64, D>) -> f64 {
        self.rdistance(a, b).sqrt()
    }

    #[inline]
    fn rdistance<D: Dimension>(&self, a: ArrayView<f64, D>, b: ArrayView<f64, D>) -> f64 {
        match (a.as_slice(), b.as_slice()) {
            (Some(a), Some(b)) => squared_distance(a, b),
            _ => a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum(),
        }
    }

    fn rdist_to_dist(&self, squared: f64) -> f64 {
        squared.sqrt()
    }

    fn dist_to_rdist(&self, distance: f64) -> f64 {
        distance * distance
    }
}

/// Groups points, rows of `dimensions` coordinates, into `clusters` clusters; the same for the same seed. Where fewer
/// points are different there are fewer clusters, one for each.
///
/// ```
/// use eigenmark::select::cluster::k_means;
/// let found = k_means(&[0.0, 10.0, 2.0, 14.0, 10.0], 1, 2, 1)?;
/// assert_eq!(found.partition.of(), [0, 1, 0, 1, 1]);
/// assert_eq!(found.centroids[0], 1.0);
/// assert!((found.ssd - (2.0 + 32.0 / 3.0)).abs() < 1e-12);
/// # Ok::<(), eigenmark::select::cluster::ClusterError>(())
/// ```
///
/// # Errors
/// When there is no point, rows are not whole, numbers are not finite or too large, or there are fewer points than
/// clusters.
pub fn k_means(
    points: &[f64],
    dimensions: usize,
    clusters: usize,
    seed: u64,
) -> Result<KMeans, ClusterError> {
    let n = check(points, dimensions)?;
    if !(1..=n).contains(&clusters) {
        return Err(ClusterError::Clusters { clusters, views: n });
    }
    let mut random = seeded(seed, clusters as u64);
    let seeds = Seeds::draw(points, dimensions, clusters, &mut random);
    let count = seeds.centroids.len() / dimensions;
    let centroids = if count == n || seeds.spread == 0.0 {
        seeds.centroids
    } else {
        rounds(points, dimensions, &seeds)
    };
    Ok(last_rounds(points, dimensions, centroids))
}

/// Where clusters start.
struct Seeds {
    /// As many different points as asked for, or as there are: rows of k.
    centroids: Vec<f64>,
    /// Sum of squared distances of all points to the first.
    spread: f64,
}

impl Seeds {
    fn draw(points: &[f64], dimensions: usize, clusters: usize, random: &mut impl Rng) -> Self {
        let n = points.len() / dimensions;
        let row = |index: usize| &points[index * dimensions..][..dimensions];
        let first = random.random_range(0..n);
        let mut centroids = row(first).to_vec();
        let mut nearest = vec![f64::INFINITY; n];
        let spread = approach(points, row(first), &mut nearest);
        let (mut sum, mut trial, mut best) = (spread, nearest.clone(), nearest.clone());
        let trials = 2 + (clusters as f64).ln() as u32;
        for _ in 1..clusters {
            // Points that are seeds already have no share of the sum.
            let Some(last) = nearest.iter().rposition(|&distance| distance > 0.0) else {
                break;
            };
            let mut least = (f64::INFINITY, last);
            for _ in 0..trials {
                let mut left = sum * random.random_range(0.0..1.0);
                let is_drawn = |distance: &f64| {
                    left -= distance;
                    left < 0.0
                };
                let drawn = nearest.iter().position(is_drawn).unwrap_or(last);
                trial.copy_from_slice(&nearest);
                let left_over = approach(points, row(drawn), &mut trial);
                if left_over < least.0 {
                    least = (left_over, drawn);
                    std::mem::swap(&mut trial, &mut best);
                }
            }
            nearest.copy_from_slice(&best);
            sum = least.0;
            centroids.extend(row(least.1));
        }
        Self { centroids, spread }
    }
}

/// What is left of the squared distances to the nearest seed with another one; and their sum.
fn approach(points: &[f64], seed: &[f64], nearest: &mut [f64]) -> f64 {
    let rows = points.chunks_exact(seed.len()).zip(nearest);
    rows.map(|(point, nearest)| {
        *nearest = nearest.min(squared_distance(point, seed));
        *nearest
    })
    .sum()
}

/// Rounds of m_k-means; the seeds themselves should linfa refuse.
fn rounds(points: &[f64], dimensions: usize, seeds: &Seeds) -> Vec<f64> {
    let shape = |numbers: &[f64]| (numbers.len() / dimensions, dimensions);
    let records = ArrayView2::from_shape(shape(points), points);
    let precomputed = Array2::from_shape_vec(shape(&seeds.centroids), seeds.centroids.clone());
    let (Ok(records), Ok(precomputed)) = (records, precomputed) else {
        return seeds.centroids.clone();
    };
    // Asked for, and not used: seeds are drawn already.
    let random = Xoshiro256Plus::seed_from_u64(0);
    let found = linfa_clustering::KMeans::params_with(precomputed.nrows(), random, Squared)
        .n_runs(1)
        .max_n_iterations(MAX_ROUNDS)
        .tolerance(TOLERANCE * seeds.spread.sqrt())
        .init_method(KMeansInit::Precomputed(precomputed))
        .fit(&DatasetBase::from(records));
    match found {
        Ok(found) => found.centroids().iter().copied().collect(),
        Err(_) => seeds.centroids.clone(),
    }
}

/// From centroids to clusters whose means they are.
fn last_rounds(points: &[f64], dimensions: usize, mut centroids: Vec<f64>) -> KMeans {
    let mut labels = vec![usize::MAX; points.len() / dimensions];
    for _ in 0..MAX_ROUNDS {
        let is_settled = assign(points, dimensions, &centroids, &mut labels);
        centroids = means(points, dimensions, centroids.len() / dimensions, &labels);
        if is_settled {
            break;
        }
    }
    let partition = Partition::new(&labels);
    // In the order in which the partition numbers them.
    let centroids = partition.centroids(points, dimensions);
    let rows = points.chunks_exact(dimensions).zip(partition.of());
    let ssd = rows
        .map(|(point, &cluster)| {
            squared_distance(
                point,
                &centroids[cluster as usize * dimensions..][..dimensions],
            )
        })
        .sum();
    KMeans {
        partition,
        centroids,
        ssd,
    }
}

/// Gives every point to its nearest centroid, the first of several, and every centroid a point. Whether nothing changed.
fn assign(points: &[f64], dimensions: usize, centroids: &[f64], labels: &mut [usize]) -> bool {
    let mut sizes = vec![0_usize; centroids.len() / dimensions];
    let mut distances = Vec::with_capacity(labels.len());
    let mut is_settled = true;
    for (point, label) in points.chunks_exact(dimensions).zip(labels.iter_mut()) {
        let (nearest, distance) = nearest(point, centroids);
        is_settled &= *label == nearest;
        *label = nearest;
        sizes[nearest] += 1;
        distances.push(distance);
    }
    for empty in 0..sizes.len() {
        if sizes[empty] > 0 {
            continue;
        }
        let spare = (0..labels.len()).filter(|&index| sizes[labels[index]] > 1);
        let farthest = spare.max_by(|&a, &b| distances[a].total_cmp(&distances[b]));
        if let Some(index) = farthest.filter(|&index| distances[index] > 0.0) {
            sizes[labels[index]] -= 1;
            sizes[empty] += 1;
            (labels[index], distances[index]) = (empty, 0.0);
            is_settled = false;
        }
    }
    is_settled
}

/// The centroid nearest to a point, the first of several, and its squared distance.
fn nearest(point: &[f64], centroids: &[f64]) -> (usize, f64) {
    let rows = centroids.chunks_exact(point.len()).enumerate();
    rows.fold((0, f64::INFINITY), |(nearest, least), (index, centroid)| {
        let distance = squared_distance(point, centroid);
        if distance < least {
            (index, distance)
        } else {
            (nearest, least)
        }
    })
}

/// Mean points of `count` labels; of a label that no point has, infinitely far away.
fn means(points: &[f64], dimensions: usize, count: usize, labels: &[usize]) -> Vec<f64> {
    let mut means = vec![0.0; count * dimensions];
    let mut sizes = vec![0.0; count];
    for (point, &label) in points.chunks_exact(dimensions).zip(labels) {
        sizes[label] += 1.0;
        let mean = &mut means[label * dimensions..][..dimensions];
        for (sum, g) in mean.iter_mut().zip(point) {
            *sum += g;
        }
    }
    for (mean, size) in means.chunks_exact_mut(dimensions).zip(sizes) {
        for sum in mean {
            *sum = if size > 0.0 {
                *sum / size
            } else {
                f64::INFINITY
            };
        }
    }
    means
}

/// ‖a − b‖², four sums at a time.
#[inline]
fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    let (a_fours, a_rest) = a.as_chunks::<4>();
    let (b_fours, b_rest) = b.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (a, b) in a_fours.iter().zip(b_fours) {
        for i in 0..4 {
            sums[i] += (a[i] - b[i]) * (a[i] - b[i]);
        }
    }
    let rest = a_rest.iter().zip(b_rest);
    let rest: f64 = rest.map(|(a, b)| (a - b) * (a - b)).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random_points(count: usize, dimensions: usize) -> Vec<f64> {
        let mut random = seeded(4, 2);
        let numbers = (0..count * dimensions).map(|_| random.random_range(-100.0..100.0));
        numbers.collect()
    }

    #[test]
    fn groups_that_are_apart_are_found() {
        // Three groups of three around (0, 0), (100, 0) and (0, 100).
        let offsets = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let middles = [[0.0, 0.0], [100.0, 0.0], [0.0, 100.0]];
        let points: Vec<f64> = offsets
            .iter()
            .flat_map(|offset| middles.map(|at| [at[0] + offset[0], at[1] + offset[1]]))
            .flatten()
            .collect();
        for seed in 0..20 {
            let found = k_means(&points, 2, 3, seed).expect("finite");
            assert_eq!(found.partition.of(), [0, 1, 2, 0, 1, 2, 0, 1, 2], "{seed}");
            // 2/3 along each axis, of each group.
            assert!((found.ssd - 4.0).abs() < 1e-9, "{}", found.ssd);
        }
    }

    #[test]
    fn every_view_is_nearest_to_the_mean_of_its_cluster() {
        let points = random_points(83, 5);
        for clusters in [2, 7, 30, 60, 82] {
            let found = k_means(&points, 5, clusters, 9).expect("finite");
            assert_eq!(found.partition.count() as usize, clusters);
            assert_eq!(found.centroids, found.partition.centroids(&points, 5));
            for (point, &of) in points.chunks_exact(5).zip(found.partition.of()) {
                assert_eq!(nearest(point, &found.centroids).0, of as usize);
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_clusters() {
        let points = random_points(83, 3);
        let alone = k_means(&points, 3, 12, 5);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build();
        let among_others = pool
            .expect("threads")
            .install(|| k_means(&points, 3, 12, 5));
        assert_eq!(alone, among_others);
        assert_ne!(alone, k_means(&points, 3, 12, 6));
    }

    #[test]
    fn one_cluster_has_all_and_n_have_one_each() {
        let points = [3.0, 1.0, 8.0];
        let one = k_means(&points, 1, 1, 1).expect("finite");
        assert_eq!((one.partition.of(), one.ssd), (&[0, 0, 0][..], 26.0));
        let three = k_means(&points, 1, 3, 1).expect("finite");
        assert_eq!((three.partition.of(), three.ssd), (&[0, 1, 2][..], 0.0));
        assert_eq!(three.centroids, points);
    }

    #[test]
    fn points_that_are_the_same_stay_together() {
        let points = [1.0, 5.0, 1.0, 5.0, 1.0];
        for clusters in 2..=5 {
            let found = k_means(&points, 1, clusters, 3).expect("finite");
            assert_eq!(found.partition.of(), [0, 1, 0, 1, 0]);
            assert_eq!(found.ssd, 0.0);
        }
        let same = k_means(&[0.1; 9], 3, 3, 1).expect("finite");
        assert_eq!(same.partition.of(), [0, 0, 0]);
    }

    #[test]
    fn a_cluster_that_loses_its_views_takes_the_farthest() {
        // Nothing is nearest to the third centroid.
        let found = last_rounds(&[0.0, 1.0, 9.0, 10.0, 20.0], 1, vec![0.5, 9.5, 1000.0]);
        assert_eq!(found.partition.of(), [0, 0, 1, 1, 2]);
    }

    #[test]
    fn more_clusters_than_points_are_refused() {
        for clusters in [0, 3] {
            let found = k_means(&[1.0, 2.0], 1, clusters, 1);
            assert_eq!(found, Err(ClusterError::Clusters { clusters, views: 2 }));
        }
    }
}
