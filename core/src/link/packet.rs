//! Packets: message + CRC-32, COBS, zero.

use core::fmt;

use serde::{Deserialize, Serialize};

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
const CRC_LEN: usize = size_of::<u32>();

/// Why a packet was dropped, or could not be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Damage {
    /// It is longer than the receiver's, or the sender's, buffer.
    TooLong,
    /// It is not COBS.
    Encoding,
    /// Its CRC does not match.
    Crc,
    /// It is intact but not a message.
    Message,
}

/// Collects the bytes of packets of up to `N` bytes, zero included.
#[derive(Debug)]
pub struct Receiver<const N: usize> {
    buffer: [u8; N],
    len: usize,
    is_overlong: bool,
}

/// Bytes of a packet that carries a message of `len` bytes, at most, zero included.
#[must_use]
pub const fn encoded_len(len: usize) -> usize {
    cobs::max_encoding_length(len + CRC_LEN) + 1
}

/// Encodes `message` as a packet at the start of `packet`, using `scratch` for the plain message.
///
/// # Errors
/// [`Damage::TooLong`] when either buffer is too small.
pub fn encode<'b>(
    message: &impl Serialize,
    scratch: &mut [u8],
    packet: &'b mut [u8],
) -> Result<&'b [u8], Damage> {
    let encoded = postcard::to_slice(message, scratch).map_err(|_| Damage::TooLong)?;
    let (len, crc) = (encoded.len(), CRC.checksum(encoded).to_le_bytes());
    let place = scratch.get_mut(len..).and_then(<[u8]>::first_chunk_mut);
    *place.ok_or(Damage::TooLong)? = crc;
    let plain = scratch.get(..len + CRC_LEN).ok_or(Damage::TooLong)?;
    if packet.len() < encoded_len(len) {
        return Err(Damage::TooLong);
    }
    let end = cobs::try_encode(plain, packet).map_err(|_| Damage::TooLong)?;
    *packet.get_mut(end).ok_or(Damage::TooLong)? = 0;
    packet.get(..=end).ok_or(Damage::TooLong)
}

impl<const N: usize> Receiver<N> {
    /// An empty receiver.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            buffer: [0; N],
            len: 0,
            is_overlong: false,
        }
    }

    /// Takes one byte. When it ends a packet, returns the message or what is wrong with it; empty packets are
    /// skipped, so that extra zeros can be sent to bring both sides in step.
    pub fn push<'s, M: Deserialize<'s>>(&'s mut self, byte: u8) -> Option<Result<M, Damage>> {
        if byte != 0 {
            match self.buffer.get_mut(self.len) {
                Some(place) => {
                    *place = byte;
                    self.len += 1;
                }
                None => self.is_overlong = true,
            }
            return None;
        }
        let (len, is_overlong) = (self.len, self.is_overlong);
        (self.len, self.is_overlong) = (0, false);
        match self.buffer.get_mut(..len) {
            Some([]) if !is_overlong => None,
            Some(packet) if !is_overlong => Some(decode(packet)),
            _ => Some(Err(Damage::TooLong)),
        }
    }
}

impl<const N: usize> Default for Receiver<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooLong => "a packet is longer than its buffer",
            Self::Encoding => "a packet is not COBS",
            Self::Crc => "a packet's CRC does not match",
            Self::Message => "a packet is not a message",
        })
    }
}

impl core::error::Error for Damage {}

fn decode<'b, M: Deserialize<'b>>(packet: &'b mut [u8]) -> Result<M, Damage> {
    let plain = unstuff(packet).ok_or(Damage::Encoding)?;
    let (message, crc) = plain.split_last_chunk::<CRC_LEN>().ok_or(Damage::Crc)?;
    if CRC.checksum(message) != u32::from_le_bytes(*crc) {
        return Err(Damage::Crc);
    }
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => Ok(message),
        _ => Err(Damage::Message),
    }
}

