//! A pilot without an atlas: the core's exploration, then flights to places that it found.

use std::collections::VecDeque;

use eigenmark_core::{
    chart::{Chart, Exploration, Memory, Pattern, Phase, Progress, SIDE_PX},
    frame::Frame,
    landmark::Point,
    mission::State,
};

use super::{CameraFrame, Command, Estimate, Pilot, Report, Sight, Truth};

/// Capacities of the reference board.
const PLACES: usize = 128;
const LEGS: usize = 1024;

/// The core's exploration in the simulated vehicle: flies a pattern, then from place to place, the last one where it
/// began.
#[derive(Debug)]
pub struct Scout {
    exploration: Exploration<Box<Memory<PLACES, LEGS>>, PLACES, LEGS>,
    field_of_view_rad: f32,
    footprint_px: f64,
    visits: usize,
    goals: Option<VecDeque<u16>>,
    goal: u16,
    progress: Option<Progress>,
    // What the vehicle's software never knows.
    truth: Option<Truth>,
    origin: Option<Origin>,
    places_px: Vec<[f64; 2]>,
    arrivals: Vec<Arrival>,
}

/// The vehicle said that it was at its goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// The place, 0-based.
    pub place: u16,
    /// Where the vehicle really was, in map pixels.
    pub at_px: [f64; 2],
    /// Where it really was when it made the place, in map pixels.
    pub place_px: [f64; 2],
}

/// Where the chart's origin and up really are.
#[derive(Clone, Copy, Debug)]
struct Origin {
    at_px: [f64; 2],
    /// Heading of the chart's up.
    up_rad: f64,
}

impl Arrival {
    /// Distance between the two, in map pixels.
    #[must_use]
    pub fn error_px(&self) -> f64 {
        distance(self.at_px, self.place_px)
    }
}

impl Scout {
    /// Flies `pattern` with a camera of that field of view and footprint (map pixels); then visits so many places, spread
    /// over the chart from the newest to the first.
    #[must_use]
    pub fn new(pattern: Pattern, visits: usize, field_of_view_rad: f64, footprint_px: f64) -> Self {
        Self {
            exploration: Exploration::new(pattern, Box::new(Memory::new())),
            field_of_view_rad: field_of_view_rad as f32,
            footprint_px,
            visits,
            goals: None,
            goal: 0,
            progress: None,
            truth: None,
            origin: None,
            places_px: Vec::new(),
            arrivals: Vec::new(),
        }
    }

    /// What it found.
    #[must_use]
    pub fn chart(&self) -> &Chart<PLACES, LEGS> {
        self.exploration.chart()
    }

    /// What it made of the last sight.
    #[must_use]
    pub fn progress(&self) -> Option<&Progress> {
        self.progress.as_ref()
    }

    /// Its arrivals so far.
    #[must_use]
    pub fn arrivals(&self) -> &[Arrival] {
        &self.arrivals
    }

    /// How far each place of the chart is from where it was really made, in map pixels, with the chart laid on the map as it
    /// was at the start: same origin, same up.
    #[must_use]
    pub fn chart_errors_px(&self) -> Vec<f64> {
        let places = self.chart().map().places().iter();
        places
            .zip(&self.places_px)
            .map(|(place, &truth)| {
                let at = self.on_map(place.point());
                distance([at.x_px, at.y_px].map(f64::from), truth)
            })
            .collect()
    }

    /// A point of the chart on the map.
    fn on_map(&self, point: Point) -> Point {
        let Some(Origin { at_px, up_rad }) = self.origin else {
            return point;
        };
        let [x, y] = [point.x_px, point.y_px].map(|px| f64::from(px / SIDE_PX) * self.footprint_px);
        let (sin, cos) = up_rad.sin_cos();
        Point {
            x_px: (at_px[0] + x * cos - y * sin) as f32,
            y_px: (at_px[1] + x * sin + y * cos) as f32,
        }
    }

    /// Notes what really happened.
    fn witness(&mut self, progress: &Progress) {
        let Some(truth) = self.truth else {
            return;
        };
        let places = self.chart().map().len();
        self.places_px.resize(places, truth.position_px);
        if progress.phase == Phase::Going && progress.state == State::Arrived {
            self.arrivals.push(Arrival {
                place: self.goal,
                at_px: truth.position_px,
                place_px: self.places_px[usize::from(self.goal)],
            });
        }
    }

    /// The next goal, when there is one to be had.
    fn go_on(&mut self, progress: &Progress) {
        let is_idle = match progress.phase {
            Phase::Exploring { .. } => false,
            Phase::Explored => true,
            Phase::Going => progress.state == State::Arrived,
        };
        if is_idle {
            let goals = self
                .goals
                .get_or_insert_with(|| spread(self.exploration.chart().map().len(), self.visits));
            if let Some(goal) = goals.pop_front()
                && self.exploration.go(goal).is_ok()
            {
                self.goal = goal;
            }
        }
    }
}

impl Pilot for Scout {
    fn told(&mut self, truth: &Truth) {
        self.truth = Some(*truth);
    }

    fn decide(&mut self, sight: &Sight<'_>) -> Command {
        let readings = sight.readings.for_core(self.field_of_view_rad);
        let frame: Option<Frame<'_>> = sight.frame.map(CameraFrame::as_frame);
        if let (None, Some(_), Some(truth)) = (self.origin, frame, self.truth) {
            self.origin = Some(Origin {
                at_px: truth.position_px,
                up_rad: truth.heading_rad - f64::from(readings.heading_rad.unwrap_or(0.0)),
            });
        }
        let progress = self
            .exploration
            .advance(frame.as_ref(), &readings, sight.step_s);
        self.witness(&progress);
        self.progress = Some(progress);
        self.go_on(&progress);
        progress.command.into()
    }

