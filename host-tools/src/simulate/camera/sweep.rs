//! A frame of a camera that moves: rows are read one after another, and light is gathered for some time.
//!
//! The pose changes at constant rates. Its projection is computed for the first and the last row of each exposure and
//! interpolated between: over the hundredths of a second that a frame takes, what is left out is a thousandth of a
//! pixel. Blur is the mean of a few exposures spread over the shutter's time, one per pixel of the longest way that
//! anything goes meanwhile.
//!
//! **Cost.** A sample is a division and a bilinear look-up: a 160×120 frame at rest is 19,200 of them where a frame's
//! pixel covers at most two of the map's.

use serde::{Deserialize, Serialize};

use super::{Camera, CameraFrame, MAX_SAMPLES, Projection, Sampler, Scene, mean};
use crate::map::Map;

/// Exposures that a blurred frame is the mean of, at most.
const MAX_EXPOSURES: f64 = 8.0;

/// All samples of a pixel, at most: their sum is held in 32 bits.
const MAX_SAMPLES_PER_PIXEL: u32 = 256;

/// The longest way that counts as standing still, in frame pixels.
const SHARP_PX: f64 = 0.5;

/// Map pixels between two samples: a bilinear sample reaches two. A tenth more is let pass, so that what tilt and
/// altitude add to the nominal pitch does not quadruple the samples.
const SAMPLE_PITCH_PX: f64 = 2.2;

/// How fast a scene changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Velocity in map pixels per second.
    pub velocity_px_s: [f64; 2],
    /// Rate of the heading, in radians per second.
    pub yaw_rad_s: f64,
    /// Rate of the altitude ratio, per second.
    pub climb_per_s: f64,
    /// Rate of the roll, in radians per second.
    pub roll_rad_s: f64,
    /// Rate of the pitch, in radians per second.
    pub pitch_rad_s: f64,
}

/// When a frame's rows gather light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shutter {
    /// How long each row gathers light, in seconds; zero for no motion blur.
    pub exposure_s: f64,
    /// Time from the first row to the last, in seconds; zero for a global shutter.
    pub readout_s: f64,
}

impl Shutter {
    /// All at once.
    pub const INSTANT: Self = Self {
        exposure_s: 0.0,
        readout_s: 0.0,
    };
}

impl Camera {
    /// What a moving camera sees: `scene` is the pose in the middle of the frame's time. Light and noise of the scene,
    /// its way and what hides it are not regarded. Beyond the map its border pixels are repeated; what lies at the
    /// horizon or beyond is black.
    pub fn sweep(
        &self,
        map: &Map,
        scene: &Scene,
        motion: &Motion,
        shutter: Shutter,
        frame: &mut CameraFrame,
    ) {
        let samples = self.samples(scene);
        let most = MAX_SAMPLES_PER_PIXEL / (samples * samples);
        let exposures = self.exposures(scene, motion, shutter.exposure_s).min(most);
        let at = |time_s: f64| Projection::new(self, &scene.later(motion, time_s));
        // The projections of the first and the last row, for each exposure.
        let ways: Vec<[Projection; 2]> = (0..exposures)
            .map(|index| {
                let share = (f64::from(index) + 0.5) / f64::from(exposures) - 0.5;
                let time_s = share * shutter.exposure_s;
                let half_s = shutter.readout_s / 2.0;
                [at(time_s - half_s), at(time_s + half_s)]
            })
            .collect();
        let sampler = Sampler::new(map);
        let (width, height) = (usize::from(self.width), f64::from(self.height));
        let spacing = 1.0 / f64::from(samples);
        let mut sums = vec![0; width];
        for (row, pixels) in (0..)
            .map(f64::from)
            .zip(frame.pixels.chunks_exact_mut(width))
        {
            sums.fill(0);
            let share = row / (height - 1.0).max(1.0);
            for [first, last] in &ways {
                let projection = first.toward(last, share);
                for sub_row in 0..samples {
                    let line = projection.row(row + (f64::from(sub_row) + 0.5) * spacing);
                    line.sample(&sampler, samples, spacing, &mut sums);
                }
            }
            let count = exposures * samples * samples;
            for (pixel, &sum) in pixels.iter_mut().zip(&sums) {
                *pixel = mean(sum, count);
            }
        }
    }

    /// Samples per direction of a pixel.
    fn samples(&self, scene: &Scene) -> u32 {
        let pitch_px = self.pixel_px() * scene.altitude_ratio;
        (pitch_px / SAMPLE_PITCH_PX).ceil().clamp(1.0, MAX_SAMPLES) as u32
    }

    /// Exposures for the longest way that anything goes in the frame, in frame pixels.
    fn exposures(&self, scene: &Scene, motion: &Motion, exposure_s: f64) -> u32 {
        let side = f64::from(self.width.min(self.height));
        let focal = side / 2.0 / (self.field_of_view_rad / 2.0).tan();
        let corner = f64::from(self.width).hypot(f64::from(self.height)) / 2.0;
        let [x, y] = motion.velocity_px_s;
        let moved = x.hypot(y) / (self.pixel_px() * scene.altitude_ratio);
        let turned = motion.yaw_rad_s.abs() * corner;
        let swung = motion.roll_rad_s.hypot(motion.pitch_rad_s) * focal;
        let way = (moved + turned + swung) * exposure_s;
        if way < SHARP_PX {
            1
        } else {
            (way.ceil() + 1.0).min(MAX_EXPOSURES) as u32
        }
    }

