//! Rendering a frame from the map.
//!
//! The largest centered square of the frame of a camera that looks straight down covers `altitude_ratio × footprint` of
//! the map around its position, turned by its heading (clockwise from map-up to frame-up). Roll and pitch then turn the
//! camera, as in the core's `preprocess::Pose`. Every pixel is the mean of bilinear samples spread over its area, so
//! that frames coarser than the map are anti-aliased, and over the way the camera goes during the exposure; then come
//! what hides a corner of the frame, gamma, and noise.

mod projection;
mod sampler;
mod scene;
mod sensor;
mod sweep;

use std::f64::consts::PI;

use eigenmark_core::{atlas::Atlas, frame::Frame};
use rand::Rng;

use crate::map::Map;
use projection::Projection;
use sampler::{Sampler, fixed, mean};
use sensor::exposed;

pub use scene::{Corner, Occlusion, Scene};
pub(crate) use sensor::{gamma_levels, gamma_table};
pub use sweep::{Motion, Shutter};

/// Sides of the camera that the vehicle carries: 160×120 pixels.
const WIDTH: u16 = 160;
const HEIGHT: u16 = 120;

/// Field of view over the side of the square, in radians: 60°.
const FIELD_OF_VIEW_RAD: f64 = 60.0 * PI / 180.0;

/// Samples per pixel and direction, at most: enough for windows of 1920 pixels, and nearly for larger ones.
const MAX_SAMPLES: f64 = 8.0;

/// The longest side of a square as fine as the map, in pixels.
const MAX_FINE_SIDE: u32 = 512;

/// Exposures that a moving frame is the mean of, at most.
const MAX_EXPOSURES: f64 = 16.0;

/// How far off the map a frame's corner may lie by rounding, in map pixels.
const ROUNDING_PX: f64 = 1e-6;

/// A camera that fits an atlas.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    width: u16,
    height: u16,
    footprint_px: f64,
    field_of_view_rad: f64,
}

/// A frame that owns its pixels.
#[derive(Clone, Debug)]
pub struct CameraFrame {
    /// Luminance, row by row without gaps.
    pub pixels: Vec<u8>,
    /// Width in pixels.
    pub width: u16,
    /// Height in pixels.
    pub height: u16,
}

impl Camera {
    /// A 160×120 camera for the views of `atlas`, with a field of view of 60° over the side of its square.
    #[must_use]
    pub fn for_atlas(atlas: &Atlas<'_>) -> Self {
        Self {
            width: WIDTH,
            height: HEIGHT,
            footprint_px: f64::from(atlas.header().footprint_px),
            field_of_view_rad: FIELD_OF_VIEW_RAD,
        }
    }

    /// The centered square of that camera alone: all that the core looks at, quicker to render.
    #[must_use]
    pub fn square_for(atlas: &Atlas<'_>) -> Self {
        Self::square_of(f64::from(atlas.header().footprint_px))
    }

    /// The same for views of that footprint.
    #[must_use]
    pub fn square_of(footprint_px: f64) -> Self {
        Self {
            width: HEIGHT,
            height: HEIGHT,
            footprint_px,
            field_of_view_rad: FIELD_OF_VIEW_RAD,
        }
    }

    /// A square as fine as the map: at the nominal pose its pixels are the map's, as far as a square of 512 pixels goes.
    #[must_use]
    pub fn finest(footprint_px: u32) -> Self {
        let side = footprint_px.clamp(1, MAX_FINE_SIDE) as u16;
        Self {
            width: side,
            height: side,
            footprint_px: f64::from(footprint_px),
            field_of_view_rad: FIELD_OF_VIEW_RAD,
        }
    }

    /// A camera of `width`×`height` pixels for views of that footprint, with a field of view of 60° over the side of its
    /// square.
    #[must_use]
    pub fn sized(width: u16, height: u16, footprint_px: f64) -> Self {
        Self {
            width,
            height,
            footprint_px,
            field_of_view_rad: FIELD_OF_VIEW_RAD,
        }
    }

    /// The same camera with that field of view over the side of its square, in radians.
    #[must_use]
    pub fn with_field_of_view(self, field_of_view_rad: f64) -> Self {
        Self {
            field_of_view_rad,
            ..self
        }
    }

