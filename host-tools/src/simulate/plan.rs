//! Which flights are flown: between places of an atlas, given or at random.

use eigenmark_core::{
    atlas::Atlas,
    navigator::{BOARD_PLACES, MAX_GOALS},
    route::{RouteError, Router},
};
use rand::RngExt;

use super::{FlightSettings, Kidnapping, World, flight_seed, seeded};

/// The vehicle has arrived when it is nearer to its goal than this, in sides of a view.
const ARRIVAL: f64 = 0.5;

/// It is given this many times the time that it would take straight along its route in calm air.
const PATIENCE: f64 = 4.0;

/// Goals that are drawn before there is none that can be reached.
const TRIES: usize = 1000;

/// Stream of the generator that routes are drawn from.
const ROUTES: u64 = 0x0007_07e5;

/// A flight before it is flown.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What it is flown with.
    pub settings: FlightSettings,
    /// Places to fly to, one after the other, 0-based.
    pub goals: Vec<u16>,
    /// Length of the shortest way, in meters.
    pub length_m: f64,
}

/// Why no flight can be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The route cannot be found.
    #[error(transparent)]
    Route(#[from] RouteError),
    /// No way leads there.
    #[error("no way leads from place {} to place {}", u32::from(*from) + 1, u32::from(*to) + 1)]
    NoWay {
        /// From here, 0-based.
        from: u16,
        /// To here, 0-based.
        to: u16,
    },
    /// The atlas's places are too few.
    #[error("a route needs two places that a leg joins; places of the atlas: {0}")]
    NoRoutes(usize),
    /// More goals than can be given at once.
    #[error("a route of {0} goals; expected at most {MAX_GOALS}")]
    TooManyGoals(usize),
}

/// Plans a flight through places (0-based), the first of which is where it starts.
///
/// # Errors
/// When no way leads through them.
pub fn plan_route(
    world: &World<'_>,
    atlas: &Atlas<'_>,
    stops: &[u16],
    seed: u64,
) -> Result<Plan, PlanError> {
    let goals = stops.get(1..).unwrap_or_default();
    if goals.is_empty() {
        return Err(PlanError::NoRoutes(atlas.topology().len()));
    }
    if goals.len() > MAX_GOALS {
        return Err(PlanError::TooManyGoals(goals.len()));
    }
    let mut router = Box::new(Router::<BOARD_PLACES>::new());
    let mut length_px = 0.0;
    for pair in stops.windows(2) {
        router.plan(atlas.topology(), pair[1])?;
        let length = router.length_px(pair[0]);
        length_px += length.ok_or(PlanError::NoWay {
            from: pair[0],
            to: pair[1],
        })?;
    }
    Ok(planned(world, atlas, stops, f64::from(length_px), seed))
}

/// Plans a flight at least so long through places at random; halfway the vehicle is carried off to another one if
/// `kidnapped`.
///
/// # Errors
/// When the atlas's places allow none.
pub fn plan_at_random(
    world: &World<'_>,
    atlas: &Atlas<'_>,
    distance_m: f64,
    kidnapped: bool,
    seed: u64,
) -> Result<Plan, PlanError> {
    let topology = atlas.topology();
    let places = topology.len() as u16;
    let mut random = seeded(seed, ROUTES);
    let mut any = || random.random_range(0..places.max(1));
    let start = (0..TRIES)
        .map(|_| any())
        .find(|&start| topology.legs(start).next().is_some());
    let start = start.ok_or(PlanError::NoRoutes(topology.len()))?;
    let mut router = Box::new(Router::<BOARD_PLACES>::new());
    let (mut stops, mut length_px) = (vec![start], 0.0);
    for _ in 0..TRIES {
        let (here, next) = (stops[stops.len() - 1], any());
        let is_long = length_px * world.meters_per_px >= distance_m;
        if is_long || stops.len() > MAX_GOALS {
            break;
        }
        router.plan(topology, next)?;
        if let Some(length) = router.length_px(here).filter(|_| next != here) {
            stops.push(next);
            length_px += f64::from(length);
        }
    }
    if stops.len() < 2 {
        return Err(PlanError::NoRoutes(topology.len()));
    }
    let mut plan = planned(world, atlas, &stops, length_px, seed);
    if let Some(to) = topology.point(any()).filter(|_| kidnapped) {
        let time_s = plan.length_m / plan.settings.blimp.cruise_m_s / 2.0;
        plan.settings.kidnapping = Some(Kidnapping { time_s, to });
    }
    Ok(plan)
}

/// Plans several flights at random, each with a seed of its own.
///
/// # Errors
/// When the atlas's places allow none.
pub fn plan_flights(
    world: &World<'_>,
    atlas: &Atlas<'_>,
    flights: u32,
    distance_m: f64,
    kidnapped: bool,
    seed: u64,
) -> Result<Vec<Plan>, PlanError> {
    (0..flights)
        .map(|index| {
            let seed = flight_seed(seed, index.into());
            plan_at_random(world, atlas, distance_m, kidnapped, seed)
        })
        .collect()
}

fn planned(world: &World<'_>, atlas: &Atlas<'_>, stops: &[u16], length_px: f64, seed: u64) -> Plan {
    let topology = atlas.topology();
    let point = |stop: Option<&u16>| stop.and_then(|&place| topology.point(place));
    let start = point(stops.first()).unwrap_or(eigenmark_core::landmark::Point {
        x_px: 0.0,
        y_px: 0.0,
    });
    let settings = FlightSettings::new(seed, start);
    let length_m = length_px * world.meters_per_px;
    let side_px = f64::from(atlas.header().footprint_px);
    let mut random = seeded(seed, ROUTES + 1);
    Plan {
        settings: FlightSettings {
            start_heading_rad: random.random_range(-3.1..3.1),
            goal: point(stops.last()),
            arrival_px: ARRIVAL * side_px,
            time_limit_s: 60.0 + PATIENCE * length_m / settings.blimp.cruise_m_s,
            ..settings
        },
        goals: stops.get(1..).unwrap_or_default().to_vec(),
        length_m,
    }
}
