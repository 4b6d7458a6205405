//! Which candidates become landmarks.

mod dissimilarity;
mod nearest;
mod profile;

pub use dissimilarity::{dissimilarity, metric_distance};
pub use nearest::nearest_others;
pub use profile::{MAX_PROFILED, profile, rank_by_profile};
