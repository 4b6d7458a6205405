//! What a user can choose about selection.

use serde::{Deserialize, Serialize};

use super::{Attention, Dissimilarity};

/// Landmarks in the start list of an IPCA ranking that takes them from another ranking or at random: as in the report.
pub const START_LEN: usize = 3;

/// Which candidates become landmarks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Selection {
    /// All of them, in the order of their numbers: a dense table.
    All,
    /// The first of a ranking.
    Best(Best),
}

/// The first landmarks of a ranking.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Best {
    /// Number of landmarks, l.
    pub landmarks: u32,
    /// How they are ranked.
    pub method: Method,
    /// What a profile averages; `None` for the dissimilarity of the metric that matches.
    pub dissimilarity: Option<Dissimilarity>,
    /// Whether the report's algorithms 2.3 and 2.4 run literally, instead of the fast routes to the same ranking.
    pub is_literal: bool,
    /// Which candidates are ranked at all; `None` for every one.
    pub preselection: Option<Preselection>,
    /// Map pixels between two landmarks, at least; 0 for any.
    pub spacing_px: f32,
}

/// How candidates are ranked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Method {
    /// By their mean dissimilarity to all others (report section 2.3.2).
    Profile,
    /// By what the landmarks before them leave of them (report section 2.3.3).
    Ipca {
        /// The first landmarks.
        start: Start,
        /// Norm of the residual below which no further landmark is selected.
        stop_residual: Option<f64>,
    },
    /// So that landmarks are as far apart as possible in the eigenspace, which makes radii large.
    Reliable,
}

/// Where an IPCA ranking starts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Start {
    /// From the first [`START_LEN`] of the profile ranking.
    Profile,
    /// From [`START_LEN`] at random.
    Random {
        /// Seed of the choice.
        seed: u64,
    },
    /// From these candidates (1-based).
    Given(Vec<u32>),
}

/// Candidates that attract attention are ranked, others not (report section 5.2.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Preselection {
    /// What attracts attention.
    pub attention: Attention,
    /// How many candidates are kept; `None` for a quarter of them.
    pub keep: Option<u32>,
}

impl Selection {
    /// The first `landmarks` of the profile ranking, as in the report.
    #[must_use]
    pub fn profile(landmarks: u32) -> Self {
        Self::Best(Best::new(landmarks, Method::Profile))
    }
}

impl Best {
    /// The first `landmarks` of a ranking of all candidates, wherever they are.
    #[must_use]
    pub fn new(landmarks: u32, method: Method) -> Self {
        Self {
            landmarks,
            method,
            dissimilarity: None,
            is_literal: false,
            preselection: None,
            spacing_px: 0.0,
        }
    }

    /// Whether its numbers make sense; a selection read from a file may be anything.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let is_threshold = |residual: f64| residual.is_finite() && residual >= 0.0;
        self.landmarks > 0
            && self.spacing_px.is_finite()
            && self.spacing_px >= 0.0
            && self.preselection.is_none_or(|some| some.keep != Some(0))
            && match &self.method {
                Method::Ipca { stop_residual, .. } => stop_residual.is_none_or(is_threshold),
                Method::Profile | Method::Reliable => true,
            }
    }
}
