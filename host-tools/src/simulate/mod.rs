//! A camera over the map: frames as the vehicle would see them.

mod camera;
mod flight;

use rand::SeedableRng;
use rand_pcg::Pcg64;

pub(crate) use camera::gamma_levels;
pub use camera::{Camera, CameraFrame, Corner, Occlusion, Scene};
pub use flight::{Flight, Waypoint, fly};

/// A random generator for one thing of a seeded whole: the same for the same pair, whatever the number of threads.
#[must_use]
pub fn seeded(seed: u64, stream: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15))
}
