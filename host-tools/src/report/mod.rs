//! Self-contained HTML pages: pictures and plots are inside, nothing is fetched.

mod page;
mod plot;
mod training;

pub use page::Page;
pub use plot::{Axes, line_plot};
pub use training::{FlightReport, TrainingReport, training_report};