    /// Map pixels per frame pixel at nominal altitude.
    fn pixel_px(&self) -> f64 {
        self.footprint_px / f64::from(self.width.min(self.height))
    }
}

#[cfg(test)]
mod tests {
    use eigenmark_core::landmark::Point;
    use image::GrayImage;

    use super::*;
    use crate::simulate::seeded;

    fn map() -> Map {
        let picture = GrayImage::from_fn(400, 300, |x, y| {
            let wave = (f64::from(x) / 9.0).sin() * (f64::from(y) / 7.0).cos();
            image::Luma([(120.0 + 100.0 * wave) as u8])
        });
        Map::from_luminance("waves", picture)
    }

    fn scene() -> Scene {
        Scene {
            heading_rad: 0.7,
            altitude_ratio: 1.1,
            roll_rad: 0.08,
            pitch_rad: -0.12,
            ..Scene::nominal(Point {
                x_px: 190.0,
                y_px: 140.0,
            })
        }
    }

    fn swept(camera: &Camera, scene: &Scene, motion: &Motion, shutter: Shutter) -> CameraFrame {
        let mut frame = camera.frame();
        camera.sweep(&map(), scene, motion, shutter, &mut frame);
        frame
    }

    fn largest(a: &[u8], b: &[u8]) -> u8 {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
    }

    #[test]
    fn at_rest_it_sees_what_a_still_camera_sees() {
        let camera = Camera::sized(160, 120, 120.0);
        for scene in [scene(), Scene::nominal(scene().place)] {
            let mut still = camera.frame();
            camera.render(&map(), &scene, &mut seeded(1, 1), &mut still);
            let rest = swept(&camera, &scene, &Motion::default(), Shutter::INSTANT);
            assert!(largest(&still.pixels, &rest.pixels) <= 1);
        }
    }

    #[test]
    fn each_row_is_seen_when_it_is_read() {
        let camera = Camera::sized(160, 120, 120.0);
        let motion = Motion {
            velocity_px_s: [80.0, -30.0],
            yaw_rad_s: 0.4,
            climb_per_s: 0.1,
            roll_rad_s: 0.3,
            pitch_rad_s: -0.2,
        };
        let shutter = Shutter {
            exposure_s: 0.0,
            readout_s: 0.1,
        };
        let rolling = swept(&camera, &scene(), &motion, shutter);
        for (row, time_s) in [(0, -0.05), (119, 0.05), (40, 40.0 / 1190.0 - 0.05)] {
            let then = scene().later(&motion, time_s);
            let global = swept(&camera, &then, &Motion::default(), Shutter::INSTANT);
            let row = row * 160..(row + 1) * 160;
            assert!(largest(&rolling.pixels[row.clone()], &global.pixels[row]) <= 2);
        }
        let now = swept(&camera, &scene(), &motion, Shutter::INSTANT);
        assert!(
            largest(&rolling.pixels, &now.pixels) > 20,
            "rows differ in time"
        );
    }

    #[test]
    fn what_moves_during_the_exposure_is_smeared_along_its_way() {
        let mut picture = GrayImage::new(400, 300);
        picture.put_pixel(200, 150, image::Luma([210]));
        let map = Map::from_luminance("dot", picture);
        let camera = Camera::sized(100, 100, 100.0);
        let scene = Scene::nominal(Point {
            x_px: 200.0,
            y_px: 150.0,
        });
        let motion = Motion {
            velocity_px_s: [60.0, 0.0],
            ..Motion::default()
        };
        let shutter = Shutter {
            exposure_s: 0.1,
            readout_s: 0.0,
        };
        let mut frame = camera.frame();
        camera.sweep(&map, &scene, &motion, shutter, &mut frame);
        let lit: Vec<usize> = (0..10_000).filter(|&i| frame.pixels[i] > 0).collect();
        // Six pixels of way: the dot is seen from three before to three after the middle, column 50.
        assert!(
            lit.iter()
                .all(|i| i / 100 == 50 && (46..=54).contains(&(i % 100))),
            "{lit:?}"
        );
        let sum: u32 = frame.pixels.iter().map(|&pixel| u32::from(pixel)).sum();
        assert!(sum.abs_diff(210) <= 8, "no light is lost: {sum}");
        assert!(lit.len() >= 6 && frame.pixels.iter().all(|&pixel| pixel < 60));
    }

    #[test]
    fn frames_coarser_than_the_map_are_averaged() {
        let checks = GrayImage::from_fn(400, 300, |x, y| image::Luma([((x + y) % 2 * 200) as u8]));
        let map = Map::from_luminance("checks", checks);
        let camera = Camera::sized(40, 40, 240.0);
        let mut frame = camera.frame();
        let scene = Scene::nominal(scene().place);
        camera.sweep(
            &map,
            &scene,
            &Motion::default(),
            Shutter::INSTANT,
            &mut frame,
        );
        assert!(frame.pixels.iter().all(|pixel| pixel.abs_diff(100) < 30));
    }
}
