//! Frames and instruments → commands: everything that flies, put together.
//!
//! **What.** For every frame: path integration says how the vehicle moved, the belief moves with it; the frame, levelled
//! by what the instruments say, is located and observed; the mission turns what is believed into a heading and a speed.
//! With several goals the vehicle flies from one to the next; a goal that no way leads to is left out.
//!
//! **Memory.** What is large lies in a [`Memory`], which is const-constructible, for a `static` on a board.
//!
//! **Cost.** On the target, from a frame of 160×120 to a command, with 3,621 landmarks of 48 dimensions (8 bits) and 4,941
//! states: 2,943,077 instructions in the costliest step of a flight; 5,163,720 in the costliest that is known, when no
//! corner is found again and the belief spreads as widely as it ever does. A frame of thirty per second has 5,600,000 at
//! 168 MHz. A landmark more costs some 200, a state more 50 to 205.
//!
//! **A wrong compass.** Where landmarks were stored at one heading, frames are levelled by the compass. How far it is off
//! is learned from how alike frames and landmarks look (`compass`): what is believed of the heading is corrected by that, and
//! commands are given in what the compass will read. Where a reading is missing, path integration goes on from the last one.
//! With several headings, commands are headings on the map.
//!
//! **Without an instrument.** Without a compass the heading is what landmarks at several headings say, or else that of
//! path integration; without an altimeter the altitude is; without roll and pitch the camera is taken to look straight
//! down. Without a frame, or when a frame cannot be related to the one before, the vehicle is taken to move on as it did.

mod compass;
pub(crate) mod dead_reckoning;
mod digest;
#[cfg(test)]
mod tests;

use core::ops::DerefMut;

use heapless::Deque;

use crate::{
    atlas::Atlas,
    belief::{Belief, Estimate, Motion, Observation},
    frame::Frame,
    localizer::{Fix, Localizer},
    math::{sqrt, wrapped},
    mission::{Command, Limits, Mission, Situation, State},
    preprocess::{Coverage, MAX_ALTITUDE_RATIO, MIN_ALTITUDE_RATIO, Pose, Tilt},
    route::{Leg, RouteError, Router},
    track::{BoardOdometry, Displacement},
};

use compass::Compass;
use dead_reckoning::DeadReckoning;

pub use digest::digest;

/// States of the belief that the reference board has room for: in its 128 KiB, beside 20 KiB of stack, a frame of
/// 160×120, the odometry, links and [`BOARD_PLACES`]. It is a cell for every landmark, and on to the
/// borders, of a map of 1600×1200 pixels with a landmark every 20.
pub const BOARD_STATES: usize = 4992;

/// Places that the reference board has room for, beside [`BOARD_STATES`].
pub const BOARD_PLACES: usize = 320;

/// What else flies takes 8 KiB at most.
const _: () = {
    let frame = 160 * 120;
    assert!(size_of::<BoardMemory>() + frame + 8 * 1024 <= 108 * 1024 - 128);
};

/// Goals that can be given at once.
pub const MAX_GOALS: usize = 32;

/// What the vehicle is believed to be off by after a way, as a share of it: of a compass that is wrong by 10°.
const ASTRAY: f32 = 0.15;

/// How long that error stays the same, as a share of a view's side.
const ASTRAY_FOR: f32 = 0.1;

/// Probability per frame that the vehicle was carried away unseen.
const CARRIED_AWAY: f32 = 1e-4;

/// The same for a frame that cannot be related to the one before.
const CARRIED_AWAY_IF_UNRELATED: f32 = 0.3;

/// Way after which frames are independent of each other, as a share of a view's side, and the least worth of one.
const INDEPENDENT: f32 = 0.1;
const LEAST_WORTH: f32 = 0.05;

/// How wrong a compass is believed to be at most, where landmarks were stored at several headings: 15°.
const COMPASS_TOLERANCE_RAD: f32 = 15.0_f32.to_radians();

/// Variances of a compass (8°, in squared radians) and of an altimeter (1.8 %, relative), and for how long their errors stay
/// alike, in seconds: of what they say meanwhile, all together counts once. That is twice the time that a walking error
/// takes to forget where it was. One that is wrong by at most 10° errs by 6°; path integration does better to trust it less.
const COMPASS_VARIANCE: f32 = 0.14 * 0.14;
const ALTIMETER_VARIANCE: f32 = 0.018 * 0.018;
const ALIKE_FOR_S: f32 = 120.0;

