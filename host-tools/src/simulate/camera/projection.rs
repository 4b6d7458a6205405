//! From frame positions to the ground, for a camera that may be tilted.

use super::{Camera, MAX_SAMPLES, Scene, sampler::Sampler};

/// What lies at this angle to the horizon or higher is not ground.
const HORIZON: f64 = 1e-6;

/// Half a map pixel, in 1/2¹⁶ pixels.
const HALF: i64 = 1 << 15;

/// From the frame to the ground: x·z, y·z and z of the map position, linear in (column, row, 1).
pub(super) struct Projection {
    rows: [[f64; 3]; 3],
}

impl Projection {
    pub(super) fn new(camera: &Camera, scene: &Scene) -> Self {
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
    pub(super) fn ground(&self, [column, row]: [f64; 2]) -> Option<[f64; 2]> {
        let [x, y, z] = self.rows.map(|[a, b, c]| a * column + b * row + c);
        (z > HORIZON).then(|| [x / z, y / z])
    }

    /// Samples per direction in the frame pixel that starts at a position: a bilinear sample reaches two map pixels.
    pub(super) fn samples(&self, [column, row]: [f64; 2]) -> u32 {
        let corner = |across: f64, along: f64| self.ground([column + across, row + along]);
        let (Some(a), Some(b), Some(c)) = (corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0))
        else {
            return 1;
        };
        let length = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
        let pitch = length(a, b).max(length(a, c));
        (pitch / 2.0).ceil().clamp(1.0, MAX_SAMPLES) as u32
    }

    /// The projection at a share of the way from this one to another that differs little.
    pub(super) fn toward(&self, other: &Self, share: f64) -> Self {
        let between = |axis: usize, i: usize| {
            let (a, b) = (self.rows[axis][i], other.rows[axis][i]);
            a + share * (b - a)
        };
        Self {
            rows: [0, 1, 2].map(|axis| [0, 1, 2].map(|i| between(axis, i))),
        }
    }

    /// The projection along one row of the frame.
    pub(super) fn row(&self, row: f64) -> Line {
        let [x, y, z] = self.rows.map(|[a, b, c]| [a, b * row + c]);
        Line { x, y, z }
    }
}

/// From columns of a frame's row to the ground: x·z, y·z and z of the map position, linear in (column, 1).
pub(super) struct Line {
    x: [f64; 2],
    y: [f64; 2],
    z: [f64; 2],
}

impl Line {
    /// Adds `samples` samples per column, `spacing` columns apart, to the sum of each column.
    #[inline]
    pub(super) fn sample(&self, map: &Sampler<'_>, samples: u32, spacing: f64, sums: &mut [u32]) {
        let ([x, x_start], [y, y_start], [z, z_start]) = (self.x, self.y, self.z);
        for (column, sum) in (0_u32..).zip(sums) {
            for index in 0..samples {
                let column = f64::from(column) + (f64::from(index) + 0.5) * spacing;
                let depth = z * column + z_start;
                if depth > HORIZON {
                    // In 1/2¹⁶ map pixels, whose centers lie at halves; truncated.
                    let scale = 65_536.0 / depth;
                    let x = ((x * column + x_start) * scale) as i64 - HALF;
                    let y = ((y * column + y_start) * scale) as i64 - HALF;
                    *sum += map.bilinear(x, y);
                }
            }
        }
    }
}
