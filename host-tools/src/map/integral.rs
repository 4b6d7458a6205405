//! Sums over rectangles of a map in constant time, and windows reduced to views by them.
//!
//! **Notation.** S(x, y) is the sum of all pixels left of x and above y (a summed-area table; F. C. Crow, *Summed-area
//! tables for texture mapping*, 1984). A window has q pixels per side, the view made of it v.
//!
//! **Method.** Every view pixel is the mean of the map pixels it overlaps, weighted by overlap, rounded half up: the same
//! bits as the core's [`reduce`](eigenmark_core::preprocess::reduce()), for views of any side. A map pixel is v units
//! long and a view pixel q, so its borders lie on whole units; between whole pixels S grows linearly along both axes, so
//! S at a border is a sum of four entries with whole weights. All of it is done modulo 2³²: what remains after the
//! differences is below 255.5·q² < 2³² for q ≤ [`MAX_SIDE`].
//!
//! **Cost.** (v + 1)² border values per window, whatever q; four bytes per map pixel.

use eigenmark_core::frame::MAX_SIDE;
use image::GrayImage;

/// The summed-area table of a map.
#[derive(Clone, Debug)]
pub struct Integral {
    /// (width + 1)·(height + 1) sums modulo 2³², row-major.
    sums: Vec<u32>,
    stride: usize,
}

impl Integral {
    /// Sums up a picture.
    #[must_use]
    pub fn new(luminance: &GrayImage) -> Self {
        Self::of(luminance.as_raw(), luminance.width() as usize)
    }

    /// Sums up pixels, row-major, `width` per row.
    #[must_use]
    pub fn of(pixels: &[u8], width: usize) -> Self {
        let stride = width + 1;
        let rows = pixels.chunks_exact(width.max(1));
        let mut sums = vec![0_u32; stride * (rows.len() + 1)];
        for (y, row) in rows.enumerate() {
            let (above, below) = sums.split_at_mut((y + 1) * stride);
            let above = &above[y * stride + 1..];
            let mut row_sum = 0_u32;
            for ((sum, &above), &pixel) in below[1..stride].iter_mut().zip(above).zip(row) {
                row_sum = row_sum.wrapping_add(u32::from(pixel));
                *sum = above.wrapping_add(row_sum);
            }
        }
        Self { sums, stride }
    }

    /// Reduces the window of `window_px` pixels per side at `corner` to the view `out` of `side`×`side` pixels.
    ///
    /// # Panics
    /// When the window is not on the map or larger than a frame may be, or `out` is not that large.
    pub fn reduce(&self, corner: (u32, u32), window_px: u32, side: usize, out: &mut [u8]) {
        assert!(window_px <= u32::from(MAX_SIDE) && out.len() == side * side);
        let (q, v) = (window_px as usize, side);
        let area = window_px * window_px;
        let mut above = vec![0_u32; v + 1];
        let mut below = vec![0_u32; v + 1];
        self.border(corner, (0, q, v), &mut above);
        for (row, i) in out.chunks_exact_mut(v).zip(1..) {
            self.border(corner, (i, q, v), &mut below);
            for (pixel, j) in row.iter_mut().zip(0..) {
                let lower = below[j + 1].wrapping_sub(below[j]);
                let upper = above[j + 1].wrapping_sub(above[j]);
                *pixel = ((lower.wrapping_sub(upper) + area / 2) / area) as u8;
            }
            std::mem::swap(&mut above, &mut below);
        }
    }

    /// The mean of the square of `side` pixels per side at `corner`, rounded half up: a view pixel of a whole ratio.
    ///
    /// # Panics
    /// When the square is empty or not on the map.
    #[must_use]
    pub fn mean(&self, (x, y): (u32, u32), side: u32) -> u8 {
        let (left, right) = (x as usize, (x + side) as usize);
        let top = &self.sums[y as usize * self.stride..][..self.stride];
        let bottom = &self.sums[(y + side) as usize * self.stride..][..self.stride];
        let lower = bottom[right].wrapping_sub(bottom[left]);
        let upper = top[right].wrapping_sub(top[left]);
        let area = side * side;
        ((lower.wrapping_sub(upper) + area / 2) / area) as u8
    }

