//! The loop.

use std::convert::Infallible;

use eigenmark_core::landmark::Point;
use rayon::prelude::*;

use super::{End, Flight, FlightSettings, Kidnapping, Pilot, Sight, Step};
use crate::simulate::{
    CameraFrame, Command, Readings, World,
    instruments::Panel,
    sensor::Imager,
    vehicle::Vehicle,
    world::{Air, Daylight},
};

/// The longest step of the integration, in seconds.
const LONGEST_STEP_S: f64 = 0.01;

/// Why a flight cannot be flown.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FlightError {
    /// A number makes no sense.
    #[error("{name} of {found}; expected {expected}")]
    Setting {
        /// Of what.
        name: &'static str,
        /// The number.
        found: f64,
        /// What would make sense.
        expected: &'static str,
    },
    /// A place is not on the map.
    #[error("{name} at ({}, {}); expected a place on the map of {}×{} pixels", found[0], found[1], size[0], size[1])]
    OffMap {
        /// Which place.
        name: &'static str,
        /// Where it is, in map pixels.
        found: [f32; 2],
        /// Width and height of the map.
        size: [u32; 2],
    },
}

/// Why a watched flight did not end.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum Interrupted<E> {
    /// It cannot be flown.
    #[error(transparent)]
    Flight(#[from] FlightError),
    /// Whoever watched stopped it.
    #[error("{0}")]
    Watcher(E),
}

/// Flies.
///
/// # Errors
/// When the settings make no sense in that world.
pub fn fly(
    world: &World<'_>,
    settings: &FlightSettings,
    pilot: &mut impl Pilot,
) -> Result<Flight, FlightError> {
    let mut steps = Vec::new();
    let end = fly_watched(world, settings, pilot, |step, _| {
        steps.push(step);
        Ok::<(), Infallible>(())
    });
    match end {
        Ok(end) => Ok(Flight {
            settings: *settings,
            steps,
            end,
        }),
        Err(Interrupted::Flight(error)) => Err(error),
        Err(Interrupted::Watcher(never)) => match never {},
    }
}

/// Flies several flights on all processors, each with a pilot made for it (from its index and settings); `flown` gets
/// each as it ends.
///
/// # Errors
/// When the settings of a flight make no sense in that world.
pub fn fly_all<P: Pilot>(
    world: &World<'_>,
    settings: &[FlightSettings],
    pilot: impl Fn(usize, &FlightSettings) -> P + Sync,
    flown: impl Fn(&Flight) + Sync,
) -> Result<Vec<Flight>, FlightError> {
    settings
        .par_iter()
        .enumerate()
        .map(|(index, settings)| {
            let flight = fly(world, settings, &mut pilot(index, settings))?;
            flown(&flight);
            Ok(flight)
        })
        .collect()
}

/// Flies, and hands each step and its frame to `watch` instead of keeping it.
///
/// # Errors
/// When the settings make no sense in that world, or `watch` fails.
pub fn fly_watched<E>(
    world: &World<'_>,
    settings: &FlightSettings,
    pilot: &mut impl Pilot,
    mut watch: impl FnMut(Step, Option<&CameraFrame>) -> Result<(), E>,
) -> Result<End, Interrupted<E>> {
    settings.check(world)?;
    let period_s = 1.0 / settings.frame_rate_hz;
    let substeps = (period_s / LONGEST_STEP_S).ceil() as u32;
    let mut surroundings = Surroundings::new(world, settings, period_s / f64::from(substeps));
    let mut imager = Imager::new(&world.camera, settings.sensor, settings.seed);
    let mut kidnapping = settings.kidnapping;
    for number in 0_u64.. {
        let time_s = number as f64 * period_s;
        if time_s > settings.time_limit_s {
            break;
        }
        let due = kidnapping.take_if(|kidnapping| kidnapping.time_s <= time_s);
        if let Some(Kidnapping { to, .. }) = due {
            surroundings
                .vehicle
                .kidnap([to.x_px, to.y_px].map(f64::from));
        }
        let truth = surroundings.vehicle.truth();
        if !world.is_on_map(truth.position_px) {
            return Ok(End::LeftMap);
        }
        let frame = imager.take(world, &truth, &surroundings.day, number, time_s);
        let readings = surroundings.panel.read(&truth);
        let sight = Sight {
            time_s: time_s as f32,
            step_s: period_s as f32,
            frame,
            readings,
        };
        pilot.told(&truth);
        let command = sane(pilot.decide(&sight), readings);
        let report = pilot.report().sane();
        let said_arrived = report.arrived;
        let step = Step {
            time_s: sight.time_s,
            step_s: sight.step_s,
            kidnapped: due.is_some(),
            truth: Some(truth),
            readings,
            seen: frame.is_some(),
            command,
            report,
        };
        watch(step, frame).map_err(Interrupted::Watcher)?;
        if said_arrived {
            return Ok(judged(settings, truth.position_px));
        }
        (0..substeps).for_each(|_| surroundings.step(command));
    }
    Ok(End::OutOfTime)
}

/// All that goes on between two frames.
struct Surroundings {
    air: Air,
    day: Daylight,
    vehicle: Vehicle,
    panel: Panel,
}

impl Surroundings {
    fn new(world: &World<'_>, settings: &FlightSettings, step_s: f64) -> Self {
        let seed = settings.seed;
        let air = Air::new(&settings.wind, seed, step_s);
        let start = [settings.start.x_px, settings.start.y_px].map(f64::from);
        Self {
            day: Daylight::new(&settings.light, air.mean_m_s(), seed, step_s),
            vehicle: Vehicle::new(
                settings.blimp,
                world.meters_per_px,
                start,
                settings.start_heading_rad,
                air.velocity_m_s(),
                seed,
                step_s,
            ),
            panel: Panel::new(&settings.instruments, seed, step_s),
            air,
        }
    }

    fn step(&mut self, command: Command) {
        self.air.step();
        self.day.step();
        self.panel.step();
        // The autopilot holds what its compass reads.
        let heading_rad = f64::from(command.heading_rad) - self.panel.heading_error_rad();
        let held = Command {
            heading_rad: heading_rad as f32,
            ..command
        };
        self.vehicle.step(held, self.air.velocity_m_s());
    }
}

/// A command of numbers: in place of what is none, the heading read and no speed.
fn sane(command: Command, readings: Readings) -> Command {
    let is_heading = command.heading_rad.is_finite();
    Command {
        heading_rad: if is_heading {
            command.heading_rad
        } else {
            readings.heading_rad.unwrap_or(0.0)
        },
        speed: if command.speed.is_finite() {
            command.speed
        } else {
            0.0
        },
    }
}

/// Whether an arrival is one.
fn judged(settings: &FlightSettings, [x, y]: [f64; 2]) -> End {
    let distance = |goal: Point| (x - f64::from(goal.x_px)).hypot(y - f64::from(goal.y_px));
    match settings.goal.map(distance) {
        Some(distance) if distance <= settings.arrival_px => End::Arrived,
        _ => End::Mistaken,
    }
}
