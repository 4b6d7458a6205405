//! Self-contained HTML pages: pictures and plots are inside, nothing is fetched.

mod atlas;
mod experiment;
mod explorer;
mod map_picture;
mod page;

pub use atlas::{AtlasReport, FlightReport, atlas_cell, atlas_report};
pub use experiment::experiment_report;
pub use explorer::Explorer;
use map_picture::map_picture;
pub use page::Page;
pub(crate) use page::STYLE;
