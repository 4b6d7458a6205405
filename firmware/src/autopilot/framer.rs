//! Bytes → the messages among them that are wanted.
//!
//! A message that is wanted is known by its identity and its checksum. What is not wanted is not checked, for its
//! checksum needs a number that only its definition has: it is believed by its header when it begins where the message
//! before it ended. That only decides what counts as damage: bytes are looked through for wanted messages wherever
//! they are, one after the other, so that no header that is none hides a message. Whatever is damaged costs no other
//! message.

use mavlink::{
    MAV_STX, MAV_STX_V2, MavlinkVersion, MessageData,
    consts::{CHECKSUM_SIZE, MAX_PAYLOAD_LEN, v1, v2},
    dialects::common::{
        ALTITUDE_DATA, ATTITUDE_DATA, DISTANCE_SENSOR_DATA, GLOBAL_POSITION_INT_DATA,
        HEARTBEAT_DATA,
    },
};

use super::checksum::checksum;

/// Start and header of either version.
const V1_HEAD_LEN: usize = 1 + v1::HEADER_SIZE;
const V2_HEAD_LEN: usize = 1 + v2::MIN_HEADER_SIZE;

/// Bytes of the longest message that is read, without its signature.
const ROOM: usize = V2_HEAD_LEN + MAX_PAYLOAD_LEN + CHECKSUM_SIZE;

/// A wanted message whose checksum is right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Message<'a> {
    pub header: Header,
    /// Zeros at its end may be missing.
    pub payload: &'a [u8],
}

/// What precedes a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub version: MavlinkVersion,
    pub sequence: u8,
    pub system: u8,
    pub component: u8,
    /// Which message it is.
    pub id: u32,
    /// Bytes up to the payload's end, up to the checksum's end, and after that.
    body_len: usize,
    len: usize,
    signature_len: usize,
}

/// What is heard, piece by piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Heard<'a> {
    /// A wanted message.
    Message(Message<'a>),
    /// The header of another one, which is not checked.
    Other(Header),
}

/// Finds messages in a stream of bytes.
#[derive(Clone, Debug)]
pub(super) struct Framer {
    bytes: [u8; ROOM],
    len: usize,
    /// Bytes at the front that belong to a message which is not wanted, or to a signature.
    excused: usize,
    /// The last byte belonged to no message.
    is_astray: bool,
    damaged: u32,
}

/// What is at the front.
enum Front {
    /// No message.
    Nothing,
    /// The beginning of one.
    Part,
    Wanted(Header),
    Other(Header),
}

impl Framer {
    pub const fn new() -> Self {
        Self {
            bytes: [0; ROOM],
            len: 0,
            excused: 0,
            is_astray: false,
            damaged: 0,
        }
    }

    /// Stretches of bytes that belong to no message, and messages that such a stretch interrupts.
    pub fn damaged(&self) -> u32 {
        self.damaged
    }

    /// Takes in a byte, and hands on what it completes.
    pub fn push(&mut self, byte: u8, mut hear: impl FnMut(Heard<'_>)) {
        // There is room: a message that fills it is complete.
        if let Some(free) = self.bytes.get_mut(self.len) {
            *free = byte;
            self.len += 1;
        }
        while let Some((&first, _)) = self.held().split_first() {
            if first != MAV_STX && first != MAV_STX_V2 {
                self.pass();
                continue;
            }
            match front(self.held()) {
                Front::Part => return,
                Front::Nothing => self.pass(),
                Front::Other(header) => {
                    if self.excused == 0 && !self.is_astray {
                        self.excused = header.len + header.signature_len;
                        hear(Heard::Other(header));
                    }
                    self.pass();
                }
                Front::Wanted(header) => {
                    if self.excused > 0 {
                        // The message before ended too early.
                        self.damaged = self.damaged.saturating_add(1);
                    }
                    // What is lost of a signature costs nothing.
                    self.excused = header.signature_len;
                    self.is_astray = false;
                    let head_len = header.head_len();
                    if let Some(payload) = self.held().get(head_len..header.body_len) {
                        hear(Heard::Message(Message { header, payload }));
                    }
                    self.discard(header.len);
                }
            }
        }
    }

    fn held(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&[])
    }

    /// Passes over the byte at the front.
    fn pass(&mut self) {
        if self.excused > 0 {
            self.excused -= 1;
        } else if !self.is_astray {
            self.is_astray = true;
            self.damaged = self.damaged.saturating_add(1);
        }
        self.discard(1);
    }

    fn discard(&mut self, count: usize) {
        let kept = self.len.saturating_sub(count);
        for to in 0..kept {
            let from = self.bytes.get(to + count).copied().unwrap_or(0);
            if let Some(byte) = self.bytes.get_mut(to) {
                *byte = from;
            }
        }
        self.len = kept;
    }
}

impl Header {
    fn head_len(&self) -> usize {
        match self.version {
            MavlinkVersion::V1 => V1_HEAD_LEN,
            MavlinkVersion::V2 => V2_HEAD_LEN,
        }
    }
}

