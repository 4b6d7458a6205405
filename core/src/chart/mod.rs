//! Without an atlas: a pattern is flown, landmarks are chosen on the way and linked into a map, and the vehicle finds its
//! way over it.
//!
//! **What.** The report's remark on simultaneous localization and mapping, made to fly: an [`Exploration`] flies a
//! [`Pattern`] by path integration alone. Where the view is new to the eigenspace of the landmarks so far (algorithm 2.4
//! online, [`explore`](crate::explore)), a landmark is made, and a place of the [`Chart`] with the same number. A landmark
//! seen again, where path integration holds that to be possible, corrects path integration. Afterwards the vehicle flies to
//! any place of the chart by the [`Mission`](crate::mission::Mission) that atlases are flown by.
//!
//! **Notation.** The chart's plane is that of path integration: the start is its origin, map-up what the compass said
//! there. Its *pixel* is a hundredth of a side, [`SIDE_PX`], so that whatever works on maps works on charts.
//!
//! **Method.**
//! 1. *Views* are turned to the chart's heading and show the square that a frame has at every heading ([`WINDOW`] of a
//!    side), so that a place looks the same from every direction. They have zero mean and the same contrast.
//! 2. *Revisits.* Of each visit the look nearest to the landmark counts, once, and the less the more it differs from it:
//!    lines beside each other recall each other's landmarks, always from the same side. If path integration has erred by e since the
//!    landmark was first seen, that look says e but for how far from the landmark it may have been. Over a closed way
//!    errors only add up, so the covariance of e is the present one less that of then; a Kalman update with the two
//!    corrects position and heading, and leaves of the covariance what it was then.
//! 3. *Legs* join places visited one after the other, and a new place to older ones around it when no third place lies in
//!    the circle over the two (Gabriel and Sokal 1969): few legs, and short ones, that stay near landmarks.
//! 4. *Commands* are headings of the compass: the chart's, by as much as compass and path integration differ.
//!
//! **Cost.** Memory is 66 KiB of path integration, 9 KiB of eigenspace, 184 bytes per place and 2 per leg: 101 KiB for 128
//! places and 1,024 legs, and 2.7 KiB of the [`Exploration`] itself. A new landmark takes some 18 KiB of stack on
//! a Cortex-M4F. A look, every tenth of a side, takes a levelled view
//! and one or two projections; a new landmark an update of the eigenspace, and p² steps to find its neighbors among p places.
//!
//! **Measured.** In the simulator, with wind, tilts, clouds, noise, and a compass within 10°, over boxes of up to 4 by 1.8
//! sides of four maps: places are 0.07 to 0.14 sides off on average and 0.40 at most; the median arrival is 0.32 sides from
//! where its place was made, of which a quarter is the mission's radius, the worst 0.57. Thresholds were chosen on these maps
//! and flights.
//!
//! **Limits.**
//! 1. Places stay where they were first seen: only the vehicle is corrected, not the way between two places.
//! 2. Beyond the dimensions of the eigenspace only the sizes of residuals are compared, so other views can pass for a place's.
//!    On short ways, where path integration hardly drifts, corrections can do more harm than good: in a flight with an error
//!    of 0.3 sides put there on purpose the vehicle ended 1.1 sides off.
//! 3. Lengths are as wrong as the altimeter. Nothing is known of obstacles. A full chart grows no further.
//! 4. Who is not sure where it is flies on by its best guess, and does not say that it has arrived. A vehicle that is
//!    carried off unseen does not notice.

mod closing;
mod exploration;
mod memory;
mod pattern;
mod places;
mod window;

pub use exploration::{Exploration, Phase, Progress};
pub use memory::Memory;
pub use pattern::Pattern;
pub use places::Chart;
pub use window::{VIEW_SIDE, WINDOW};

/// Pixels of a chart per side.
pub const SIDE_PX: f32 = 100.0;
