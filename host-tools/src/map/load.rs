//! Picture files → 8-bit luminance, or 8-bit color.
//!
//! PNG (palettes included), JPEG and TIFF are told apart by their contents, not by their names. Luminance is Rec. 601 (what cameras put
//! into the Y of YUYV), rounded to the nearest; 16-bit samples are scaled by 255/65535; transparency is ignored.

use std::{
    fs::File,
    io::{self, BufReader, Read},
    path::{Path, PathBuf},
};

use image::{
    ColorType, DynamicImage, GrayImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits,
    RgbImage,
};

/// The largest accepted number of pixels of a picture: 8192×8192.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Memory a decoder may use: 16-bit RGBA of the largest picture, and as much again.
const MAX_DECODER_BYTES: u64 = MAX_PIXELS * 16;

/// Why a map or picture cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// There is no built-in map of that name.
    #[error("builtin:{name}: no such built-in map; there is builtin:city")]
    UnknownBuiltin {
        /// The name asked for.
        name: String,
    },
    /// The file cannot be opened or read.
    #[error("{}: cannot read the picture: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is not a PNG, JPEG or TIFF picture.
    #[error("{}: expected a PNG, JPEG or TIFF picture, found {found}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        found: String,
    },
    /// The picture has more pixels than are accepted.
    #[error("{}: expected a picture of at most {MAX_PIXELS} pixels, found {width}×{height}", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its width.
        width: u32,
        /// Its height.
        height: u32,
    },
    /// The picture's samples are of a kind that is not accepted.
    #[error("{}: expected 8-bit or 16-bit gray or color samples, found {found}", path.display())]
    Samples {
        /// The file.
        path: PathBuf,
        /// The kind found.
        found: String,
    },
    /// The picture is damaged.
    #[error("{}: the picture does not decode: {reason}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What the decoder says.
        reason: String,
    },
}

/// Reads a picture file as luminance.
///
/// # Errors
/// See [`MapError`].
pub fn load(path: &Path) -> Result<GrayImage, MapError> {
    let picture = decode(path)?;
    let (width, height) = (picture.width(), picture.height());
    Ok(match picture {
        DynamicImage::ImageLuma8(gray) => gray,
        DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_) => {
            let gray = picture.to_luma16();
            let pixels = gray
                .iter()
                .map(|&sample| from_16_bits(u32::from(sample)))
                .collect();
            gray_image(width, height, pixels)
        }
        DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_) => {
            let color = picture.to_rgb16();
            let pixels = color
                .pixels()
                .map(|p| from_16_bits(weigh(p.0.map(u32::from))))
                .collect();
            gray_image(width, height, pixels)
        }
        other => luminance(&other.to_rgb8()),
    })
}

/// Reads a picture file in color; of a gray one, all three samples are its luminance.
///
/// # Errors
/// See [`MapError`].
pub fn load_color(path: &Path) -> Result<RgbImage, MapError> {
    let picture = decode(path)?;
    Ok(match picture {
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let color = picture.to_rgb16();
            let samples = color
                .iter()
                .map(|&sample| from_16_bits(u32::from(sample)))
                .collect();
            RgbImage::from_raw(color.width(), color.height(), samples).unwrap_or_default()
        }
        other => other.into_rgb8(),
    })
}

/// Checks a picture file, and decodes it.
fn decode(path: &Path) -> Result<DynamicImage, MapError> {
    let read = |source| MapError::Read {
        path: path.to_owned(),
        source,
    };
    let damaged = |error: ImageError| match error {
        ImageError::Unsupported(what) => MapError::Samples {
            path: path.to_owned(),
            found: what.to_string(),
        },
        error => MapError::Damaged {
            path: path.to_owned(),
            reason: error.to_string(),
        },
    };
    let file = File::open(path).map_err(read)?;
    if file.metadata().map_err(read)?.is_dir() {
        return Err(read(io::Error::from(io::ErrorKind::IsADirectory)));
    }
    let mut reader = ImageReader::new(BufReader::new(file))
        .with_guessed_format()
        .map_err(read)?;
    let format = match reader.format() {
        Some(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Tiff)) => format,
        other => {
            let found = other.map_or("an unknown format".to_owned(), |format| {
                format!("{format:?}")
            });
            return Err(MapError::Format {
                path: path.to_owned(),
                found,
            });
        }
    };
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_DECODER_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(MapError::TooLarge {
            path: path.to_owned(),
            width,
            height,
        });
    }
    let color = decoder.color_type();
    if matches!(color, ColorType::Rgb32F | ColorType::Rgba32F) {
        return Err(MapError::Samples {
            path: path.to_owned(),
            found: "32-bit floats".to_owned(),
        });
    }
    if format == ImageFormat::Jpeg {
        check_jpeg_is_whole(path)?;
    }
    DynamicImage::from_decoder(decoder).map_err(damaged)
}

/// The decoder fills what is missing of a JPEG file with gray; here a file that is cut short is an error. A whole file
/// has an end marker after the start of its last scan.
fn check_jpeg_is_whole(path: &Path) -> Result<(), MapError> {
    const START_OF_SCAN: [u8; 2] = [0xff, 0xda];
    const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];
    let read = |source| MapError::Read {
        path: path.to_owned(),
        source,
    };
    // As many bytes as a picture of the largest size could need, uncompressed.
    let mut bytes = Vec::new();
    File::open(path)
        .map_err(read)?
        .take(MAX_PIXELS * 4)
        .read_to_end(&mut bytes)
        .map_err(read)?;
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    if last(END_OF_IMAGE) > last(START_OF_SCAN) {
        return Ok(());
    }
    Err(MapError::Damaged {
        path: path.to_owned(),
        reason: "the JPEG file is cut short".to_owned(),
    })
}

/// Rec. 601 luminance of an 8-bit color picture, rounded to the nearest.
#[must_use]
pub fn luminance(picture: &RgbImage) -> GrayImage {
    let pixels = picture
        .pixels()
        .map(|p| weigh(p.0.map(u32::from)) as u8)
        .collect();
    gray_image(picture.width(), picture.height(), pixels)
}

fn weigh([red, green, blue]: [u32; 3]) -> u32 {
    (299 * red + 587 * green + 114 * blue + 500) / 1000
}

fn from_16_bits(sample: u32) -> u8 {
    ((sample * 255 + 32_767) / 65_535) as u8
}

fn gray_image(width: u32, height: u32, pixels: Vec<u8>) -> GrayImage {
    GrayImage::from_raw(width, height, pixels).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_and_gray_keep_their_level() {
        assert_eq!(weigh([255, 255, 255]), 255);
        assert_eq!(weigh([65_535; 3]), 65_535);
        for level in 0..=255 {
            assert_eq!(weigh([level; 3]), level);
            assert_eq!(u32::from(from_16_bits(level * 257)), level);
        }
    }
}
