//! The words that options accept, and the values they stand for.

use clap::ValueEnum;
use eigenmark::{
    evaluate::Deviation,
    select::{Attention, Dissimilarity},
};
use eigenmark_core::{
    atlas,
    eigenspace::Normalize,
    landmark::{self, Width},
};

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum BlurChoice {
    None,
    /// 3×3 pixels, σ = 0.48
    Gauss1,
    /// 5×5 pixels, σ = 0.65
    Gauss2,
    /// 7×7 pixels, σ = 0.76
    Gauss3,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum NormalizeChoice {
    None,
    /// Zero mean
    Mean,
    /// Zero mean and unit variance
    Std,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum MetricChoice {
    /// Normalized sum of squared differences
    Nssd,
    /// Euclidean distance
    Euclid,
    /// Angle between coefficient vectors: gain and offset of brightness drop out
    Cosine,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum WidthChoice {
    I16,
    I8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SelectChoice {
    /// The most dissimilar views, by distance profile
    Profile,
    /// One after the other the view that those before represent worst
    Ipca,
    /// Views as far apart as possible in the eigenspace: the largest radii
    Reliable,
    /// Every view: a dense table
    All,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodChoice {
    Fast,
    Literal,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum DissimilarityChoice {
    /// Sum of squared differences
    Ssd,
    /// Euclidean distance
    Euclid,
    /// Normalized sum of squared differences
    Nssd,
    /// The same of coefficients less their mean, as the report prints it
    NssdCentered,
    /// Angle between coefficient vectors
    Angle,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum AttentionChoice {
    /// Corners
    Harris,
    /// Density of edges
    Edges,
    /// Local entropy of gray levels
    Entropy,
}

impl From<DissimilarityChoice> for Dissimilarity {
    fn from(choice: DissimilarityChoice) -> Self {
        match choice {
            DissimilarityChoice::Ssd => Self::Ssd,
            DissimilarityChoice::Euclid => Self::Euclid,
            DissimilarityChoice::Nssd => Self::Nssd,
            DissimilarityChoice::NssdCentered => Self::NssdCentered,
            DissimilarityChoice::Angle => Self::Angle,
        }
    }
}

impl From<AttentionChoice> for Attention {
    fn from(choice: AttentionChoice) -> Self {
        match choice {
            AttentionChoice::Harris => Self::Harris,
            AttentionChoice::Edges => Self::Edges,
            AttentionChoice::Entropy => Self::Entropy,
        }
    }
}

impl From<BlurChoice> for atlas::Blur {
    fn from(choice: BlurChoice) -> Self {
        match choice {
            BlurChoice::None => Self::None,
            BlurChoice::Gauss1 => Self::Gauss1,
            BlurChoice::Gauss2 => Self::Gauss2,
            BlurChoice::Gauss3 => Self::Gauss3,
        }
    }
}

impl From<NormalizeChoice> for Normalize {
    fn from(choice: NormalizeChoice) -> Self {
        match choice {
            NormalizeChoice::None => Self::None,
            NormalizeChoice::Mean => Self::Mean,
            NormalizeChoice::Std => Self::Std,
        }
    }
}

impl From<MetricChoice> for landmark::Metric {
    fn from(choice: MetricChoice) -> Self {
        match choice {
            MetricChoice::Nssd => Self::Nssd,
            MetricChoice::Euclid => Self::Euclid,
            MetricChoice::Cosine => Self::Cosine,
        }
    }
}

impl From<WidthChoice> for Width {
    fn from(choice: WidthChoice) -> Self {
        match choice {
            WidthChoice::I16 => Self::I16,
            WidthChoice::I8 => Self::I8,
        }
    }
}

/// Named distributions of errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DeviationChoice {
    /// ±2°, ±2 % shift, altitude to 1.02, gamma to 1.05, noise
    Slight,
    /// ±20°, ±15 % shift, altitude to 1.2, gamma to 2, more noise
    Moderate,
    /// The same, tilted by up to 8°, in motion by 5 % of the footprint, 5 % hidden
    Rough,
}

impl From<DeviationChoice> for Deviation {
    fn from(choice: DeviationChoice) -> Self {
        match choice {
            DeviationChoice::Slight => Self::SLIGHT,
            DeviationChoice::Moderate => Self::MODERATE,
            DeviationChoice::Rough => Self::ROUGH,
        }
    }
}
