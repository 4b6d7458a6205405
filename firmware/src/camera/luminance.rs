//! Luminance of what cameras send: one byte a pixel out of two.
//!
//! YUYV carries luminance as every other byte, which is taken as it is. RGB565 is weighted as in ITU-R BT.601,
//! Y = 0.299 R + 0.587 G + 0.114 B, where the five bits of red and blue and the six of green stand for 0 to 255. With
//! r, g and b as they come this is
//!
//! ```text
//! Y = 255 (299 r/31 + 587 g/63 + 114 b/31) / 1000 = 17 (18837 r + 18197 g + 7182 b) / 130200
//! ```
//!
//! and it is computed so, in integers, rounded to nearest (no pixel lies halfway). White is exactly 255.
//!
//! Bytes come in pieces of any length ([`Extractor::extract`]), or all at once where the pixels are to lie
//! ([`extract_in_place`]). Both are total.

use core::cell::Cell;

/// How two bytes make a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum PixelFormat {
    /// Luminance, then a color difference.
    Yuyv,
    /// Red (5 bits), green (6) and blue (5) from the most significant bit down, the high byte first.
    Rgb565HighFirst,
    /// The same, the low byte first.
    Rgb565LowFirst,
}

/// Bytes of a pixel.
pub const BYTES_PER_PIXEL: usize = 2;

/// Makes luminance of a stream of bytes that is cut anywhere.
#[derive(Clone, Copy, Debug)]
pub struct Extractor {
    format: PixelFormat,
    /// The first byte of a pixel whose second has not come.
    carry: Option<u8>,
}

impl PixelFormat {
    /// Luminance of the pixel that is sent as these bytes.
    #[must_use]
    pub fn luminance(self, bytes: [u8; BYTES_PER_PIXEL]) -> u8 {
        match self {
            Self::Yuyv => bytes[0],
            Self::Rgb565HighFirst => of_rgb565(u16::from_be_bytes(bytes)),
            Self::Rgb565LowFirst => of_rgb565(u16::from_le_bytes(bytes)),
        }
    }
}

impl Extractor {
    /// At the first byte of a frame.
    #[must_use]
    pub const fn new(format: PixelFormat) -> Self {
        Self {
            format,
            carry: None,
        }
    }

    /// Puts the luminance of the next `bytes` to the start of `pixels` and returns how many pixels that are.
    ///
    /// Half a pixel at the end is kept for the next call; pixels without room are dropped.
    pub fn extract(&mut self, bytes: &[u8], pixels: &mut [u8]) -> usize {
        let room = pixels.len();
        let mut places = pixels.iter_mut();
        let mut rest = bytes;
        if let Some(first) = self.carry
            && let Some((&second, after)) = bytes.split_first()
        {
            (self.carry, rest) = (None, after);
            if let Some(place) = places.next() {
                *place = self.format.luminance([first, second]);
            }
        }
        let (pairs, half) = rest.as_chunks();
        if let [first] = half {
            self.carry = Some(*first);
        }
        for (&pair, place) in pairs.iter().zip(places.by_ref()) {
            *place = self.format.luminance(pair);
        }
        room.saturating_sub(places.len())
    }
}

/// Puts the luminance of the pixels that `bytes` are to the start of `bytes`, and returns it. Half a pixel at the end
/// is dropped.
pub fn extract_in_place(format: PixelFormat, bytes: &mut [u8]) -> &mut [u8] {
    let cells = Cell::from_mut(&mut *bytes).as_slice_of_cells();
    let (pairs, _) = cells.as_chunks();
    for (place, [first, second]) in cells.iter().zip(pairs) {
        place.set(format.luminance([first.get(), second.get()]));
    }
    let len = pairs.len();
    bytes.get_mut(..len).unwrap_or_default()
}

/// See the module.
fn of_rgb565(pixel: u16) -> u8 {
    let pixel = u32::from(pixel);
    let (red, green, blue) = (pixel >> 11, pixel >> 5 & 63, pixel & 31);
    let weighted = 17 * (18_837 * red + 18_197 * green + 7_182 * blue);
    // At most 255: the weights add up to it.
    ((weighted + 65_100) / 130_200) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::{vec, vec::Vec};

    const FORMATS: [PixelFormat; 3] = [
        PixelFormat::Yuyv,
        PixelFormat::Rgb565HighFirst,
        PixelFormat::Rgb565LowFirst,
    ];

    /// The definition, in floating point.
    fn reference(format: PixelFormat, bytes: &[u8]) -> f64 {
        let word = match format {
            PixelFormat::Yuyv => return f64::from(bytes[0]),
            PixelFormat::Rgb565HighFirst => u16::from(bytes[0]) << 8 | u16::from(bytes[1]),
            PixelFormat::Rgb565LowFirst => u16::from(bytes[1]) << 8 | u16::from(bytes[0]),
        };
        let red = f64::from(word >> 11) * 255.0 / 31.0;
        let green = f64::from(word >> 5 & 0b11_1111) * 255.0 / 63.0;
        let blue = f64::from(word & 0b1_1111) * 255.0 / 31.0;
        0.299 * red + 0.587 * green + 0.114 * blue
    }

    #[test]
    fn every_pixel_is_exact_to_rounding() {
        for format in FORMATS {
            for word in 0..=u16::MAX {
                let bytes = word.to_be_bytes();
                let error = f64::from(format.luminance(bytes)) - reference(format, &bytes);
                assert!(error.abs() < 0.5 + 1e-9, "{format:?} {bytes:?}: {error}");
            }
        }
    }

    #[test]
    fn primary_colors_have_their_weights() {
        for (word, luminance) in [
            (0xFFFF_u16, 255),
            (0x0000, 0),
            (0xF800, 76),
            (0x07E0, 150),
            (0x001F, 29),
        ] {
            let [high, low] = word.to_be_bytes();
            assert_eq!(
                PixelFormat::Rgb565HighFirst.luminance([high, low]),
                luminance
            );
            assert_eq!(
                PixelFormat::Rgb565LowFirst.luminance([low, high]),
                luminance
            );
        }
    }

    #[test]
    fn yuyv_is_every_other_byte() {
        let mut bytes = [10, 128, 20, 128, 30, 0, 40];
        let mut pixels = [0; 8];
        assert_eq!(
            Extractor::new(PixelFormat::Yuyv).extract(&bytes, &mut pixels),
            3
        );
        assert_eq!(pixels[..3], [10, 20, 30]);
        assert_eq!(
            extract_in_place(PixelFormat::Yuyv, &mut bytes),
            [10, 20, 30]
        );
    }

    proptest! {
        #[test]
        fn extraction_matches_reference(
            format in proptest::sample::select(FORMATS.to_vec()),
            mut bytes in proptest::collection::vec(any::<u8>(), 0..300),
            cuts in proptest::collection::vec(0_usize..40, 0..30), room in 0_usize..200,
        ) {
            let expected: Vec<u8> = bytes
                .chunks_exact(2)
                .map(|pair| reference(format, pair).round() as u8)
                .collect();

            let mut extractor = Extractor::new(format);
            let (mut pixels, mut at, mut rest) = (vec![0; room], 0, &bytes[..]);
            for cut in cuts {
                let (piece, after) = rest.split_at(cut.min(rest.len()));
                at += extractor.extract(piece, &mut pixels[at..]);
                rest = after;
            }
            at += extractor.extract(rest, &mut pixels[at..]);
            prop_assert_eq!(at, expected.len().min(room));
            prop_assert_eq!(&pixels[..at], &expected[..at]);

            prop_assert_eq!(extract_in_place(format, &mut bytes), &expected[..]);
        }
    }
}
