//! Path integration: frames → where the vehicle is, relative to where it started.

use core::f32::consts::{PI, TAU};

use heapless::Vec;
use nalgebra::Vector4;

use super::{
    MAX_TRACKS, Track,
    corner::Candidates,
    follow::follow,
    ground::Ground,
    level::{Base, Halves, Level},
    placement::{Covariance, Displacement, Placement, is_covariance, of_fit, propagation, turned},
    similarity::{Agreement, Pair, Similarity, agree},
};
use crate::{frame::Frame, preprocess::Tilt};

/// Corners that tell others where to look.
const SURPRISES: usize = 5;
const MIN_SURPRISES: usize = 3;

/// With fewer corners, new ones are looked for everywhere.
const FEW: usize = MAX_TRACKS / 2;

/// Corners that must agree, at least; and as shares of those found again, and of those that should have been: half a
/// frame from another time has half of the corners, and is refused.
const MIN_INLIERS: usize = 6;
const MIN_PERCENT_OF_FOUND: usize = 60;
const MIN_PERCENT_OF_VISIBLE: usize = 40;

/// How far from where a corner should be it may be found to agree, in pixels.
const LIMIT_PX: f32 = 2.5;

/// No fit is better than this, in pixels: the error of a corner on a noiseless frame.
const FLOOR_PX: f32 = 0.05;

/// The smallest distance of two corners that may fix a similarity, as a share of the side.
const LEAST_BASE: f32 = 0.15;

/// When corners moved by this on average since the reference frame, in pixels, the present one takes its place.
const RENEW_PX: f32 = 6.0;

/// The same for turns, in radians, and relative changes of altitude: windows are not turned or scaled.
const RENEW_TURN: f32 = 0.04;

/// A corner is dropped where its window will not fit any more: half a window, a difference, and a pixel to spare.
const MARGIN_PX: f32 = 8.0;

/// The outgoing region: beyond this share of the side from the middle, along the way of the ground.
const OUTGOING: f32 = 0.3;

/// A fit's errors enter the map of anchors with the new ones among them, by this factor; see the module's notes.
const GROWTH: f32 = 2.5;

/// Visual path integration: 66 KiB of state.
#[derive(Clone, Debug)]
pub struct Odometry {
    /// The frame that corners are tracked from.
    base: Base,
    /// Its halves, and those of the present frame, in this order or the other.
    halves: [Halves; 2],
    is_swapped: bool,
    /// Side of the reference's square and of the part that is tracked, in pixels; 0 before the first frame.
    square_px: u16,
    side_px: u16,
    tracks: Vec<Track, MAX_TRACKS>,
    next_id: u32,
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
}

const _: () = assert!(size_of::<Odometry>() <= 68 * 1024);

const ZERO: Covariance = Covariance::from_array_storage(nalgebra::ArrayStorage([[0.0; 4]; 4]));

