//! Frames and instruments → commands, without an atlas: first the pattern, then any place of the chart.

use core::ops::DerefMut;

use nalgebra::Vector4;

use super::{Chart, Memory, Pattern, SIDE_PX, VIEW_SIDE, closing, window};
use crate::{
    belief::Estimate,
    explore::Sighting,
    frame::Frame,
    landmark::Point,
    math::{exp_of_negative, sqrt, wrapped},
    mission::{Command, Limits, Mission, Situation, State},
    navigator::{Readings, dead_reckoning::DeadReckoning},
    preprocess::View,
    route::{Leg, RouteError},
    track::{BoardOdometry, Covariance, Displacement, Placement},
};

/// Way between two looks, in sides.
const LOOK: f32 = 0.1;

/// Views that differ by at most this (root mean square, in gray levels) are of the same place, where that is plausible.
/// Chosen by flights. On four maps, medians of level views as shares of the contrast: 0.55 to 0.75 a twentieth of a side
/// apart, 0.92 to 1.14 a tenth, 1.27 to 1.34 a fifth; at a fifth, one in twenty is below 0.76 to 0.92.
const SAME: f32 = 0.95 * window::CONTRAST;

/// What path integration is believed to err by beyond what it states, per side of way: variances of the place along each
/// axis, in square sides, and of the heading, in square radians. For tilts told wrong, an altimeter that walks, torn frames.
const ASTRAY: f32 = 4e-4;
const ASTRAY_TURN: f32 = 1e-5;

/// Variance of an altimeter: 3 %, relative.
const ALTIMETER_VARIANCE: f32 = 0.03 * 0.03;

/// Variance of a turn that the compass saw while frames could not be related: 1°.
const COMPASS_TURN_VARIANCE: f32 = 0.017 * 0.017;

/// What the vehicle is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Phase {
    /// It flies its pattern, and learns.
    Exploring {
        /// The corner that it flies to, 0-based.
        corner: u16,
    },
    /// The pattern is flown, and no goal was given: it stays where the wind lets it.
    Explored,
    /// It flies to a goal, and learns nothing more.
    Going,
}

/// What an exploration makes of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// What the autopilot is asked to do: a heading of its compass.
    pub command: Command,
    /// What the vehicle is at.
    pub phase: Phase,
    /// Where the mission stands; at the goal, it has arrived.
    pub state: State,
    /// Where the vehicle takes itself to be on the chart; `None` before the first frame.
    pub estimate: Option<Estimate>,
    /// The place that the last look showed, or made.
    pub place: Option<u16>,
    /// How the vehicle moved since the frame before, when that could be seen.
    pub displacement: Option<Displacement>,
}

/// Explores, and flies over what was explored, in a memory that it owns or borrows: `&mut Memory` on a board, a box on a
/// host.
#[derive(Debug)]
pub struct Exploration<M, const PLACES: usize, const LEGS: usize> {
    memory: M,
    pattern: Pattern,
    phase: Phase,
    mission: Mission,
    view: View,
    reckoning: DeadReckoning,
    /// Heading of the compass less that of path integration, in radians.
    compass_ahead_rad: f32,
    has_begun: bool,
    /// Where it looked last.
    looked_at: Option<Point>,
    /// The place that was visited last.
    before: Option<u16>,
    visit: Option<Visit>,
}

/// Looks at one place, one after the other.
#[derive(Clone, Copy, Debug)]
struct Visit {
    place: u16,
    /// The smallest distance between views, in gray levels.
    distance: f32,
    /// From where the vehicle took itself to be at that look to the place, in sides; `None` at a place that was made.
    offset: Option<[f32; 2]>,
}

