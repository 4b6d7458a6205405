//! Which candidates become landmarks.

mod attention;
mod dissimilarity;
mod eligible;
mod nearest;
mod profile;
mod reliable;

pub use attention::{Attention, Plane, preselect};
pub use dissimilarity::{dissimilarity, metric_distance};
pub use eligible::Eligible;
pub use nearest::nearest_others;
pub use profile::{MAX_PROFILED, profile, rank_by_profile};
pub use reliable::{Objective, exchange, farthest_points, most_reliable};