/// Decodes COBS in place, byte by byte: `cobs::decode_in_place` indexes, and so could panic.
fn unstuff(packet: &mut [u8]) -> Option<&[u8]> {
    let (mut state, mut len) = (cobs::DecoderState::Idle, 0);
    for index in 0..packet.len() {
        let byte = *packet.get(index)?;
        if let cobs::DecodeResult::DataContinue(byte) = state.feed(byte).ok()? {
            *packet.get_mut(len)? = byte;
            len += 1;
        }
    }
    match state.feed(0) {
        Ok(cobs::DecodeResult::DataComplete) => packet.get(..len),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{
        Camera, Cause, Crash, Faults, Goals, MAX_REPLY_LEN, MAX_REQUEST_LEN, PART_LEN,
        PICTURE_PART_LEN, Refusal, Rejection, Reply, Report, Request, Upload,
    };
    use super::*;
    use crate::{
        belief::Estimate,
        landmark::Point,
        localizer::Fix,
        mission::{Command, State},
        navigator::MAX_GOALS,
        slots::Setup,
    };
    use proptest::prelude::*;
    use std::{vec, vec::Vec};

    fn packet_of(message: &impl Serialize) -> Vec<u8> {
        let (mut scratch, mut packet) = (vec![0; 100_000], vec![0; 100_000]);
        encode(message, &mut scratch, &mut packet)
            .expect("fits")
            .to_vec()
    }

    #[test]
    fn the_largest_request_fits() {
        let bytes = [0xff; PART_LEN];
        let setup = Setup::default();
        let goals = Goals::from_slice(&[u16::MAX; MAX_GOALS]).expect("fits");
        for request in [
            Request::Pixels {
                offset: u32::MAX,
                bytes: &bytes,
            },
            Request::Upload(Upload::Chunk {
                offset: u32::MAX,
                bytes: &bytes,
            }),
            Request::Upload(Upload::Begin {
                len: u32::MAX,
                crc: u32::MAX,
                setup,
            }),
            Request::Go(goals),
        ] {
            let packet = packet_of(&request);
            let mut receiver = Receiver::<MAX_REQUEST_LEN>::new();
            for &byte in &packet[..packet.len() - 1] {
                assert_eq!(receiver.push::<Request<'_>>(byte), None);
            }
            assert_eq!(receiver.push(0), Some(Ok(request)));
        }
    }

    #[test]
    fn the_largest_replies_fit() {
        let point = Point {
            x_px: f32::MAX,
            y_px: f32::MAX,
        };
        let fix = Fix {
            landmark: u32::MAX,
            view: u32::MAX,
            place: point,
            position: point,
            heading_rad: 1.0,
            altitude_ratio: 1.0,
            distance: 1.0,
            second: 1.0,
            margin: 1.0,
            from_feature_space: 1.0,
            guaranteed: true,
            known: true,
        };
        let report = Report {
            sequence: u32::MAX,
            time_ms: u32::MAX,
            step_s: 1.0,
            took_us: u32::MAX,
            camera: Camera::Absent,
            heading_rad: Some(1.0),
            tilt_rad: Some((1.0, 1.0)),
            altitude_ratio: Some(1.0),
            estimate: Some(Estimate {
                position: point,
                covariance_px2: [1.0; 3],
                heading_rad: 1.0,
                confidence: 1.0,
            }),
            odometry_px: [1.0; 2],
            fix: Some(fix),
            refusal: Some(Refusal::Unknown),
            state: State::Arrived,
            command: Command {
                heading_rad: 1.0,
                speed: 1.0,
            },
            damaged: u32::MAX,
        };
        let bytes = heapless::Vec::from_slice(&[0xff; PICTURE_PART_LEN]).expect("fits");
        let crash = Crash::HardFault {
            pc: u32::MAX,
            lr: u32::MAX,
            status: u32::MAX,
            address: u32::MAX,
        };
        for reply in [
            Reply::Report(report),
            Reply::Picture {
                sequence: u32::MAX,
                width: u16::MAX,
                height: u16::MAX,
                offset: u32::MAX,
                bytes,
            },
            Reply::Faults(Faults {
                cause: Cause::Watchdog,
                resets: u16::MAX,
                by_watchdog: u16::MAX,
                by_brown_out: u16::MAX,
                crash: Some(crash),
                camera_losses: u16::MAX,
                link_storms: u16::MAX,
                worn_pages: u16::MAX,
            }),
        ] {
            assert!(packet_of(&reply).len() <= MAX_REPLY_LEN, "{reply:?}");
        }
    }

    #[test]
    fn every_flipped_bit_is_noticed_and_the_next_packet_still_arrives() {
        let rejected = Reply::Rejected {
            sequence: Some(7),
            reason: Rejection::Damaged(Damage::Crc),
        };
        let packet = packet_of(&rejected);
        for bit in 0..(packet.len() - 1) * 8 {
            let mut damaged = packet.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let mut receiver = Receiver::<MAX_REPLY_LEN>::new();
            for byte in damaged {
                if let Some(result) = receiver.push::<Reply>(byte) {
                    assert!(result.is_err(), "bit {bit}");
                }
            }
            let last = packet
                .iter()
                .filter_map(|&byte| receiver.push::<Reply>(byte).map(|r| r.is_ok()))
                .last();
            assert_eq!(last, Some(true), "bit {bit}");
        }
    }

    #[test]
    fn overlong_packets_are_dropped_whole() {
        let mut receiver = Receiver::<8>::new();
        for _ in 0..100 {
            assert_eq!(receiver.push::<Reply>(1), None);
        }
        assert_eq!(receiver.push::<Reply>(0), Some(Err(Damage::TooLong)));
        assert_eq!(receiver.push::<Reply>(0), None);
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..600)) {
            let mut receiver = Receiver::<256>::new();
            for byte in bytes {
                let _ = receiver.push::<Request<'_>>(byte);
            }
        }
    }
}
