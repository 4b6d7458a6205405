//! Rendering a frame from the map.
//!
//! The largest centered square of the frame of a camera that looks straight down covers `altitude_ratio × footprint` of
//! the map around its position, turned by its heading (clockwise from map-up to frame-up). Roll and pitch then turn the
//! camera, as in the core's `preprocess::Pose`. Every pixel is the mean of bilinear samples spread over its area, so
//! that frames coarser than the map are anti-aliased, and over the way the camera goes during the exposure; then come
//! what hides a corner of the frame, gamma, and noise.

use std::f64::consts::PI;

use eigenmark_core::{atlas::Atlas, frame::Frame, landmark::Point};
use rand::Rng;

use crate::map::Map;

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

/// Where the camera is and how bright it is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scene {
    /// Where the camera is on the map; the middle of the frame without tilt.
    pub place: Point,
    /// Heading in radians, clockwise from map-up to frame-up.
    pub heading_rad: f64,
    /// Altitude over nominal altitude.
    pub altitude_ratio: f64,
    /// Roll in radians, right side down: the camera looks left.
    pub roll_rad: f64,
    /// Pitch in radians, nose up: the camera looks ahead.
    pub pitch_rad: f64,
    /// Exponent of the brightness, 1 for none: level ↦ 255·(level/255)^gamma.
    pub gamma: f64,
    /// Standard deviation of the noise, in gray levels.
    pub noise: f64,
    /// Which way the camera goes during the exposure, in map pixels; `place` is the middle.
    pub motion_px: [f64; 2],
    /// What hides a part of the frame.
    pub occlusion: Option<Occlusion>,
}

/// A black square in a corner of the frame's square, such as a landing leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Occlusion {
    /// The corner.
    pub corner: Corner,
    /// Share of the frame's square that it hides, 0 to 1.
    pub share: f64,
}

/// A corner of the frame's square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corner {
    /// Ahead, to the left.
    TopLeft,
    /// Ahead, to the right.
    TopRight,
    /// Behind, to the left.
    BottomLeft,
    /// Behind, to the right.
    BottomRight,
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
        let count = u64::from(samples * samples);
        let samples = i64::from(samples);
        for (row, pixels) in (0..).zip(frame.pixels.chunks_exact_mut(usize::from(self.width))) {
            for (column, pixel) in (0..).zip(pixels) {
                let mut sum = 0_u64;
                for sub_row in row * samples..(row + 1) * samples {
                    for sub_column in column * samples..(column + 1) * samples {
                        let at = |axis: usize| {
                            first[axis] + sub_column * right[axis] + sub_row * down[axis]
                        };
                        sum += u64::from(sampler.bilinear(at(0), at(1)));
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
                let mut sum = 0_u64;
                for index in 0..samples * samples {
                    let share = |i: u32| (f64::from(i) + 0.5) / f64::from(samples);
                    let (across, along) = (share(index % samples), share(index / samples));
                    if let Some([x, y]) = projection.ground([corner[0] + across, corner[1] + along])
                    {
                        // The map's pixel centers lie at halves.
                        sum += u64::from(sampler.bilinear(fixed(x - 0.5), fixed(y - 0.5)));
                    }
                }
                *pixel = mean(sum, u64::from(samples * samples));
            }
        }
    }
}

/// From the frame to the ground: x·z, y·z and z of the map position, linear in (column, row, 1).
struct Projection {
    rows: [[f64; 3]; 3],
}

