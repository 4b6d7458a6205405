//! Flights over the map: everything but the vehicle's own software. A vehicle with its camera and its instruments, the
//! air and the light around it, in a closed loop with whatever steers.
//!
//! | room | does |
//! | --- | --- |
//! | `camera` | frames of the map, from one pose or along the way of a moving one |
//! | `world` | the ground and its scale, wind, light, shadows of clouds |
//! | `vehicle` | a blimp: heading, speed, slip, altitude, swing |
//! | `sensor` | what the sensor and its link do to frames |
//! | `instruments` | what an autopilot tells, and how wrong that is |
//! | `flight` | the loop: sight → pilot → command → vehicle; what is kept of it, and its statistics |
//! | `plan` | which flights are flown: between places, given or at random |
//! | `record` | flights written to a directory, read again, shown to any pilot |
//! | `picture` | a flight over the map as a picture |
//! | `chance` | random processes, a generator for each cause |
//! | `onboard` | the vehicle's own software as a pilot |
//! | `scout` | the same without an atlas: it explores, then visits what it found |
//! | `legs` | the short flight of the demo |
//!
//! The same seed gives the same flight, bit for bit, whatever the number of threads; and an effect that is switched off
//! changes no other, because each draws from a generator of its own.
//!
//! # Examples
//! ```
//! use eigenmark::{
//!     map::Map,
//!     simulate::{Camera, Command, End, Pilot, FlightSettings, Sight, Statistics, World, drawn_way, fly},
//! };
//!
//! /// Heads where the compass says map-up is, and thinks nothing.
//! struct North;
//!
//! impl Pilot for North {
//!     fn decide(&mut self, _: &Sight<'_>) -> Command {
//!         Command { heading_rad: 0.0, speed: 1.0 }
//!     }
//! }
//!
//! let map = Map::city();
//! let world = World { map: &map, meters_per_px: 0.5, camera: Camera::sized(160, 120, 200.0) };
//! let settings = FlightSettings { time_limit_s: 5.0, ..FlightSettings::new(7, drawn_way(&world, 0.0, 7)[0]) };
//! let flight = fly(&world, &settings, &mut North)?;
//! assert_eq!((flight.end, flight.steps.len()), (End::OutOfTime, 51));
//! let statistics = Statistics::of(&flight.steps, Some(flight.end), 0.5, 200.0);
//! assert!(statistics.distance_m.is_some_and(|way| way > 5.0 && way < 40.0));
//! # Ok::<(), eigenmark::simulate::FlightError>(())
//! ```

mod camera;
mod chance;
mod flight;
mod instruments;
mod legs;
mod onboard;
mod picture;
mod plan;
mod record;
mod scout;
mod sensor;
mod vehicle;
mod world;

use rand::SeedableRng;
use rand_pcg::Pcg64;

pub(crate) use camera::gamma_levels;
pub use camera::{Camera, CameraFrame, Corner, Motion, Occlusion, Scene, Shutter};
pub use chance::flight_seed;
pub use flight::{
    End, Estimate, Flight, FlightError, FlightSettings, Guided, Interrupted, Kidnapping, Pilot,
    Report, Sight, Statistics, Step, Totals, drawn_way, fly, fly_all, fly_watched,
};
pub use instruments::{Instruments, Readings};
pub use legs::{Legs, Waypoint, fly_legs};
pub use onboard::Onboard;
pub use picture::FlightPicture;
pub use plan::{Plan, PlanError, plan_at_random, plan_flights, plan_route};
pub use record::{Ground, Header, RecordError, Recorder, Recording, fly_recorded};
pub use scout::{Arrival, Scout};
pub use sensor::Sensor;
pub use vehicle::{Blimp, Command, Truth};
pub use world::{Clouds, Light, Wind, World};

/// A random generator for one thing of a seeded whole: the same for the same pair, whatever the number of threads.
#[must_use]
pub fn seeded(seed: u64, stream: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15))
}
