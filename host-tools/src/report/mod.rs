//! Self-contained HTML pages: pictures and plots are inside, nothing is fetched.

mod page;
mod picture;
mod plot;
mod training;

pub use page::Page;
pub use picture::{jpeg_uri, png_uri};
pub use plot::{Axes, line_plot};
pub use training::{FlightReport, TrainingReport, training_report};
