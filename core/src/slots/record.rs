//! What is written after an atlas to say that it is whole, and newer than others.

use super::Setup;

/// Bytes of a record: the last of its slot.
pub const RECORD_LEN: usize = 64;

/// What the record of a slot says. It is written last, and at once: a slot without a valid record was not finished, or its
/// atlas was flashed without one.
///
/// ```text
/// 0  "EIGSLOT1"   8  sequence u32   12  atlas length u32   16  atlas CRC-32 u32
/// 20 meters per pixel f32   24  field of view f32, radians   28  zeros   60  CRC-32 of bytes 0..60
/// ```
/// Numbers are little-endian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Its number in the order of writing: the valid atlas with the largest is flown by.
    pub sequence: u32,
    /// Bytes of the atlas.
    pub len: u32,
    /// CRC-32 of the atlas, as in its preamble.
    pub crc: u32,
    /// What else the board has to know.
    pub setup: Setup,
}

const MAGIC: [u8; 8] = *b"EIGSLOT1";
const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

impl Record {
    /// As bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; RECORD_LEN] {
        let mut bytes = [0; RECORD_LEN];
        let words = [
            self.sequence,
            self.len,
            self.crc,
            self.setup.meters_per_px.to_bits(),
            self.setup.field_of_view_rad.to_bits(),
        ];
        let fields = words.iter().flat_map(|word| word.to_le_bytes());
        for (place, byte) in bytes.iter_mut().zip(MAGIC.into_iter().chain(fields)) {
            *place = byte;
        }
        if let Some((fields, crc)) = bytes.split_last_chunk_mut() {
            *crc = CRC.checksum(fields).to_le_bytes();
        }
        bytes
    }

    /// The record that these bytes are, if they are one.
    #[must_use]
    pub fn decode(bytes: &[u8; RECORD_LEN]) -> Option<Self> {
        let (fields, crc) = bytes.split_last_chunk()?;
        let (magic, fields) = fields.split_first_chunk::<8>()?;
        if *magic != MAGIC
            || CRC.checksum(bytes.split_last_chunk::<4>()?.0) != u32::from_le_bytes(*crc)
        {
            return None;
        }
        let (words, _) = fields.as_chunks::<4>();
        let [sequence, len, crc, scale, view] = words.first_chunk()?.map(u32::from_le_bytes);
        let setup = Setup {
            meters_per_px: f32::from_bits(scale),
            field_of_view_rad: f32::from_bits(view),
        };
        setup.is_valid().then_some(Self {
            sequence,
            len,
            crc,
            setup,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_is_noticed() {
        let record = Record {
            sequence: 7,
            len: 12_345,
            crc: 0xdead_beef,
            setup: Setup::default(),
        };
        let bytes = record.encode();
        assert_eq!(Record::decode(&bytes), Some(record));
        for bit in 0..RECORD_LEN * 8 {
            let mut damaged = bytes;
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Record::decode(&damaged), None, "bit {bit}");
        }
        assert_eq!(Record::decode(&[0xff; RECORD_LEN]), None);
    }
}
