//! The camera at work: one frame after another.

use rand::RngExt;

use super::{Sensor, vignette::vignette};
use crate::simulate::{
    Camera, CameraFrame, Motion, Scene, Truth, World,
    camera::gamma_table,
    chance::{Cause, gaussian},
    world::{Daylight, Exposure, Sky},
};

/// Frame pixels between two points at which the clouds' shadows are looked up.
const SHADE_CELL_PX: usize = 8;

/// A camera in flight.
#[derive(Clone, Debug)]
pub(crate) struct Imager {
    sensor: Sensor,
    seed: u64,
    /// Light per pixel, without clouds; empty when all of it arrives everywhere.
    vignette: Vec<f32>,
    /// Light per pixel with clouds, of the frame at hand.
    light: Vec<f32>,
    frame: CameraFrame,
    /// The lower part of the frame before goes into a torn one.
    before: CameraFrame,
    has_before: bool,
}

impl Imager {
    pub(crate) fn new(camera: &Camera, sensor: Sensor, seed: u64) -> Self {
        let frame = camera.frame();
        Self {
            sensor,
            seed,
            vignette: if sensor.vignetting == 0.0 {
                Vec::new()
            } else {
                vignette(camera, sensor.vignetting)
            },
            light: vec![1.0; frame.pixels.len()],
            before: frame.clone(),
            has_before: false,
            frame,
        }
    }

    /// Takes the frame of that number, from 0, at the time `time_s`; `None` when it does not arrive.
    pub(crate) fn take(
        &mut self,
        world: &World<'_>,
        truth: &Truth,
        day: &Daylight,
        number: u64,
        time_s: f64,
    ) -> Option<&CameraFrame> {
        let happens =
            |share: f64, cause: Cause| cause.random(self.seed, number).random::<f64>() < share;
        if happens(self.sensor.dropped, Cause::Dropped) {
            return None;
        }
        let is_torn = self.has_before && happens(self.sensor.torn, Cause::Torn);
        self.has_before = true;
        if self.sensor.torn > 0.0 {
            std::mem::swap(&mut self.frame, &mut self.before);
        }
        let (scene, motion) = seen_from(truth, world.meters_per_px);
        let (camera, shutter) = (&world.camera, self.sensor.shutter);
        camera.sweep(world.map, &scene, &motion, shutter, &mut self.frame);
        self.gather(world, &scene, day.sky(), time_s);
        self.expose(day, number);
        if is_torn {
            self.tear(number);
        }
        Some(&self.frame)
    }

    /// How much light each pixel gets.
    fn gather(&mut self, world: &World<'_>, scene: &Scene, sky: Option<&Sky>, time_s: f64) {
        match sky {
            Some(sky) => {
                let ground = world.camera.ground(scene);
                let shade = |column: usize, row: usize| {
                    // Above the horizon there is no shadow.
                    ground([column as f64, row as f64]).map_or(1.0, |place| {
                        sky.light(place.map(|px| px * world.meters_per_px), time_s) as f32
                    })
                };
                spread(&mut self.light, usize::from(self.frame.width), shade);
                for (light, vignette) in self.light.iter_mut().zip(&self.vignette) {
                    *light *= vignette;
                }
            }
            None if self.vignette.is_empty() => self.light.fill(1.0),
            None => self.light.copy_from_slice(&self.vignette),
        }
    }

    /// What the sensor makes of it.
    fn expose(&mut self, day: &Daylight, number: u64) {
        let Exposure { gamma, gain } = day.exposure();
        let noise = self.sensor.noise as f32;
        let is_plain = self.vignette.is_empty() && day.sky().is_none();
        if is_plain && (gamma, gain, noise) == (1.0, 1.0, 0.0) {
            return;
        }
        let levels = FineLevels::new(gamma);
        let mut random = Cause::Noise.random(self.seed, number);
        let gain = gain as f32;
        for (pixel, light) in self.frame.pixels.iter_mut().zip(&self.light) {
            let level = levels.at(f32::from(*pixel) * light * gain);
            let level = if noise > 0.0 {
                level + noise * gaussian(&mut random) as f32
            } else {
                level
            };
            *pixel = (level + 0.5) as u8; // truncates and saturates
        }
    }

    /// Replaces the lower part, of any height, by the one of the frame before.
    fn tear(&mut self, number: u64) {
        // The first number of this generator said that the frame is torn.
        let mut random = Cause::Torn.random(self.seed, number);
        let _ = random.random::<f64>();
        let row = random.random_range(1..self.frame.height.max(2));
        let start = usize::from(row) * usize::from(self.frame.width);
        let parts = self.frame.pixels.iter_mut().zip(&self.before.pixels);
        for (pixel, &before) in parts.skip(start) {
            *pixel = before;
        }
    }
}

/// The pose of a camera fixed to the vehicle, and how it changes.
fn seen_from(truth: &Truth, meters_per_px: f64) -> (Scene, Motion) {
    let scene = Scene {
        heading_rad: truth.heading_rad,
        altitude_ratio: truth.altitude_ratio,
        roll_rad: truth.roll_rad,
        pitch_rad: truth.pitch_rad,
        ..Scene::nominal(truth.place())
    };
    let motion = Motion {
        velocity_px_s: truth.velocity_m_s.map(|velocity| velocity / meters_per_px),
        yaw_rad_s: truth.yaw_rad_s,
        climb_per_s: truth.climb_per_s,
        roll_rad_s: truth.roll_rad_s,
        pitch_rad_s: truth.pitch_rad_s,
    };
    (scene, motion)
}

/// Fills rows of `width` values from values at the corners of square cells, bilinearly.
fn spread(values: &mut [f32], width: usize, at: impl Fn(usize, usize) -> f32) {
    let columns: Vec<usize> = (0..=width.div_ceil(SHADE_CELL_PX)).collect();
    let corners = |row: usize| -> Vec<f32> {
        let row_px = row * SHADE_CELL_PX;
        columns
            .iter()
            .map(|column| at(column * SHADE_CELL_PX, row_px))
            .collect()
    };
    let mut below = corners(0);
    for (index, cells) in values.chunks_mut(width * SHADE_CELL_PX).enumerate() {
        let above = std::mem::replace(&mut below, corners(index + 1));
        for (row, values) in cells.chunks_mut(width).enumerate() {
            let down = (row as f32 + 0.5) / SHADE_CELL_PX as f32;
            let mix = |column: usize| above[column] + down * (below[column] - above[column]);
            for (column, values) in values.chunks_mut(SHADE_CELL_PX).enumerate() {
                let (left, right) = (mix(column), mix(column + 1));
                let step = (right - left) / SHADE_CELL_PX as f32;
                for (value, across) in values.iter_mut().zip(0_u8..) {
                    *value = left + step * (f32::from(across) + 0.5);
                }
            }
        }
    }
}

/// The curve of a gamma between whole levels.
struct FineLevels([f32; 257]);

impl FineLevels {
    fn new(gamma: f64) -> Self {
        let mut levels = [255.0; 257];
        for (level, value) in levels.iter_mut().zip(gamma_table(gamma)) {
            *level = value as f32;
        }
        Self(levels)
    }

    /// The curve at a level; above white it is white.
    #[inline]
    fn at(&self, level: f32) -> f32 {
        let level = level.min(255.0);
        let whole = level as u8; // truncates
        let (a, b) = (self.0[usize::from(whole)], self.0[usize::from(whole) + 1]);
        a + (level - f32::from(whole)) * (b - a)
    }
}
