//! Which candidates become landmarks.

mod all_pairs;
mod compare;
mod dissimilarity;
mod eligible;
mod ipca;
mod nearest;
mod profile;

pub use all_pairs::{MAX_PROFILED, profile, rank_by_profile};
pub use compare::{
    CompareError, Stability, average_overlap, kendall_tau, overlap, spearman_rho, stability,
};
pub use dissimilarity::{Dissimilarity, dissimilarity, metric_distance};
pub use eligible::Eligible;
pub use ipca::{
    IpcaError, IpcaRanking, Stop, TIE, Until, ZERO, random_start, rank_by_ipca,
    rank_by_ipca_literally,
};
pub use nearest::nearest_others;
pub use profile::{Order, Profile, Ranking, Route};
