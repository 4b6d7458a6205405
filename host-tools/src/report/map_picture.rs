//! The map in a page.

use image::{DynamicImage, imageops::FilterType};

use crate::{map::Map, output::jpeg_uri};

/// Its width at most, in pixels.
const WIDTH_PX: u32 = 1000;

/// The map as a data URI; `picture` is the map as a person would like to see it, if there is more than its luminance.
#[must_use]
pub fn map_picture(map: &Map, picture: Option<&DynamicImage>) -> String {
    let luminance;
    let picture = match picture {
        Some(picture) => picture,
        None => {
            luminance = DynamicImage::ImageLuma8(map.luminance().clone());
            &luminance
        }
    };
    let (width, height) = (map.width(), map.height());
    let shown = picture.resize(
        WIDTH_PX,
        WIDTH_PX * height / width.max(1) + 1,
        FilterType::Triangle,
    );
    jpeg_uri(&shown)
}
