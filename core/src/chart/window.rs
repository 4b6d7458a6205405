//! What of a frame a place is known by: the square that it shows at every heading.

use core::f32::consts::{FRAC_1_SQRT_2, SQRT_2};

use crate::{
    frame::Frame,
    preprocess::{MAX_ALTITUDE_RATIO, MIN_ALTITUDE_RATIO, Pose, Tilt, View, level},
};

/// Pixels along the side of a view.
pub const VIEW_SIDE: u8 = 8;

/// Side of what a view shows, in sides: of the square that every turn of the frame's square has in it.
pub const WINDOW: f32 = FRAC_1_SQRT_2;

/// Pixels of a view.
pub(super) const PIXELS: usize = VIEW_SIDE as usize * VIEW_SIDE as usize;

/// Standard deviation of all views, in gray levels.
pub(super) const CONTRAST: f32 = 50.0;

/// Views whose own standard deviation is below this show nothing to know them by, in gray levels: noise.
const FLAT: f32 = 3.0;

/// A frame turned, scaled and levelled, of zero mean and of that contrast; `None` when it shows nothing, or not enough.
pub(super) fn look(
    frame: &Frame<'_>,
    tilt: Option<Tilt>,
    heading_rad: f32,
    altitude_ratio: f32,
    view: &mut View,
) -> Option<[f32; PIXELS]> {
    let ratio = (altitude_ratio * SQRT_2).clamp(MIN_ALTITUDE_RATIO, MAX_ALTITUDE_RATIO);
    let pose = Pose::new(heading_rad, ratio).ok()?.with_tilt(tilt);
    if !level(frame, &pose, view).is_half() {
        return None;
    }
    let pixels = view.pixels().first_chunk::<PIXELS>()?;
    let count = PIXELS as f32;
    let mean = view.sum() as f32 / count;
    let deviation = crate::math::sqrt(view.scaled_variance() as f32) / count;
    if deviation < FLAT {
        return None;
    }
    let gain = CONTRAST / deviation;
    Some(pixels.map(|pixel| (f32::from(pixel) - mean) * gain))
}