    /// Width and height of its frames, in pixels.
    #[must_use]
    pub fn size(&self) -> [u16; 2] {
        [self.width, self.height]
    }

    /// A black frame to render into.
    #[must_use]
    pub fn frame(&self) -> CameraFrame {
        let len = usize::from(self.width) * usize::from(self.height);
        CameraFrame {
            pixels: vec![0; len],
            width: self.width,
            height: self.height,
        }
    }

    /// Angle over the side of the square, in radians.
    #[must_use]
    pub fn field_of_view_rad(&self) -> f64 {
        self.field_of_view_rad
    }

    /// What its square covers at nominal altitude, in map pixels.
    #[must_use]
    pub fn footprint_px(&self) -> f64 {
        self.footprint_px
    }

    /// Whether everything that the frame shows lies on the map.
    #[must_use]
    pub fn is_on_map(&self, map: &Map, scene: &Scene) -> bool {
        let (right, below) = (f64::from(self.width), f64::from(self.height));
        let corners = [[0.0, 0.0], [right, 0.0], [0.0, below], [right, below]];
        let is_within =
            |at: f64, size: u32| (-ROUNDING_PX..=f64::from(size) + ROUNDING_PX).contains(&at);
        // The way is straight: the frame is on the map all along when it is at both ends.
        [-0.5, 0.5].into_iter().all(|share| {
            let projection = Projection::new(self, &scene.moved(share));
            corners.into_iter().all(|corner| {
                projection
                    .ground(corner)
                    .is_some_and(|[x, y]| is_within(x, map.width()) && is_within(y, map.height()))
            })
        })
    }

    /// Tells the map position that a position of the frame shows; `None` at the horizon and beyond.
    pub(crate) fn ground(&self, scene: &Scene) -> impl Fn([f64; 2]) -> Option<[f64; 2]> + use<> {
        let projection = Projection::new(self, scene);
        move |position| projection.ground(position)
    }

    /// Renders `scene` into a frame made by [`frame`](Self::frame). Beyond the map its border pixels are repeated; what
    /// lies at the horizon or beyond is black.
    pub fn render(&self, map: &Map, scene: &Scene, random: &mut impl Rng, frame: &mut CameraFrame) {
        self.see(map, scene, frame);
        self.expose(scene, random, frame);
    }

    /// The first half of [`render`](Self::render): what the pose and the way let the camera see.
    pub fn see(&self, map: &Map, scene: &Scene, frame: &mut CameraFrame) {
        if scene.motion_px == [0.0; 2] {
            self.sample(map, scene, frame);
        } else {
            self.sample_moving(map, scene, frame);
        }
    }

    /// The second half of [`render`](Self::render): what hides a part of that, the light, and the sensor's noise.
    pub fn expose(&self, scene: &Scene, random: &mut impl Rng, frame: &mut CameraFrame) {
        if let Some(occlusion) = scene.occlusion {
            self.hide(occlusion, frame);
        }
        if scene.gamma == 1.0 && scene.noise == 0.0 {
            return;
        }
        let levels = gamma_table(scene.gamma);
        for pixel in &mut frame.pixels {
            *pixel = exposed(*pixel, &levels, scene.noise, random);
        }
    }

    /// The mean of frames along the way.
    fn sample_moving(&self, map: &Map, scene: &Scene, frame: &mut CameraFrame) {
        let [x, y] = scene.motion_px;
        let exposures = (x.hypot(y).ceil() + 1.0).min(MAX_EXPOSURES);
        let count = exposures as u32;
        let mut sums = vec![0_u32; frame.pixels.len()];
        for index in 0..count {
            let share = f64::from(index) / (exposures - 1.0) - 0.5;
            self.sample(map, &scene.moved(share), frame);
            for (sum, &level) in sums.iter_mut().zip(&frame.pixels) {
                *sum += u32::from(level);
            }
        }
        for (pixel, sum) in frame.pixels.iter_mut().zip(sums) {
            *pixel = ((sum + count / 2) / count) as u8;
        }
    }

