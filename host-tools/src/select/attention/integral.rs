//! Sums over rectangles of a plane, in four reads: the integral image (Crow, Summed-area tables for texture mapping,
//! 1984), in f64.

use super::plane::Plane;

/// Sums of everything above and to the left.
pub(super) struct Integral {
    /// Numbers per row: one more than the plane's.
    stride: usize,
    sums: Vec<f64>,
}

impl Integral {
    /// The integral image of a plane.
    pub(super) fn of(plane: &Plane) -> Self {
        let stride = plane.width() + 1;
        let mut sums = vec![0.0; stride * (plane.height() + 1)];
        for (y, row) in plane
            .values()
            .chunks_exact(plane.width().max(1))
            .enumerate()
        {
            let (above, below) = sums[y * stride..].split_at_mut(stride);
            let mut sum = 0.0;
            for (value, (above, below)) in row.iter().zip(above[1..].iter().zip(&mut below[1..])) {
                sum += f64::from(*value);
                *below = above + sum;
            }
        }
        Self { stride, sums }
    }

    /// The mean over the square of `side`×`side` pixels whose top-left pixel is `corner`.
    ///
    /// # Panics
    /// When it is not within the plane.
    pub(super) fn mean(&self, (x, y): (usize, usize), side: usize) -> f64 {
        assert!(x + side < self.stride, "columns {x} to {}", x + side);
        let (top, bottom) = (y * self.stride, (y + side) * self.stride);
        let inner = self.sums[bottom + x + side] - self.sums[bottom + x];
        let outer = self.sums[top + x + side] - self.sums[top + x];
        // Rounding must not turn nothing into less.
        ((inner - outer) / (side * side) as f64).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::plane::tests::noise;
    use super::*;

    #[test]
    fn means_match_reference() {
        let plane = Plane::of(&noise(14, 10));
        let integral = Integral::of(&plane);
        for (x, y, side) in [(0, 0, 1), (0, 0, 10), (4, 0, 10), (13, 9, 1), (3, 2, 5)] {
            let places = (x..x + side).flat_map(|x| (y..y + side).map(move |y| (x, y)));
            let sum: f64 = places.map(|(x, y)| f64::from(plane.at(x, y))).sum();
            // Sums of whole numbers are exact.
            assert_eq!(integral.mean((x, y), side), sum / (side * side) as f64);
        }
    }
}
