//! Making, judging and keeping atlases.
//!
//! [`Folded`] turns an eigenspace in f64 into the integers that fly, with a proven bound of what that costs;
//! [`radii`] says how near a view must be for its landmark to be guaranteed; [`calibrate`] sets what counts as known,
//! and narrows radii that trying shows to be too wide; [`AtlasBuffer`] holds the bytes.

mod buffer;
mod calibrate;
mod likelihood;
mod quantize;
mod radius;
mod summary;

pub use buffer::{AtlasBuffer, AtlasFileError};
pub use calibrate::{CalibrationError, KEPT_SHARE, calibrate};
pub use quantize::Folded;
pub use radius::radii;
pub use summary::Summary;
