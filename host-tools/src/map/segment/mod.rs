//! Color segmentation: a picture of a few colors, in which each is a gray of its own; report section 5.2.1.
//!
//! **What.** Every pixel gets the nearest color of a palette, small regions get the color around them, and the palette,
//! sorted by lightness, is mapped to equally spaced grays. Regions of one color become equal, and what lies between them
//! gets the contrast. The result is a map like any other; and a frame that is mapped with the same palette looks like it,
//! also under a light that is not too different.
//!
//! **Notation.** CIE Lab under D65, from 8-bit sRGB; distances of colors are Euclidean there. c colors.
//!
//! **Method.** After K.-J. Yoon and I.-S. Kweon, *Human perception based color image quantization*, 2001 (and Yoon et al.,
//! 2000), as far as the report describes them: k-means in CIE Lab, in which colors weigh less where the neighborhood varies
//! much, because people tell colors apart less well there.
//! 1. *Weights*: the variance V of a pixel's neighborhood is the mean squared distance of its 5×5 pixels from their mean
//!    color; its weight is 1/(1 + V/V̄), where V̄ is the mean V. Half as much as on even ground, where the neighborhood is
//!    as varied as the picture's on average.
//! 2. *Palette*: k-means has no weights, so pixels are drawn for it in proportion to theirs, with a seed.
//! 3. *Pixels* take the nearest color.
//! 4. *Regions* (connected by edges) of fewer than [`MIN_REGION_PX`] pixels take the color with which they share the longest
//!    border, until there are none.
//!
//! Deviations: (1) the weight is this one, not that of the paper, which is made of the variances of hue and brightness;
//! (2) weights enter through the draw of a sample; (3) the paper removes no regions, the report asks for it.
//!
//! **Cost.** 1600×1200 pixels take about a second; one byte per pixel, and as much again for regions. The palette comes
//! from a sample, whatever the size.
//!
//! **Limits.** A light of another color moves all pixels to other colors of the palette: what one light calls a roof,
//! another may call a street.

mod lab;
mod regions;
mod sample;

use image::{GrayImage, Rgb, RgbImage};
use rayon::prelude::*;
use serde::{Serialize, Serializer};

use self::lab::Lab;
use crate::select::cluster::k_means;

pub use regions::MIN_REGION_PX;

/// Colors of a palette, at most: as many as k-means finds quickly.
pub const MAX_COLORS: usize = 64;

/// A picture of a few colors.
#[derive(Clone, Debug, PartialEq)]
pub struct Segmentation {
    palette: Vec<PaletteColor>,
    /// The color of every pixel, row-major.
    of: Vec<u8>,
    width: u32,
    height: u32,
}

/// A color of a palette.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PaletteColor {
    /// Red, green and blue, sRGB.
    #[serde(serialize_with = "hexadecimal")]
    pub rgb: [u8; 3],
    /// The gray it is mapped to: equally spaced from 0 for the darkest to 255 for the lightest.
    pub gray: u8,
    /// Share of the picture's pixels that have it.
    pub share: f64,
}

/// Why a picture cannot be segmented.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SegmentError {
    /// There are no pixels.
    #[error("expected a picture with pixels, found {width}×{height}")]
    Empty {
        /// Its width.
        width: u32,
        /// Its height.
        height: u32,
    },
    /// There cannot be as many colors.
    #[error("expected 1 to {MAX_COLORS} colors, found {colors}")]
    Colors {
        /// Colors asked for or given.
        colors: usize,
    },
}

impl Segmentation {
    /// Segments a picture into `colors` colors, or as many as there are; the same for the same seed.
    ///
    /// # Errors
    /// When the picture has no pixels, or there are too few or too many colors.
    pub fn new(picture: &RgbImage, colors: usize, seed: u64) -> Result<Self, SegmentError> {
        check(picture, colors)?;
        let sample = sample::draw(picture, seed);
        let points = sample.as_flattened();
        // There may be fewer pixels than colors are asked for.
        let found = k_means(points, 3, colors.min(sample.len()), seed);
        // A sample is neither empty nor infinite.
        let found = found.map_or_else(|_| points[..3].to_vec(), |found| found.centroids);
        let palette: Vec<[u8; 3]> = found
            .chunks_exact(3)
            .map(|color| lab::to_rgb([color[0], color[1], color[2]]))
            .collect();
        Self::with_palette(picture, &palette)
    }

