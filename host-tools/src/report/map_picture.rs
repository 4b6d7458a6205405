//! The map in a page.

use image::DynamicImage;

use crate::{
    map::Map,
    output::{fitted, jpeg_uri},
};

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
    jpeg_uri(&fitted(picture, WIDTH_PX))
}
