//! Pictures as files in memory, and as data URIs.

use std::io::Cursor;

use base64::{Engine, engine::general_purpose::STANDARD};
use image::{
    DynamicImage, GrayImage, ImageFormat, codecs::jpeg::JpegEncoder, imageops::FilterType,
};

/// Quality of JPEG pictures, of 100.
const QUALITY: u8 = 82;

/// A picture that is at most `width_px` wide and twice as high, as it is when it is smaller.
#[must_use]
pub fn fitted(picture: &DynamicImage, width_px: u32) -> DynamicImage {
    if picture.width() <= width_px && picture.height() <= 2 * width_px {
        return picture.clone();
    }
    picture.resize(width_px, 2 * width_px, FilterType::Triangle)
}

/// A small picture, exactly: a data URI of a PNG file.
///
/// # Panics
/// Never: memory takes any picture.
#[must_use]
pub fn png_uri(picture: &GrayImage) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(png(picture)))
}

/// A small picture, exactly: a PNG file.
///
/// # Panics
/// Never: memory takes any picture.
#[must_use]
pub fn png(picture: &GrayImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, ImageFormat::Png)
        .expect("memory takes any picture");
    bytes.into_inner()
}

/// A large picture, nearly: a data URI of a JPEG file.
///
/// # Panics
/// Never: memory takes any picture.
#[must_use]
pub fn jpeg_uri(picture: &DynamicImage) -> String {
    format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg(picture)))
}

/// A large picture, nearly: a JPEG file.
///
/// # Panics
/// Never: memory takes any picture.
#[must_use]
pub fn jpeg(picture: &DynamicImage) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
    picture
        .write_with_encoder(encoder)
        .expect("memory takes any picture");
    bytes
}
