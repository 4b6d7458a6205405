//! Lines with round ends on a picture, smooth at the edges.
//!
//! Everything is a stroke: a disc is a stroke of one point, a letter a few strokes. Each pixel is covered by half the
//! width, plus half a pixel, minus its distance to the nearest segment, 0 to 1. A stroke is gathered in a mask before
//! it is blended, so that one that crosses itself is no denser there.

use std::f32::consts::TAU;

use image::{Rgb, RgbImage};

use super::font;

/// Points joined by straight lines; one point alone is a dot.
pub(super) type Line = Vec<[f32; 2]>;

/// A color and how much of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ink {
    pub(super) color: [u8; 3],
    /// 0 to 1.
    pub(super) opacity: f32,
}

impl Ink {
    pub(super) const fn new(color: [u8; 3]) -> Self {
        Self {
            color,
            opacity: 1.0,
        }
    }

    pub(super) const fn faint(self, opacity: f32) -> Self {
        Self { opacity, ..self }
    }
}

/// A picture that is drawn on.
pub(super) struct Canvas {
    picture: RgbImage,
    /// How much of each pixel the stroke at hand covers; zero between strokes.
    mask: Vec<f32>,
}

impl Canvas {
    pub(super) fn new(picture: RgbImage) -> Self {
        let mask = vec![0.0; picture.width() as usize * picture.height() as usize];
        Self { picture, mask }
    }

    pub(super) fn into_picture(self) -> RgbImage {
        self.picture
    }

    /// Fills all from the row `top` on.
    pub(super) fn fill_below(&mut self, top: u32, ink: Ink) {
        for y in top..self.picture.height() {
            for x in 0..self.picture.width() {
                self.picture.put_pixel(x, y, Rgb(ink.color));
            }
        }
    }

    /// Draws lines, as one, `width` pixels wide.
    pub(super) fn stroke(&mut self, lines: &[Line], width: f32, ink: Ink) {
        let mut touched = Area::EMPTY;
        for line in lines {
            if let [point] = line[..] {
                touched = touched.with(self.cover(point, point, width / 2.0));
            }
            for pair in line.windows(2) {
                touched = touched.with(self.cover(pair[0], pair[1], width / 2.0));
            }
        }
        self.blend(touched, ink);
    }

    pub(super) fn disc(&mut self, center: [f32; 2], radius: f32, ink: Ink) {
        self.stroke(&[vec![center]], 2.0 * radius, ink);
    }

    pub(super) fn ring(&mut self, center: [f32; 2], radius: f32, width: f32, ink: Ink) {
        let count = (radius * 2.0).clamp(12.0, 200.0) as u16;
        let point = |index: u16| {
            let (sin, cos) = (TAU * f32::from(index) / f32::from(count)).sin_cos();
            [center[0] + radius * cos, center[1] + radius * sin]
        };
        self.stroke(&[(0..=count).map(point).collect()], width, ink);
    }

    /// Writes a line of text whose capitals are `cap` pixels high and stand on `at`, its left end.
    pub(super) fn text(&mut self, at: [f32; 2], cap: f32, ink: Ink, text: &str) {
        self.stroke(&font::lines(at, cap, text), cap * font::WEIGHT, ink);
    }

    /// How much of each pixel a segment covers; where pixels were touched.
    fn cover(&mut self, a: [f32; 2], b: [f32; 2], half: f32) -> Area {
        let reach = half + 0.5;
        let bound = |low: f32, high: f32, size: u32| {
            // Saturates at both ends.
            let first = (low - reach).floor().max(0.0) as u32;
            let last = (high + reach).ceil().max(0.0) as u32;
            (first.min(size), last.min(size))
        };
        let (left, right) = bound(a[0].min(b[0]), a[0].max(b[0]), self.picture.width());
        let (top, bottom) = bound(a[1].min(b[1]), a[1].max(b[1]), self.picture.height());
        let way = [b[0] - a[0], b[1] - a[1]];
        let squared = way[0] * way[0] + way[1] * way[1];
        let width = self.picture.width() as usize;
        for y in top..bottom {
            for x in left..right {
                let from = [x as f32 + 0.5 - a[0], y as f32 + 0.5 - a[1]];
                let along = if squared > 0.0 {
                    ((from[0] * way[0] + from[1] * way[1]) / squared).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let distance = (from[0] - along * way[0]).hypot(from[1] - along * way[1]);
                let covered = (reach - distance).clamp(0.0, 1.0);
                let pixel = &mut self.mask[y as usize * width + x as usize];
                *pixel = pixel.max(covered);
            }
        }
        Area([left, right, top, bottom])
    }

    /// Blends what the mask covers, and clears it.
    fn blend(&mut self, Area([left, right, top, bottom]): Area, ink: Ink) {
        let width = self.picture.width() as usize;
        for y in top..bottom {
            for x in left..right {
                let covered = std::mem::take(&mut self.mask[y as usize * width + x as usize]);
                if covered > 0.0 {
                    let Rgb(pixel) = self.picture.get_pixel_mut(x, y);
                    for (level, color) in pixel.iter_mut().zip(ink.color) {
                        let (from, to) = (f32::from(*level), f32::from(color));
                        *level = (from + covered * ink.opacity * (to - from) + 0.5) as u8;
                    }
                }
            }
        }
    }
}

/// Left, right, top and bottom of some pixels; right and bottom are the first beyond.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Area([u32; 4]);

impl Area {
    const EMPTY: Self = Self([u32::MAX, 0, u32::MAX, 0]);