    /// S in units, at the v + 1 column borders on row border `i` of a window.
    fn border(&self, corner: (u32, u32), (i, q, v): (usize, usize, usize), out: &mut [u32]) {
        let (y, part) = (i * q / v, i * q % v);
        let start = (corner.1 as usize + y) * self.stride + corner.0 as usize;
        let row = &self.sums[start..=start + q];
        if part == 0 {
            along(row, (q, v), v as u32, out, |_, sum| sum);
        } else {
            let next = &self.sums[start + self.stride..=start + self.stride + q];
            along(row, (q, v), (v - part) as u32, out, |_, sum| sum);
            along(next, (q, v), part as u32, out, u32::wrapping_add);
        }
    }
}

/// `weight` times S in units along one row of sums, at the v + 1 borders of q pixels, merged into `out`.
fn along(
    row: &[u32],
    (q, v): (usize, usize),
    weight: u32,
    out: &mut [u32],
    merge: impl Fn(u32, u32) -> u32,
) {
    let mut place = 0; // the border, in units: v per map pixel
    for target in out {
        let (x, part) = (place / v, place % v);
        let mut sum = row[x].wrapping_mul((v - part) as u32);
        if part > 0 {
            sum = sum.wrapping_add(row[x + 1].wrapping_mul(part as u32));
        }
        *target = merge(*target, sum.wrapping_mul(weight));
        place += q;
    }
}

#[cfg(test)]
mod tests {
    use eigenmark_core::{
        frame::Frame,
        preprocess::{View, reduce},
    };
    use rand::RngExt;

    use super::*;
    use crate::simulate::seeded;

    #[test]
    fn windows_are_reduced_to_the_bits_of_the_core() {
        let mut random = seeded(3, 5);
        let picture = GrayImage::from_fn(301, 260, |x, y| {
            let level: u32 = random.random_range(0..256);
            image::Luma([if (x ^ y) & 64 == 0 { 255 } else { level as u8 }])
        });
        let integral = Integral::new(&picture);
        for (q, v) in [
            (200, 20),
            (200, 33),
            (140, 14),
            (125, 12),
            (49, 50),
            (41, 41),
            (260, 2),
        ] {
            for corner in [(0, 0), (301 - q, 260 - q), (7.min(301 - q), 0)] {
                let pixels = &picture.as_raw()[(corner.1 * 301 + corner.0) as usize..];
                let frame = Frame::new(pixels, q as u16, q as u16, 301).expect("on the map");
                let mut view = View::black(v as u8);
                reduce(&frame, &mut view);
                let mut out = vec![0; v * v];
                integral.reduce(corner, q, v, &mut out);
                assert_eq!(out, view.pixels(), "{q} to {v} at {corner:?}");
            }
        }
    }

    #[test]
    fn means_are_the_view_pixels_of_whole_ratios() {
        let picture = GrayImage::from_fn(31, 26, |x, y| image::Luma([(x * x * 7 + y * 83) as u8]));
        let integral = Integral::new(&picture);
        let mut view = [0; 4];
        integral.reduce((3, 2), 24, 2, &mut view);
        let corners = [(3, 2), (15, 2), (3, 14), (15, 14)];
        assert_eq!(corners.map(|corner| integral.mean(corner, 12)), view);
    }

    #[test]
    fn large_windows_of_white_do_not_overflow() {
        let white = GrayImage::from_pixel(4096, 4096, image::Luma([255]));
        let mut out = vec![0; 60 * 60];
        Integral::new(&white).reduce((0, 0), 4096, 60, &mut out);
        assert!(out.iter().all(|&pixel| pixel == 255));
    }
}
