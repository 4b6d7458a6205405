//! Color segmentation before training, and what it is worth: report section 5.2.1.

mod effect;
mod shown;

pub use effect::{
    SegmentationEffect, SegmentationEffectError, Variant, VariantReliability, segmentation_effect,
};
pub use shown::{Segmented, Shade, Tolerates};
