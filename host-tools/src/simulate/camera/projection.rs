//! From frame positions to the ground, for a camera that may be tilted.

use super::{Camera, MAX_SAMPLES, Scene};

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
        (z > 1e-6).then(|| [x / z, y / z])
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
}