impl Projection {
    fn new(camera: &Camera, scene: &Scene) -> Self {
        let half = f64::from(camera.width.min(camera.height)) / 2.0;
        let t = (camera.field_of_view_rad / 2.0).tan();
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        // The ray in the body's axes.
        let forward = [0.0, -t / half, height / 2.0 * t / half];
        let right = [t / half, 0.0, -width / 2.0 * t / half];
        let down = [0.0, 0.0, 1.0];
        // In level axes: out of the roll, out of the pitch.
        let turn = |a: [f64; 3], b: [f64; 3], angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let mix =
                |p: [f64; 3], x: f64, q: [f64; 3], y: f64| [0, 1, 2].map(|i| x * p[i] + y * q[i]);
            (mix(a, cos, b, -sin), mix(a, sin, b, cos))
        };
        let (right, down) = turn(right, down, scene.roll_rad);
        let (forward, down) = turn(forward, down, -scene.pitch_rad);
        // On the map.
        let altitude = camera.footprint_px / 2.0 * scene.altitude_ratio / t;
        let (sin, cos) = scene.heading_rad.sin_cos();
        let at = |place: f32, ahead: f64, aside: f64| {
            [0, 1, 2].map(|i| {
                f64::from(place) * down[i] + altitude * (ahead * forward[i] + aside * right[i])
            })
        };
        Self {
            rows: [
                at(scene.place.x_px, sin, cos),
                at(scene.place.y_px, -cos, sin),
                down,
            ],
        }
    }

    /// The map position that a frame position shows; `None` at the horizon and beyond.
    fn ground(&self, [column, row]: [f64; 2]) -> Option<[f64; 2]> {
        let [x, y, z] = self.rows.map(|[a, b, c]| a * column + b * row + c);
        (z > 1e-6).then(|| [x / z, y / z])
    }

    /// Samples per direction in the frame pixel that starts at a position: a bilinear sample reaches two map pixels.
    fn samples(&self, [column, row]: [f64; 2]) -> u32 {
        let corner = |across: f64, along: f64| self.ground([column + across, row + along]);
        let (Some(a), Some(b), Some(c)) = (corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0))
        else {
            return 1;
        };
        let length = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
        let pitch = length(a, b).max(length(a, c));
        (pitch / 2.0).ceil().clamp(1.0, MAX_SAMPLES) as u32
    }
}

/// The mean of `count` samples of the map from their sum: 0 to 255, rounded half up.
fn mean(sum: u64, count: u64) -> u8 {
    ((sum + (count << 15)) / (count << 16)) as u8
}

/// What the sensor makes of a level.
fn exposed(level: u8, levels: &[f64], noise: f64, random: &mut impl Rng) -> u8 {
    let level = levels[usize::from(level)];
    let level = if noise > 0.0 {
        level + noise * gaussian(random)
    } else {
        level
    };
    (level + 0.5).clamp(0.0, 255.0) as u8 // truncates
}

/// The map between its pixel centers, in fixed point: a frame is a few hundred thousand samples.
struct Sampler<'a> {
    pixels: &'a [u8],
    width: usize,
    height: usize,
}

impl<'a> Sampler<'a> {
    fn new(map: &'a Map) -> Self {
        Self {
            pixels: map.luminance().as_raw(),
            width: map.width() as usize,
            height: map.height() as usize,
        }
    }

    /// 2¹⁶ times the level at (x, y), in 1/2¹⁶ pixels; pixel centers lie at whole pixels.
    #[inline]
    fn bilinear(&self, x: i64, y: i64) -> u32 {
        let (u, v) = ((x >> 8 & 0xff) as u32, (y >> 8 & 0xff) as u32);
        let between = |left: u8, right: u8| u32::from(left) * (256 - u) + u32::from(right) * u;
        // Negative coordinates become large ones.
        let (column, row) = ((x >> 16) as usize, (y >> 16) as usize);
        let (top, bottom) = if column < self.width - 1 && row < self.height - 1 {
            let above = &self.pixels[row * self.width + column..];
            let below = &above[self.width..];
            (between(above[0], above[1]), between(below[0], below[1]))
        } else {
            let [left, right] = [0, 1].map(|next| clamped((x >> 16) + next, self.width));
            let row = |next: i64| {
                let row = clamped((y >> 16) + next, self.height) * self.width;
                between(self.pixels[row + left], self.pixels[row + right])
            };
            (row(0), row(1))
        };
        top * (256 - v) + bottom * v
    }
}

/// The pixel at a coordinate, or the nearest there is.
fn clamped(at: i64, size: usize) -> usize {
    at.clamp(0, size as i64 - 1) as usize
}

