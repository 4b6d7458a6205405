//! Aerial maps: loading, the built-in city, segmentation by color, and where candidates lie.
//!
//! A [`Map`] is 8-bit luminance, seen straight from above with north up, as large as the area the vehicle flies over.
//! Map coordinates are pixels, x to the right, y down, origin at the top-left corner of the top-left pixel.

pub mod city;
pub mod grid;
mod integral;
mod load;
mod segment;

use image::{GrayImage, RgbImage};

pub use grid::{Grid, GridError};
pub use integral::Integral;
pub use load::{MAX_PIXELS, MapError, load, load_color, luminance};
pub use segment::{MAX_COLORS, MIN_REGION_PX, PaletteColor, SegmentError, Segmentation};

/// The name under which the command line knows the built-in city.
pub const BUILTIN_CITY: &str = "builtin:city";

/// An aerial map.
#[derive(Clone, Debug)]
pub struct Map {
    name: String,
    luminance: GrayImage,
}

impl Map {
    /// Opens a map by name: [`BUILTIN_CITY`], or the path of a PNG, JPEG or TIFF file.
    ///
    /// # Errors
    /// When the file cannot be read or is not a picture of a supported kind and size.
    pub fn open(name: &str) -> Result<Self, MapError> {
        if is_city(name)? {
            return Ok(Self::city());
        }
        Ok(Self {
            name: name.to_owned(),
            luminance: load(name.as_ref())?,
        })
    }

    /// The built-in procedural city: 1600×1200 pixels, the same bytes every time.
    #[must_use]
    pub fn city() -> Self {
        Self {
            name: BUILTIN_CITY.to_owned(),
            luminance: luminance(&city::draw()),
        }
    }

    /// A map from pixels, for tests and mosaics.
    #[must_use]
    pub fn from_luminance(name: &str, luminance: GrayImage) -> Self {
        Self {
            name: name.to_owned(),
            luminance,
        }
    }

    /// What it was opened as.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What a page calls it: the name of the file without its directory, or the built-in name.
    #[must_use]
    pub fn title(&self) -> &str {
        let file = std::path::Path::new(&self.name).file_name();
        file.and_then(|file| file.to_str()).unwrap_or(&self.name)
    }

    /// Its pixels.
    #[must_use]
    pub fn luminance(&self) -> &GrayImage {
        &self.luminance
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.luminance.width()
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.luminance.height()
    }

    /// CRC-32 (ISO-HDLC) of its luminance, row-major: tells whether two maps are the same.
    #[must_use]
    pub fn crc(&self) -> u32 {
        crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(self.luminance.as_raw())
    }
}

/// Opens a map by name as [`Map::open`] does, in color.
///
/// # Errors
/// When the file cannot be read or is not a picture of a supported kind and size.
pub fn open_color(name: &str) -> Result<RgbImage, MapError> {
    if is_city(name)? {
        return Ok(city::draw());
    }
    load_color(name.as_ref())
}

/// Whether a map is the built-in one, not a file.
fn is_city(name: &str) -> Result<bool, MapError> {
    match name.strip_prefix("builtin:") {
        None => Ok(false),
        Some(_) if name == BUILTIN_CITY => Ok(true),
        Some(other) => Err(MapError::UnknownBuiltin {
            name: other.to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_city_has_the_same_bytes_every_time() {
        let city = Map::city();
        assert_eq!((city.width(), city.height()), (1600, 1200));
        assert_eq!(city.crc(), CITY_CRC, "found {:08x}", city.crc());
    }

    /// Taken from the first drawing; the drawing uses only exact IEEE operations, so it holds on every machine.
    const CITY_CRC: u32 = 0x1e30_6d71;
}
