//! Shadows of clouds: soft patches that move over the ground with the wind.
//!
//! A sum of three octaves of value noise (hashed lattice points, joined by the quintic 6t⁵ − 15t⁴ + 10t³) is compared
//! with a threshold. The threshold is a quantile of the noise, so that the stated share of the ground is in shadow
//! whatever the noise's distribution. The edge is a ramp in the noise, so that it is as wide as the patch is soft.

use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::simulate::chance::Cause;

/// Octaves of the noise: the finest is a quarter of the size of a cloud.
const OCTAVES: u32 = 3;

/// Points along each axis at which the noise is looked at to find the threshold.
const PROBES: u32 = 64;

/// Clouds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clouds {
    /// Share of the ground in shadow, 0 to 1, over a large area.
    pub cover: f64,
    /// What is left of the light in full shadow, 0 to 1.
    pub shade: f64,
    /// Size of a cloud, in meters.
    pub size_m: f64,
    /// Width of the ramp from light to shadow, in units of the noise: about 1 from the brightest to the darkest place.
    pub softness: f64,
}

impl Default for Clouds {
    /// A third of the ground loses 30 % of its light, in patches of 100 m with edges of some 15 m.
    fn default() -> Self {
        Self {
            cover: 0.33,
            shade: 0.7,
            size_m: 100.0,
            softness: 0.2,
        }
    }
}

/// The clouds of one flight.
#[derive(Clone, Debug)]
pub(crate) struct Sky {
    clouds: Clouds,
    wind_m_s: [f64; 2],
    key: u64,
    threshold: f64,
}

impl Sky {
    pub(crate) fn new(clouds: Clouds, wind_m_s: [f64; 2], seed: u64) -> Self {
        let key = Cause::Clouds.random(seed, 0).next_u64();
        let mut values: Vec<f64> = (0..PROBES * PROBES)
            .map(|index| {
                // Steps that no lattice repeats after.
                let at = |i: u32| f64::from(i) * 0.71;
                noise(key, [at(index % PROBES), at(index / PROBES)])
            })
            .collect();
        values.sort_by(f64::total_cmp);
        let rank = (1.0 - clouds.cover.clamp(0.0, 1.0)) * (values.len() - 1) as f64;
        Self {
            clouds,
            wind_m_s,
            key,
            threshold: values[rank as usize],
        }
    }

    /// The share of the light at a place of the ground (meters) at a time.
    pub(crate) fn light(&self, place_m: [f64; 2], time_s: f64) -> f64 {
        let at =
            [0, 1].map(|axis| (place_m[axis] - self.wind_m_s[axis] * time_s) / self.clouds.size_m);
        let above = noise(self.key, at) - self.threshold;
        let depth = (above / self.clouds.softness.max(f64::EPSILON) + 0.5).clamp(0.0, 1.0);
        let depth = depth * depth * (3.0 - 2.0 * depth);
        1.0 - (1.0 - self.clouds.shade) * depth
    }
}

/// Octaves of value noise at a point, 0 to 1; of the first, lattice points are whole numbers.
fn noise(key: u64, [x, y]: [f64; 2]) -> f64 {
    let (mut sum, mut weights, mut weight, mut scale) = (0.0, 0.0, 1.0, 1.0);
    for octave in 0..OCTAVES {
        sum += weight * octave_at(key.wrapping_add(u64::from(octave)), [x * scale, y * scale]);
        weights += weight;
        (weight, scale) = (weight / 2.0, scale * 2.0);
    }
    sum / weights
}

fn octave_at(key: u64, at: [f64; 2]) -> f64 {
    let [[column, u], [row, v]] = at.map(|at| {
        let t = at - at.floor();
        [at.floor(), t * t * t * (t * (t * 6.0 - 15.0) + 10.0)]
    });
    let (column, row) = (column as i64, row as i64);
    let between = |a: f64, b: f64, share: f64| a + share * (b - a);
    let row_at = |row: i64| between(lattice(key, column, row), lattice(key, column + 1, row), u);
    between(row_at(row), row_at(row + 1), v)
}

/// The noise at a lattice point, 0 to 1: the finalizer of SplitMix64 over its coordinates.
fn lattice(key: u64, column: i64, row: i64) -> f64 {
    let mut bits = key
        ^ (column as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (row as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    f64::from((bits ^ bits >> 31) as u32) / f64::from(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places() -> impl Iterator<Item = [f64; 2]> {
        (0..40_000_i32).map(|i| [f64::from(i % 200) * 13.3, f64::from(i / 200) * 13.3])
    }

    #[test]
    fn the_stated_share_of_the_ground_is_in_shadow() {
        for (cover, seed) in [(0.2, 1), (0.33, 2), (0.6, 3)] {
            let clouds = Clouds {
                cover,
                shade: 0.6,
                size_m: 60.0,
                softness: 0.12,
            };
            let sky = Sky::new(clouds, [0.0; 2], seed);
            let lights: Vec<f64> = places().map(|place| sky.light(place, 0.0)).collect();
            let dark = lights.iter().filter(|&&light| light < 0.8).count() as f64;
            let share = dark / lights.len() as f64;
            assert!((share - cover).abs() < 0.06, "{share} for {cover}");
            assert!(lights.iter().all(|light| (0.6..=1.0).contains(light)));
            assert!(lights.contains(&0.6) && lights.contains(&1.0));
        }
    }

    #[test]
    fn shadows_are_soft_and_move_with_the_wind() {
        let sky = Sky::new(Clouds::default(), [2.0, -1.0], 4);
        for [x, y] in places().take(5_000) {
            let light = sky.light([x, y], 0.0);
            assert!(
                (light - sky.light([x + 0.5, y], 0.0)).abs() < 0.06,
                "no step in half a meter"
            );
            assert!((light - sky.light([x + 20.0, y - 10.0], 10.0)).abs() < 1e-9);
        }
    }
}
