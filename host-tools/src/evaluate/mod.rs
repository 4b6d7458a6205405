//! How often the core is right when the view is not quite the landmark's, and which selection is better for a map.

mod comparison;
mod deviation;
mod trial;

pub use comparison::{
    AcrossDimensions, Comparison, ComparisonError, JudgedSelection, REPORT_DIMENSIONS,
    compare_selections,
};
pub use deviation::Deviation;
pub use trial::{Outcome, deviated_fixes, fixes_around, foreign_fixes};