fn front(held: &[u8]) -> Front {
    let header = match *held {
        [MAV_STX, len, sequence, system, component, id, ..] => {
            let body_len = V1_HEAD_LEN + usize::from(len);
            Header {
                version: MavlinkVersion::V1,
                sequence,
                system,
                component,
                id: id.into(),
                body_len,
                len: body_len + CHECKSUM_SIZE,
                signature_len: 0,
            }
        }
        // What a flag means that is not known cannot be read: system ids of 32 bits are not. A signature is left
        // unread.
        [MAV_STX_V2, _, flags, ..] if flags & !v2::IFLAG_SIGNED != 0 => return Front::Nothing,
        [
            MAV_STX_V2,
            len,
            flags,
            _,
            sequence,
            system,
            component,
            low,
            middle,
            high,
            ..,
        ] => {
            let body_len = V2_HEAD_LEN + usize::from(len);
            Header {
                version: MavlinkVersion::V2,
                sequence,
                system,
                component,
                id: u32::from_le_bytes([low, middle, high, 0]),
                body_len,
                len: body_len + CHECKSUM_SIZE,
                signature_len: if flags == 0 { 0 } else { v2::SIGNATURE_SIZE },
            }
        }
        _ => return Front::Part,
    };
    let Some(seed) = seed(header.id) else {
        return Front::Other(header);
    };
    let checked = held.get(1..header.body_len);
    let stored = held
        .get(header.body_len..header.len)
        .and_then(|rest| rest.first_chunk());
    match (checked, stored) {
        (Some(checked), Some(stored)) => {
            if checksum(checked, seed) == u16::from_le_bytes(*stored) {
                Front::Wanted(header)
            } else {
                Front::Nothing
            }
        }
        _ => Front::Part,
    }
}

/// What the checksum of a wanted message ends with.
fn seed(id: u32) -> Option<u8> {
    Some(match id {
        HEARTBEAT_DATA::ID => HEARTBEAT_DATA::EXTRA_CRC,
        ATTITUDE_DATA::ID => ATTITUDE_DATA::EXTRA_CRC,
        GLOBAL_POSITION_INT_DATA::ID => GLOBAL_POSITION_INT_DATA::EXTRA_CRC,
        DISTANCE_SENSOR_DATA::ID => DISTANCE_SENSOR_DATA::EXTRA_CRC,
        ALTITUDE_DATA::ID => ALTITUDE_DATA::EXTRA_CRC,
        _ => return None,
    })
}

#[cfg(test)]
pub(super) mod tests {
    use std::vec::Vec;

    use mavlink::{
        MAVLinkV1MessageRaw, MAVLinkV2MessageRaw, MavHeader, calculate_crc,
        dialects::common::VFR_HUD_DATA,
    };
    use proptest::{collection::vec, prelude::*, sample::Index, test_runner::RngSeed};

    use super::*;

    /// Bytes after which everything before them was heard: as many as a message has.
    pub const FLUSH: [u8; ROOM] = [0; ROOM];

    /// A message as mavlink's own writer has it.
    pub fn written<M: MessageData>(
        version: MavlinkVersion,
        (system, component): (u8, u8),
        sequence: u8,
        message: &M,
    ) -> Vec<u8> {
        let header = MavHeader {
            system_id: system.into(),
            component_id: component,
            sequence,
        };
        match version {
            MavlinkVersion::V1 => {
                let mut raw = MAVLinkV1MessageRaw::new();
                raw.serialize_message_data(header, message);
                raw.raw_bytes().to_vec()
            }
            MavlinkVersion::V2 => {
                let mut raw = MAVLinkV2MessageRaw::new();
                raw.serialize_message_data(header, message);
                raw.raw_bytes().to_vec()
            }
        }
    }

    /// The same, signed by nobody.
    pub fn signed(mut frame: Vec<u8>, seed: u8) -> Vec<u8> {
        frame[2] |= v2::IFLAG_SIGNED;
        let end = frame.len() - CHECKSUM_SIZE;
        let checksum = calculate_crc(&frame[1..end], seed).to_le_bytes();
        frame[end..].copy_from_slice(&checksum);
        // A signature may look like the beginning of a message.
        frame.extend([MAV_STX_V2; v2::SIGNATURE_SIZE]);
        frame
    }

    fn attitude(sequence: u8) -> Vec<u8> {
        let message = ATTITUDE_DATA {
            time_boot_ms: u32::from(sequence) * 0x0101_FEFD,
            roll: f32::from(sequence),
            ..ATTITUDE_DATA::DEFAULT
        };
        written(MavlinkVersion::V2, (7, 1), sequence, &message)
    }

    fn other(sequence: u8) -> Vec<u8> {
        let message = VFR_HUD_DATA {
            airspeed: f32::from_bits(0xFEFD_FEFD),
            ..VFR_HUD_DATA::DEFAULT
        };
        written(MavlinkVersion::V2, (7, 1), sequence, &message)
    }

    /// Identities and sequence numbers.
    type Numbers = Vec<(u32, u8)>;

