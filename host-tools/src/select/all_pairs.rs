//! Profile-based ranking: candidates that are most dissimilar to all others come first; report section 2.3.2.
//!
//! p_j = 1/(n−1) · Σ_{i≠j} ρ(g_i, g_j) (report (2.37)), sorted in descending order (algorithm 2.3). Of equals the
//! lower number comes first. Distances are computed row by row, so memory is O(n).

use eigenmark_core::landmark::Metric;
use rayon::prelude::*;

use super::dissimilarity;

/// Candidates that may be ranked: every pair of them is compared.
pub const MAX_PROFILED: u32 = 50_000;

/// The distance profile of `coefficients` (n rows of `dimensions`).
#[must_use]
pub fn profile(metric: Metric, coefficients: &[f64], dimensions: usize) -> Vec<f64> {
    let rows: Vec<&[f64]> = coefficients.chunks_exact(dimensions).collect();
    let others = rows.len().saturating_sub(1).max(1) as f64;
    rows.par_iter()
        .map(|a| {
            rows.iter()
                .map(|b| dissimilarity(metric, a, b))
                .sum::<f64>()
                / others
        })
        .collect()
}

/// Candidate numbers (1-based), largest profile value first.
#[must_use]
pub fn rank_by_profile(profile: &[f64]) -> Vec<u32> {
    let mut ranking: Vec<u32> = (1..=profile.len() as u32).collect();
    ranking.sort_by(|&a, &b| profile[b as usize - 1].total_cmp(&profile[a as usize - 1]));
    ranking
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_odd_one_out_comes_first() {
        let coefficients = [1.0, 0.0, 1.1, 0.0, -5.0, 0.1, 0.9, 0.0];
        let profile = profile(Metric::Euclid, &coefficients, 2);
        let ranking = rank_by_profile(&profile);
        assert_eq!(ranking[0], 3);
        assert_eq!(ranking, [3, 2, 4, 1]);
    }

    #[test]
    fn two_points_share_their_distance() {
        assert_eq!(profile(Metric::Euclid, &[0.0, 7.0], 1), [7.0, 7.0]);
        assert_eq!(rank_by_profile(&[7.0, 7.0]), [1, 2]);
    }
}
