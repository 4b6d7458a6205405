//! Self-contained HTML pages: pictures and plots are inside, nothing is fetched.

mod experiment;
mod explorer;
mod map_picture;
mod page;
mod plot;
mod training;

pub use experiment::experiment_report;
pub use explorer::Explorer;
pub use map_picture::map_picture;
pub use page::Page;
pub use plot::{Axes, line_plot};
pub use training::{FlightReport, TrainingReport, training_report};
