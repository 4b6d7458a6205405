//! A board at the other end of a TCP connection, with a link that can be as bad as asked for.

use std::{
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    thread::{self, JoinHandle},
    time::Duration,
};

use eigenmark_core::{
    link::{
        AtlasIdentity, Identity, MAX_REPLY_LEN, MAX_REQUEST_LEN, Receiver, Rejection, Reply,
        Request, SlotState, Upload, encode,
    },
    slots::{Setup, SlotError},
};

/// What goes wrong. Counts are of all that happened since the start, from 1; 0 is never.
#[derive(Clone, Copy, Debug, Default)]
pub struct Trouble {
    /// Every so many requests are lost.
    pub request_lost: u64,
    /// Every so many requests are answered as damaged.
    pub request_damaged: u64,
    /// Every so many replies are lost.
    pub reply_lost: u64,
    /// Noise comes before every so many replies, and damages them.
    pub noise: u64,
    /// Every so many replies come that much later.
    pub late: Option<(u64, Duration)>,
    /// An unasked [`Reply::Done`] comes before every reply.
    pub is_talkative: bool,
    /// After so many requests the board is started anew: what it was doing is forgotten, flash is not.
    pub restart: u64,
    /// After so many requests the connection ends.
    pub hang_up: u64,
    /// The board is gone before it answers that it starts anew.
    pub restart_lost: bool,
    /// The board does not start anew when it is asked to.
    pub refuses_restart: bool,
    /// The answer to every part, from this offset on.
    pub rejection: Option<(u32, Rejection)>,
}

/// A board's memory: it outlives connections.
#[derive(Clone, Debug)]
pub struct Flash {
    /// What is in the slot that is written.
    pub bytes: Vec<u8>,
    /// What was announced: length, CRC-32, setup.
    pub announced: Option<(u32, u32, Setup)>,
    /// What is in the slots.
    pub slots: [SlotState; 2],
    /// Requests that arrived.
    pub requests: u64,
}

impl Default for Flash {
    fn default() -> Self {
        let empty = SlotState {
            sequence: None,
            atlas: Err(SlotError::Empty),
            is_flown: false,
        };
        Self {
            bytes: Vec::new(),
            announced: None,
            slots: [empty; 2],
            requests: 0,
        }
    }
}

/// Serves one connection on a thread of its own. Gives the name of the link, and what is in flash at the end.
pub fn serve(flash: Flash, trouble: Trouble) -> (String, JoinHandle<Flash>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let name = format!("tcp:{}", listener.local_addr().expect("bound"));
    let board = thread::spawn(move || {
        let (stream, _) = listener.accept().expect("the test connects");
        let mut board = Board {
            stream,
            flash,
            trouble,
            replies: 0,
            has_begun: false,
        };
        board.run();
        board.flash
    });
    (name, board)
}

struct Board {
    stream: TcpStream,
    flash: Flash,
    trouble: Trouble,
    replies: u64,
    has_begun: bool,
}

/// Whether it is the turn of the event that happens `every` so many times.
fn is_turn(count: u64, every: u64) -> bool {
    every > 0 && count.is_multiple_of(every)
}