    /// Segments a picture with a known palette: a frame as its map, perhaps under another light.
    ///
    /// # Errors
    /// When the picture has no pixels, or there are too few or too many colors.
    pub fn with_palette(picture: &RgbImage, palette: &[[u8; 3]]) -> Result<Self, SegmentError> {
        check(picture, palette.len())?;
        let (rgbs, labs) = sorted(palette);
        let (width, height) = picture.dimensions();
        let mut of = vec![0; width as usize * height as usize];
        of.par_chunks_mut(width as usize)
            .zip(picture.as_raw().par_chunks(3 * width as usize))
            .for_each(|(row, pixels)| {
                let (pixels, _) = pixels.as_chunks::<3>();
                for (of, &pixel) in row.iter_mut().zip(pixels) {
                    *of = nearest(&labs, lab::of(pixel));
                }
            });
        regions::merge_small(&mut of, width as usize);
        let mut counts = vec![0_u64; rgbs.len()];
        for &index in &of {
            counts[usize::from(index)] += 1;
        }
        let count = rgbs.len();
        let color = |(index, (rgb, pixels)): (usize, ([u8; 3], u64))| PaletteColor {
            rgb,
            gray: gray(index, count),
            share: pixels as f64 / of.len() as f64,
        };
        Ok(Self {
            palette: rgbs
                .into_iter()
                .zip(counts)
                .enumerate()
                .map(color)
                .collect(),
            of,
            width,
            height,
        })
    }

    /// Its colors, from dark to light.
    #[must_use]
    pub fn palette(&self) -> &[PaletteColor] {
        &self.palette
    }

    /// The same as [`with_palette`](Self::with_palette) takes them.
    #[must_use]
    pub fn colors(&self) -> Vec<[u8; 3]> {
        self.palette.iter().map(|color| color.rgb).collect()
    }

    /// The picture in grays: a map.
    #[must_use]
    pub fn gray(&self) -> GrayImage {
        let pixels = self
            .of
            .iter()
            .map(|&index| self.palette[usize::from(index)].gray);
        GrayImage::from_raw(self.width, self.height, pixels.collect()).unwrap_or_default()
    }

    /// The picture in the colors of the palette.
    #[must_use]
    pub fn color(&self) -> RgbImage {
        RgbImage::from_fn(self.width, self.height, |x, y| {
            let index = self.of[y as usize * self.width as usize + x as usize];
            Rgb(self.palette[usize::from(index)].rgb)
        })
    }
}

fn check(picture: &RgbImage, colors: usize) -> Result<(), SegmentError> {
    let (width, height) = picture.dimensions();
    if width == 0 || height == 0 {
        return Err(SegmentError::Empty { width, height });
    }
    if !(1..=MAX_COLORS).contains(&colors) {
        return Err(SegmentError::Colors { colors });
    }
    Ok(())
}

/// Different colors from dark to light, and the same in Lab.
fn sorted(palette: &[[u8; 3]]) -> (Vec<[u8; 3]>, Vec<Lab>) {
    let mut colors: Vec<(Lab, [u8; 3])> = palette.iter().map(|&rgb| (lab::of(rgb), rgb)).collect();
    colors.sort_by(|(a, rgb), (b, other)| a[0].total_cmp(&b[0]).then(rgb.cmp(other)));
    colors.dedup_by_key(|(_, rgb)| *rgb);
    colors.into_iter().map(|(lab, rgb)| (rgb, lab)).unzip()
}

/// The gray of color `index` of `count`. A single color is in the middle.
fn gray(index: usize, count: usize) -> u8 {
    match count {
        0 | 1 => 128,
        _ => ((255 * index + (count - 1) / 2) / (count - 1)) as u8,
    }
}

/// The color of the palette nearest to one, the darkest of several.
fn nearest(palette: &[Lab], color: Lab) -> u8 {
    let distance = |other: &Lab| -> f64 {
        let difference = [0, 1, 2].map(|i| color[i] - other[i]);
        difference.iter().map(|d| d * d).sum()
    };
    let mut nearest = (f64::INFINITY, 0);
    for (other, index) in palette.iter().zip(0..) {
        let distance = distance(other);
        if distance < nearest.0 {
            nearest = (distance, index);
        }
    }
    nearest.1
}