    /// Blackens a corner of the square.
    fn hide(&self, occlusion: Occlusion, frame: &mut CameraFrame) {
        let (width, height) = (usize::from(self.width), usize::from(self.height));
        let side = width.min(height);
        let hidden = (side as f64 * occlusion.share.clamp(0.0, 1.0).sqrt()).round() as usize;
        let is_right = matches!(occlusion.corner, Corner::TopRight | Corner::BottomRight);
        let is_low = matches!(occlusion.corner, Corner::BottomLeft | Corner::BottomRight);
        let start = |length: usize, is_far: bool| {
            (length - side) / 2 + if is_far { side - hidden } else { 0 }
        };
        let (left, top) = (start(width, is_right), start(height, is_low));
        for row in frame.pixels.chunks_exact_mut(width).skip(top).take(hidden) {
            row[left..left + hidden].fill(0);
        }
    }

    /// What the map shows from one place, before the sensor.
    fn sample(&self, map: &Map, scene: &Scene, frame: &mut CameraFrame) {
        if scene.roll_rad != 0.0 || scene.pitch_rad != 0.0 {
            return self.sample_tilted(map, scene, frame);
        }
        let side = f64::from(self.width.min(self.height));
        let pitch = self.footprint_px * scene.altitude_ratio / side; // map pixels per frame pixel
        // A bilinear sample reaches two map pixels, so samples up to two apart miss nothing.
        let samples = (pitch / 2.0).ceil().clamp(1.0, MAX_SAMPLES) as u32;
        let sampler = Sampler::new(map);
        // Steps on the map per sample, to the right and down the frame.
        let (sin, cos) = scene.heading_rad.sin_cos();
        let step = pitch / f64::from(samples);
        let (right, down) = (
            [fixed(cos * step), fixed(sin * step)],
            [fixed(-sin * step), fixed(cos * step)],
        );
        // The first sample of the top-left pixel; the map's pixel centers lie at halves.
        let across = 0.5 - f64::from(self.width) / 2.0 * f64::from(samples);
        let along = 0.5 - f64::from(self.height) / 2.0 * f64::from(samples);
        let first = [
            fixed(f64::from(scene.place.x_px) - 0.5 + step * (cos * across - sin * along)),
            fixed(f64::from(scene.place.y_px) - 0.5 + step * (sin * across + cos * along)),
        ];
        let count = samples * samples;
        let samples = i64::from(samples);
        for (row, pixels) in (0..).zip(frame.pixels.chunks_exact_mut(usize::from(self.width))) {
            for (column, pixel) in (0..).zip(pixels) {
                let mut sum = 0;
                for sub_row in row * samples..(row + 1) * samples {
                    let start = column * samples;
                    let mut x = first[0] + start * right[0] + sub_row * down[0];
                    let mut y = first[1] + start * right[1] + sub_row * down[1];
                    for _ in 0..samples {
                        sum += sampler.bilinear(x, y);
                        (x, y) = (x + right[0], y + right[1]);
                    }
                }
                *pixel = mean(sum, count);
            }
        }
    }

    /// The same for a camera that does not look straight down: every sample has a ray of its own.
    fn sample_tilted(&self, map: &Map, scene: &Scene, frame: &mut CameraFrame) {
        let projection = Projection::new(self, scene);
        let sampler = Sampler::new(map);
        for (row, pixels) in (0..).zip(frame.pixels.chunks_exact_mut(usize::from(self.width))) {
            for (column, pixel) in (0..).zip(pixels) {
                let corner = [f64::from(column), f64::from(row)];
                let samples = projection.samples(corner);
                let mut sum = 0;
                for index in 0..samples * samples {
                    let share = |i: u32| (f64::from(i) + 0.5) / f64::from(samples);
                    let (across, along) = (share(index % samples), share(index / samples));
                    if let Some([x, y]) = projection.ground([corner[0] + across, corner[1] + along])
                    {
                        // The map's pixel centers lie at halves.
                        sum += sampler.bilinear(fixed(x - 0.5), fixed(y - 0.5));
                    }
                }
                *pixel = mean(sum, samples * samples);
            }
        }
    }
}

impl CameraFrame {
    /// The frame as the core sees it.
    ///
    /// # Panics
    /// When the fields contradict each other.
    #[must_use]
    pub fn as_frame(&self) -> Frame<'_> {
        Frame::new(
            &self.pixels,
            self.width,
            self.height,
            usize::from(self.width),
        )
        .expect("a camera's frame is valid")
    }
}

#[cfg(test)]
mod tests;