impl Board {
    fn run(&mut self) {
        let mut receiver = Box::new(Receiver::<MAX_REQUEST_LEN>::new());
        let mut buffer = [0; 256];
        loop {
            let len = match self.stream.read(&mut buffer) {
                Ok(0) | Err(_) => return,
                Ok(len) => len,
            };
            for &byte in &buffer[..len] {
                let Some(request) = receiver.push::<Request<'_>>(byte) else {
                    continue;
                };
                let count = self.flash.requests + 1;
                self.flash.requests = count;
                if count == self.trouble.hang_up {
                    return;
                }
                self.has_begun &= count != self.trouble.restart;
                if is_turn(count, self.trouble.request_lost) {
                    continue;
                }
                let is_gone = self.trouble.restart_lost && matches!(request, Ok(Request::Restart));
                let reply = match request {
                    Ok(_) if is_turn(count, self.trouble.request_damaged) => Err(damage()),
                    Ok(request) => self.answer(&request),
                    Err(damage) => Err(Rejection::Damaged(damage)),
                };
                let reply = reply.unwrap_or_else(|reason| Reply::Rejected {
                    sequence: None,
                    reason,
                });
                if !is_gone && self.say(&reply).is_err() {
                    return;
                }
            }
        }
    }

    fn answer(&mut self, request: &Request<'_>) -> Result<Reply, Rejection> {
        let Request::Upload(upload) = request else {
            return match request {
                Request::Slots => Ok(Reply::Slots(self.flash.slots)),
                Request::Identify => Ok(Reply::Identity(self.identity())),
                Request::Restart if !self.trouble.refuses_restart => {
                    self.restart();
                    Ok(Reply::Done)
                }
                _ => Err(Rejection::Refused),
            };
        };
        let flash = &mut self.flash;
        match *upload {
            Upload::Begin { len, crc, setup } => {
                if flash.announced != Some((len, crc, setup)) {
                    flash.bytes.clear();
                    flash.announced = Some((len, crc, setup));
                }
                self.has_begun = true;
            }
            _ if !self.has_begun => return Err(Rejection::Slot(SlotError::NotBegun)),
            Upload::Chunk { offset, bytes } => {
                if let Some((from, reason)) = self.trouble.rejection
                    && offset >= from
                {
                    return Err(reason);
                }
                let expected = flash.bytes.len() as u32;
                if offset != expected {
                    return Err(Rejection::Slot(SlotError::Gap { expected }));
                }
                flash.bytes.extend_from_slice(bytes);
            }
            Upload::Finish => {
                let (len, crc, _) = flash.announced.expect("has begun");
                let expected = flash.bytes.len() as u32;
                if expected != len {
                    return Err(Rejection::Gap { expected });
                }
                let atlas = AtlasIdentity {
                    crc,
                    map_crc: 0,
                    landmarks: 1,
                    view_side: 10,
                    dimensions: 5,
                };
                let newest = flash.slots.iter().filter_map(|slot| slot.sequence).max();
                let free = flash.slots.iter_mut().find(|slot| !slot.is_flown);
                *free.expect("only one is flown by") = SlotState {
                    sequence: Some(newest.map_or(1, |newest| newest + 1)),
                    atlas: Ok(atlas),
                    is_flown: false,
                };
                self.has_begun = false;
                return Ok(Reply::Slots(flash.slots));
            }
            Upload::Abandon => return Ok(Reply::Done),
        }
        Ok(Reply::Upload {
            next: self.flash.bytes.len() as u32,
        })
    }

    /// Flies by the newest atlas.
    fn restart(&mut self) {
        self.has_begun = false;
        let sequences = self
            .flash
            .slots
            .map(|slot| slot.atlas.ok().and(slot.sequence));
        let newest = sequences.into_iter().flatten().max();
        for (slot, sequence) in self.flash.slots.iter_mut().zip(sequences) {
            slot.is_flown = sequence.is_some() && sequence == newest;
        }
    }

    fn identity(&self) -> Identity {
        let flown = self.flash.slots.iter().find(|slot| slot.is_flown);
        Identity {
            firmware: [0; 3],
            atlas: flown.and_then(|slot| slot.atlas.ok()),
            setup: Setup::default(),
            stack_bytes: 0,
        }
    }

    fn say(&mut self, reply: &Reply) -> std::io::Result<()> {
        self.replies += 1;
        if is_turn(self.replies, self.trouble.reply_lost) {
            return Ok(());
        }
        if let Some((every, delay)) = self.trouble.late
            && is_turn(self.replies, every)
        {
            thread::sleep(delay);
        }
        if self.trouble.is_talkative {
            self.send(&Reply::Done)?;
        }
        if is_turn(self.replies, self.trouble.noise) {
            self.stream.write_all(&[0x55, 0x00, 0x03, 0xaa])?;
        }
        self.send(reply)
    }

    fn send(&mut self, reply: &Reply) -> std::io::Result<()> {
        let (mut scratch, mut packet) = ([0; MAX_REPLY_LEN], [0; MAX_REPLY_LEN]);
        self.stream
            .write_all(encode(reply, &mut scratch, &mut packet).expect("fits"))
    }
}

fn damage() -> Rejection {
    Rejection::Damaged(eigenmark_core::link::Damage::Crc)
}
