//! Bytes on the wire → requests → replies.

use std::cell::RefCell;

use eigenmark_core::{
    atlas::{Atlas, sample},
    link::{Cause, MAX_REPLY_LEN, PART_LEN, Receiver, Reply, Request, encode},
};
use eigenmark_firmware::simulated::Simulation;
use serde::{Serialize, Serializer, ser::SerializeTuple};

use super::input::Input;

/// A receiver so small that packets overflow it.
const SMALL: usize = 24;

/// Room for a packet with a frame of 39×39 pixels.
const MAX_PACKET_LEN: usize = 2048;

/// The board's side, which lives through all inputs: what was sent before must not matter.
struct Board {
    simulation: Simulation,
    small: Receiver<SMALL>,
}

thread_local! {
    static BOARD: RefCell<Board> = RefCell::new(Board::new());
}

/// A message that is these bytes.
struct Raw<'a>(&'a [u8]);

/// Sends a board what the input describes: bytes as they are, intact packets of arbitrary messages, frames, to its host's
/// wire, and bytes to that of its autopilot. Every reply decodes, and after all of it the board still says who it is.
///
/// # Panics
/// When a promise is broken.
pub fn link(input: &[u8]) {
    BOARD.with_borrow_mut(|board| talk(board, Input(input)));
}

fn talk(board: &mut Board, mut input: Input<'_>) {
    while !input.is_empty() {
        let (kind, len) = (input.byte(), usize::from(input.byte()));
        let sent = match kind % 5 {
            0 => board.send(input.bytes(len)),
            1 => board.send(&packet_of(&Raw(input.bytes(len)))),
            2 => frame(&mut input, board),
            3 => {
                // Damaged on the way.
                let mut packet = packet_of(&Raw(input.bytes(len)));
                let at = usize::from(input.byte()) % packet.len();
                packet[at] ^= input.byte();
                board.send(&packet)
            }
            _ => {
                let bytes = input.bytes(len);
                let wire = &board.simulation.autopilot;
                wire.with(|wire| {
                    wire.from_board.clear();
                    wire.to_board.extend(bytes);
                });
                board.send(&[])
            }
        };
        check(&sent);
    }
    // What is left of a packet ends, a storm passes, a slot is erased.
    board.send(&[0]);
    board
        .simulation
        .clock
        .with(|clock| clock.now_us += 1_100_000);
    board.simulation.run(10);
    let replies = board.simulation.ask(&Request::Identify);
    assert!(
        replies
            .iter()
            .any(|reply| matches!(reply, Reply::Identity(_))),
        "{replies:?}"
    );
}

/// Everything that a board says are whole packets.
fn check(sent: &[u8]) {
    let mut receiver = Receiver::<MAX_REPLY_LEN>::new();
    for &byte in sent {
        if let Some(reply) = receiver.push::<Reply>(byte) {
            reply.expect("an intact reply");
        }
    }
}

impl Board {
    /// Sends bytes to the host's wire, and gives what comes back.
    fn send(&mut self, bytes: &[u8]) -> Vec<u8> {
        for &byte in bytes {
            let _: Option<Result<Request<'_>, _>> = self.small.push(byte);
        }
        self.simulation
            .host
            .with(|wire| wire.to_board.extend(bytes));
        self.simulation.run(1);
        self.simulation.sent()
    }

    fn new() -> Self {
        let words = sample::row();
        let atlas = Atlas::parse(bytemuck::cast_slice(&words)).expect("valid");
        let bytes = bytemuck::cast_slice(&words);
        let mut flash = Simulation::flash();
        flash.put(0, &bytes[..atlas.total_len() as usize]);
        Self {
            simulation: Simulation::start(flash, Cause::PowerOn),
            small: Receiver::new(),
        }
    }
}

/// A frame whose sides and parts fit or nearly fit each other.
fn frame(input: &mut Input<'_>, board: &mut Board) -> Vec<u8> {
    let sequence = u32::from_le_bytes(input.array());
    let (width, height) = (input.byte() % 40, input.byte() % 40);
    let missing = usize::from(input.byte() % 2);
    let len = usize::from(width) * usize::from(height);
    let pixels = input.repeated(len.saturating_sub(missing));
    let (width, height) = (width.into(), height.into());
    let mut sent = board.send(&packet_of(&Request::Frame {
        sequence,
        width,
        height,
    }));
    for (bytes, offset) in pixels.chunks(PART_LEN).zip((0..).step_by(PART_LEN)) {
        sent.extend(board.send(&packet_of(&Request::Pixels { offset, bytes })));
    }
    sent
}

fn packet_of(message: &impl Serialize) -> Vec<u8> {
    let (mut scratch, mut packet) = ([0; MAX_PACKET_LEN], [0; MAX_PACKET_LEN]);
    encode(message, &mut scratch, &mut packet)
        .expect("fits")
        .to_vec()
}

impl Serialize for Raw<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // Without a length before it, unlike bytes.
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}
