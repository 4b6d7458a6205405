//! One number for a flight by an atlas: the same on every machine, or something is wrong.

use core::ops::DerefMut;

use super::{Memory, Navigator, Readings};
use crate::{
    atlas::Atlas,
    frame::Frame,
    preprocess::Pose,
    track::{Placement, see_ground},
};

/// Side of the frames of the flight, in pixels.
const SIDE_PX: u16 = 96;

/// Frames of the flight.
const FRAMES: u16 = 16;

/// Time between frames, in seconds.
const STEP_S: f32 = 0.1;

/// CRC-32 of every estimate and command of a flight of 16 frames over a made-up ground, to the first and the last place
/// of an atlas. Instruments and frames are missing now and then, and once the vehicle is carried away.
///
/// A board and a host that disagree on any bit give different numbers, if their memories are of the same size. Frames
/// lie in `pixels`: 9,216 bytes; with fewer there is no frame.
#[must_use]
#[inline(never)] // its navigator is not the caller's
pub fn digest<M, const STATES: usize, const PLACES: usize>(
    atlas: Atlas<'_>,
    memory: M,
    pixels: &mut [u8],
) -> u32
where
    M: DerefMut<Target = Memory<STATES, PLACES>>,
{
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = CRC.digest();
    let last = atlas.topology().len().saturating_sub(1) as u16;
    let mut navigator = Navigator::new(atlas, memory);
    digest.update(&[navigator.go(&[0, last]).is_ok().into()]);
    for number in 0..FRAMES {
        let at = f32::from(number);
        let is_carried_away = number >= FRAMES / 2;
        let placement = Placement {
            x: 0.06 * at + if is_carried_away { 9.0 } else { 0.0 },
            y: -0.04 * at,
            heading_rad: 0.03 * at,
            altitude_ratio: 1.0 + 0.004 * at,
        };
        see_ground(&placement, SIDE_PX, pixels);
        let frame = Frame::new(pixels, SIDE_PX, SIDE_PX, SIDE_PX.into()).ok();
        let tilt = Pose::NOMINAL
            .tilted(0.003 * at, -0.002 * at, 1.0)
            .ok()
            .and_then(|pose| pose.tilt());
        let readings = Readings {
            heading_rad: (number % 4 != 1).then_some(placement.heading_rad),
            tilt: tilt.filter(|_| number % 4 != 2),
            altitude_ratio: (number % 4 != 3).then_some(placement.altitude_ratio),
        };
        let frame = frame.filter(|_| number % 6 != 5);
        let guidance = navigator.advance(frame.as_ref(), &readings, STEP_S);
        let estimate = guidance.estimate.map_or([0.0; 7], |estimate| {
            let [xx, xy, yy] = estimate.covariance_px2;
            let position = estimate.position;
            let (heading, confidence) = (estimate.heading_rad, estimate.confidence);
            [
                position.x_px,
                position.y_px,
                xx,
                xy,
                yy,
                heading,
                confidence,
            ]
        });
        let command = [guidance.command.heading_rad, guidance.command.speed];
        for number in estimate.iter().chain(&command) {
            digest.update(&number.to_bits().to_le_bytes());
        }
        digest.update(&[guidance.state as u8, guidance.fix.is_some().into()]);
    }
    for weight in navigator.belief().weights() {
        digest.update(&weight.to_bits().to_le_bytes());
    }
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use std::boxed::Box;

    use super::*;
    use crate::navigator::tests::world;

    #[test]
    fn a_memory_that_was_used_is_as_good_as_a_new_one() {
        let words = world();
        let atlas = Atlas::parse(bytemuck::cast_slice(&words)).expect("valid");
        let mut pixels = [0; SIDE_PX as usize * SIDE_PX as usize];
        let mut memory = Box::new(Memory::<64, 8>::new());
        let mut fly = |memory: &mut Memory<64, 8>| digest(atlas.clone(), memory, &mut pixels);
        let first = fly(&mut memory);
        assert_eq!(fly(&mut memory), first);
        assert_eq!(fly(&mut Memory::new()), first);

        // It has no goal of before.
        let mut navigator = Navigator::new(atlas.clone(), &mut *memory);
        navigator.go(&[1]).expect("a plan");
        let navigator = Navigator::new(atlas, navigator.memory);
        assert_eq!(navigator.memory.router.goal(), None);
    }
}
