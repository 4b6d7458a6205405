//! The vehicle's own software as a pilot: the core's navigator, with the capacities of the reference board.

use eigenmark_core::{
    atlas::Atlas,
    frame::Frame,
    landmark::Point,
    mission::State,
    navigator::{BOARD_PLACES, BOARD_STATES, Guidance, Memory, Navigator},
    route::RouteError,
    track::{Covariance, Placement},
};

use super::{CameraFrame, Command, Estimate, Pilot, Report, Sight, Truth};

type BoardMemory = Memory<BOARD_STATES, BOARD_PLACES>;

/// The core's navigator in the simulated vehicle.
#[derive(Debug)]
pub struct Onboard<'a> {
    navigator: Navigator<'a, Box<BoardMemory>, BOARD_STATES, BOARD_PLACES>,
    field_of_view_rad: f32,
    has_begun: bool,
    guidance: Option<Guidance>,
}

impl<'a> Onboard<'a> {
    /// Flies by `atlas` to one goal (a place, 0-based) after the other, with a camera of that field of view.
    ///
    /// # Errors
    /// When the first goal cannot be planned to.
    pub fn new(
        atlas: Atlas<'a>,
        goals: &[u16],
        field_of_view_rad: f64,
    ) -> Result<Self, RouteError> {
        let mut navigator = Navigator::new(atlas, Box::new(Memory::new()));
        navigator.go(goals)?;
        Ok(Self {
            navigator,
            field_of_view_rad: field_of_view_rad as f32,
            has_begun: false,
            guidance: None,
        })
    }

    /// What it made of the last sight.
    #[must_use]
    pub fn guidance(&self) -> Option<&Guidance> {
        self.guidance.as_ref()
    }
}

impl Pilot for Onboard<'_> {
    /// Path integration starts where the vehicle does: its drift is measured from there. Nothing else learns of it.
    fn told(&mut self, truth: &Truth) {
        if !self.has_begun {
            self.has_begun = true;
            let side_px = self.navigator.atlas().header().footprint_px;
            let [x, y] = truth.position_px.map(|px| px as f32 / side_px);
            let start = Placement {
                x,
                y,
                heading_rad: truth.heading_rad as f32,
                altitude_ratio: truth.altitude_ratio as f32,
            };
            self.navigator
                .odometry_mut()
                .restart(start, &Covariance::zeros());
        }
    }

    fn decide(&mut self, sight: &Sight<'_>) -> Command {
        let readings = sight.readings.for_core(self.field_of_view_rad);
        let frame: Option<Frame<'_>> = sight.frame.map(CameraFrame::as_frame);
        let guidance = self
            .navigator
            .advance(frame.as_ref(), &readings, sight.step_s);
        self.guidance = Some(guidance);
        guidance.command.into()
    }

    fn report(&self) -> Report {
        let Some(guidance) = &self.guidance else {
            return Report::default();
        };
        let side_px = self.navigator.atlas().header().footprint_px;
        let placement = self.navigator.odometry().placement();
        Report {
            estimate: guidance.estimate.map(Estimate::from),
            odometry: Some(Point {
                x_px: placement.x * side_px,
                y_px: placement.y * side_px,
            }),
            fix: guidance.fix,
            mission: Some(guidance.state.name().to_owned()),
            arrived: guidance.state == State::Arrived && self.navigator.goals_left() == 0,
        }
    }
}
