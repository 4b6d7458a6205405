//! Which candidates become landmarks.
//!
//! | file | chooses |
//! | --- | --- |
//! | `selection` | what a user can ask for; [`select`] does it |
//! | `attention` | candidates worth ranking: corners, edges, entropy (report 5.2.3) |
//! | `eligible` | which candidates take part, and how far apart landmarks must be |
//! | `profile` | the most dissimilar on average (report 2.3.2) |
//! | `ipca` | what the landmarks before represent worst (report 2.3.3) |
//! | `reliable` | what makes radii large |
//! | [`cluster`] | one per group of views that are near each other (report 4.1) |
//! | `compare` | how far rankings agree (`compare_ranks` in table C.3) |

mod attention;
mod choose;
pub mod cluster;
mod compare;
mod dissimilarity;
mod eligible;
mod ipca;
mod nearest;
mod profile;
mod reliable;
mod selection;

pub use attention::{Attention, Plane, preselect};
pub(crate) use choose::{Chooser, eligible};
pub use choose::{Profiled, Selected, SelectionError, select};
pub use compare::{
    CompareError, Stability, average_overlap, kendall_tau, overlap, spearman_rho, stability,
};
pub(crate) use dissimilarity::nearness;
pub use dissimilarity::{Dissimilarity, dissimilarity, metric_distance};
pub use eligible::Eligible;
pub use ipca::{
    IpcaError, IpcaRanking, Stop, TIE, Until, ZERO, random_start, rank_by_ipca,
    rank_by_ipca_literally,
};
pub use nearest::nearest_others;
pub use profile::{Order, Profile, Ranking, Route};
pub use reliable::{Objective, exchange, farthest_points, most_reliable};
pub use selection::{Best, Method, Preselection, START_LEN, Selection, Start};
