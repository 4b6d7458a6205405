//! A board that is not there, for tests on a host.

use std::{boxed::Box, collections::VecDeque, vec::Vec};

use core::{cell::RefCell, convert::Infallible};
use std::rc::Rc;

use eigenmark_core::{
    link::{
        Cause, MAX_FRAME_LEN, MAX_REPLY_LEN, MAX_REQUEST_LEN, PART_LEN, Provocation, Receiver,
        Reply, Request, encode,
    },
    navigator::BoardMemory,
    slots::{Region, SimulatedFlash, Slot, Writer},
};
use embedded_io::{ErrorType, Read, ReadReady, Write};

use crate::{
    board::{AtlasFlash, Lamp, Parts, Refused, System},
    camera::{Camera, CameraError, FrameSize},
    faults::{FaultLog, KEPT_LEN},
    flight::Flight,
};

/// A page of the simulated flash, and a slot of two.
const PAGE_LEN: usize = 1024;
const SLOT_LEN: usize = 2 * PAGE_LEN;

/// Flash of two small slots.
pub type Flash = SimulatedFlash<4, PAGE_LEN>;

/// What flies on it.
pub type SimulatedFlight =
    Flight<'static, Shared<SimulatedCamera>, Shared<Wire>, Shared<Wire>, Flash, Shared<Clock>>;

/// A part that a test holds, too.
#[derive(Debug, Default)]
pub struct Shared<T>(Rc<RefCell<T>>);

/// A wire, seen from the board.
#[derive(Debug, Default)]
pub struct Wire {
    /// What has arrived.
    pub to_board: VecDeque<u8>,
    /// What was sent.
    pub from_board: Vec<u8>,
}

/// Width, height and pixels of a frame.
pub type Picture = (u16, u16, Vec<u8>);

/// A camera that gives what it is told to, once.
#[derive(Debug, Default)]
pub struct SimulatedCamera {
    /// The next frame, or what becomes of it.
    pub next: Option<Result<Picture, CameraError>>,
    /// Nothing answers.
    pub is_unplugged: bool,
}

/// A clock that stands still until it is set.
#[derive(Debug, Default)]
pub struct Clock {
    /// Microseconds since the start.
    pub now_us: u64,
    /// How often the board wanted to start anew.
    pub restarts: u32,
    /// How often it said that it makes progress.
    pub fed: u32,
}

/// A board that flies, and what a test needs of it.
pub struct Simulation {
    /// What flies.
    pub flight: SimulatedFlight,
    /// The wire to the host.
    pub host: Shared<Wire>,
    /// The wire to the autopilot.
    pub autopilot: Shared<Wire>,
    /// The camera.
    pub camera: Shared<SimulatedCamera>,
    /// The clock.
    pub clock: Shared<Clock>,
    receiver: Receiver<MAX_REPLY_LEN>,
}

impl<T> Shared<T> {
    /// Looks at the part, or changes it.
    pub fn with<R>(&self, look: impl FnOnce(&mut T) -> R) -> R {
        look(&mut self.0.borrow_mut())
    }
}

impl<T> Clone for Shared<T> {
    fn clone(&self) -> Self {
        Self(Rc::clone(&self.0))
    }
}

impl Simulation {
    /// Erased flash.
    #[must_use]
    pub fn flash() -> Flash {
        Flash::new(2 * SLOT_LEN, false)
    }

    /// Switches a board on. What is in flash at that moment is leaked, as is its memory: on a board both are static.
    #[must_use]
    pub fn start(flash: Flash, cause: Cause) -> Self {
        let words: Vec<u64> = bytemuck::cast_slice(flash.bytes()).to_vec();
        let region = Region::read(
            bytemuck::cast_slice(Box::leak(words.into_boxed_slice())),
            SLOT_LEN,
        );
        let (host, autopilot) = (Shared::<Wire>::default(), Shared::<Wire>::default());
        let (camera, clock) = (
            Shared::<SimulatedCamera>::default(),
            Shared::<Clock>::default(),
        );
        let parts = Parts {
            camera: camera.clone(),
            host: host.clone(),
            autopilot: autopilot.clone(),
            flash,
            system: clock.clone(),
        };
        let writer = Writer::new(0, SLOT_LEN as u32);
        let memory = Box::leak(Box::new(BoardMemory::new()));
        let pixels = Box::leak(Box::new([0; MAX_FRAME_LEN]));
        let faults = FaultLog::begin(Box::leak(Box::new([0; KEPT_LEN])), cause);
        Self {
            flight: Flight::new(parts, &region, writer, memory, pixels, faults),
            host,
            autopilot,
            camera,
            clock,
            receiver: Receiver::new(),
        }
    }