impl<M, const PLACES: usize, const LEGS: usize> Exploration<M, PLACES, LEGS>
where
    M: DerefMut<Target = Memory<PLACES, LEGS>>,
{
    /// Begins anew: knows nothing, and flies `pattern` from where it is.
    #[must_use]
    pub fn new(pattern: Pattern, mut memory: M) -> Self {
        memory.reset();
        Self {
            memory,
            pattern,
            phase: Phase::Exploring { corner: 0 },
            mission: Mission::new(Limits {
                // Path integration has one guess, and the way to see a place again is to fly by it.
                patience_s: f32::INFINITY,
                ..Limits::for_footprint(SIDE_PX)
            }),
            view: View::black(VIEW_SIDE),
            reckoning: DeadReckoning::default(),
            compass_ahead_rad: 0.0,
            has_begun: false,
            looked_at: None,
            before: None,
            visit: None,
        }
    }

    /// Ends exploring, and flies to a place (0-based).
    ///
    /// # Errors
    /// When there is no such place; then nothing changes.
    pub fn go(&mut self, place: u16) -> Result<(), RouteError> {
        let memory = &mut *self.memory;
        memory.router.plan(&memory.chart.map(), place)?;
        self.mission = self.mission.redirected();
        self.phase = Phase::Going;
        Ok(())
    }

    /// What was found.
    #[must_use]
    pub fn chart(&self) -> &Chart<PLACES, LEGS> {
        &self.memory.chart
    }

    /// The path so far, corrected by places that were seen again.
    #[must_use]
    pub fn odometry(&self) -> &BoardOdometry {
        &self.memory.odometry
    }

    /// The same, for corrections from elsewhere.
    pub fn odometry_mut(&mut self) -> &mut BoardOdometry {
        &mut self.memory.odometry
    }

    /// Takes in a frame and what the instruments said, `step_s` seconds after the one before; `None` when the camera
    /// gave nothing.
    pub fn advance(
        &mut self,
        frame: Option<&Frame<'_>>,
        readings: &Readings,
        step_s: f32,
    ) -> Progress {
        self.reckoning.wait(step_s);
        let mut displacement = None;
        if let Some(frame) = frame {
            displacement = self.integrate(frame, readings);
            if !self.odometry().is_waiting() {
                self.look(frame, readings);
            }
        }
        let estimate = self.has_begun.then(|| self.estimate());
        self.decide(estimate, step_s);
        let Command { heading_rad, speed } = self.mission.command();
        let command = Command {
            heading_rad: wrapped(heading_rad + self.compass_ahead_rad),
            speed: if self.phase == Phase::Explored {
                0.0
            } else {
                speed
            },
        };
        Progress {
            command,
            phase: self.phase,
            state: self.mission.state(),
            estimate,
            place: self.visit.map(|visit| visit.place),
            displacement,
        }
    }

    /// Path integration, and what helps it.
    fn integrate(&mut self, frame: &Frame<'_>, readings: &Readings) -> Option<Displacement> {
        let compass = readings
            .heading_rad
            .filter(|heading| heading.is_finite())
            .map(wrapped);
        let is_first = !core::mem::replace(&mut self.has_begun, true);
        let odometry = &mut self.memory.odometry;
        if is_first {
            let start = Placement {
                heading_rad: compass.unwrap_or(0.0),
                altitude_ratio: readings.altitude_ratio.unwrap_or(1.0),
                ..Placement::ORIGIN
            };
            let variances = Vector4::new(0.0, 0.0, 0.0, ALTIMETER_VARIANCE);
            odometry.restart(start, &Covariance::from_diagonal(&variances));
        }
        let displacement = odometry.advance(frame, readings.tilt);
        let turned = |odometry: &BoardOdometry| {
            compass.map(|compass| compass - odometry.placement().heading_rad)
        };
        match &displacement {
            Some(displacement) => {
                let moved = self.reckoning.learn(displacement);
                let way = sqrt(moved.forward * moved.forward + moved.right * moved.right);
                let variances = Vector4::new(ASTRAY, ASTRAY, ASTRAY_TURN, 0.0) * way;
                odometry.widen(&Covariance::from_diagonal(&variances));
            }
            None if odometry.is_waiting() => return None,
            None if is_first => {}
            None => {
                // On as before, more or less; turned as the compass says.
                self.reckoning.go_on();
                let mut unseen = self.reckoning.settle();
                if let Some(ahead) = turned(odometry) {
                    unseen.yaw_rad = wrapped(ahead - self.compass_ahead_rad);
                    unseen.covariance.m33 = COMPASS_TURN_VARIANCE;
                }
                odometry.skip(&unseen);
            }
        }
        if let Some(ratio) = readings.altitude_ratio {
            odometry.correct_altitude(ratio, ALTIMETER_VARIANCE * ratio * ratio);
        }
        if let Some(ahead) = turned(odometry) {
            self.compass_ahead_rad = wrapped(ahead);
        }
        displacement
    }

    /// Looks at what is below, if the last look was elsewhere.
    fn look(&mut self, frame: &Frame<'_>, readings: &Readings) {
        let memory = &mut *self.memory;
        let placement = memory.odometry.placement();
        let here = point(&placement);
        if self
            .looked_at
            .is_some_and(|last| last.distance_px(here) < LOOK * SIDE_PX)
        {
            return;
        }
        let (heading, ratio) = (placement.heading_rad, placement.altitude_ratio);
        let seen = window::look(frame, readings.tilt, heading, ratio, &mut self.view);
        let Some(seen) = seen else {
            return;
        };
        self.looked_at = Some(here);
        let (chart, now) = (&memory.chart, memory.odometry.covariance());
        let is_plausible = |landmark: usize| {
            let place = landmark as u16;
            chart
                .map()
                .point(place)
                .zip(chart.covariance(place))
                .is_some_and(|(place, then)| closing::is_plausible(here, &now, place, then))
        };
        let recalled = memory.explorer.recall(&seen, is_plausible);
        if let Some((landmark, distance)) = recalled.filter(|&(_, distance)| distance <= SAME) {
            self.revisit(landmark as u16, distance, here);
            return;
        }
        self.leave();
        if matches!(self.phase, Phase::Exploring { .. })
            && let Some(Sighting::New { .. }) = self.memory.explorer.observe(&seen)
        {
            self.settle();
        }
    }

    /// Makes a place of where the vehicle is; its landmark has the same number.
    fn settle(&mut self) {
        let memory = &mut *self.memory;
        let (here, now) = (
            point(&memory.odometry.placement()),
            memory.odometry.covariance(),
        );
        if let Some(place) = memory.chart.add(here, &now, self.before) {
            self.before = Some(place);
            self.visit = Some(Visit {
                place,
                distance: 0.0,
                offset: None,
            });
        }
    }

    /// A look showed a place that was seen before.
    fn revisit(&mut self, place: u16, distance: f32, here: Point) {
        let offset = self.memory.chart.map().point(place).map(|place| {
            [place.x_px - here.x_px, place.y_px - here.y_px].map(|offset_px| offset_px / SIDE_PX)
        });
        match &mut self.visit {
            Some(visit) if visit.place == place => {
                if distance < visit.distance {
                    (visit.distance, visit.offset) = (distance, offset);
                }
            }
            _ => {
                self.leave();
                if let (Some(before), Phase::Exploring { .. }) = (self.before, self.phase) {
                    self.memory.chart.link(before, place);
                }
                self.before = Some(place);
                self.visit = Some(Visit {
                    place,
                    distance,
                    offset,
                });
            }
        }
    }

    /// A visit is over, and counts.
    fn leave(&mut self) {
        let memory = &mut *self.memory;
        if let Some(visit) = self.visit.take()
            && let Some(offset) = visit.offset
            && let Some(then) = memory.chart.covariance(visit.place)
        {
            closing::correct(&mut memory.odometry, offset, then);
        }
    }

    /// Where the vehicle takes itself to be: confident as far as a normal distribution is within a side of its middle.
    fn estimate(&self) -> Estimate {
        let odometry = &self.memory.odometry;
        let (placement, covariance) = (odometry.placement(), odometry.covariance());
        let variance = (covariance.m11 + covariance.m22) / 2.0;
        Estimate {
            position: point(&placement),
            covariance_px2: [covariance.m11, covariance.m12, covariance.m22]
                .map(|square| square * (SIDE_PX * SIDE_PX)),
            heading_rad: placement.heading_rad,
            confidence: 1.0 - exp_of_negative(-0.5 / variance),
        }
    }

    /// The next step of the pattern, or of the way to the goal.
    fn decide(&mut self, estimate: Option<Estimate>, step_s: f32) {
        let memory = &mut *self.memory;
        let situation = Situation {
            estimate,
            heading_rad: memory.odometry.placement().heading_rad,
            drift_rad: self.reckoning.drift_rad(),
            step_s,
        };
        match self.phase {
            Phase::Exploring { corner } => {
                let leg = self.leg_to(corner);
                match (leg, estimate) {
                    (Some(leg), Some(estimate)) => {
                        self.mission = self.mission.step_along(&leg, &situation);
                        if self.mission.is_along(&leg, estimate.position) {
                            let corner = corner.saturating_add(1);
                            self.phase = Phase::Exploring { corner };
                        }
                    }
                    (None, _) => self.phase = Phase::Explored,
                    (_, None) => {}
                }
            }
            Phase::Explored => {}
            Phase::Going => {
                let map = memory.chart.map();
                self.mission = self.mission.step(&situation, &map, &memory.router);
            }
        }
    }

    /// The leg to a corner of the pattern from the one before, or from the start.
    fn leg_to(&self, corner: u16) -> Option<Leg> {
        let before = corner.checked_sub(1);
        let origin = Point {
            x_px: 0.0,
            y_px: 0.0,
        };
        Some(Leg {
            from: before.unwrap_or(0),
            to: corner,
            start: before.map_or(Some(origin), |before| self.pattern.corner(before))?,
            end: self.pattern.corner(corner)?,
        })
    }
}

/// Where a placement is on the chart.
fn point(placement: &Placement) -> Point {
    Point {
        x_px: placement.x * SIDE_PX,
        y_px: placement.y * SIDE_PX,
    }
}