/// What the instruments say when a frame is taken; what is missing is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings {
    /// Heading in radians, clockwise from map-up.
    pub heading_rad: Option<f32>,
    /// Roll and pitch, and the camera's field of view.
    pub tilt: Option<Tilt>,
    /// Actual over nominal altitude.
    pub altitude_ratio: Option<f32>,
}

/// What the reference board has room for.
pub type BoardMemory = Memory<BOARD_STATES, BOARD_PLACES>;

/// What flies on the reference board.
pub type BoardNavigator<'a> = Navigator<'a, &'a mut BoardMemory, BOARD_STATES, BOARD_PLACES>;

/// What a navigator has room for: `STATES` of the belief (6 bytes each), `PLACES` of the topological map (8 bytes each),
/// and 27 KiB of path integration.
#[derive(Clone, Debug)]
pub struct Memory<const STATES: usize, const PLACES: usize> {
    odometry: BoardOdometry,
    belief: Belief<STATES>,
    router: Router<PLACES>,
}

/// Flies an atlas's routes, in a memory that it owns or borrows: `&mut Memory` on a board, a box on a host.
#[derive(Debug)]
pub struct Navigator<'a, M, const STATES: usize, const PLACES: usize> {
    localizer: Localizer<'a>,
    memory: M,
    goals: Deque<u16, MAX_GOALS>,
    mission: Mission,
    reckoning: DeadReckoning,
    compass: Compass,
    has_seen: bool,
}

/// What a navigator makes of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guidance {
    /// What the autopilot is asked to do.
    pub command: Command,
    /// Where the mission stands.
    pub state: State,
    /// The leg that is followed.
    pub leg: Option<Leg>,
    /// Where the vehicle is believed to be; `None` before the first frame.
    pub estimate: Option<Estimate>,
    /// The nearest landmark of this frame.
    pub fix: Option<Fix>,
    /// How the vehicle moved since the frame before, when that could be seen.
    pub displacement: Option<Displacement>,
}

impl<const STATES: usize, const PLACES: usize> Memory<STATES, PLACES> {
    /// Nothing yet: all zeros, so that a static one needs no copy in flash.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            odometry: BoardOdometry::new(),
            belief: Belief::new(),
            router: Router::new(),
        }
    }
}

