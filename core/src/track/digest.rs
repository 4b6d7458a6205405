//! A ground to look at, and one number for a flight over it: the same on every machine, or something is wrong.

use super::{Odometry, Placement};
use crate::{frame::Frame, preprocess::Pose};

/// Side of the frames of the flight, in pixels.
const SIDE_PX: u16 = 96;

/// Frames of the flight.
const FRAMES: u32 = 12;

/// Spacings of the lattices of levels that make the ground, in pixels at altitude ratio 1, and their shares of 256.
const LATTICES: [(i32, u32); 3] = [(32, 120), (11, 88), (5, 48)];

/// What a camera that looks straight down sees of a made-up ground at a placement: a square of `side_px` pixels, row by
/// row, as far as `pixels` go.
///
/// ```
/// use eigenmark_core::track::{Placement, see_ground};
/// let mut pixels = [0; 40 * 40];
/// see_ground(&Placement::ORIGIN, 40, &mut pixels);
/// assert!(pixels.iter().any(|&level| level > 150) && pixels.iter().any(|&level| level < 100));
/// ```
pub fn see_ground(placement: &Placement, side_px: u16, pixels: &mut [u8]) {
    let (sin, cos) = crate::math::sin_cos(placement.heading_rad);
    let (side, ratio) = (f32::from(side_px), placement.altitude_ratio);
    let rows = pixels.chunks_exact_mut(usize::from(side_px.max(1)));
    for (row, behind) in rows.zip(0_u16..) {
        let behind = (f32::from(behind) + 0.5 - side / 2.0) * ratio;
        for (pixel, right) in row.iter_mut().zip(0_u16..) {
            let right = (f32::from(right) + 0.5 - side / 2.0) * ratio;
            let x = placement.x * side + right * cos - behind * sin;
            let y = placement.y * side + right * sin + behind * cos;
            *pixel = ground([x, y].map(|at| (at * 256.0) as i32));
        }
    }
}

/// The level of the ground at a position in units of 1/256 pixel: random levels on lattices, interpolated.
pub(super) fn ground([x, y]: [i32; 2]) -> u8 {
    let mut sum = 0;
    for (spacing, share) in LATTICES {
        let spacing = spacing * 256;
        let (i, j) = (x.div_euclid(spacing), y.div_euclid(spacing));
        let weight = |at: i32| (at.rem_euclid(spacing) * 256 / spacing) as u32;
        let (u, v) = (weight(x), weight(y));
        let level = |i: i32, j: i32| {
            let mut hash =
                (i as u32).wrapping_mul(0x9e37_79b9) ^ (j as u32).wrapping_mul(0x85eb_ca6b);
            hash = (hash ^ (hash >> 15) ^ share).wrapping_mul(0x2c1b_3c6d);
            (hash ^ (hash >> 12)).wrapping_mul(0x297a_2d39) >> 24
        };
        let above = level(i, j) * (256 - u) + level(i + 1, j) * u;
        let below = level(i, j + 1) * (256 - u) + level(i + 1, j + 1) * u;
        sum += share * ((above * (256 - v) + below * v) >> 16);
    }
    (sum >> 8) as u8
}

/// CRC-32 of every displacement, placement and covariance of a flight of 12 frames, some of them tilted, over a
/// made-up ground. The odometry begins anew. Frames lie in `pixels`: 9,216 bytes; 0 when there are fewer.
#[must_use]
#[inline(never)] // its frames are not the caller's
pub fn digest(odometry: &mut Odometry, pixels: &mut [u8]) -> u32 {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = CRC.digest();
    odometry.reset();
    for number in 0..FRAMES {
        let at = number as f32;
        let placement = Placement {
            x: 0.03 * at,
            y: -0.05 * at,
            heading_rad: 0.02 * at,
            altitude_ratio: 1.0 + 0.004 * at,
        };
        see_ground(&placement, SIDE_PX, pixels);
        let tilt = Pose::NOMINAL
            .tilted(0.002 * at, -0.001 * at, 1.0)
            .ok()
            .and_then(|pose| pose.tilt());
        let Ok(frame) = Frame::new(pixels, SIDE_PX, SIDE_PX, SIDE_PX.into()) else {
            return 0;
        };
        let moved = odometry.advance(&frame, tilt);
        let moved = moved.map_or([0.0; 4], |d| [d.forward, d.right, d.yaw_rad, d.scale]);
        let placement = odometry.placement();
        let placed = [
            placement.x,
            placement.y,
            placement.heading_rad,
            placement.altitude_ratio,
        ];
        for number in moved.iter().chain(&placed).chain(&odometry.covariance()) {
            digest.update(&number.to_bits().to_le_bytes());
        }
    }
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use std::boxed::Box;

    use super::*;

    #[test]
    fn an_odometry_that_begins_anew_is_as_a_new_one() {
        let mut pixels = [0; 200 * 200];
        let mut used = Box::new(Odometry::whole());
        let first = digest(&mut used, &mut pixels);
        // Larger frames, which leave their pixels behind, and a reference that lies second.
        for number in 0..2_u8 {
            let placement = Placement {
                x: 0.05 * f32::from(number),
                ..Placement::ORIGIN
            };
            see_ground(&placement, 200, &mut pixels);
            let frame = Frame::new(&pixels, 200, 200, 200).expect("valid");
            used.advance(&frame, None);
        }
        used.reset();
        assert_eq!(used.placement(), Placement::ORIGIN);
        assert!(used.tracks().is_empty() && used.covariance() == Odometry::whole().covariance());
        assert_eq!(digest(&mut used, &mut pixels), first);
        assert_eq!(digest(&mut Odometry::whole(), &mut pixels), first);
    }
}
