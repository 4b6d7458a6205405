//! Views grouped by where they lie in the eigenspace: report section 4.1.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cell::SEED;
use crate::select::{
    Dissimilarity,
    cluster::{
        ClusterError, Dendrogram, Linkage, Merge, Pairwise, Partition, k_means, representatives,
        silhouette_curve, silhouettes,
    },
};

/// Numbers of k-means clusters that are shown view by view; the report's are 15.
const SHOWN: [usize; 5] = [2, 4, 8, 15, 30];

/// Dissimilarities that cophenetic correlation is compared for.
const COMPARED: [(&str, Dissimilarity); 3] = [
    ("euclid", Dissimilarity::Euclid),
    ("ssd", Dissimilarity::Ssd),
    ("nssd", Dissimilarity::Nssd),
];

/// The clusters of the candidates of a cell, by dimensions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clusters {
    /// By linkage, of Euclidean distances.
    pub dendrograms: BTreeMap<String, Vec<Vec<Joined>>>,
    /// Cophenetic correlation coefficients (4.1), by dissimilarity and linkage; `None` where there is none.
    pub ccc: BTreeMap<String, BTreeMap<String, Vec<Option<f64>>>>,
    /// By k-means.
    pub k_means: Vec<Means>,
}

/// Two clusters that are merged, and how far apart they were. Clusters 0…n−1 are the views 1…n; merge i makes cluster
/// n + i.
pub type Joined = (u32, u32, f32);

/// Clusters by k-means.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Means {
    /// For 1…n clusters: mean silhouette, median, and share of those below zero.
    pub curve: Vec<[f64; 3]>,
    /// Some numbers of clusters, view by view.
    pub cuts: BTreeMap<usize, Cut>,
}

/// A partition, and how well views fit in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cut {
    /// The cluster of every view, from 0.
    pub of: Vec<u32>,
    /// The silhouette of every view.
    pub silhouettes: Vec<f32>,
}

/// How views are grouped when a landmark is selected from every group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grouping {
    Linkage,
    KMeans,
}

impl Clusters {
    /// Clusters of candidates with these coordinates, by numbers of dimensions.
    ///
    /// # Errors
    /// When coordinates cannot be clustered.
    pub(super) fn of(spaces: &[(usize, Vec<f64>)]) -> Result<Self, ClusterError> {
        let found = spaces
            .par_iter()
            .map(|(k, points)| in_dimensions(points, *k))
            .collect::<Result<Vec<_>, _>>()?;
        let mut all = Self {
            dendrograms: BTreeMap::new(),
            ccc: BTreeMap::new(),
            k_means: Vec::new(),
        };
        for (trees, k_means) in found {
            for Tree {
                dissimilarity,
                linkage,
                dendrogram,
                ccc,
            } in trees
            {
                if dissimilarity == COMPARED[0].0 {
                    let merges = dendrogram.merges().iter().map(joined).collect();
                    all.dendrograms
                        .entry(linkage.clone())
                        .or_default()
                        .push(merges);
                }
                let by_linkage = all.ccc.entry(dissimilarity.to_owned()).or_default();
                by_linkage.entry(linkage).or_default().push(ccc);
            }
            all.k_means.push(k_means);
        }
        Ok(all)
    }

    /// Whether its lengths are those of `views` candidates in so many numbers of dimensions.
    pub(super) fn is_sound(&self, views: usize, dimensions: usize) -> bool {
        let is_tree =
            |merges: &Vec<Joined>| merges.len() + 1 == views && is_merged_once(merges, views);
        let is_cut = |(count, cut): (&usize, &Cut)| {
            cut.of.len() == views
                && cut.silhouettes.len() == views
                && cut.of.iter().all(|&cluster| (cluster as usize) < *count)
        };
        self.dendrograms
            .values()
            .all(|trees| trees.len() == dimensions && trees.iter().all(is_tree))
            && self
                .ccc
                .values()
                .flat_map(BTreeMap::values)
                .all(|by| by.len() == dimensions)
            && self.k_means.len() == dimensions
            && self
                .k_means
                .iter()
                .all(|means| means.curve.len() == views && means.cuts.iter().all(is_cut))
    }
}

/// Whether every cluster is there when it is merged, and is merged once.
fn is_merged_once(merges: &[Joined], views: usize) -> bool {
    let mut merged = vec![false; views + merges.len()];
    merges.iter().zip(views..).all(|(&(a, b, _), made)| {
        [a, b].into_iter().all(|cluster| {
            let cluster = cluster as usize;
            cluster < made && !std::mem::replace(&mut merged[cluster], true)
        })
    })
}

/// One landmark from each of `count` groups; `None` when there are fewer groups.
pub(super) fn landmarks(
    grouping: Grouping,
    points: &[f64],
    dimensions: usize,
    count: usize,
) -> Option<Vec<u32>> {
    let partition = match grouping {
        Grouping::Linkage => {
            let pairwise = Pairwise::new(Dissimilarity::Euclid, points, dimensions).ok()?;
            Dendrogram::new(Linkage::Average, &pairwise)
                .ok()?
                .cut(count)
                .ok()?
        }
        Grouping::KMeans => k_means(points, dimensions, count, SEED).ok()?.partition,
    };
    let landmarks = representatives(points, dimensions, &partition).ok()?;
    (landmarks.len() == count).then_some(landmarks)
}

/// A dendrogram of one dissimilarity and linkage.
struct Tree {
    dissimilarity: &'static str,
    linkage: String,
    dendrogram: Dendrogram,
    ccc: Option<f64>,
}

fn in_dimensions(points: &[f64], k: usize) -> Result<(Vec<Tree>, Means), ClusterError> {
    let mut trees = Vec::new();
    for (dissimilarity, of) in COMPARED {
        let pairwise = Pairwise::new(of, points, k)?;
        for linkage in Linkage::ALL {
            let dendrogram = match Dendrogram::new(linkage, &pairwise) {
                Err(ClusterError::NoCentroids { .. }) => continue,
                dendrogram => dendrogram?,
            };
            trees.push(Tree {
                dissimilarity,
                linkage: format!("{linkage:?}").to_lowercase(),
                ccc: dendrogram.cophenetic_correlation(&pairwise),
                dendrogram,
            });
        }
    }
    let pairwise = Pairwise::new(Dissimilarity::Ssd, points, k)?;
    let curve = silhouette_curve(points, k, SEED)?;
    let mut cuts = BTreeMap::new();
    for clusters in SHOWN
        .into_iter()
        .filter(|&clusters| clusters <= pairwise.count())
    {
        let partition: Partition = k_means(points, k, clusters, SEED)?.partition;
        let silhouettes = silhouettes(&pairwise, &partition)?;
        let cut = Cut {
            of: partition.of().to_vec(),
            silhouettes: silhouettes.into_iter().map(|one| one as f32).collect(),
        };
        cuts.insert(clusters, cut);
    }
    let curve = curve.iter().map(|all| [all.mean, all.median, all.negative]);
    Ok((
        trees,
        Means {
            curve: curve.collect(),
            cuts,
        },
    ))
}

fn joined(merge: &Merge) -> Joined {
    let [a, b] = merge.clusters;
    (a, b, merge.height as f32)
}
