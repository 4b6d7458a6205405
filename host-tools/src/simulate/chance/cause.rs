//! What draws random numbers during a flight.

use rand::Rng;
use rand_pcg::Pcg64;

use crate::simulate::seeded;

/// A cause of chance; its number is its stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// Where the wind blows to.
    Wind = 1,
    /// Gusts, by axis of the map.
    Gusts,
    /// The vehicle's altitude.
    Altitude,
    /// What sets roll and pitch swinging.
    Swing,
    /// The compass's error.
    Compass,
    /// The errors of roll and pitch.
    Level,
    /// The barometer's error.
    Barometer,
    /// The exponent of the brightness.
    Gamma,
    /// The factor of the brightness.
    Gain,
    /// Where clouds are.
    Clouds,
    /// The sensor's noise, by frame.
    Noise,
    /// Which frames do not arrive, by frame.
    Dropped,
    /// Which frames arrive torn, and where, by frame.
    Torn,
    /// Where a way leads.
    Way,
}

impl Cause {
    /// The generator of one part of this cause, such as an axis or a frame, in the flight of that seed.
    pub(crate) fn random(self, seed: u64, part: u64) -> Pcg64 {
        seeded(seeded(seed, self as u64).next_u64(), part)
    }
}

/// The seed of one flight of several (`index` from 0) that share a seed.
#[must_use]
pub fn flight_seed(seed: u64, index: u64) -> u64 {
    seeded(seed, index).next_u64()
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn no_two_causes_parts_or_flights_share_a_generator() {
        let mut first = HashSet::new();
        for flight in 0..4 {
            let seed = flight_seed(7, flight);
            for cause in [Cause::Wind, Cause::Gusts, Cause::Noise, Cause::Torn] {
                for part in 0..50 {
                    assert!(first.insert(cause.random(seed, part).next_u64()));
                }
            }
        }
    }
}