    /// Those of wanted messages, and of others.
    fn heard(framer: &mut Framer, bytes: &[u8]) -> (Numbers, Numbers) {
        let (mut wanted, mut others) = (Vec::new(), Vec::new());
        for &byte in bytes {
            framer.push(byte, |heard| match heard {
                Heard::Message(message) => {
                    wanted.push((message.header.id, message.header.sequence));
                }
                Heard::Other(header) => others.push((header.id, header.sequence)),
            });
        }
        (wanted, others)
    }

    #[test]
    fn both_versions_are_read_and_signatures_are_passed_over() {
        let message = HEARTBEAT_DATA::DEFAULT;
        let mut bytes = written(MavlinkVersion::V1, (7, 1), 0, &message);
        let second = written(MavlinkVersion::V2, (7, 1), 1, &message);
        bytes.extend(signed(second.clone(), HEARTBEAT_DATA::EXTRA_CRC));
        bytes.extend(second);
        let mut framer = Framer::new();
        let (wanted, others) = heard(&mut framer, &bytes);
        assert_eq!(wanted, [(0, 0), (0, 1), (0, 1)]);
        assert_eq!((others.len(), framer.damaged()), (0, 0));
    }

    #[test]
    fn a_message_is_heard_with_its_last_byte() {
        let bytes = attitude(3);
        let mut framer = Framer::new();
        let (most, last) = bytes.split_at(bytes.len() - 1);
        assert_eq!(heard(&mut framer, most).0.len(), 0);
        assert_eq!(heard(&mut framer, last).0, [(30, 3)]);
    }

    #[test]
    fn messages_that_are_not_wanted_are_no_damage() {
        // What looks like the beginning of a message in one of them is waited for.
        let mut bytes = [attitude(0), other(1), other(2), attitude(3)].concat();
        bytes.extend((4..20).flat_map(other));
        let mut framer = Framer::new();
        let (wanted, others) = heard(&mut framer, &bytes);
        assert_eq!(wanted, [(30, 0), (30, 3)]);
        assert_eq!(others[..3], [(74, 1), (74, 2), (74, 4)]);
        assert_eq!(framer.damaged(), 0);
    }

    #[test]
    fn a_message_after_one_that_lost_bytes_is_heard() {
        for missing in 0..other(1).len() {
            let mut short = other(1);
            short.remove(missing);
            let bytes = [attitude(0), short, attitude(2), FLUSH.to_vec()].concat();
            let mut framer = Framer::new();
            let (wanted, _) = heard(&mut framer, &bytes);
            assert_eq!(wanted, [(30, 0), (30, 2)], "byte {missing}");
            assert!(framer.damaged() > 0);
        }
    }

    #[test]
    fn flags_that_are_not_known_are_refused() {
        let mut bytes = attitude(0);
        bytes[2] = v2::IFLAG_SYSID32;
        let mut framer = Framer::new();
        assert_eq!(heard(&mut framer, &bytes).0.len(), 0);
        assert_eq!(framer.damaged(), 1);
    }

    const LIKELY: [u8; 8] = [0xFD, 0xFE, 0, 1, 9, 28, 30, 33];

    proptest! {
        // Of 65,536 damaged messages one has the right checksum: the same ones every time.
        #![proptest_config(ProptestConfig {
            rng_seed: RngSeed::Fixed(8),
            ..ProptestConfig::default()
        })]

        #[test]
        fn any_bytes_are_survived(bytes in vec(any::<u8>(), 0..3000)) {
            let mut framer = Framer::new();
            heard(&mut framer, &bytes);
            let left = heard(&mut framer, &FLUSH);
            prop_assert!(left.0.len() < ROOM);
            prop_assert_eq!(heard(&mut framer, &attitude(9)).0, [(30, 9)]);
        }

        /// Bytes that often are magic, flags, lengths or identities.
        #[test]
        fn bytes_like_headers_hide_no_message(
            bytes in vec(prop::sample::select(&LIKELY[..]), 0..600),
        ) {
            let all = [bytes, attitude(1), FLUSH.to_vec()].concat();
            let mut framer = Framer::new();
            prop_assert!(heard(&mut framer, &all).0.contains(&(30, 1)));
        }

        /// Messages that nothing happened to arrive, in order, whatever happens in between.
        #[test]
        fn intact_messages_arrive(
            pieces in vec((0..5_u8, any::<Index>(), 1..=255_u8, vec(any::<u8>(), 0..300)), 0..60),
        ) {
            let (mut stream, mut intact) = (Vec::new(), Vec::new());
            for ((what, place, flip, garbage), sequence) in pieces.into_iter().zip(0..) {
                let mut bytes = attitude(sequence);
                match what {
                    0 => intact.push((30, sequence)),
                    1 => { bytes.remove(1 + place.index(bytes.len() - 1)); }
                    2 => {
                        let at = place.index(bytes.len());
                        bytes[at] ^= flip;
                    }
                    3 => bytes.truncate(place.index(bytes.len())),
                    _ => bytes = garbage,
                }
                stream.extend(bytes);
            }
            stream.extend(FLUSH);
            let mut framer = Framer::new();
            prop_assert_eq!(heard(&mut framer, &stream).0, intact);
        }
    }
}
