//! In which respects a view may deviate, and in which steps.

use serde::{Deserialize, Serialize};

use crate::simulate::{Corner, Occlusion, Scene};

/// Frames of different noise that a step of noise must pass.
const NOISY_FRAMES: usize = 4;

/// One respect in which a view deviates from its landmark's, everything else being nominal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Measure {
    /// Heading in degrees, clockwise; steps of 1°.
    #[serde(rename = "orientation_deg")]
    Orientation,
    /// Altitude over nominal altitude; steps of 1 %.
    #[serde(rename = "altitude_ratio")]
    Altitude,
    /// Exponent of the brightness; steps are chosen, to the other side their reciprocals.
    #[serde(rename = "gamma")]
    Gamma,
    /// Roll in degrees, right side down; steps of 1°.
    #[serde(rename = "roll_deg")]
    Roll,
    /// Pitch in degrees, nose up; steps of 1°.
    #[serde(rename = "pitch_deg")]
    Pitch,
    /// Standard deviation of the sensor's noise in gray levels; steps of 2. Four frames must pass.
    #[serde(rename = "noise_levels")]
    Noise,
    /// Way during the exposure as a share of the footprint; steps of 2 %. Ways to the right and ahead must pass.
    #[serde(rename = "motion_share")]
    Motion,
    /// Share of the frame that is hidden; steps of 1 %. Each corner must pass.
    #[serde(rename = "occlusion_share")]
    Occlusion,
}

/// How finely a measure is tried.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Steps {
    /// Step of gamma; the report's is 0.5.
    pub gamma: f64,
}

impl Default for Steps {
    fn default() -> Self {
        Self { gamma: 0.5 }
    }
}

impl Measure {
    /// All of them. Position is not among them: a catchment is an area, not a limit.
    pub const ALL: [Self; 8] = [
        Self::Orientation,
        Self::Altitude,
        Self::Gamma,
        Self::Roll,
        Self::Pitch,
        Self::Noise,
        Self::Motion,
        Self::Occlusion,
    ];

    /// Those of the report (section 3.5).
    pub const REPORT: [Self; 3] = [Self::Orientation, Self::Altitude, Self::Gamma];

    /// Where nothing deviates.
    #[must_use]
    pub fn nominal(self) -> f64 {
        match self {
            Self::Altitude | Self::Gamma => 1.0,
            _ => 0.0,
        }
    }

    /// The value of step `step`, counted from the nominal one to both sides; `None` beyond the range that is tried.
    #[must_use]
    pub fn value(self, step: i32, steps: Steps) -> Option<f64> {
        let n = f64::from(step);
        let (value, range) = match self {
            Self::Orientation => (n, -180.0..=180.0),
            Self::Altitude => ((100.0 + n) / 100.0, 0.25..=4.0),
            Self::Gamma => {
                let away = (1e9 * (1.0 + n.abs() * steps.gamma)).round() / 1e9;
                (if step < 0 { 1.0 / away } else { away }, 0.1..=10.0)
            }
            Self::Roll | Self::Pitch => (n, -45.0..=45.0),
            Self::Noise => (2.0 * n, 0.0..=50.0),
            Self::Motion => (n / 50.0, 0.0..=0.5),
            Self::Occlusion => (n / 100.0, 0.0..=0.5),
        };
        range.contains(&value).then_some(value)
    }

    /// The scenes that have to pass for `value` to be tolerated around a nominal one: still, level, in nominal light.
    #[must_use]
    pub fn scenes(self, value: f64, nominal: &Scene, footprint_px: f64) -> Vec<Scene> {
        let nominal = *nominal;
        let way = value * footprint_px;
        match self {
            Self::Orientation => vec![Scene {
                heading_rad: nominal.heading_rad + value.to_radians(),
                ..nominal
            }],
            Self::Altitude => vec![Scene {
                altitude_ratio: nominal.altitude_ratio * value,
                ..nominal
            }],
            Self::Gamma => vec![Scene {
                gamma: value,
                ..nominal
            }],
            Self::Roll => vec![Scene {
                roll_rad: value.to_radians(),
                ..nominal
            }],
            Self::Pitch => vec![Scene {
                pitch_rad: value.to_radians(),
                ..nominal
            }],
            Self::Noise => vec![
                Scene {
                    noise: value,
                    ..nominal
                };
                NOISY_FRAMES
            ],
            Self::Motion => [[way, 0.0], [0.0, way]]
                .map(|motion_px| Scene {
                    motion_px,
                    ..nominal
                })
                .to_vec(),
            Self::Occlusion => Corner::ALL
                .map(|corner| Scene {
                    occlusion: Some(Occlusion {
                        corner,
                        share: value,
                    }),
                    ..nominal
                })
                .to_vec(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_those_of_the_report() {
        let values = |measure: Measure, range: std::ops::RangeInclusive<i32>| -> Vec<f64> {
            range
                .map_while(|step| measure.value(step, Steps::default()))
                .collect()
        };
        assert_eq!(
            values(Measure::Orientation, -2..=2),
            [-2.0, -1.0, 0.0, 1.0, 2.0]
        );
        assert_eq!(values(Measure::Altitude, -1..=13).last(), Some(&1.13));
        assert_eq!(
            values(Measure::Gamma, -2..=2),
            [0.5, 1.0 / 1.5, 1.0, 1.5, 2.0]
        );
        assert_eq!(values(Measure::Gamma, 0..=99).last(), Some(&10.0));
        assert_eq!(values(Measure::Orientation, 0..=999).len(), 181);
        assert_eq!(Measure::Noise.value(-1, Steps::default()), None);
        let fine = Steps { gamma: 0.1 };
        assert_eq!(Measure::Gamma.value(3, fine), Some(1.3));
        for measure in Measure::ALL {
            let nominal = measure.value(0, Steps::default());
            assert_eq!(nominal, Some(measure.nominal()), "{measure:?}");
        }
    }
}