/// A coordinate in 1/2¹⁶ pixels.
fn fixed(pixels: f64) -> i64 {
    (pixels * 65_536.0).round() as i64
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

impl Scene {
    /// Exactly above a place: nominal heading, altitude and light, no tilt.
    #[must_use]
    pub fn nominal(place: Point) -> Self {
        Self {
            place,
            heading_rad: 0.0,
            altitude_ratio: 1.0,
            roll_rad: 0.0,
            pitch_rad: 0.0,
            gamma: 1.0,
            noise: 0.0,
            motion_px: [0.0; 2],
            occlusion: None,
        }
    }

    /// The scene at a share of the way that the camera goes, −½ to ½, standing still.
    fn moved(&self, share: f64) -> Self {
        let [x, y] = self.motion_px;
        Self {
            place: Point {
                x_px: (f64::from(self.place.x_px) + share * x) as f32,
                y_px: (f64::from(self.place.y_px) + share * y) as f32,
            },
            motion_px: [0.0; 2],
            ..*self
        }
    }
}

impl Corner {
    /// All four.
    pub const ALL: [Self; 4] = [
        Self::TopLeft,
        Self::TopRight,
        Self::BottomLeft,
        Self::BottomRight,
    ];
}

fn gamma_table(gamma: f64) -> Vec<f64> {
    (0..=255)
        .map(|level| 255.0 * (f64::from(level) / 255.0).powf(gamma))
        .collect()
}

/// Nearly normal with unit variance: the sum of four bytes. Reaches 3.45 standard deviations, which noise of a sensor
/// hardly exceeds, and costs one random number.
fn gaussian(random: &mut impl Rng) -> f64 {
    // Each byte has the variance (256² − 1)/12; four of them a standard deviation of 147.8.
    let sum: u32 = random.next_u32().to_le_bytes().map(u32::from).iter().sum();
    (f64::from(sum) - 510.0) / 147.8
}

#[cfg(test)]
mod tests {
    use super::super::seeded;
    use super::*;
    use image::GrayImage;

    fn map() -> Map {
        let picture = GrayImage::from_fn(400, 300, |x, y| {
            image::Luma([((x * 7 + y * 13) % 256) as u8])
        });
        Map::from_luminance("test", picture)
    }

    #[test]
    fn at_nominal_pose_and_the_maps_scale_pixels_are_copied() {
        let camera = Camera {
            width: 100,
            height: 100,
            footprint_px: 100.0,
            field_of_view_rad: FIELD_OF_VIEW_RAD,
        };
        let mut frame = camera.frame();
        let scene = Scene::nominal(Point {
            x_px: 150.0,
            y_px: 120.0,
        });
        camera.render(&map(), &scene, &mut seeded(1, 1), &mut frame);
        for (i, &pixel) in frame.pixels.iter().enumerate() {
            let (x, y) = (100 + i as u32 % 100, 70 + i as u32 / 100);
            assert_eq!(pixel, map().luminance().get_pixel(x, y).0[0]);
        }
    }

    #[test]
    fn a_moving_camera_smears_along_its_way() {
        let mut picture = GrayImage::new(400, 300);
        picture.put_pixel(200, 150, image::Luma([210]));
        let map = Map::from_luminance("test", picture);
        let camera = Camera::finest(100);
        let mut frame = camera.frame();
        let scene = Scene {
            motion_px: [20.0, 0.0],
            ..Scene::nominal(Point {
                x_px: 200.0,
                y_px: 150.0,
            })
        };
        camera.render(&map, &scene, &mut seeded(1, 1), &mut frame);
        for (x, expected) in [(39, 0), (40, 13), (60, 13), (61, 0)] {
            assert_eq!(frame.pixels[50 * 100 + x], expected, "column {x}");
        }
        assert!(frame.pixels[49 * 100..50 * 100].iter().all(|&p| p == 0));
    }

    #[test]
    fn an_occlusion_hides_its_share_of_its_corner() {
        let white =
            Map::from_luminance("white", GrayImage::from_pixel(400, 300, image::Luma([255])));
        let scene = Scene::nominal(Point {
            x_px: 200.0,
            y_px: 150.0,
        });
        for (camera, left) in [
            (Camera::finest(100), 0),
            (
                Camera {
                    width: 160,
                    ..Camera::finest(100)
                },
                30,
            ),
        ] {
            for (corner, x, y) in [
                (Corner::TopLeft, 0, 0),
                (Corner::TopRight, 99, 0),
                (Corner::BottomLeft, 0, 99),
                (Corner::BottomRight, 99, 99),
            ] {
                let occlusion = Some(Occlusion {
                    corner,
                    share: 0.25,
                });
                let mut frame = camera.frame();
                let scene = Scene { occlusion, ..scene };
                camera.render(&white, &scene, &mut seeded(1, 1), &mut frame);
                let black = frame.pixels.iter().filter(|&&pixel| pixel == 0).count();
                assert_eq!(black, 2500, "{corner:?}");
                assert_eq!(frame.pixels[y * usize::from(camera.width) + left + x], 0);
            }
        }
    }

    #[test]
    fn a_quarter_turn_clockwise_puts_map_right_at_the_top() {
        let mut picture = GrayImage::new(400, 300);
        picture.put_pixel(249, 120, image::Luma([200])); // right of the middle
        let map = Map::from_luminance("test", picture);
        let camera = Camera {
            width: 100,
            height: 100,
            footprint_px: 100.0,
            field_of_view_rad: FIELD_OF_VIEW_RAD,
        };
        let mut frame = camera.frame();
        let heading_rad = std::f64::consts::FRAC_PI_2;
        let scene = Scene {
            heading_rad,
            ..Scene::nominal(Point {
                x_px: 200.5,
                y_px: 120.5,
            })
        };
        camera.render(&map, &scene, &mut seeded(1, 1), &mut frame);
        let brightest = (0..10_000)
            .max_by_key(|&i| frame.pixels[i])
            .expect("pixels");
        assert!(brightest / 100 <= 1, "row {}", brightest / 100);
    }

    /// A frame of the map in the middle of which a square is bright.
    fn tilted(roll_rad: f64, pitch_rad: f64) -> (CameraFrame, Camera) {
        let picture = GrayImage::from_fn(400, 300, |x, y| {
            image::Luma([if x.abs_diff(200) < 3 && y.abs_diff(150) < 3 {
                255
            } else {
                40
            }])
        });
        let camera = Camera {
            width: 160,
            height: 120,
            footprint_px: 120.0,
            field_of_view_rad: FIELD_OF_VIEW_RAD,
        };
        let scene = Scene {
            roll_rad,
            pitch_rad,
            ..Scene::nominal(Point {
                x_px: 200.5,
                y_px: 150.5,
            })
        };
        let map = Map::from_luminance("test", picture);
        let mut frame = camera.frame();
        camera.render(&map, &scene, &mut seeded(1, 1), &mut frame);
        (frame, camera)
    }

    #[test]
    fn a_tilted_camera_sees_what_is_below_off_the_middle() {
        // F·tan 0.1 = 60 / tan 30° · 0.1003 = 10.4 pixels.
        for (roll, pitch, expected) in [(0.1, 0.0, [90.4, 60.0]), (0.0, 0.1, [80.0, 70.4])] {
            let (frame, _) = tilted(roll, pitch);
            let bright = frame.pixels.iter().enumerate().filter(|&(_, &p)| p > 150);
            let (mut sum, mut count) = ([0.0, 0.0], 0.0);
            for (i, _) in bright {
                sum[0] += (i % 160) as f64 + 0.5;
                sum[1] += (i / 160) as f64 + 0.5;
                count += 1.0;
            }
            for axis in 0..2 {
                let found = sum[axis] / count;
                assert!((found - expected[axis]).abs() < 0.5, "{found} {expected:?}");
            }
        }
    }

    #[test]
    fn a_hardly_tilted_frame_is_nearly_the_untilted_one() {
        let largest = |a: &CameraFrame, b: &CameraFrame| {
            let pairs = a.pixels.iter().zip(&b.pixels);
            pairs.map(|(a, b)| a.abs_diff(*b)).max()
        };
        let (level, _) = tilted(0.0, 0.0);
        assert!(largest(&level, &tilted(1e-9, 0.0).0) <= Some(1));
        assert!(largest(&level, &tilted(0.0, 1e-9).0) <= Some(1));
    }

    #[test]
    fn frames_that_leave_the_map_are_noticed() {
        let (_, camera) = tilted(0.0, 0.0);
        let at = |x_px, y_px, pitch_rad| {
            let scene = Scene {
                pitch_rad,
                ..Scene::nominal(Point { x_px, y_px })
            };
            camera.is_on_map(&map(), &scene)
        };
        assert!(at(80.0, 60.0, 0.0) && !at(79.9, 60.0, 0.0));
        assert!(!at(80.0, 60.0, 0.1), "looks over the upper edge");
        assert!(!at(200.0, 150.0, 1.2), "looks beyond the horizon");
    }

    #[test]
    fn noise_has_the_stated_deviation() {
        let mut random = seeded(3, 3);
        let n = 100_000;
        let squares: f64 = (0..n).map(|_| gaussian(&mut random).powi(2)).sum();
        assert!(
            (squares / f64::from(n) - 1.0).abs() < 0.02,
            "{}",
            squares / f64::from(n)
        );
    }
}
