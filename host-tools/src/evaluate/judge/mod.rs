//! Who says which landmark a view shows: the quantized atlas through the core, or the eigenspace in f64.

mod exact;
mod nearest;
mod onboard;
mod panel;

pub use exact::Exact;
pub(crate) use nearest::nearest_of;
pub use onboard::Onboard;
pub(crate) use panel::Panel;

/// What is said about a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// The nearest landmark: its rank in the table, 0-based.
    pub landmark: u32,
    /// No other landmark is as near.
    pub is_strict: bool,
    /// The distance is below the landmark's radius; report (2.39), reconstructed.
    pub is_guaranteed: bool,
}

/// When a view counts as localized at a landmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Criterion {
    /// The landmark is the strict nearest neighbor.
    Nearest,
    /// The landmark is nearer than its radius: report (2.39). Implies the other.
    Guaranteed,
}

/// Finds views among landmarks, every view on its own.
pub trait Judge: Sync {
    /// Pixels per side of its views, v.
    fn side(&self) -> usize;

    /// Number of landmarks, l.
    fn landmarks(&self) -> usize;

    /// What it says about the view with these v² pixels, row-major; `None` when there is nothing to go by.
    fn judge(&self, view: &[u8]) -> Option<Verdict>;
}

impl Criterion {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Nearest, Self::Guaranteed];

    /// Whether a verdict localizes at `landmark` (0-based).
    #[must_use]
    pub fn holds(self, verdict: Option<Verdict>, landmark: u32) -> bool {
        verdict.is_some_and(|verdict| {
            verdict.landmark == landmark
                && match self {
                    Self::Nearest => verdict.is_strict,
                    Self::Guaranteed => verdict.is_guaranteed,
                }
        })
    }
}
