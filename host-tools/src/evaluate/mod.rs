//! How often the core is right when the view is not quite the landmark's.

mod deviation;
mod trial;

pub use deviation::Deviation;
pub use trial::{Outcome, deviated_fixes, fixes_around, foreign_fixes};