    fn with(self, Self(other): Self) -> Self {
        let Self([left, right, top, bottom]) = self;
        if other[0] >= other[1] || other[2] >= other[3] {
            return self;
        }
        Self([
            left.min(other[0]),
            right.max(other[1]),
            top.min(other[2]),
            bottom.max(other[3]),
        ])
    }
}

/// A line cut into dashes of that length, with gaps as long.
pub(super) fn dashes(line: &[[f32; 2]], length: f32) -> Vec<Line> {
    let mut dashes: Vec<Line> = Vec::new();
    let mut gone = 0.0;
    let mut is_open = false;
    for pair in line.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        let total = (b[0] - a[0]).hypot(b[1] - a[1]);
        let at = |along: f32| [0, 1].map(|axis| a[axis] + along / total * (b[axis] - a[axis]));
        let mut along = 0.0;
        while along < total {
            let is_dash = ((gone / length) as u32).is_multiple_of(2);
            let step = (length - gone % length).max(0.01).min(total - along);
            if is_dash {
                if !is_open {
                    dashes.push(vec![at(along)]);
                }
                if let Some(dash) = dashes.last_mut() {
                    dash.push(at(along + step));
                }
            }
            is_open = is_dash;
            along += step;
            gone += step;
        }
    }
    dashes
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: Ink = Ink::new([255; 3]);

    /// The red of each pixel of what is drawn on a black picture.
    fn drawn(draw: impl Fn(&mut Canvas)) -> Vec<u8> {
        let mut canvas = Canvas::new(RgbImage::new(20, 20));
        draw(&mut canvas);
        canvas
            .into_picture()
            .pixels()
            .map(|pixel| pixel.0[0])
            .collect()
    }

    #[test]
    fn strokes_have_their_width_and_smooth_edges() {
        let line = vec![[2.0, 10.0], [18.0, 10.0]];
        let pixels = drawn(|canvas| canvas.stroke(std::slice::from_ref(&line), 3.0, WHITE));
        let column: Vec<u8> = (7..13).map(|y| pixels[y * 20 + 10]).collect();
        assert_eq!(column, [0, 128, 255, 255, 128, 0]);
    }

    #[test]
    fn a_disc_has_its_area_and_what_is_beyond_the_picture_is_not_drawn() {
        let sum = |pixels: Vec<u8>| pixels.iter().map(|&p| f32::from(p) / 255.0).sum::<f32>();
        let whole = sum(drawn(|canvas| canvas.disc([10.0, 10.0], 6.0, WHITE)));
        assert!((whole - 113.1).abs() < 2.0, "{whole}");
        let quarter = sum(drawn(|canvas| canvas.disc([0.0, 20.0], 6.0, WHITE)));
        assert!((quarter - 28.3).abs() < 1.0, "{quarter}");
        assert_eq!(
            sum(drawn(|canvas| canvas.disc([-50.0, 1e9], 6.0, WHITE))),
            0.0
        );
    }

    #[test]
    fn a_stroke_that_crosses_itself_is_no_denser_there() {
        let lines = [
            vec![[2.0, 2.0], [18.0, 18.0]],
            vec![[2.0, 18.0], [18.0, 2.0]],
        ];
        let pixels = drawn(|canvas| canvas.stroke(&lines, 4.0, WHITE.faint(0.5)));
        assert_eq!(pixels.iter().max(), Some(&128));
    }

    #[test]
    fn dashes_are_as_long_as_their_gaps_around_corners_too() {
        let dashes = dashes(&[[0.0, 0.0], [5.0, 0.0], [5.0, 10.0]], 3.0);
        let expected = [
            vec![[0.0, 0.0], [3.0, 0.0]],
            vec![[5.0, 1.0], [5.0, 4.0]],
            vec![[5.0, 7.0], [5.0, 10.0]],
        ];
        assert_eq!(dashes, expected);
    }
}
