//! From a map to an atlas: views, preprocessing, PCA, selection, quantization, calibration.
//!
//! [`train`](train()) is the whole way; its parts are public for experiments.

mod pca;
mod preprocess;
mod settings;
mod train;
mod views;

pub use pca::{Model, PcaError};
pub use preprocess::{Kernel, Preprocess};
pub use settings::{Selection, Settings};
pub use train::{TrainError, Trained, train};
pub use views::{MAX_TRAINING_BYTES, Views};
