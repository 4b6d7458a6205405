//! From a belief and a route to a commanded heading and speed: a pure state machine.
//!
//! ```text
//!                         first frame                     confident
//!            ┌──────┐  ─────────────────▶  ┌────────────┐ ─────────────▶ ┌───────────┐ ◀────────┐
//!   start ─▶ │ boot │                      │ localizing │                │ following │          │ confident
//!            └──────┘                      └────────────┘                └───────────┘ ──────▶ ┌──────┐
//!                                                ▲                         │          patience │ lost │
//!                                        another │               near goal │          is over  └──────┘
//!                                           goal │        ┌─────────┐      │
//!                                                └─────── │ arrived │ ◀────┘
//!                                                         └─────────┘
//! ```
//!
//! **What.** A [`Mission`] is a value: [`step`](Mission::step) makes the next one from the situation, and says what to
//! do. It holds no map and no filter, and asks no clock.
//!
//! **Method.** Pure pursuit along the route (Coulter 1992): the course leads to the point of the route that is a
//! [`lookahead`](Limits::lookahead_px) ahead of where the vehicle is beside it, around corners, too. The heading that is
//! commanded is that course less the drift angle, by which the vehicle was seen to go aside of its heading: wind is held
//! against without knowing it. A vehicle that is farther from its leg than [`off_leg`](Limits::off_leg_px) takes the way
//! from the place it is nearest to. Whoever does not know where it is flies slowly in circles over the ground, which
//! grow wider, and which the wind does not carry off: what it sees there may tell. Whoever has to turn back does so at half
//! speed, and near a border of the map on the side that leads past its inside.
//!
//! **Units.** Headings in radians, clockwise from map-up; speeds as a share of the cruising speed.

mod guidance;
#[cfg(test)]
mod tests;

use crate::{
    belief::Estimate,
    landmark::Point,
    route::{Leg, Router, TopologicalMap},
};

/// What the autopilot is asked to do.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Command {
    /// Heading in radians, clockwise from map-up, in −π..=π.
    pub heading_rad: f32,
    /// Share of the cruising speed, 0 to 1.
    pub speed: f32,
}

/// Where a mission stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// No frame came yet.
    Boot,
    /// Frames come; where they were taken is not known yet.
    Localizing,
    /// On the way to the goal.
    Following,
    /// On the way, but it is not known any more where.
    Lost,
    /// At the goal.
    Arrived,
}

impl State {
    /// Its name in a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Boot => "boot",
            Self::Localizing => "localizing",
            Self::Following => "following",
            Self::Lost => "lost",
            Self::Arrived => "arrived",
        }
    }
}

/// What a mission goes by in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// Where the vehicle most likely is; `None` before the first frame.
    pub estimate: Option<Estimate>,
    /// Heading, in radians clockwise from map-up: as it is believed, whatever the compass reads.
    pub heading_rad: f32,
    /// Course over ground less heading, in radians: how far the vehicle goes aside of where it heads.
    pub drift_rad: f32,
    /// Time since the last step, in seconds.
    pub step_s: f32,
}

/// Lengths and times that a mission keeps to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// How far ahead on its leg the vehicle aims, in map pixels.
    pub lookahead_px: f32,
    /// Farther from its leg than this, the vehicle looks for another one, in map pixels.
    pub off_leg_px: f32,
    /// Nearer to the goal than this it has arrived, in map pixels.
    pub arrival_px: f32,
    /// How long it follows its leg without being confident, in seconds.
    pub patience_s: f32,
    /// Speed without knowing where it is, as a share of the cruising speed.
    pub searching_speed: f32,
    /// At the rate at which it turns at first, how long a circle would take, in seconds. The rate falls: the first takes 1.7
    /// times as long.
    pub circle_s: f32,
    /// Width and height of the map that the vehicle is to stay on, in map pixels; `None` when there is no such map.
    pub map_px: Option<[f32; 2]>,
    /// Nearer to the map's borders than this, turns back are flown away from them, in map pixels.
    pub border_px: f32,
}

/// A mission: its state, and what it remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mission {
    limits: Limits,
    state: State,
    leg: Option<Leg>,
    /// Since the last confident estimate, in seconds.
    unsure_s: f32,
    /// How long it has searched, in seconds.
    searched_s: f32,
    /// Course over ground that is aimed at while it searches, in radians clockwise from map-up.
    course_rad: f32,
    /// Whether it searches in circles to the left.
    is_left: bool,
    /// The side on which it turns back, as a sign: +1 to the right.
    turn_back: Option<f32>,
    command: Command,
}

impl Limits {
    /// What suits views whose footprint has that side, in map pixels, on no map in particular: half a side ahead, one side
    /// off, a quarter to arrive.
    #[must_use]
    pub fn for_footprint(footprint_px: f32) -> Self {
        Self {
            lookahead_px: footprint_px / 2.0,
            off_leg_px: footprint_px,
            arrival_px: footprint_px / 4.0,
            patience_s: 5.0,
            searching_speed: 0.5,
            circle_s: 60.0,
            map_px: None,
            border_px: 1.25 * footprint_px,
        }
    }

