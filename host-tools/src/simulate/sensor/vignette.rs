//! How much light reaches each pixel.

use crate::simulate::Camera;

/// The share of the light that each pixel of a camera's frame gets, row by row: cos⁴ of the angle to the axis, stretched
/// so that the corners lose the share `lost`.
pub(super) fn vignette(camera: &Camera, lost: f64) -> Vec<f32> {
    let [width, height] = camera.size().map(f64::from);
    let focal = width.min(height) / 2.0 / (camera.field_of_view_rad() / 2.0).tan();
    let loss = |x: f64, y: f64| {
        let tan = x.hypot(y) / focal;
        1.0 - (1.0 + tan * tan).powi(-2)
    };
    let stretch = lost / loss(width / 2.0 - 0.5, height / 2.0 - 0.5);
    let [columns, rows] = camera.size();
    let at = |index: u16, length: f64| f64::from(index) + 0.5 - length / 2.0;
    let row = |y: u16| {
        (0..columns).map(move |x| (1.0 - stretch * loss(at(x, width), at(y, height))) as f32)
    };
    (0..rows).flat_map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_lose_the_stated_share_and_the_middle_nothing() {
        let light = vignette(&Camera::sized(160, 120, 100.0), 0.3);
        for corner in [0, 159, 119 * 160, 119 * 160 + 159] {
            assert!((light[corner] - 0.7).abs() < 1e-6);
        }
        assert!(light[60 * 160 + 80] > 0.999);
        assert!(
            light[60 * 160] < light[60 * 160 + 40],
            "falls off to the side"
        );
    }
}
