//! The light: how the exposure walks, and the shadows of clouds.

use serde::{Deserialize, Serialize};

use super::{Clouds, Sky};
use crate::simulate::chance::{Cause, Walk};

/// How the light changes during a flight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Bounds of the exponent of the brightness; it walks between them, on a logarithmic scale.
    pub gamma: [f64; 2],
    /// Bounds of the factor of the brightness; it walks between them, on a logarithmic scale.
    pub gain: [f64; 2],
    /// How long both take to forget where they were, in seconds.
    pub time_s: f64,
    /// The clouds that throw shadows.
    pub clouds: Option<Clouds>,
}

/// What becomes of the light all over a frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// Exponent of the brightness: level ↦ 255·(level/255)^gamma; 1 for none.
    pub gamma: f64,
    /// Factor of the brightness, before the exponent; 1 for none.
    pub gain: f64,
}

impl Light {
    /// As when the map was taken.
    #[must_use]
    pub fn steady() -> Self {
        Self {
            gamma: [1.0; 2],
            gain: [1.0; 2],
            time_s: 60.0,
            clouds: None,
        }
    }
}

impl Default for Light {
    /// Gamma within 0.5 to 2, gain within 0.8 to 1.25, over a minute; some clouds.
    fn default() -> Self {
        Self {
            gamma: [0.5, 2.0],
            gain: [0.8, 1.25],
            clouds: Some(Clouds::default()),
            ..Self::steady()
        }
    }
}

/// The light of one flight.
#[derive(Clone, Debug)]
pub(crate) struct Daylight {
    gamma: Walk,
    gain: Walk,
    sky: Option<Sky>,
}

impl Daylight {
    /// With clouds that move as the mean wind does.
    pub(crate) fn new(light: &Light, wind_m_s: [f64; 2], seed: u64, step_s: f64) -> Self {
        let walk = |bounds: [f64; 2], cause: Cause| {
            let random = cause.random(seed, 0);
            Walk::new(bounds.map(f64::ln), light.time_s, step_s, random)
        };
        Self {
            gamma: walk(light.gamma, Cause::Gamma),
            gain: walk(light.gain, Cause::Gain),
            sky: light.clouds.map(|clouds| Sky::new(clouds, wind_m_s, seed)),
        }
    }

    /// Goes on by one step.
    pub(crate) fn step(&mut self) {
        self.gamma.step();
        self.gain.step();
    }

    /// The exposure now.
    pub(crate) fn exposure(&self) -> Exposure {
        Exposure {
            gamma: self.gamma.value().exp(),
            gain: self.gain.value().exp(),
        }
    }

    /// The clouds, if any.
    pub(crate) fn sky(&self) -> Option<&Sky> {
        self.sky.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exposure_walks_slowly_between_its_bounds() {
        let light = Light {
            clouds: None,
            ..Light::default()
        };
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        for seed in 0..30 {
            let mut day = Daylight::new(&light, [0.0; 2], seed, 0.1);
            for _ in 0..1_000 {
                let before = day.exposure();
                day.step();
                let Exposure { gamma, gain } = day.exposure();
                assert!(
                    (gamma / before.gamma).ln().abs() < 0.01,
                    "a tenth of a second"
                );
                assert!((0.8..=1.25).contains(&gain), "{gain}");
                (low, high) = (low.min(gamma), high.max(gamma));
            }
        }
        assert!(
            (0.5..0.55).contains(&low) && (1.8..=2.0).contains(&high),
            "{low} {high}"
        );
        let steady = Daylight::new(&Light::steady(), [0.0; 2], 1, 0.1).exposure();
        assert_eq!((steady.gamma, steady.gain), (1.0, 1.0));
    }
}
