//! IPCA-based ranking: the candidate that the landmarks so far express worst comes next; report section 2.3.3.
//!
//! **What.** A few candidates start the table. Then, again and again, the one with the largest residual to the
//! eigenspace of all landmarks becomes the next.
//!
//! **Notation.** x_i candidates of m pixels, S the landmarks, x_s0 the first of them, r residuals (report (2.21)).
//! Candidates are numbered from 1; row i of the views is candidate i + 1.
//!
//! **Method.** Algorithm 2.4, corrected, by two routes that give the same ranking: [`rank_by_ipca_literally`] updates
//! an eigenspace and projects every candidate into it, as printed; [`rank_by_ipca`] updates nothing. Nothing is
//! truncated, so the residual to the eigenspace of S is the distance to the affine hull of S: what Gram-Schmidt leaves
//! of x − x_s0. Deviations, in both routes:
//! 1. x_s0 is subtracted from every view first. No residual depends on it, but rounding does.
//! 2. A residual up to [`ZERO`] of the largest distance to x_s0 is zero; a start member with such a residual to those
//!    before it is a landmark, but not in the eigenspace. When the largest residual is zero the ranking ends, instead
//!    of ranking what rounding has left.
//! 3. Residuals that are within [`TIE`] of the largest distance to x_s0 are equal, and of equals the lowest number
//!    comes first. So candidates that look alike have one order, whatever the rounding.
//!
//! **Cost.** See the two routes.
//!
//! **Limits.** Distinct residuals whose difference is exactly [`TIE`], or that are exactly [`ZERO`], are judged by
//! rounding.

mod deviations;
mod hull;
mod literal;
mod pivoted;
mod start;
#[cfg(test)]
mod tests;

pub use literal::rank_by_ipca_literally;
pub use pivoted::rank_by_ipca;
pub use start::random_start;

/// Residuals up to this share of the largest distance to the first landmark are zero: 2⁻²⁰.
///
/// Pixels are single precision: rounding alone puts a view 2⁻²⁴ of its norm outside of a span that it lies in, and the
/// norm is a few times the largest distance where the mean gray level is. One gray level in one pixel of 200×200 is
/// twenty times as much, 2·10⁻⁵.
pub const ZERO: f64 = 1.0 / 1_048_576.0;

/// Residuals that differ by no more than this share of the largest distance to the first landmark are equal.
///
/// The routes differ by less than 10⁻¹⁵ of it (measured in their tests); candidates that only happen to be similar
/// differ by far more than both.
pub const TIE: f64 = 1e-11;

// Ties are far above rounding, and far below zero.
const _: () = assert!(TIE > 1000.0 * f64::EPSILON && TIE * 1000.0 < ZERO);

/// When a ranking ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Until {
    /// With this many landmarks, those of the start list included.
    pub landmarks: usize,
    /// When no candidate's residual is above this (norm, in the pixels' unit).
    pub residual: Option<f64>,
}

impl Until {
    /// Until there are so many landmarks.
    #[must_use]
    pub fn landmarks(landmarks: usize) -> Self {
        Self {
            landmarks,
            residual: None,
        }
    }
}

/// Why a ranking ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// There are as many landmarks as asked for.
    Landmarks,
    /// No candidate's residual is above the threshold.
    Residual,
    /// No candidate is left, or all that are left are expressed entirely.
    Exhausted,
}

/// Candidates in the order of their selection.
#[derive(Clone, Debug, PartialEq)]
pub struct IpcaRanking {
    /// Candidate numbers (1-based): the start list, then the selected ones.
    pub ranking: Vec<u32>,
    /// ‖r‖ of each at the moment of its selection, to those before it; 0 for the first.
    pub residuals: Vec<f64>,
    /// Why there are no more.
    pub stop: Stop,
}

/// Why candidates cannot be ranked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum IpcaError {
    /// There is nothing to start from.
    #[error("the start list is empty; it needs one view at least")]
    EmptyStart,
    /// There are no such views.
    #[error(
        "view {candidate} of the start list does not exist; there are {count}, numbered from 1"
    )]
    Unknown {
        /// The number that was given.
        candidate: u32,
        /// Candidates there are, n.
        count: usize,
    },
    /// A landmark cannot be selected twice.
    #[error("view {candidate} is in the start list twice; its members must differ")]
    Repeated {
        /// The number that was given.
        candidate: u32,
    },
    /// A start member is not among those that may be selected.
    #[error("view {candidate} is in the start list, but not among the preselected views")]
    Ineligible {
        /// The number that was given.
        candidate: u32,
    },
    /// Two start members may not both be landmarks.
    #[error(
        "views {candidate} and {other} of the start list are closer than the landmarks' spacing"
    )]
    TooClose {
        /// The one that comes later in the list.
        candidate: u32,
        /// The one before it.
        other: u32,
    },
    /// Fewer candidates than asked for can be landmarks together.
    #[error(
        "{asked} views are to start from, but only {found} were found that may be landmarks together"
    )]
    TooFew {
        /// Candidates asked for.
        asked: usize,
        /// Candidates there are.
        found: usize,
    },
    /// A view has pixels that cannot be computed with.
    #[error("view {candidate} has pixels that are not finite numbers")]
    NotFinite {
        /// The first such candidate.
        candidate: u32,
    },
}

/// What both routes go by.
#[derive(Clone, Copy, Debug)]
struct Rules {
    until: Until,
    /// Norms up to this are zero.
    zero: f64,
    /// Norms that differ by no more than this are equal.
    tie: f64,
}

impl Rules {
    /// `scale` is the largest distance to the first landmark.
    fn new(until: Until, scale: f64) -> Self {
        Self {
            until,
            zero: ZERO * scale,
            tie: TIE * scale,
        }
    }

    /// Whether, and why, the ranking ends when `largest` is the largest residual.
    fn stop(&self, largest: f64) -> Option<Stop> {
        if largest <= self.zero {
            Some(Stop::Exhausted)
        } else {
            let is_below = self
                .until
                .residual
                .is_some_and(|residual| largest <= residual);
            is_below.then_some(Stop::Residual)
        }
    }

    /// Which of the candidates (number, residual) is next; the lowest number among equals.
    fn next(&self, candidates: &[(u32, f64)]) -> Option<(u32, f64)> {
        let largest = candidates
            .iter()
            .map(|&(_, residual)| residual)
            .reduce(f64::max)?;
        let equals = candidates
            .iter()
            .filter(|&&(_, residual)| residual >= largest - self.tie);
        equals.min_by_key(|&&(candidate, _)| candidate).copied()
    }
}
