//! One number for many updates: the same on every machine, or something is wrong.

use super::{Growth, IncrementalPca};

/// CRC-32 of the coordinates and eigenvalues of 100 pseudo-random views of 36 pixels in five dimensions.
#[must_use]
#[inline(never)] // its eigenspace is not the caller's
pub fn digest() -> u32 {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = CRC.digest();
    let mut pca = IncrementalPca::<36, 6>::new(Growth::Fixed);
    let mut state = 1_u32;
    for _ in 0..100 {
        let view: [u8; 36] = core::array::from_fn(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        });
        let Some(step) = pca.update(&view) else {
            return 0;
        };
        for value in step.coordinates.iter().chain(pca.eigenvalues()) {
            digest.update(&value.to_bits().to_le_bytes());
        }
    }
    digest.finalize()
}
