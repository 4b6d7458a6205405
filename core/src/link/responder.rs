//! The board's side of the link: bytes in, replies out.

use super::{
    Identity, MAX_REPLY_LEN, MAX_REQUEST_LEN, Receiver, Rejection, Reply, Request, encode,
};
use crate::{frame::Frame, localizer::Localizer};

/// Answers requests as their bytes arrive. Holds one request of the largest size, so make it static.
#[derive(Debug)]
pub struct Responder {
    receiver: Receiver<MAX_REQUEST_LEN>,
    scratch: [u8; MAX_REPLY_LEN],
    packet: [u8; MAX_REPLY_LEN],
}

impl Responder {
    /// A responder that has received nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            receiver: Receiver::new(),
            scratch: [0; MAX_REPLY_LEN],
            packet: [0; MAX_REPLY_LEN],
        }
    }

    /// Takes one byte; when it completes a request, returns the reply and the packet to send.
    pub fn push(&mut self, byte: u8, localizer: &mut Localizer<'_>) -> Option<(Reply, &[u8])> {
        let reply = match self.receiver.push::<Request<'_>>(byte)? {
            Ok(Request::Identify) => Reply::Identity(Identity::of(localizer.atlas())),
            Ok(Request::Locate {
                sequence,
                width,
                height,
                pixels,
            }) => match Frame::new(pixels, width, height, usize::from(width)) {
                Ok(frame) => Reply::Fix {
                    sequence,
                    fix: localizer.locate(&frame),
                },
                Err(error) => Reply::Rejected {
                    sequence: Some(sequence),
                    reason: Rejection::Frame(error),
                },
            },
            Err(damage) => Reply::Rejected {
                sequence: None,
                reason: Rejection::Damaged(damage),
            },
        };
        let packet = encode(&reply, &mut self.scratch, &mut self.packet).ok()?;
        Some((reply, packet))
    }
}

impl Default for Responder {
    fn default() -> Self {
        Self::new()
    }
}
