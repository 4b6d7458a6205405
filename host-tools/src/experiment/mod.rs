//! Experiments of the report, and what it left to others.

pub mod segmentation;