    /// Lets so many milliseconds pass, a turn each.
    pub fn run(&mut self, ms: u32) {
        for _ in 0..ms {
            self.clock.with(|clock| clock.now_us += 1000);
            self.flight.turn();
        }
    }

    /// Sends a request.
    ///
    /// # Panics
    /// When it is larger than any request.
    pub fn send(&mut self, request: &Request<'_>) {
        let (mut scratch, mut packet) = ([0; MAX_REQUEST_LEN], [0; MAX_REQUEST_LEN]);
        let packet = encode(request, &mut scratch, &mut packet).expect("fits");
        self.host.with(|wire| wire.to_board.extend(packet));
    }

    /// What the board has told its host since it was asked last; what does not decode is left out.
    pub fn replies(&mut self) -> Vec<Reply> {
        let sent = self.sent();
        let replies = sent.iter().filter_map(|&byte| self.receiver.push(byte));
        replies.filter_map(Result::ok).collect()
    }

    /// The bytes that the board has sent to its host since it was asked last.
    #[must_use]
    pub fn sent(&self) -> Vec<u8> {
        self.host.with(|wire| core::mem::take(&mut wire.from_board))
    }

    /// Sends a request and gives what comes within 50 ms.
    pub fn ask(&mut self, request: &Request<'_>) -> Vec<Reply> {
        self.replies();
        self.send(request);
        self.run(50);
        self.replies()
    }

    /// Sends a frame to be located, part by part.
    pub fn locate(&mut self, sequence: u32, width: u16, height: u16, pixels: &[u8]) -> Vec<Reply> {
        self.replies();
        self.send(&Request::Frame {
            sequence,
            width,
            height,
        });
        for (bytes, offset) in pixels.chunks(PART_LEN).zip((0..).step_by(PART_LEN)) {
            self.send(&Request::Pixels { offset, bytes });
        }
        self.run(50);
        self.replies()
    }
}

impl ErrorType for Shared<Wire> {
    type Error = Infallible;
}

impl ReadReady for Shared<Wire> {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.with(|wire| !wire.to_board.is_empty()))
    }
}

impl Read for Shared<Wire> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        Ok(self.with(|wire| {
            let len = bytes.len().min(wire.to_board.len());
            for (place, byte) in bytes.iter_mut().zip(wire.to_board.drain(..len)) {
                *place = byte;
            }
            len
        }))
    }
}

impl Write for Shared<Wire> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.with(|wire| wire.from_board.extend(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl Camera for Shared<SimulatedCamera> {
    fn begin(&mut self) -> Result<(), CameraError> {
        self.with(|camera| {
            if camera.is_unplugged {
                Err(CameraError::Absent)
            } else {
                Ok(())
            }
        })
    }

    fn take(&mut self, pixels: &mut [u8]) -> Result<Option<FrameSize>, CameraError> {
        self.with(|camera| {
            if camera.is_unplugged {
                return Err(CameraError::Absent);
            }
            let Some(next) = camera.next.take() else {
                return Ok(None);
            };
            let (width, height, frame) = next?;
            let size = FrameSize::new(width, height).ok_or(CameraError::Torn)?;
            pixels[..size.len()].copy_from_slice(&frame);
            Ok(Some(size))
        })
    }

    fn recover(&mut self) {}
}

impl System for Shared<Clock> {
    fn now_us(&self) -> u64 {
        self.with(|clock| clock.now_us)
    }

    fn feed(&mut self) {
        self.with(|clock| clock.fed += 1);
    }

    fn rest(&mut self) {}

    fn show(&mut self, _: Lamp) {}

    fn restart(&mut self) {
        self.with(|clock| clock.restarts += 1);
    }

    fn provoke(&mut self, _: Provocation) -> Result<(), Refused> {
        Err(Refused)
    }
}

impl AtlasFlash for Flash {
    fn mapped(&self, slot: Slot) -> Option<&[u8]> {
        let slots = self.bytes().split_at_checked(SLOT_LEN)?;
        Some(match slot {
            Slot::A => slots.0,
            Slot::B => slots.1,
        })
    }
}