    /// The same on a map of that width and height, in map pixels.
    #[must_use]
    pub fn on_map(self, (width_px, height_px): (u32, u32)) -> Self {
        Self {
            map_px: Some([width_px as f32, height_px as f32]),
            ..self
        }
    }
}

impl Mission {
    /// A mission that has not begun.
    #[must_use]
    pub const fn new(limits: Limits) -> Self {
        Self {
            limits,
            state: State::Boot,
            leg: None,
            unsure_s: 0.0,
            searched_s: 0.0,
            course_rad: 0.0,
            is_left: false,
            turn_back: None,
            command: Command {
                heading_rad: 0.0,
                speed: 0.0,
            },
        }
    }

    /// Where it stands.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// The leg that is followed.
    #[must_use]
    pub fn leg(&self) -> Option<Leg> {
        self.leg
    }

    /// What the autopilot was last asked to do.
    #[must_use]
    pub fn command(&self) -> Command {
        self.command
    }

    /// The same mission with another goal, for which the caller plans anew.
    #[must_use]
    pub fn redirected(&self) -> Self {
        let state = match self.state {
            State::Arrived => State::Localizing,
            state => state,
        };
        Self {
            state,
            leg: None,
            turn_back: None,
            ..*self
        }
    }

    /// The mission after one more step, to the goal of `router`.
    #[must_use]
    #[inline(never)]
    pub fn step<const PLACES: usize>(
        &self,
        situation: &Situation,
        map: &TopologicalMap<'_>,
        router: &Router<PLACES>,
    ) -> Self {
        let Some(estimate) = situation.estimate else {
            return *self;
        };
        let mut next = *self;
        next.unsure_s = if estimate.is_confident() {
            0.0
        } else {
            self.unsure_s + situation.step_s.max(0.0)
        };
        let is_sure = estimate.is_confident();
        next.state = match self.state {
            State::Arrived => State::Arrived,
            _ if is_sure => State::Following,
            State::Boot | State::Localizing => State::Localizing,
            State::Following if next.unsure_s <= self.limits.patience_s => State::Following,
            State::Following | State::Lost => State::Lost,
        };
        let goal = router.goal().and_then(|goal| map.point(goal));
        if let (State::Following, true, Some(goal)) = (next.state, is_sure, goal)
            && estimate.position.distance_px(goal) <= self.limits.arrival_px
        {
            next.state = State::Arrived;
        }
        next.act(situation, &estimate, map, router);
        next
    }

    /// The mission after one more step along a leg that the caller chose, without a map or a goal: following it.
    #[must_use]
    pub fn step_along(&self, leg: &Leg, situation: &Situation) -> Self {
        let mut next = *self;
        if let Some(estimate) = situation.estimate {
            next.state = State::Following;
            next.leg = Some(*leg);
            let aim = self.aim_on(leg, estimate.position);
            next.pursue(&aim, situation, &estimate);
        }
        next
    }

    /// Whether a vehicle there is so far along a leg that the next one is due.
    #[must_use]
    pub fn is_along(&self, leg: &Leg, position: Point) -> bool {
        let (along, _) = guidance::on_leg(leg, position);
        along >= leg.length_px() - self.limits.arrival_px / 2.0
    }

    /// What to do in the new state.
    fn act<const PLACES: usize>(
        &mut self,
        situation: &Situation,
        estimate: &Estimate,
        map: &TopologicalMap<'_>,
        router: &Router<PLACES>,
    ) {
        match self.state {
            State::Boot => {}
            State::Arrived => {
                self.leg = None;
                self.turn_back = None;
                self.searched_s = 0.0;
                self.command.speed = 0.0;
            }
            State::Localizing | State::Lost => {
                self.leg = None;
                self.turn_back = None;
                self.search(situation, estimate.position);
            }
            State::Following => {
                self.searched_s = 0.0;
                self.choose(estimate.position, map, router);
                match self.leg {
                    Some(leg) => {
                        let aim = self.aim(&leg, estimate.position, map, router);
                        self.pursue(&aim, situation, estimate);
                    }
                    // No way leads to the goal.
                    None => self.command.speed = 0.0,
                }
            }
        }
    }

    /// Keeps to its leg, goes on to the next, or finds another one.
    fn choose<const PLACES: usize>(
        &mut self,
        position: Point,
        map: &TopologicalMap<'_>,
        router: &Router<PLACES>,
    ) {
        if let Some(leg) = self.leg {
            let (_, across) = guidance::on_leg(&leg, position);
            if across.abs() > self.limits.off_leg_px {
                self.leg = None;
            } else if self.is_along(&leg, position) {
                // The last leg is flown to its end.
                self.leg = router.next_leg(map, leg.to).or(Some(leg));
            }
        }
        if self.leg.is_none() {
            self.leg = map.nearest(position).and_then(|place| {
                router.length_px(place)?;
                let end = map.point(place)?;
                let approach = Leg {
                    from: place,
                    to: place,
                    start: position,
                    end,
                };
                // Near the place already: on from there.
                let is_there = approach.length_px() <= self.limits.lookahead_px;
                let next = router.next_leg(map, place).filter(|_| is_there);
                Some(next.unwrap_or(approach))
            });
        }
    }
}