impl Odometry {
    /// At the origin, heading up, at nominal altitude; nothing has been seen.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            base: Base::new(),
            halves: [Halves::new(), Halves::new()],
            is_swapped: false,
            square_px: 0,
            side_px: 0,
            tracks: Vec::new(),
            next_id: 0,
            pose: None,
            reference_turn: [0.0; 2],
            motion: None,
            common: ZERO,
            fit: ZERO,
        }
    }

    /// Takes the vehicle to be at `start`, known to `covariance`, as after a fix. Corners that are tracked stay so.
    ///
    /// Does nothing and says `false` when a number is not finite, the altitude or a variance not positive or zero.
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
    /// `None` when it cannot be related to the one before: it is the first, of another size, flat, torn, or shows
    /// somewhere else. The placement stays, the frame is what the next is related to, and the caller may
    /// [`skip`](Self::skip) what is known of the displacement otherwise.
    pub fn advance(&mut self, frame: &Frame<'_>, tilt: Option<Tilt>) -> Option<Displacement> {
        let base = Level::of(frame);
        let square_px = frame.square_side();
        let ground = Ground::new(square_px, base.side, tilt);
        self.halves_of_both().1.halve(&base);
        let is_comparable = (square_px, base.side) == (self.square_px, self.side_px);
        let displacement = if is_comparable {
            self.track(&base, &ground)
        } else {
            None
        };
        if displacement.is_none() {
            self.tracks.clear();
            self.motion = None;
            self.common += self.fit;
            self.fit = ZERO;
            (self.square_px, self.side_px) = (square_px, base.side);
        }
        if displacement.is_none() || self.is_due() {
            self.renew(&base, &ground);
        }
        displacement
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
        &self.tracks
    }

    /// Takes in a displacement that was not seen: dead reckoning, after [`advance`](Self::advance) gave `None`.
    ///
    /// Does nothing and says `false` when a number is not finite, the scale not positive, or a variance negative.
    pub fn skip(&mut self, displacement: &Displacement) -> bool {
        let d = displacement;
        let step = Placement {
            x: d.right,
            y: -d.forward,
            heading_rad: d.yaw_rad,
            altitude_ratio: d.scale,
        };
        if !step.is_valid() || !is_covariance(&d.covariance) {
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
        let growth = forward_right_to_plane(&d.covariance, self.heading());
        self.move_to(pose);
        let propagation = propagation([x, y]);
        self.common = propagation * self.common * propagation.transpose() + growth;
        true
    }

    /// Takes in what a compass says of the heading, in radians, with its variance: a Kalman update.
    ///
    /// Does nothing and says `false` when a number is not finite or the variance not positive.
    pub fn correct_heading(&mut self, heading_rad: f32, variance: f32) -> bool {
        let turn = heading_rad - self.placement().heading_rad;
        if !turn.is_finite() {
            return false;
        }
        let turns = turn / TAU;
        let turn = turn - TAU * libm::floorf(turns + 0.5);
        self.correct(2, turn.clamp(-PI, PI), variance)
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
        self.common -= gain * column.transpose();
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
        self.move_to(corrected.similarity());
        true
    }

    /// Moves the vehicle, and with it all that it sees.
    fn move_to(&mut self, pose: Similarity) {
        let moved = pose.after(&self.pose().inverse());
        for track in &mut self.tracks {
            track.anchor = moved.apply(track.anchor);
        }
        self.reference_turn = moved.rotate(self.reference_turn);
        self.pose = Some(pose);
    }

    /// The halves of the reference and of the present frame.
    fn halves_of_both(&mut self) -> (&mut Halves, &mut Halves) {
        let [first, second] = &mut self.halves;
        if self.is_swapped {
            (second, first)
        } else {
            (first, second)
        }
    }

    /// Finds the corners in the present frame, whose halves are up to date, and the pose that they agree on.
    #[inline(never)]
    fn track(&mut self, base: &Level<'_>, ground: &Ground) -> Option<Displacement> {
        let (reference, present) = if self.is_swapped {
            (&self.halves[1], &self.halves[0])
        } else {
            (&self.halves[0], &self.halves[1])
        };
        let from = reference.under(self.base.level(self.side_px));
        let to = present.under(*base);
        // The vehicle goes on as it went.
        let motion = self.motion.unwrap_or(Similarity::IDENTITY);
        let to_ground = self.pose().after(&motion).inverse();
        let mut surprises = Surprises::default();
        for is_inner in [true, false] {
            for track in &mut self.tracks {
                let guess = ground.project(to_ground.apply(track.anchor));
                let Some(guess) = guess.filter(|_| is_inner == track.is_inner(self.side_px)) else {
                    continue;
                };
                track.before_px = track.at_px;
                track.found_px = follow(&from, &to, track.reference_px, surprises.add_to(guess));
                if let Some(found) = track.found_px {
                    surprises.note(guess, found);
                }
            }
        }
        let mut pairs: Vec<Pair, MAX_TRACKS> = Vec::new();
        for track in &mut self.tracks {
            let from = track.found_px.and_then(|found| ground.level(found));
            let pair = from.map(|from| Pair {
                from,
                to: track.anchor,
            });
            if pair.is_none_or(|pair| pairs.push(pair).is_err()) {
                track.found_px = None;
            }
        }
        let per_px = ground.per_px();
        let least = LEAST_BASE * f32::from(self.side_px) * per_px;
        let agreement = agree(&pairs, LIMIT_PX * per_px, FLOOR_PX * per_px, least)?;
        let inliers = agreement.inliers.count_ones() as usize;
        let visible = self.count_visible(&agreement.similarity, ground);
        let is_share = |of: usize, percent: usize| inliers * 100 >= of * percent;
        let is_most = is_share(pairs.len(), MIN_PERCENT_OF_FOUND);
        if inliers < MIN_INLIERS || !is_most || !is_share(visible, MIN_PERCENT_OF_VISIBLE) {
            return None;
        }
        let mut index = 0;
        self.tracks.retain_mut(|track| {
            let Some(found) = track.found_px.take() else {
                return false;
            };
            track.at_px = found;
            track.age = track.age.saturating_add(1);
            let is_inlier = agreement.inliers >> index & 1 == 1;
            index += 1;
            is_inlier
        });
        let last = f32::from(self.side_px) - MARGIN_PX;
        self.tracks.retain(|track| {
            let stays = |axis: usize| {
                let next = 2.0 * track.at_px[axis] - track.before_px[axis];
                (MARGIN_PX..=last).contains(&next)
            };
            stays(0) && stays(1)
        });
        self.arrive(&agreement, pairs.len() as u8)
    }

    /// Corners that the frame shows when it was taken at that pose.
    fn count_visible(&self, pose: &Similarity, ground: &Ground) -> usize {
        let (to_ground, regions) = (pose.inverse(), Regions::new(self.side_px, [0.0; 2]));
        let is_visible = |track: &&Track| {
            let at = ground.project(to_ground.apply(track.anchor));
            at.is_some_and(|at| regions.is_inside(at))
        };
        self.tracks.iter().filter(is_visible).count()
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
        let propagation = propagation(way);
        self.common = propagation * self.common * propagation.transpose();
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

    /// Whether the present frame should become the reference.
    fn is_due(&self) -> bool {
        if self.tracks.len() < FEW {
            return true;
        }
        // The present turn, seen from the reference's.
        let [c, s] = self.reference_turn;
        let [now_c, now_s] = self.pose().turn;
        let square = c * c + s * s;
        let (along, across) = (c * now_c + s * now_s - square, c * now_s - s * now_c);
        if along.abs().max(across.abs()) > RENEW_TURN * square {
            return true;
        }
        let squares: f32 = self.tracks.iter().map(Track::moved_squared).sum();
        squares > RENEW_PX * RENEW_PX * self.tracks.len() as f32
    }

    /// Makes the present frame the reference, and looks for new corners in it.
    #[inline(never)]
    fn renew(&mut self, base: &Level<'_>, ground: &Ground) {
        self.base.copy(base);
        self.is_swapped = !self.is_swapped;
        self.reference_turn = self.pose().turn;
        for track in &mut self.tracks {
            track.reference_px = track.at_px;
        }
        let old = self.tracks.len();
        if old == MAX_TRACKS {
            return;
        }
        let half = self.halves_of_both().0.under(*base)[1];
        let mut candidates = Candidates::none();
        candidates.find(base, &half);
        // Where the ground goes in the frame.
        let flow = self
            .motion
            .map_or([0.0; 2], |motion| motion.inverse().shift);
        let regions = Regions::new(self.side_px, flow);
        let is_few = old < FEW;
        let corners = candidates.spread(&self.tracks, MAX_TRACKS - old, |at_px| {
            regions.is_inside(at_px) && (is_few || !regions.is_outgoing(at_px))
        });
        for corner in &corners {
            let Some(below) = ground.level(corner.at_px) else {
                continue;
            };
            let track = Track {
                id: self.next_id,
                age: 0,
                at_px: corner.at_px,
                before_px: corner.at_px,
                found_px: None,
                reference_px: corner.at_px,
                anchor: self.pose().apply(below),
            };
            if self.tracks.push(track).is_ok() {
                self.next_id = self.next_id.wrapping_add(1);
            }
        }
        let share = (self.tracks.len() - old) as f32 / self.tracks.len().max(1) as f32;
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

impl Default for Odometry {
    fn default() -> Self {
        Self::new()
    }
}

/// How far corners were from where they should have been.
#[derive(Default)]
struct Surprises {
    moves: Vec<[f32; 2], SURPRISES>,
}

impl Surprises {
    /// Where a corner should be, seeing where others were: moved by the medians of the first ones' surprises.
    fn add_to(&self, guess: [f32; 2]) -> [f32; 2] {
        if self.moves.len() < MIN_SURPRISES {
            return guess;
        }
        [guess[0] + self.median(0), guess[1] + self.median(1)]
    }

    fn note(&mut self, guess: [f32; 2], found: [f32; 2]) {
        // Those that come when it is full are not needed.
        let _ = self.moves.push([found[0] - guess[0], found[1] - guess[1]]);
    }

    /// The one that as many are above as below; of an even number the upper of the two.
    fn median(&self, axis: usize) -> f32 {
        let values = || {
            self.moves
                .iter()
                .filter_map(move |by| by.get(axis).copied())
        };
        let below = |value: f32| values().filter(|&other| other < value).count();
        let half = self.moves.len() / 2;
        let is_median = |&value: &f32| {
            let equal = values().filter(|&other| other == value).count();
            (below(value)..below(value) + equal).contains(&half)
        };
        values().find(is_median).unwrap_or_default()
    }
}

/// Regions of the frame by the way of the ground through it.
struct Regions {
    side_px: f32,
    /// Unit vector of the ground's way, or none when it stands still.
    way: [f32; 2],
}

impl Regions {
    fn new(side_px: u16, [x, y]: [f32; 2]) -> Self {
        let length = crate::math::sqrt(x * x + y * y);
        // Half a percent of the side: a pixel of 200.
        let is_moving = length > 0.005;
        Self {
            side_px: side_px.into(),
            way: if is_moving {
                [x / length, y / length]
            } else {
                [0.0; 2]
            },
        }
    }

    /// Whether a window fits around it.
    fn is_inside(&self, at_px: [f32; 2]) -> bool {
        let inside = MARGIN_PX..=self.side_px - MARGIN_PX;
        at_px.iter().all(|at| inside.contains(at))
    }

    fn is_outgoing(&self, at_px: [f32; 2]) -> bool {
        let [x, y] = at_px.map(|at| at - self.side_px / 2.0);
        x * self.way[0] + y * self.way[1] > OUTGOING * self.side_px
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
