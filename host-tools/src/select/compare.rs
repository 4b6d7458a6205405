//! How much two rankings of candidates agree, and how stable a sequence of rankings is.
//!
//! **What and why.** The report compares rankings of different numbers of dimensions (section 3.3, `compare_ranks` of
//! table C.3): do the same landmarks come first?
//!
//! **Notation.** A ranking lists candidate numbers, best first. Full rankings list the same candidates.
//!
//! **Method.** [`overlap`] is the share of the first l that two rankings have in common, whatever their order.
//! [`average_overlap`] is its mean over depths 1 … l, so that the front counts more. [`kendall_tau`] counts pairs in
//! the same order less pairs in opposite order, [`spearman_rho`] correlates positions; both are 1 for equal rankings
//! and −1 for reversed ones. Rankings have no ties, so that neither needs a correction.
//!
//! **Cost.** O(n·log n) for Kendall's τ (inversions counted while merging), O(n) for the others.

use std::collections::{HashMap, HashSet};

use serde::Serialize;

/// Why two rankings cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// Less is ranked than is compared.
    #[error(
        "a comparison of the first {needed} candidates needs as many, and a ranking has {have}"
    )]
    TooShort {
        /// How many are compared.
        needed: usize,
        /// How many the shorter ranking lists.
        have: usize,
    },
    /// The first none of two rankings agree in nothing, or in everything.
    #[error("the first 0 candidates of rankings cannot be compared")]
    NothingCompared,
    /// Full rankings must list the same candidates.
    #[error("candidate {candidate} is in one of the rankings only")]
    OnlyInOne {
        /// One that is in one only.
        candidate: u32,
    },
    /// A candidate has one place in a ranking.
    #[error("candidate {candidate} is ranked twice")]
    Repeated {
        /// The first that is.
        candidate: u32,
    },
    /// Neighbors need two rankings.
    #[error("stability needs at least 2 rankings, and there are {have}")]
    TooFewRankings {
        /// How many there are.
        have: usize,
    },
}

/// How much rankings in a sequence agree, such as those of 1, 2, 3 … dimensions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stability {
    /// The [`overlap`] of every ranking (row) with every ranking (column).
    pub overlaps: Vec<Vec<f64>>,
    /// The mean overlap of each ranking and the next.
    pub mean_of_neighbors: f64,
}

/// The share of the first `first` candidates that two rankings have in common.
///
/// ```
/// use eigenmark::select::overlap;
/// assert_eq!(overlap(&[4, 2, 7, 1], &[2, 4, 1, 7], 2), Ok(1.0));
/// assert_eq!(overlap(&[4, 2, 7, 1], &[2, 3, 4, 5], 4), Ok(0.5));
/// ```
///
/// # Errors
/// When nothing is compared, a ranking is shorter than `first`, or a candidate comes twice in what is compared.
pub fn overlap(one: &[u32], other: &[u32], first: usize) -> Result<f64, CompareError> {
    let one = distinct(front(one, first)?)?;
    let other = distinct(front(other, first)?)?;
    Ok(one.intersection(&other).count() as f64 / first as f64)
}

/// The mean of [`overlap`] over the depths 1 … `first`.
///
/// ```
/// use eigenmark::select::average_overlap;
/// // 0 of 1, 2 of 2, 2 of 3.
/// assert_eq!(average_overlap(&[4, 2, 7], &[2, 4, 1], 3), Ok((0.0 + 1.0 + 2.0 / 3.0) / 3.0));
/// ```
///
/// # Errors
/// As [`overlap`].
pub fn average_overlap(one: &[u32], other: &[u32], first: usize) -> Result<f64, CompareError> {
    let (one, other) = (front(one, first)?, front(other, first)?);
    distinct(one)?;
    distinct(other)?;
    let mut seen = HashSet::with_capacity(2 * first);
    let mut shared = 0_usize;
    let mut sum = 0.0;
    for (depth, pair) in one.iter().zip(other).enumerate() {
        for candidate in [pair.0, pair.1] {
            shared += usize::from(!seen.insert(*candidate));
        }
        sum += shared as f64 / (depth + 1) as f64;
    }
    Ok(sum / first as f64)
}

