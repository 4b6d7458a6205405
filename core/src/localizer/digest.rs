//! One number for many answers: the same on every machine, or something is wrong.

use crate::{
    atlas::Atlas,
    frame::Frame,
    localizer::{Fix, Localizer},
    preprocess::{Pose, View, reduce, reduce_reference},
};

/// Frames that are located.
const FRAMES: u32 = 64;

/// Pixels of the largest frame that [`digest`] locates.
pub const DIGEST_LEN: usize = 160 * 120;

/// CRC-32 of the fixes of 64 pseudo-random frames of different sizes and contrasts, each at the nominal and at a
/// pseudo-random pose, computed by the code that flies.
///
/// A board and a host that disagree on any bit of any fix give different numbers. Frames lie in `pixels`.
#[must_use]
#[inline(never)] // its localizer is not the caller's
pub fn digest(atlas: &Atlas<'_>, pixels: &mut [u8; DIGEST_LEN]) -> u32 {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut localizer = Localizer::new(atlas.clone());
    let mut digest = CRC.digest();
    for number in 0..FRAMES {
        let frame = pseudo_random_frame(number, pixels);
        for pose in [Some(Pose::NOMINAL), pseudo_random_pose(number)] {
            let fix: Option<Fix> = frame
                .zip(pose)
                .and_then(|(frame, pose)| localizer.locate_at(&frame, &pose));
            let mut encoded = [0; 64];
            if let Ok(bytes) = postcard::to_slice(&fix, &mut encoded) {
                digest.update(bytes);
            }
        }
    }
    digest.finalize()
}

/// Whether the reduction gives the bits of its reference twin on some small frames, which lie in `pixels`.
#[must_use]
#[inline(never)] // its views are not the caller's
pub fn reduction_matches_reference(pixels: &mut [u8; DIGEST_LEN]) -> bool {
    (0..4).all(|number| {
        let Some(frame) = pseudo_random_frame(number * 16, pixels) else {
            return false;
        };
        let side = [20, 13, 50, 2][number as usize % 4];
        let (mut fast, mut plain) = (View::black(side), View::black(side));
        reduce(&frame, &mut fast);
        reduce_reference(&frame, &mut plain);
        fast == plain
    })
}

/// Every heading, altitudes from 0.8 to 1.6, tilts up to 12° and every fourth time none. `None` would be a number out
/// of range, which does not happen.
fn pseudo_random_pose(number: u32) -> Option<Pose> {
    // From −1 to 1, in steps that do not repeat within the frames.
    let share = |factor: u32| (number * factor % 127) as f32 / 63.0 - 1.0;
    let pose = Pose::new(3.1 * share(29), 1.2 + 0.4 * share(53)).ok()?;
    if number.is_multiple_of(4) {
        return Some(pose);
    }
    pose.tilted(0.2 * share(71), 0.2 * share(97), 1.2 + 0.5 * share(11))
        .ok()
}

/// Blocks of random levels: contrast at the scale of views, so that fixes differ.
fn pseudo_random_frame(number: u32, buffer: &mut [u8; DIGEST_LEN]) -> Option<Frame<'_>> {
    let width = 32 + (number * 37 % 129) as u16;
    let height = 32 + (number * 53 % 89) as u16;
    let mut state = number.wrapping_mul(0x9e37_79b9) | 1;
    let mut levels = [0; 64];
    for level in &mut levels {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *level = (state >> 24) as u8;
    }
    let pixels = &mut buffer[..usize::from(width) * usize::from(height)];
    for (pixel, index) in pixels.iter_mut().zip(0_usize..) {
        let (x, y) = (index % usize::from(width), index / usize::from(width));
        *pixel = levels[(x * 8 / usize::from(width)) + 8 * (y * 8 / usize::from(height))];
    }
    Frame::new(pixels, width, height, usize::from(width)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preprocess::level;

    #[test]
    fn most_posed_frames_show_enough_to_be_located() {
        let located = (0..FRAMES).filter(|&number| {
            let mut buffer = [0; DIGEST_LEN];
            let frame = pseudo_random_frame(number, &mut buffer).expect("valid");
            let pose = pseudo_random_pose(number).expect("in range");
            level(&frame, &pose, &mut View::black(20)).is_half()
        });
        assert!(located.count() as u32 > FRAMES * 3 / 4);
    }
}