    fn report(&self) -> Report {
        let Some(progress) = &self.progress else {
            return Report::default();
        };
        let px2 = (self.footprint_px as f32 / SIDE_PX).powi(2);
        let estimate = progress.estimate.map(|estimate| Estimate {
            position: self.on_map(estimate.position),
            // Along the chart's axes.
            covariance_px2: Some(estimate.covariance_px2.map(|square| square * px2)),
            ..estimate.into()
        });
        Report {
            estimate,
            odometry: estimate.map(|estimate| estimate.position),
            fix: None,
            mission: Some(
                match (progress.phase, progress.state) {
                    (Phase::Exploring { .. }, _) => "exploring",
                    (Phase::Explored, _) => "explored",
                    (_, state) => state.name(),
                }
                .to_owned(),
            ),
            arrived: self.arrivals.len() >= self.visits.max(1),
        }
    }
}

/// So many of the places, spread over all, the first one last.
fn spread(places: usize, visits: usize) -> VecDeque<u16> {
    (0..visits)
        .rev()
        .map(|visit| (visit * places / visits) as u16)
        .collect()
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use eigenmark_core::track::{Covariance, Placement};

    use super::*;
    use crate::{
        map::Map,
        simulate::{Camera, End, FlightSettings, World, fly},
    };

    const FOOTPRINT_PX: f64 = 200.0;

    /// Explores a box of 3×1.2 sides of the city, and visits three places.
    const BOX: Pattern = Pattern::Lawn {
        from: [0.0, 0.0],
        to: [3.0, 1.2],
        spacing: 0.6,
    };

    fn flown(pilot: &mut impl Pilot, seed: u64) -> End {
        let map = Map::city();
        let world = World {
            map: &map,
            meters_per_px: 0.5,
            camera: camera(),
        };
        let start = Point {
            x_px: 300.0,
            y_px: 300.0,
        };
        let settings = FlightSettings {
            time_limit_s: 1_000.0,
            goal: Some(start),
            arrival_px: FOOTPRINT_PX,
            ..FlightSettings::new(seed, start)
        };
        fly(&world, &settings, pilot).expect("flies").end
    }

    fn camera() -> Camera {
        Camera::sized(160, 120, FOOTPRINT_PX)
    }

    fn scout() -> Scout {
        Scout::new(BOX, 3, camera().field_of_view_rad(), FOOTPRINT_PX)
    }

    #[test]
    fn it_explores_then_finds_what_it_found() {
        let mut scout = scout();
        assert_eq!(flown(&mut scout, 1), End::Arrived);
        let errors = scout.chart_errors_px();
        assert!(errors.len() >= 8, "{} places", errors.len());
        assert!(errors[0] < 1e-3, "home is home");
        assert!(
            errors.iter().all(|&error| error < FOOTPRINT_PX / 2.0),
            "{errors:?}"
        );
        let goals: Vec<u16> = scout.arrivals().iter().map(|it| it.place).collect();
        assert_eq!(goals, Vec::from(spread(errors.len(), 3)));
        assert_eq!(goals.last(), Some(&0));
        for arrival in scout.arrivals() {
            assert!(arrival.error_px() < FOOTPRINT_PX, "{arrival:?}");
        }
    }

    /// Takes itself to be elsewhere once the pattern is flown, by 0.3 sides, and knows that it may be.
    struct Misled {
        scout: Scout,
        is_misled: bool,
    }

    impl Pilot for Misled {
        fn told(&mut self, truth: &Truth) {
            self.scout.told(truth);
        }

        fn decide(&mut self, sight: &Sight<'_>) -> Command {
            let is_going = |progress: &Progress| progress.phase == Phase::Going;
            if !self.is_misled && self.scout.progress().is_some_and(is_going) {
                self.is_misled = true;
                let odometry = self.scout.exploration.odometry_mut();
                let placement = odometry.placement();
                let misled = Placement {
                    x: placement.x + 0.18,
                    y: placement.y - 0.24,
                    ..placement
                };
                let mut covariance: Covariance = odometry.covariance();
                covariance.m11 += 0.18 * 0.18;
                covariance.m22 += 0.24 * 0.24;
                assert!(odometry.restart(misled, &covariance));
            }
            self.scout.decide(sight)
        }

        fn report(&self) -> Report {
            self.scout.report()
        }
    }

    #[test]
    #[ignore = "not reached: the error of 60 px grows to 226, see the limits of core's `chart`"]
    fn places_seen_again_correct_what_it_believes() {
        let mut pilot = Misled {
            scout: scout(),
            is_misled: false,
        };
        let end = flown(&mut pilot, 1);
        assert!(pilot.is_misled);
        assert_eq!(end, End::Arrived);
        let estimate = pilot.report().estimate.expect("one").position;
        let truth = pilot.scout.truth.expect("told").position_px;
        let error = distance([estimate.x_px, estimate.y_px].map(f64::from), truth);
        assert!(error < 0.15 * FOOTPRINT_PX, "{error} of 60 px are left");
    }

    #[test]
    fn goals_are_spread_and_end_at_home() {
        assert_eq!(spread(30, 3), [20, 10, 0]);
        assert_eq!(spread(1, 2), [0, 0]);
        assert!(spread(5, 0).is_empty());
    }
}