/// Kendall's τ of two full rankings.
///
/// ```
/// use eigenmark::select::kendall_tau;
/// assert_eq!(kendall_tau(&[3, 1, 2], &[2, 1, 3]), Ok(-1.0));
/// // Of 6 pairs, only 2 and 4 are in opposite order.
/// assert_eq!(kendall_tau(&[1, 2, 4, 3], &[1, 4, 2, 3]), Ok(4.0 / 6.0));
/// ```
///
/// # Errors
/// When there are fewer than two candidates, or the rankings do not list the same ones once each.
pub fn kendall_tau(one: &[u32], other: &[u32]) -> Result<f64, CompareError> {
    let mut positions = positions_in(one, other)?;
    let count = positions.len() as f64;
    let pairs = count * (count - 1.0) / 2.0;
    let opposite = sort_and_count_inversions(&mut positions) as f64;
    Ok((pairs - 2.0 * opposite) / pairs)
}

/// Spearman's ρ of two full rankings.
///
/// ```
/// use eigenmark::select::spearman_rho;
/// assert_eq!(spearman_rho(&[3, 1, 2], &[2, 1, 3]), Ok(-1.0));
/// // Two positions differ by 1: 1 − 6·2/(4·15).
/// assert_eq!(spearman_rho(&[1, 2, 4, 3], &[1, 4, 2, 3]), Ok(0.8));
/// ```
///
/// # Errors
/// As [`kendall_tau`].
pub fn spearman_rho(one: &[u32], other: &[u32]) -> Result<f64, CompareError> {
    let positions = positions_in(one, other)?;
    let squares: f64 = positions
        .iter()
        .enumerate()
        .map(|(here, &there)| (here as f64 - there as f64).powi(2))
        .sum();
    let count = positions.len() as f64;
    Ok(1.0 - 6.0 * squares / (count * (count * count - 1.0)))
}

/// How much the first `first` candidates of `rankings` agree.
///
/// ```
/// use eigenmark::select::stability;
/// let stability = stability(&[[1, 2], [2, 1], [2, 3]], 2).unwrap();
/// assert_eq!(stability.mean_of_neighbors, 0.75);
/// assert_eq!(stability.overlaps[0], [1.0, 1.0, 0.5]);
/// ```
///
/// # Errors
/// When there are fewer than two rankings, or two cannot be compared by [`overlap`].
pub fn stability<R: AsRef<[u32]>>(rankings: &[R], first: usize) -> Result<Stability, CompareError> {
    if rankings.len() < 2 {
        return Err(CompareError::TooFewRankings {
            have: rankings.len(),
        });
    }
    let row = |one: &R| {
        let others = rankings.iter();
        others
            .map(|other| overlap(one.as_ref(), other.as_ref(), first))
            .collect::<Result<Vec<f64>, CompareError>>()
    };
    let overlaps = rankings.iter().map(row).collect::<Result<Vec<_>, _>>()?;
    let neighbors = (1..rankings.len()).map(|index| overlaps[index - 1][index]);
    let mean_of_neighbors = neighbors.sum::<f64>() / (rankings.len() - 1) as f64;
    Ok(Stability {
        overlaps,
        mean_of_neighbors,
    })
}

fn front(ranking: &[u32], first: usize) -> Result<&[u32], CompareError> {
    if first == 0 {
        return Err(CompareError::NothingCompared);
    }
    ranking.get(..first).ok_or(CompareError::TooShort {
        needed: first,
        have: ranking.len(),
    })
}

fn distinct(ranking: &[u32]) -> Result<HashSet<u32>, CompareError> {
    let mut seen = HashSet::with_capacity(ranking.len());
    for &candidate in ranking {
        if !seen.insert(candidate) {
            return Err(CompareError::Repeated { candidate });
        }
    }
    Ok(seen)
}