/// `#aabbcc`.
fn hexadecimal<S: Serializer>(rgb: &[u8; 3], serializer: S) -> Result<S::Ok, S::Error> {
    let [red, green, blue] = rgb;
    serializer.collect_str(&format_args!("#{red:02x}{green:02x}{blue:02x}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::city;

    const BLACK: [u8; 3] = [10, 10, 10];
    const RED: [u8; 3] = [180, 40, 30];
    const WHITE: [u8; 3] = [240, 240, 235];

    /// Three stripes of 40×20 pixels, with a little noise.
    fn stripes() -> RgbImage {
        RgbImage::from_fn(40, 60, |x, y| {
            let color = [WHITE, BLACK, RED][y as usize / 20];
            Rgb(color.map(|sample| sample + ((7 * x + 3 * y) % 5) as u8))
        })
    }

    fn level(segmentation: &Segmentation, y: u32) -> Vec<u8> {
        let gray = segmentation.gray();
        let mut levels: Vec<u8> = (0..40).map(|x| gray.get_pixel(x, y).0[0]).collect();
        levels.dedup();
        levels
    }

    #[test]
    fn colors_that_are_apart_become_equally_spaced_grays() {
        for seed in 1..5 {
            let found = Segmentation::new(&stripes(), 3, seed).expect("pixels");
            assert_eq!([5, 25, 45].map(|y| level(&found, y)), [[255], [0], [128]]);
            let shares: Vec<f64> = found.palette().iter().map(|color| color.share).collect();
            assert_eq!(shares, [1.0 / 3.0; 3]);
            for (color, expected) in found.palette().iter().zip([BLACK, RED, WHITE]) {
                let apart = color.rgb.iter().zip(expected).map(|(a, b)| a.abs_diff(b));
                assert!(apart.max() <= Some(5), "{color:?} {expected:?}");
            }
        }
    }

    #[test]
    fn a_known_palette_maps_other_pictures() {
        let darker = RgbImage::from_fn(40, 60, |x, y| {
            Rgb(stripes().get_pixel(x, y).0.map(|sample| sample / 4 * 3))
        });
        let found = Segmentation::with_palette(&darker, &[WHITE, BLACK, RED]).expect("pixels");
        assert_eq!([5, 25, 45].map(|y| level(&found, y)), [[255], [0], [128]]);
        assert_eq!(found.colors(), [BLACK, RED, WHITE]);
        assert_eq!(found.color().get_pixel(0, 0).0, WHITE);
    }

    #[test]
    fn gray_pictures_have_gray_palettes() {
        let gray = image::DynamicImage::from(stripes()).to_luma8();
        let picture = image::DynamicImage::from(gray).to_rgb8();
        let found = Segmentation::new(&picture, 3, 1).expect("pixels");
        assert_eq!(found.palette().len(), 3);
        for color in found.palette() {
            assert_eq!(color.rgb, [color.rgb[0]; 3]);
        }
    }

    #[test]
    fn fewer_colors_make_a_smaller_palette() {
        let plain = RgbImage::from_pixel(30, 20, Rgb(RED));
        let found = Segmentation::new(&plain, 6, 1).expect("pixels");
        let expected = PaletteColor {
            rgb: RED,
            gray: 128,
            share: 1.0,
        };
        assert_eq!(found.palette(), [expected]);
        let pixel = RgbImage::from_pixel(1, 1, Rgb(RED));
        assert_eq!(
            Segmentation::new(&pixel, 6, 1).expect("a pixel").palette(),
            [expected]
        );
    }

    #[test]
    fn the_same_seed_gives_the_same_picture() {
        let city = image::imageops::crop_imm(&city::draw(), 300, 200, 300, 250).to_image();
        let segment = || Segmentation::new(&city, 6, 7).expect("pixels");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build();
        assert!(segment() == pool.expect("threads").install(segment));
    }

    #[test]
    fn what_cannot_be_segmented_is_refused() {
        let empty = SegmentError::Empty {
            width: 0,
            height: 3,
        };
        assert_eq!(Segmentation::new(&RgbImage::new(0, 3), 6, 1), Err(empty));
        for colors in [0, 65] {
            let found = Segmentation::new(&stripes(), colors, 1);
            assert_eq!(found, Err(SegmentError::Colors { colors }));
        }
    }

    #[test]
    fn palettes_are_written_in_hexadecimal() {
        let color = PaletteColor {
            rgb: [170, 11, 204],
            gray: 85,
            share: 0.25,
        };
        let written = serde_json::to_string(&color).expect("numbers");
        assert_eq!(written, r##"{"rgb":"#aa0bcc","gray":85,"share":0.25}"##);
    }
}
