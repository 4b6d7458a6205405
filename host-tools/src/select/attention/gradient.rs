//! Gradients of a plane between view pixels.
//!
//! Scharr's operator (H. Scharr, Optimale Operatoren in der digitalen Bildverarbeitung, 2000): a central difference in
//! one direction, (3, 10, 3)/16 in the other, so that the magnitude depends less on the direction of an edge than with
//! Sobel's (1, 2, 1)/4. Units are levels per view pixel.

use super::plane::{Plane, spread};

const DIFFERENCE: [f32; 3] = [-0.5, 0.0, 0.5];
const SMOOTH: [f32; 3] = [3.0 / 16.0, 10.0 / 16.0, 3.0 / 16.0];

/// How a plane rises to the right and downward.
pub(super) struct Gradient {
    pub(super) across: Plane,
    pub(super) down: Plane,
}

impl Gradient {
    /// The gradient of a plane whose view pixels are `pitch` apart.
    pub(super) fn of(seen: &Plane, pitch: usize) -> Self {
        let (difference, smooth) = (spread(&DIFFERENCE, pitch), spread(&SMOOTH, pitch));
        Self {
            across: seen.filtered(&difference, &smooth),
            down: seen.filtered(&smooth, &difference),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::plane::tests::{noise, repeated};
    use super::*;

    /// Rounding of sums of nine f32 up to 255.
    const TOLERANCE: f64 = 1e-4;

    /// (to the right, downward), literally.
    pub(in super::super) fn reference(
        seen: &Plane,
        pitch: isize,
        x: isize,
        y: isize,
    ) -> (f64, f64) {
        const SCHARR: [[f64; 3]; 3] = [[-3.0, 0.0, 3.0], [-10.0, 0.0, 10.0], [-3.0, 0.0, 3.0]];
        let (mut across, mut down) = (0.0, 0.0);
        for (row, weights) in (-1..).zip(SCHARR) {
            for (column, weight) in (-1..).zip(weights) {
                across += weight / 32.0 * repeated(seen, x + column * pitch, y + row * pitch);
                down += weight / 32.0 * repeated(seen, x + row * pitch, y + column * pitch);
            }
        }
        (across, down)
    }

    #[test]
    fn gradients_match_reference() {
        for pitch in [1, 3] {
            let seen = Plane::of(&noise(17, 12));
            let gradient = Gradient::of(&seen, pitch);
            for (x, y) in (0..17).flat_map(|x| (0..12).map(move |y| (x, y))) {
                let (across, down) = reference(&seen, pitch as isize, x, y);
                assert!((repeated(&gradient.across, x, y) - across).abs() < TOLERANCE);
                assert!((repeated(&gradient.down, x, y) - down).abs() < TOLERANCE);
            }
        }
    }
}