/// Where each candidate of `one`, in order, stands in `other`: both are full and list the same.
fn positions_in(one: &[u32], other: &[u32]) -> Result<Vec<usize>, CompareError> {
    let have = one.len().min(other.len());
    if have < 2 {
        return Err(CompareError::TooShort { needed: 2, have });
    }
    let listed = distinct(one)?;
    distinct(other)?;
    if let Some(&candidate) = other.iter().find(|candidate| !listed.contains(candidate)) {
        return Err(CompareError::OnlyInOne { candidate });
    }
    let places: HashMap<u32, usize> = other.iter().copied().zip(0..).collect();
    one.iter()
        .map(|candidate| {
            places
                .get(candidate)
                .copied()
                .ok_or(CompareError::OnlyInOne {
                    candidate: *candidate,
                })
        })
        .collect()
}

/// How many pairs are out of order, by merging runs of 1, 2, 4 … numbers.
fn sort_and_count_inversions(positions: &mut [usize]) -> u64 {
    let mut inversions = 0;
    let mut merged = Vec::with_capacity(positions.len());
    let mut run = 1;
    while run < positions.len() {
        merged.clear();
        for pair in positions.chunks(2 * run) {
            let (mut left, mut right) = pair.split_at(run.min(pair.len()));
            while let (Some(&a), Some(&b)) = (left.first(), right.first()) {
                if a <= b {
                    merged.push(a);
                    left = &left[1..];
                } else {
                    merged.push(b);
                    right = &right[1..];
                    inversions += left.len() as u64;
                }
            }
            merged.extend_from_slice(left);
            merged.extend_from_slice(right);
        }
        positions.copy_from_slice(&merged);
        run *= 2;
    }
    inversions
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, seq::SliceRandom};

    use super::*;
    use crate::simulate::seeded;

    /// Both correlations are quotients of whole numbers below 2⁵³; one is subtracted from 1.
    const ROUNDING: f64 = 1e-15;

    #[test]
    fn inversions_match_counting_every_pair() {
        let mut random = seeded(3, 3);
        for count in [0, 1, 2, 3, 7, 64, 101] {
            let mut positions: Vec<usize> =
                (0..count).map(|_| random.random_range(0..50)).collect();
            let expected = (0..count)
                .flat_map(|a| (a + 1..count).map(move |b| (a, b)))
                .filter(|&(a, b)| positions[a] > positions[b])
                .count();
            assert_eq!(sort_and_count_inversions(&mut positions), expected as u64);
            assert!(positions.is_sorted());
        }
    }

    #[test]
    fn equal_rankings_agree_and_reversed_ones_disagree() {
        let mut ranking: Vec<u32> = (10..60).collect();
        ranking.shuffle(&mut seeded(1, 1));
        let reversed: Vec<u32> = ranking.iter().rev().copied().collect();
        for (other, expected) in [(&ranking, 1.0), (&reversed, -1.0)] {
            let tau = kendall_tau(&ranking, other).expect("the same candidates");
            let rho = spearman_rho(&ranking, other).expect("the same candidates");
            assert!((tau - expected).abs() < ROUNDING, "{tau}");
            assert!((rho - expected).abs() < ROUNDING, "{rho}");
        }
        assert_eq!(overlap(&ranking, &reversed, 50), Ok(1.0));
        assert_eq!(average_overlap(&ranking, &ranking, 50), Ok(1.0));
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let needs_two = CompareError::TooShort { needed: 2, have: 1 };
        assert_eq!(kendall_tau(&[1], &[1]), Err(needs_two));
        assert_eq!(spearman_rho(&[1], &[1]), Err(needs_two));
        let only = |candidate| Err(CompareError::OnlyInOne { candidate });
        assert_eq!(kendall_tau(&[1, 2], &[1, 3]), only(3));
        assert_eq!(kendall_tau(&[1, 2, 3], &[1, 3]), only(2));
        let repeated = Err(CompareError::Repeated { candidate: 4 });
        assert_eq!(spearman_rho(&[4, 4], &[4, 5]), repeated);
        assert_eq!(overlap(&[4, 4], &[4, 5], 2), repeated);
        assert_eq!(
            overlap(&[1, 2], &[1, 2], 0),
            Err(CompareError::NothingCompared)
        );
        assert_eq!(
            overlap(&[1, 2, 3], &[1, 2], 3),
            Err(CompareError::TooShort { needed: 3, have: 2 })
        );
        assert_eq!(
            stability(&[[1, 2]], 1),
            Err(CompareError::TooFewRankings { have: 1 })
        );
    }
}
