//! Path integration: frames → where the vehicle is, relative to where it started.

use core::f32::consts::PI;

use nalgebra::Vector4;

use super::{
    Track,
    frames::Frames,
    ground::Ground,
    level::{Level, MAX_SIDE_PX, frames_len},
    placement::{Covariance, Displacement, Placement, is_covariance, of_fit, propagated, turned},
    similarity::{Agreement, Similarity},
    tracks::Tracks,
};
use crate::{
    frame::Frame,
    math::{MAX_TURN_RAD, turn},
    preprocess::Tilt,
};

/// When the vehicle turned by this since the reference frame, in radians, or changed its altitude by this share, the
/// present frame takes its place: windows are not turned or scaled.
const RENEW_TURN: f32 = 0.04;

/// A fit's errors enter the map of anchors with the new ones among them, by this factor; see the module's notes.
const GROWTH: f32 = 2.5;

/// Visual path integration: corners of the ground, and where the vehicle is among them. `FRAMES` bytes for frames, see
/// [`frames_len`], and 1,232 more.
///
/// # Examples
/// ```
/// use eigenmark_core::{frame::Frame, track::{Odometry, Placement, see_ground}};
/// let mut odometry = Box::new(Odometry::whole()); // on a board: a static
/// let mut pixels = [0; 120 * 120];
/// for frames in 0..3 {
///     // Four hundredths of a side to the right per frame.
///     let at = Placement { x: 0.04 * frames as f32, ..Placement::ORIGIN };
///     see_ground(&at, 120, &mut pixels);
///     let moved = odometry.advance(&Frame::new(&pixels, 120, 120, 120)?, None);
///     assert_eq!(moved.is_some(), frames > 0);
/// }
/// let found = odometry.placement();
/// assert!((found.x - 0.08).abs() < 0.001 && found.y.abs() < 0.001);
/// # Ok::<(), eigenmark_core::frame::FrameError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Odometry<const FRAMES: usize = { frames_len(MAX_SIDE_PX) }> {
    frames: Frames<FRAMES>,
    tracks: Tracks,
    /// From ground positions below the vehicle to the plane; none is the origin. So an odometry starts as nothing but
    /// zeros, and a static one needs no copy in flash.
    pose: Option<Similarity>,
    /// The turn of the pose at the reference.
    reference_turn: [f32; 2],
    /// From ground positions below the vehicle at the present frame to those at the one before, if known.
    motion: Option<Similarity>,
    /// Of the place of all anchors, seen from the vehicle.
    common: Covariance,
    /// Of the vehicle's place among the anchors.
    fit: Covariance,
    /// The last frame could not be related to the one that is tracked from; the next one may be.
    is_waiting: bool,
}

const _: () = assert!(size_of::<Odometry>() <= 68 * 1024);

const ZERO: Covariance = Covariance::from_array_storage(nalgebra::ArrayStorage([[0.0; 4]; 4]));

impl Odometry {
    /// A [`new`](Self::new) one for squares of up to [`MAX_SIDE_PX`].
    #[must_use]
    pub const fn whole() -> Self {
        Self::new()
    }
}

