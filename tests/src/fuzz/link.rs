//! Bytes on the wire → requests → replies.

use std::cell::RefCell;

use eigenmark_core::{
    atlas::{Atlas, Blur, Contents, Header, Likelihood, Limits, Training, emit},
    eigenspace::{MeanRow, Normalize, Row, weight_index},
    landmark::{Lattice, Metric, Point, Record, Survey, Width},
    link::{Identity, MAX_REPLY_LEN, Receiver, Reply, Request, Responder, encode},
    localizer::Localizer,
};
use serde::{Serialize, Serializer, ser::SerializeTuple};

use super::input::Input;

/// A receiver so small that packets overflow it.
const SMALL: usize = 24;

/// Room for a packet with a frame of 39×39 pixels.
const MAX_PACKET_LEN: usize = 2048;

/// The board's side, which lives through all inputs: what was sent before must not matter.
struct Board {
    responder: Responder,
    localizer: Localizer<'static>,
    small: Receiver<SMALL>,
}

thread_local! {
    static BOARD: RefCell<Box<Board>> = RefCell::new(Box::new(Board::new()));
}

/// A message that is these bytes.
struct Raw<'a>(&'a [u8]);

/// Sends a responder what the input describes: bytes as they are, intact packets of arbitrary messages, frames. Every
/// reply decodes, and after all of it the responder still says who it is.
///
/// # Panics
/// When a promise is broken.
pub fn link(input: &[u8]) {
    BOARD.with_borrow_mut(|board| talk(board, Input(input)));
}

fn talk(board: &mut Board, mut input: Input<'_>) {
    let identity = Reply::Identity(Identity::of(board.localizer.atlas()));
    let mut last = None;
    let mut send = |bytes: &[u8]| {
        for &byte in bytes {
            let _: Option<Result<Request<'_>, _>> = board.small.push(byte);
            if let Some((reply, packet)) = board.responder.push(byte, &mut board.localizer) {
                assert_eq!(decoded(packet), reply);
                last = Some(reply);
            }
        }
    };
    send(&[0]);
    while !input.is_empty() {
        let (kind, len) = (input.byte(), usize::from(input.byte()));
        match kind % 4 {
            0 => send(input.bytes(len)),
            1 => send(&packet_of(&Raw(input.bytes(len)))),
            2 => send(&packet_of(&frame(&mut input, &mut Vec::new()))),
            _ => {
                // Damaged on the way.
                let mut packet = packet_of(&Raw(input.bytes(len)));
                let at = usize::from(input.byte()) % packet.len();
                packet[at] ^= input.byte();
                send(&packet);
            }
        }
    }
    send(&[0]);
    send(&packet_of(&Request::Identify));
    assert_eq!(last, Some(identity));
}

impl Board {
    fn new() -> Self {
        Self {
            responder: Responder::new(),
            localizer: Localizer::new(atlas(Box::leak(Box::new([0; 64])))),
            small: Receiver::new(),
        }
    }
}

/// A request whose sides and pixels fit or nearly fit each other.
fn frame<'p>(input: &mut Input<'_>, pixels: &'p mut Vec<u8>) -> Request<'p> {
    let sequence = u32::from_le_bytes(input.array());
    let (width, height) = (input.byte() % 40, input.byte() % 40);
    let missing = usize::from(input.byte() % 2);
    let len = usize::from(width) * usize::from(height);
    *pixels = input.repeated(len.saturating_sub(missing));
    Request::Locate {
        sequence,
        width: width.into(),
        height: height.into(),
        pixels,
    }
}

fn packet_of(message: &impl Serialize) -> Vec<u8> {
    let (mut scratch, mut packet) = ([0; MAX_PACKET_LEN], [0; MAX_PACKET_LEN]);
    encode(message, &mut scratch, &mut packet)
        .expect("fits")
        .to_vec()
}

fn decoded(packet: &[u8]) -> Reply {
    let mut receiver = Receiver::<MAX_REPLY_LEN>::new();
    let (end, bytes) = packet.split_last().expect("not empty");
    for &byte in bytes {
        assert_eq!(receiver.push::<Reply>(byte), None);
    }
    receiver
        .push(*end)
        .expect("a packet")
        .expect("an intact reply")
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

/// Two landmarks of one dimension, for views of 2×2 pixels.
fn atlas(words: &mut [u64; 64]) -> Atlas<'_> {
    let grid = Lattice {
        origin: Point {
            x_px: 100.0,
            y_px: 100.0,
        },
        stride_px: 200.0,
        columns: 2,
        rows: 1,
    };
    let header = Header {
        view_side: 2,
        dimensions: 1,
        landmarks: 2,
        width: Width::I16,
        thumbnail_side: 0,
        normalize: Normalize::None,
        metric: Metric::Nssd,
        step: 0.5,
        error: 1.5,
        limits: Limits {
            distance: 0.25,
            from_feature_space: 1024.0,
        },
        mean: MeanRow {
            base: 128.0,
            scale: 1.0,
            energy: 65536.0,
        },
        footprint_px: 200.0,
        map_px: (400, 200),
        survey: Survey::nominal([grid].into_iter().collect()),
        likelihood: Likelihood {
            sharpness: 8.0,
            ceiling: 0.5,
        },
        places: 0,
        legs: 0,
        training: Training {
            scale: 100.0,
            blur: Blur::Gauss1,
            highpass: 0.0,
            whiten: 0.0,
            covered_variance: 1.0,
            map_crc: 0,
        },
    };
    let mut weights = [0; 20];
    for (pixel, weight) in [1000, -2000, 3000, -4000].into_iter().enumerate() {
        weights[weight_index(2, 0, pixel)] = weight;
    }
    let contents = Contents {
        header: &header,
        weights: &weights,
        rows: &[Row {
            scale: 0.001,
            offset: -256.0,
            spread: 0.5,
        }],
        mean_weights: &[1, 2, -3, 0],
        coefficients: &[300, -200],
        records: &[2, 1].map(|view| Record { view, radius: 0.1 }),
        thumbnails: &[],
        places: &[],
        legs: &[],
    };
    emit(&contents, bytemuck::cast_slice_mut(words)).expect("valid")
}