impl<const STATES: usize, const PLACES: usize> Default for Memory<STATES, PLACES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'a, M, const STATES: usize, const PLACES: usize> Navigator<'a, M, STATES, PLACES>
where
    M: DerefMut<Target = Memory<STATES, PLACES>>,
{
    /// Begins anew with an atlas: it knows nothing, and has no goal.
    #[must_use]
    pub fn new(atlas: Atlas<'a>, mut memory: M) -> Self {
        let Memory {
            odometry,
            belief,
            router,
        } = &mut *memory;
        odometry.reset();
        belief.begin(&atlas);
        router.reset();
        let header = atlas.header();
        let limits = Limits::for_footprint(header.footprint_px).on_map(header.map_px);
        Self {
            localizer: Localizer::new(atlas),
            memory,
            goals: Deque::new(),
            mission: Mission::new(limits),
            reckoning: DeadReckoning::default(),
            compass: Compass::default(),
            has_seen: false,
        }
    }

    /// Sets places (0-based) to fly to, one after the other, in place of those before. No places leave it with the
    /// present goal only. Goals beyond [`MAX_GOALS`], and those that no way leads to, are left out.
    ///
    /// # Errors
    /// When the first of them cannot be planned to; there is no goal then.
    pub fn go(&mut self, goals: &[u16]) -> Result<(), RouteError> {
        self.goals.clear();
        let Some((&first, rest)) = goals.split_first() else {
            return Ok(());
        };
        self.mission = self.mission.redirected();
        self.plan(first)?;
        for &goal in rest.iter().take(MAX_GOALS - 1) {
            // There is room: they were counted.
            let _ = self.goals.push_back(goal);
        }
        Ok(())
    }

    /// Goals after the present one.
    #[must_use]
    pub fn goals_left(&self) -> usize {
        self.goals.len()
    }

    /// What it believes.
    #[must_use]
    pub fn belief(&self) -> &Belief<STATES> {
        &self.memory.belief
    }

    /// The path so far, to which fixes add nothing.
    #[must_use]
    pub fn odometry(&self) -> &BoardOdometry {
        &self.memory.odometry
    }

    /// The same, to say where it starts.
    pub fn odometry_mut(&mut self) -> &mut BoardOdometry {
        &mut self.memory.odometry
    }

    /// The atlas that it flies by.
    #[must_use]
    pub fn atlas(&self) -> &Atlas<'a> {
        self.localizer.atlas()
    }

    /// Where a frame of nominal pose was taken, by itself: flight goes on as if it had not come.
    #[must_use]
    pub fn locate_alone(&mut self, frame: &Frame<'_>) -> Option<Fix> {
        self.localizer.locate(frame)
    }

    /// How much of its view the last frame showed; all of it before the first.
    #[must_use]
    pub fn coverage(&self) -> Coverage {
        self.localizer.coverage()
    }

    /// Takes in a frame and what the instruments said, `step_s` seconds after the one before; `None` when the camera
    /// gave nothing.
    pub fn advance(
        &mut self,
        frame: Option<&Frame<'_>>,
        readings: &Readings,
        step_s: f32,
    ) -> Guidance {
        let footprint_px = self.atlas().header().footprint_px;
        let (mut displacement, mut fix) = (None, None);
        self.reckoning.wait(step_s);
        if let Some(frame) = frame {
            displacement = self.memory.odometry.advance(frame, readings.tilt);
            self.correct(readings, step_s);
        }
        let is_compared = self.is_compared(readings);
        // Zero as long as nothing was compared.
        let deviation_rad = self.compass.deviation_rad();
        let integrated_rad = self.memory.odometry.placement().heading_rad;
        let read_rad = self.compass.read(readings.heading_rad, integrated_rad);
        let heading_rad = wrapped(read_rad - deviation_rad);
        // A frame that is passed over says nothing yet.
        let is_taken = frame.is_some() && !self.memory.odometry.is_waiting();
        let is_unrelated = is_taken && displacement.is_none();
        if let Some(motion) = self.motion(is_unrelated, displacement.as_ref(), footprint_px) {
            self.memory.belief.predict(&motion, heading_rad);
        }
        self.has_seen |= frame.is_some();
        if let Some(compass) = readings.heading_rad {
            self.memory.belief.gate(compass, COMPASS_TOLERANCE_RAD);
        }
        if let Some(frame) = frame {
            if is_unrelated {
                self.compass.forget_last();
            }
            let by_rad = if is_compared {
                self.compass.aside(heading_rad)
            } else {
                heading_rad
            };
            fix = self.locate(frame, readings, by_rad);
            if is_taken && let Some(fix) = &fix {
                if is_compared {
                    self.compass.learn(fix.distance * fix.distance);
                }
                let observation = Observation {
                    independent_px: INDEPENDENT * footprint_px,
                    least_worth: LEAST_WORTH,
                };
                let atlas = self.localizer.atlas();
                let coefficients = self.localizer.coefficients();
                self.memory
                    .belief
                    .observe(atlas, coefficients, &observation);
            }
        }
        let estimate = self
            .has_seen
            .then(|| self.memory.belief.estimate(footprint_px));
        let heading_rad = estimate.map_or(heading_rad, |estimate| estimate.heading_rad);
        self.decide(estimate, heading_rad, step_s);
        let command = self.mission.command();
        Guidance {
            // By the autopilot's compass.
            command: Command {
                heading_rad: wrapped(command.heading_rad + deviation_rad),
                ..command
            },
            state: self.mission.state(),
            leg: self.mission.leg(),
            estimate,
            fix,
            displacement,
        }
    }

    /// Path integration learns from the instruments, slowly.
    fn correct(&mut self, readings: &Readings, step_s: f32) {
        let times = ALIKE_FOR_S / step_s.clamp(1e-3, ALIKE_FOR_S);
        let odometry = &mut self.memory.odometry;
        // What is refused is no number.
        if let Some(heading) = readings.heading_rad {
            odometry.correct_heading(heading, COMPASS_VARIANCE * times);
        }
        if let Some(ratio) = readings.altitude_ratio {
            odometry.correct_altitude(ratio, ALTIMETER_VARIANCE * ratio * ratio * times);
        }
    }

    /// The mission's next step; at a goal, the next goal.
    fn decide(&mut self, estimate: Option<Estimate>, heading_rad: f32, step_s: f32) {
        let situation = Situation {
            estimate,
            heading_rad,
            drift_rad: self.reckoning.drift_rad(),
            step_s,
        };
        let topology = self.localizer.atlas().topology();
        let mission = self.mission.step(&situation, topology, &self.memory.router);
        self.mission = mission;
        let has_no_way = mission.state() == State::Following && mission.leg().is_none();
        if let Some(estimate) = estimate
            && (mission.state() == State::Arrived || has_no_way)
            && let Some(place) = topology.nearest(estimate.position)
        {
            self.go_on(place);
        }
    }

    /// Takes the next goal if a way leads to it from a place, or leaves it out: one plan is what a step has time for.
    fn go_on(&mut self, place: u16) {
        if let Some(goal) = self.goals.pop_front()
            && self.plan(goal).is_ok()
            && self.memory.router.length_px(place).is_some()
        {
            self.mission = self.mission.redirected();
        }
    }

    fn plan(&mut self, goal: u16) -> Result<(), RouteError> {
        let topology = self.localizer.atlas().topology();
        self.memory.router.plan(topology, goal)
    }

    /// Whether landmarks say how far the compass is off: there is one, and they were stored at one heading.
    fn is_compared(&self, readings: &Readings) -> bool {
        readings.heading_rad.is_some_and(f32::is_finite)
            && self.atlas().header().survey.headings <= 1
    }

    /// The frame's fix, levelled by what is known of its pose.
    fn locate(&mut self, frame: &Frame<'_>, readings: &Readings, heading_rad: f32) -> Option<Fix> {
        let ratio = readings
            .altitude_ratio
            .filter(|ratio| ratio.is_finite())
            .unwrap_or_else(|| self.memory.odometry.placement().altitude_ratio)
            .clamp(MIN_ALTITUDE_RATIO, MAX_ALTITUDE_RATIO);
        // Landmarks at several headings say the heading themselves.
        let is_turned = self.atlas().header().survey.headings > 1;
        let pose = Pose::new(if is_turned { 0.0 } else { heading_rad }, ratio).ok()?;
        self.localizer
            .locate_at(frame, &pose.with_tilt(readings.tilt))
    }

    /// How the belief is to move; `None` while there is nothing to move it for.
    fn motion(
        &mut self,
        is_unrelated: bool,
        displacement: Option<&Displacement>,
        footprint_px: f32,
    ) -> Option<Motion> {
        let (moved, variance, carried_away) = match displacement {
            Some(displacement) => {
                let moved = self.reckoning.learn(displacement);
                let covariance = displacement.covariance;
                let seen = (covariance.m11 + covariance.m22) / 2.0;
                (moved, seen, CARRIED_AWAY)
            }
            // Gone on as before, more or less.
            None if is_unrelated || self.reckoning.is_overdue() => {
                let moved = self.reckoning.go_on();
                let way = moved.forward * moved.forward + moved.right * moved.right;
                if is_unrelated {
                    let unseen = self.reckoning.settle();
                    // Before the first frame nothing was known to move.
                    if self.has_seen {
                        self.memory.odometry.skip(&unseen);
                    }
                }
                (moved, way / 4.0, CARRIED_AWAY_IF_UNRELATED)
            }
            None => return None,
        };
        let way = sqrt(moved.forward * moved.forward + moved.right * moved.right);
        let astray = ASTRAY * ASTRAY * ASTRAY_FOR * way;
        Some(Motion {
            forward_px: moved.forward * footprint_px,
            right_px: moved.right * footprint_px,
            yaw_rad: moved.yaw_rad,
            variance_px2: (variance + astray) * footprint_px * footprint_px,
            variance_rad2: displacement.map_or(0.01, |displacement| displacement.covariance.m33),
            carried_away,
        })
    }
}
