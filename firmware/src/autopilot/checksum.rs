//! What ends a message of MAVLink.

use crc::{CRC_16_MCRF4XX, Crc, NoTable};

/// Bit by bit: mavlink's own has a table of 512 bytes, and at the 9 KB/s that are sent speed does not matter.
const CRC: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_MCRF4XX);

/// Of a header and its payload, and of the number that a message's definition gives.
pub(super) fn checksum(message: &[u8], seed: u8) -> u16 {
    let mut digest = CRC.digest();
    digest.update(message);
    digest.update(&[seed]);
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::checksum;

    proptest! {
        #[test]
        fn checksum_matches_mavlinks(bytes in prop::collection::vec(any::<u8>(), 0..300), seed: u8) {
            prop_assert_eq!(checksum(&bytes, seed), mavlink::calculate_crc(&bytes, seed));
        }
    }
}
