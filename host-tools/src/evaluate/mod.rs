//! How far landmarks can be trusted, which selection is better for a map, and how often the core is right when the view
//! is not quite the landmark's.
//!
//! | module | says |
//! | --- | --- |
//! | [`reliability`] | how far a view may deviate in one respect; catchment areas (report 3.5) |
//! | `score` | the probability of a right fix under a stated distribution of errors |
//! | `evaluation` | both, for every landmark of a table; resumable |
//! | `table` | means over a table, and how two judges differ |
//! | `judge` | who is asked: the core with an atlas, or the eigenspace in f64 |
//! | [`localization`] | where on the map a view could be taken for another (report 4.2) |
//! | `trial`, `deviation` | what the core says of many randomly deviated views |
//! | `comparison` | selections of the same candidates side by side |

mod comparison;
mod deviation;
mod evaluation;
mod everywhere;
mod journal;
mod judge;
pub mod localization;
pub mod reliability;
mod score;
mod table;
mod trial;

pub use comparison::{
    AcrossDimensions, Comparison, ComparisonError, JudgedSelection, REPORT_DIMENSIONS,
    compare_selections,
};
pub use deviation::Deviation;
pub use evaluation::{Evaluated, Plan, Site, evaluate};
pub use everywhere::Everywhere;
pub use journal::{Journal, JournalError};
pub use judge::{Criterion, Exact, Judge, Onboard, Verdict};
pub(crate) use judge::{Panel, nearest_of};
pub use score::{Draws, Score, wilson_interval};
pub use table::{
    CriterionDifference, EvaluatedLandmark, EvaluatedMean, EvaluatedTable, JudgeDifference,
};
pub use trial::{Outcome, deviated_fixes, fixes_around, foreign_fixes};
