//! Which candidates become landmarks.

mod dissimilarity;
mod profile;

pub use dissimilarity::{dissimilarity, metric_distance};
pub use profile::{MAX_PROFILED, profile, rank_by_profile};
