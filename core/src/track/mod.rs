//! Frames → where the vehicle is, relative to where it started: visual path integration.
//!
//! **What.** [`Odometry`] follows corners of the ground from frame to frame and says after every frame where the vehicle
//! is, which way it heads and how high it is ([`Placement`]), how far that can be trusted ([`Covariance`]), and what
//! happened since the frame before ([`Displacement`]). A route can be flown between places that landmarks know.
//!
//! **Notation.** A *side* is what the frame's centered square covers at altitude ratio 1: sides times an atlas's footprint
//! are map pixels. The plane has the map's axes, x right and y down; headings are clockwise from map-up. *Below* are
//! positions under the vehicle, [right, behind], in sides at altitude ratio 1. A corner's *anchor* is where it lies in the
//! plane, as seen when it was detected.
//!
//! **Method.** Report appendix B, algorithm B.1, corrected: corners are detected, tracked, dropped where they are about to
//! leave, and new ones are looked for. For every frame:
//! 1. Every corner is looked for where the last motion would bring it, coarse to fine (`follow`, `patch`). Those in the
//!    middle, where coarse levels reach, tell those near the border by how much that was wrong.
//! 2. Positions are levelled by the tilt that is told (`ground`), and the pose is the similarity that takes most of them
//!    to their anchors (`similarity`). When fewer than 60 % of what was found agree, everything is looked for once more
//!    where it was before; then the frame is refused. One bad frame is passed over; after two in a row, the latter is
//!    where tracking begins anew.
//! 3. When corners moved by more than six pixels on average, the vehicle turned, or few corners are left, the frame
//!    becomes the one that is tracked from, and gaps are filled with new corners (`corner`), which get anchors.
//!
//! Deviations from the report:
//! 1. The pose is fit to anchors; displacements are not added up. Errors enter only where corners are replaced: with 20
//!    corners of 0.1 pixel each, some hundredths of a pixel per side flown, however many frames that takes.
//! 2. The frame that is tracked from is kept while little moves: a vehicle that hovers does not drift at all.
//! 3. The smaller eigenvalue (Shi and Tomasi 1994) in place of Harris' measure: it is what tracking needs.
//! 4. Regions follow the way of the ground through the frame; the report's assume forward flight. Line 7's second
//!    detection, with few corners left, looks everywhere.
//! 5. Distances of new corners are to all that are tracked, see the report's errata.
//!
//! **Tilt.** A tilt told wrong by δ moves all levelled positions by about the same vector e; the pose then comes out wrong
//! by −e, and a new corner's anchor, pose plus levelled position, by e − e: right. So the place errs by what the present
//! error of the tilt is, 1.5 % of a side per degree at a field of view of 60°, and forgets it. What does not cancel is
//! keystone: corners that come in look farther apart than when they leave, or the other way round. In an error that
//! changes this averages out; one that lasts is taken for turns and climbs, a few percent of altitude and hundredths of a
//! radian of heading per side flown and degree. [`correct_heading`](Odometry::correct_heading) and
//! [`correct_altitude`](Odometry::correct_altitude) hold those, and then the place has no more than e. The stated
//! covariance knows nothing of tilts.
//!
//! **Covariance.** It has two parts. A *fit* has the covariance of least squares with the inliers' residuals; it is the
//! vehicle's error among its anchors, another in every frame. *Common* is the error of the anchors as a whole. It moves
//! with the vehicle: a wrong heading leads astray. When a share of all corners is new, it grows by 2.5 times that share
//! of the fit's covariance: a corner's error at its birth lasts as long as the corner, is passed on to those that are born
//! meanwhile, and amounts to 2/n of it in the end, in theory twice the share when birth and tracking err alike. Measured
//! over 20 random flights each, normalized squared errors are 0.9 to 1.0 times what is stated.
//!
//! **Accuracy.** Drift over flights of 16 sides above four maps: 0.05 to 0.6 % of the way, with noise of two gray levels
//! and gamma between 0.7 and 1.3; the same with tilts of 4° told wrong by up to 1°, a compass and an altimeter. Corners
//! are 0.04 to 0.07 pixel from the truth (median), as OpenCV's are.
//!
//! **Cost.** 2,115,511 instructions on the target for a frame of 200×200 with 20 corners, detection included; 3,542,886
//! when none is found again. 66,232 bytes of state for such frames, of which the one that is tracked from takes 40,000;
//! 27,856 bytes for frames of 128×128; and 5,900 bytes of stack.
//!
//! **Limits.** Flat ground. The middle 200×200 pixels of larger frames. In frames of 200×200 corners are found up to
//! some 16 pixels from where they should be, less in smaller ones; windows are not turned or scaled, which is good for 8°
//! of yaw or 8 % of altitude between two frames. A frame torn in the middle is refused; of one torn near its border the
//! larger part counts. `f32` positions resolve a hundredth of a pixel up to some 1,000 sides from the origin.

mod corner;
mod digest;
mod follow;
mod frames;
mod ground;
mod level;
mod odometry;
mod patch;
mod placement;
mod regions;
mod similarity;
#[cfg(test)]
mod tests;
mod tracks;

pub use digest::{digest, see_ground};
pub use level::{MAX_SIDE_PX, frames_len};
pub use odometry::Odometry;
pub use placement::{Covariance, Displacement, Placement};

/// The longest side of the square that the reference board tracks in, in pixels: of frames of 160×120 and 128×128 all.
pub const BOARD_SIDE_PX: u16 = 128;

/// An odometry that the reference board has room for.
pub type BoardOdometry = Odometry<{ frames_len(BOARD_SIDE_PX) }>;

/// Corners that are tracked at most: the number that the budget is made for.
pub const MAX_TRACKS: usize = 20;

/// Windows around corners this far from the border, in pixels, fit on the half-sized level: seven of its pixels, and two
/// to spare.
const INNER_PX: f32 = 18.0;

/// A corner that is followed from frame to frame.
///
/// Positions are [x, y] in pixels from the top-left corner of the tracked square: the frame's largest centered square, or
/// the middle [`MAX_SIDE_PX`] pixels of a larger one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Track {
    /// No other track of the same odometry has this number.
    pub id: u32,
    /// Frames since it was detected.
    pub age: u16,
    /// Where it is in the present frame.
    pub at_px: [f32; 2],
    /// Where it was in the frame before.
    pub before_px: [f32; 2],
    /// Where it was found in the frame that is looked at.
    found_px: Option<[f32; 2]>,
    /// Where it is in the frame that it is tracked from.
    reference_px: [f32; 2],
    /// Where it lies in the plane of path integration, in sides: as seen when it was detected.
    anchor: [f32; 2],
}

impl Track {
    /// Whether it can be found some way off: windows fit on coarser levels.
    fn is_inner(&self, side_px: u16) -> bool {
        let inner = INNER_PX..=f32::from(side_px) - INNER_PX;
        self.at_px.iter().all(|at| inner.contains(at))
    }

    /// How far it moved since the frame that it is tracked from, in pixels, squared.
    fn moved_squared(&self) -> f32 {
        let [dx, dy] = [0, 1].map(|axis| self.at_px[axis] - self.reference_px[axis]);
        dx * dx + dy * dy
    }
}