impl<const FRAMES: usize> Odometry<FRAMES> {
    /// At the origin, heading up, at nominal altitude; nothing has been seen.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            frames: Frames::new(),
            tracks: Tracks::new(),
            pose: None,
            reference_turn: [0.0; 2],
            motion: None,
            common: ZERO,
            fit: ZERO,
            is_waiting: false,
        }
    }

    /// Begins anew, as [`new`](Self::new) does, in place: it is too large for the stack of a board.
    pub fn reset(&mut self) {
        let Self {
            frames,
            tracks,
            pose,
            reference_turn,
            motion,
            common,
            fit,
            is_waiting,
        } = self;
        frames.reset();
        *tracks = Tracks::new();
        (*pose, *motion) = (None, None);
        *reference_turn = [0.0; 2];
        (*common, *fit) = (ZERO, ZERO);
        *is_waiting = false;
    }

    /// Takes the vehicle to be at `start`, known to `covariance`, as after a fix. Corners that are tracked stay so.
    ///
    /// Does nothing and says `false` when the start is not [valid](Placement::is_valid), a number of the covariance is
    /// not finite, or a variance is negative.
    pub fn restart(&mut self, start: Placement, covariance: &Covariance) -> bool {
        if !start.is_valid() || !is_covariance(covariance) {
            return false;
        }
        self.move_to(start.similarity());
        self.common = *covariance;
        self.fit = ZERO;
        true
    }

    /// Takes in the next frame. `tilt` is what is known of roll and pitch when it was taken.
    ///
    /// `None` when it cannot be related to those before: it is the first, of another size, flat, torn, or shows somewhere
    /// else. The placement stays. One such frame may only be a bad one: it is passed over, and the next frame's
    /// displacement is that since the frame before it ([`is_waiting`](Self::is_waiting)). When the next one cannot be
    /// related either, it is what later frames are related to, and the caller may [`skip`](Self::skip) what is known of
    /// the displacement otherwise.
    #[inline(never)]
    pub fn advance(&mut self, frame: &Frame<'_>, tilt: Option<Tilt>) -> Option<Displacement> {
        let base = Level::of(frame, Frames::<FRAMES>::MAX_SIDE_PX);
        let square_px = frame.square_side();
        let ground = Ground::new(square_px, base.side, tilt);
        let is_alike = self.frames.present(&base, square_px);
        let displacement = if is_alike {
            self.track(&base, &ground)
        } else {
            None
        };
        let was_waiting = core::mem::take(&mut self.is_waiting);
        if displacement.is_none() {
            if is_alike && !was_waiting && self.tracks.are_enough() {
                self.is_waiting = true;
                return None;
            }
            self.tracks.clear();
            self.motion = None;
            self.common += self.fit;
            self.fit = ZERO;
        }
        if displacement.is_none() || self.tracks.are_due() || self.is_turned() {
            self.renew(&base, square_px, &ground);
        }
        displacement
    }

    /// Whether the last frame was passed over: the next one may still be related to those before it.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.is_waiting
    }

    /// Where the vehicle is.
    #[must_use]
    pub fn placement(&self) -> Placement {
        Placement::of(&self.pose())
    }

    /// Of x, y, heading and the logarithm of the altitude ratio.
    #[must_use]
    pub fn covariance(&self) -> Covariance {
        self.common + self.fit
    }

    /// The corners that are tracked.
    #[must_use]
    pub fn tracks(&self) -> &[Track] {
        self.tracks.as_slice()
    }

    /// Takes in a displacement that was not seen: dead reckoning, after [`advance`](Self::advance) gave `None`.
    ///
    /// Does nothing and says `false` when a number is not finite, the turn not within
    /// [`MAX_ANGLE_RAD`](crate::math::MAX_ANGLE_RAD), the scale not positive, or a variance negative, and while it
    /// [waits](Self::is_waiting): the next frame may show that displacement.
    pub fn skip(&mut self, displacement: &Displacement) -> bool {
        let d = displacement;
        let step = Placement {
            x: d.right,
            y: -d.forward,
            heading_rad: d.yaw_rad,
            altitude_ratio: d.scale,
        };
        if self.is_waiting || !step.is_valid() || !is_covariance(&d.covariance) {
            return false;
        }
        // Lengths are not those of the ground at this altitude: only the heading turns them.
        let (x, y) = self.to_plane([step.x, step.y]);
        let mut pose = Similarity {
            turn: self.pose().rotate(step.similarity().turn),
            shift: self.pose().shift,
        };
        pose.shift[0] += x;
        pose.shift[1] += y;
        if !Placement::of(&pose).is_valid() {
            return false;
        }
        let growth = forward_right_to_plane(&d.covariance, self.heading());
        self.move_to(pose);
        self.common = propagated(&self.common, [x, y]) + growth;
        true
    }

    /// Takes in what a compass says of the heading, in radians, with its variance: a Kalman update.
    ///
    /// Does nothing and says `false` when a number is not finite, the heading is none ([`turn`]), or the variance is
    /// not positive.
    pub fn correct_heading(&mut self, heading_rad: f32, variance: f32) -> bool {
        let turn = turn(self.placement().heading_rad, heading_rad);
        turn.abs() < MAX_TURN_RAD && self.correct(2, turn.clamp(-PI, PI), variance)
    }

    /// Takes in what an altimeter says of the altitude ratio, with its variance: a Kalman update of its logarithm.
    ///
    /// Does nothing and says `false` when a number is not finite, or the ratio or the variance not positive.
    pub fn correct_altitude(&mut self, altitude_ratio: f32, variance: f32) -> bool {
        let now = self.placement().altitude_ratio;
        if !altitude_ratio.is_finite() || altitude_ratio <= 0.0 {
            return false;
        }
        let square = altitude_ratio * altitude_ratio;
        self.correct(3, libm::logf(altitude_ratio / now), variance / square)
    }

    /// Takes the placement to be known less well by that, in the plane's axes: for errors that frames do not show.
    ///
    /// Does nothing and says `false` when a number is not finite, or a variance negative.
    pub fn widen(&mut self, by: &Covariance) -> bool {
        let is_usable = is_covariance(by);
        if is_usable {
            self.common += by;
        }
        is_usable
    }

    /// A Kalman update by the innovation of one of the four numbers.
    fn correct(&mut self, index: usize, innovation: f32, variance: f32) -> bool {
        let is_usable = variance.is_finite() && variance > 0.0 && innovation.is_finite();
        let column: Vector4<f32> = match index {
            2 => self.common.column(2).into(),
            _ => self.common.column(3).into(),
        };
        let own = if index == 2 { column.z } else { column.w };
        // What a fit errs is not the anchors' error: it is another in the next frame.
        let fit = if index == 2 {
            self.fit.m33
        } else {
            self.fit.m44
        };
        let total = own + fit + variance;
        if !is_usable || !total.is_finite() || total <= 0.0 {
            return false;
        }
        let gain = column / total;
        let by = gain * innovation;
        let placement = self.placement();
        let corrected = Placement {
            x: placement.x + by.x,
            y: placement.y + by.y,
            heading_rad: placement.heading_rad + by.z,
            altitude_ratio: placement.altitude_ratio * libm::expf(by.w),
        };
        if !corrected.is_valid() {
            return false;
        }
        self.common -= gain * column.transpose();
        self.move_to(corrected.similarity());
        true
    }

    /// Moves the vehicle, and with it all that it sees.
    fn move_to(&mut self, pose: Similarity) {
        let moved = pose.after(&self.pose().inverse());
        self.tracks.move_anchors(&moved);
        self.reference_turn = moved.rotate(self.reference_turn);
        self.pose = Some(pose);
    }

    /// Finds the corners in the present frame, whose halves are up to date, and the pose that they agree on.
    #[inline(never)]
    fn track(&mut self, base: &Level<'_>, ground: &Ground) -> Option<Displacement> {
        let pyramids = self.frames.pyramids(base);
        // The vehicle goes on as it went, or it does not.
        let motion = self.motion.unwrap_or(Similarity::IDENTITY);
        let to_ground = self.pose().after(&motion).inverse();
        let goes_on = |track: &Track| ground.project(to_ground.apply(track.anchor));
        let mut found = self.tracks.find(&pyramids, ground, goes_on);
        if found.is_none() {
            found = self
                .tracks
                .find(&pyramids, ground, |track| Some(track.at_px));
        }
        let (agreement, tracked) = found?;
        self.tracks.settle(&agreement, base.side);
        self.arrive(&agreement, tracked)
    }

    /// Takes over the pose that corners agree on.
    fn arrive(&mut self, agreement: &Agreement, tracked: u8) -> Option<Displacement> {
        let before = self.placement();
        let heading = self.heading();
        let [from, to] = [self.pose(), agreement.similarity];
        let motion = from.inverse().after(&to);
        let after = Placement::of(&to);
        let way = [after.x - before.x, after.y - before.y];
        if !after.is_valid() {
            return None;
        }
        let fit = of_fit(agreement);
        let both = fit + self.fit;
        self.common = propagated(&self.common, way);
        self.fit = fit;
        self.pose = Some(to);
        self.motion = Some(motion);
        let [c, s] = heading;
        let turn = Placement::of(&motion);
        Some(Displacement {
            forward: way[0] * s - way[1] * c,
            right: way[0] * c + way[1] * s,
            yaw_rad: turn.heading_rad,
            scale: turn.altitude_ratio,
            covariance: plane_to_forward_right(&both, heading),
            tracked,
            inliers: agreement.inliers.count_ones() as u8,
        })
    }

    /// Whether the vehicle turned or climbed so far since the reference that windows look another way.
    fn is_turned(&self) -> bool {
        // The present turn, seen from the reference's.
        let [c, s] = self.reference_turn;
        let [now_c, now_s] = self.pose().turn;
        let square = c * c + s * s;
        let (along, across) = (c * now_c + s * now_s - square, c * now_s - s * now_c);
        along.abs().max(across.abs()) > RENEW_TURN * square
    }

    /// Makes the present frame the reference, and looks for new corners in it.
    fn renew(&mut self, base: &Level<'_>, square_px: u16, ground: &Ground) {
        let pose = self.pose();
        self.reference_turn = pose.turn;
        // Where the ground goes in the frame.
        let flow = self
            .motion
            .map_or([0.0; 2], |motion| motion.inverse().shift);
        let levels = self.frames.keep(base, square_px);
        let share = self.tracks.renew(&levels, ground, &pose, flow);
        self.common += self.fit * (GROWTH * share);
    }

    fn pose(&self) -> Similarity {
        self.pose.unwrap_or(Similarity::IDENTITY)
    }

    /// Cosine and sine of the heading.
    fn heading(&self) -> [f32; 2] {
        let pose = self.pose();
        let scale = 1.0 / crate::math::sqrt(pose.scale_squared());
        pose.turn.map(|part| part * scale)
    }

    /// [right, behind] the vehicle, in the plane's axes.
    fn to_plane(&self, [right, behind]: [f32; 2]) -> (f32, f32) {
        let [c, s] = self.heading();
        (right * c - behind * s, right * s + behind * c)
    }
}

impl<const FRAMES: usize> Default for Odometry<FRAMES> {
    fn default() -> Self {
        Self::new()
    }
}

/// A covariance in the plane's axes, of forward and right at a heading.
fn plane_to_forward_right(covariance: &Covariance, [c, s]: [f32; 2]) -> Covariance {
    // forward = (s, −c), right = (c, s): a turn by 90° less the heading.
    turned(covariance, [s, c])
}

fn forward_right_to_plane(covariance: &Covariance, [c, s]: [f32; 2]) -> Covariance {
    turned(covariance, [s, -c])
}
