//! From views to an eigenspace: what can be chosen, the candidates as views, preprocessing, PCA.

mod ipca;
mod pca;
mod preprocess;
mod rows;
mod settings;
mod views;

pub use ipca::{Growth, IncrementalPca, RESIDUAL_TOLERANCE};
pub use pca::{Model, PcaError};
pub use preprocess::{Kernel, Preprocess};
pub use rows::{Matrix, Rows};
pub use settings::{Selection, Settings};
pub use views::{MAX_TRAINING_BYTES, Views, ViewsError};
