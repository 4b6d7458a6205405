//! Which candidates become landmarks.

mod dissimilarity;
mod eligible;
mod ipca;
mod nearest;
mod profile;

pub use dissimilarity::{dissimilarity, metric_distance};
pub use eligible::Eligible;
pub use ipca::{
    IpcaError, IpcaRanking, Stop, TIE, Until, ZERO, random_start, rank_by_ipca,
    rank_by_ipca_literally,
};
pub use nearest::nearest_others;
pub use profile::{MAX_PROFILED, profile, rank_by_profile};
