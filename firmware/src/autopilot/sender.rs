//! Messages → bytes.

use mavlink::{
    MAV_STX_V2, MavlinkVersion, MessageData,
    consts::{CHECKSUM_SIZE, MAX_PAYLOAD_LEN, v2},
    dialects::common::MavComponent,
};

use super::checksum::checksum;

/// Start and header.
const HEAD_LEN: usize = 1 + v2::MIN_HEADER_SIZE;

/// Bytes of a message that is sent, at most.
pub const MAX_MESSAGE_LEN: usize = HEAD_LEN + MAX_PAYLOAD_LEN + CHECKSUM_SIZE;

/// What this component is on the vehicle.
pub(super) const COMPONENT: u8 = MavComponent::MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY as u8;

/// Numbers the messages that are sent.
#[derive(Clone, Debug)]
pub(super) struct Sender {
    sequence: u8,
}

impl Sender {
    pub const fn new() -> Self {
        Self { sequence: 0 }
    }

    /// Sends a message of MAVLink 2, unsigned, in one piece.
    pub fn send<M: MessageData>(&mut self, system: u8, message: &M, send: &mut impl FnMut(&[u8])) {
        let mut frame = [0; MAX_MESSAGE_LEN];
        if let Some(payload) = frame.get_mut(HEAD_LEN..HEAD_LEN + MAX_PAYLOAD_LEN) {
            let len = message.ser(MavlinkVersion::V2, payload);
            if let Some(bytes) = self.complete(system, (M::ID, M::EXTRA_CRC), &mut frame, len) {
                send(bytes);
            }
        }
    }

    /// Writes what goes around a payload.
    #[inline(never)]
    fn complete<'a>(
        &mut self,
        system: u8,
        (id, seed): (u32, u8),
        frame: &'a mut [u8; MAX_MESSAGE_LEN],
        len: usize,
    ) -> Option<&'a [u8]> {
        let [low, middle, high, _] = id.to_le_bytes();
        let head: &mut [u8; HEAD_LEN] = frame.first_chunk_mut()?;
        *head = [
            MAV_STX_V2,
            len as u8,
            0,
            0,
            self.sequence,
            system,
            COMPONENT,
            low,
            middle,
            high,
        ];
        self.sequence = self.sequence.wrapping_add(1);
        let end = HEAD_LEN + len;
        let checksum = checksum(frame.get(1..end)?, seed).to_le_bytes();
        *frame.get_mut(end..)?.first_chunk_mut()? = checksum;
        frame.get(..end + CHECKSUM_SIZE)
    }
}
