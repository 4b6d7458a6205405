//! The map between its pixel centers.

use crate::map::Map;

/// The map between its pixel centers, in fixed point: a frame is a few hundred thousand samples.
pub(super) struct Sampler<'a> {
    pixels: &'a [u8],
    width: usize,
    height: usize,
}

impl<'a> Sampler<'a> {
    pub(super) fn new(map: &'a Map) -> Self {
        Self {
            pixels: map.luminance().as_raw(),
            width: map.width() as usize,
            height: map.height() as usize,
        }
    }

    /// 2¹⁶ times the level at (x, y), in 1/2¹⁶ pixels; pixel centers lie at whole pixels.
    #[inline(always)] // a frame is hundreds of thousands of them
    pub(super) fn bilinear(&self, x: i64, y: i64) -> u32 {
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
#[inline]
fn clamped(at: i64, size: usize) -> usize {
    at.clamp(0, size as i64 - 1) as usize
}

/// A coordinate in 1/2¹⁶ pixels.
#[inline]
pub(super) fn fixed(pixels: f64) -> i64 {
    (pixels * 65_536.0).round() as i64
}

/// The mean of `count` samples of the map from their sum: 0 to 255, rounded half up. Of 64 samples, 32 bits hold the sum.
#[inline]
pub(super) fn mean(sum: u32, count: u32) -> u8 {
    ((sum + (count << 15)) / (count << 16)) as u8
}
