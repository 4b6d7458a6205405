//! From views to an eigenspace: what can be chosen, the candidates as vectors, preprocessing, PCA at once and one by one.

mod candidates;
mod ipca;
mod pca;
mod pixel_basis;
mod preprocess;
mod rows;
mod settings;
mod space;

pub(crate) use candidates::scene_of;
pub use candidates::{Candidates, CandidatesError};
pub use ipca::{Growth, IncrementalPca, RESIDUAL_TOLERANCE};
pub use pca::{Fold, Model, PcaError, Route, first_columns};
pub use pixel_basis::PixelBasis;
pub use preprocess::{Kernel, Preprocess};
pub use rows::{Matrix, Rows};
pub use settings::{ALTITUDES, HEADINGS, HIGHPASSES, SCALES, Settings, WHITENINGS, blur_name};
pub use space::Space;
