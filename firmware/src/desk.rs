//! The host's desk: one request after the other, and what each is answered with.

use eigenmark_core::{
    atlas::Atlas,
    frame::FrameError,
    link::{
        AtlasIdentity, Identity, MAX_FRAME_LEN, PART_LEN, Rejection, Reply, Request, SlotState,
        Upload,
    },
    navigator::BoardNavigator,
    slots::{Progress, Setup, Slot, SlotError, Target, Writer},
};

use crate::{board::AtlasFlash, camera::FrameSize, faults::FaultLog, stack};

/// How long the camera's frames are not looked at after a host has sent part of one, in microseconds.
const SHOWN_FOR_US: u64 = 2_000_000;

/// What has been asked for so far.
#[derive(Debug, Default)]
pub struct Desk {
    incoming: Option<Incoming>,
    shown_until_us: u64,
    watch: Watch,
}

/// A frame that comes part by part.
#[derive(Clone, Copy, Debug)]
struct Incoming {
    sequence: u32,
    size: FrameSize,
    next: usize,
}

/// Who watches.
#[derive(Clone, Copy, Debug, Default)]
struct Watch {
    every: u16,
    pictures: u16,
    /// Frames since the last report, and reports since the last picture.
    frames: u16,
    reports: u16,
}

/// What requests are about.
#[derive(Debug)]
pub struct Access<'c, 'a, F> {
    /// What flies, if there is an atlas.
    pub navigator: Option<&'c mut BoardNavigator<'a>>,
    /// Room for a frame.
    pub pixels: &'c mut [u8; MAX_FRAME_LEN],
    /// What was written with the atlas.
    pub setup: Setup,
    /// What was in the slots at the start.
    pub slots: &'c mut [SlotState; 2],
    /// Where a new atlas may be written.
    pub target: &'c mut Result<Target, SlotError>,
    /// Writes it.
    pub writer: &'c mut Writer,
    /// Flash.
    pub flash: &'c mut F,
    /// What went wrong.
    pub faults: &'c mut FaultLog<'a>,
}

/// What the rest of the board has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Start anew.
    Restart,
    /// Do something wrong.
    Provoke(eigenmark_core::link::Provocation),
}

/// What a watcher is to be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// Nothing.
    Nothing,
    /// A report.
    Report,
    /// A report, and the frame.
    Picture,
}

impl Desk {
    /// Whether the room for a frame is a host's at present.
    #[must_use]
    pub fn is_shown(&self, now_us: u64) -> bool {
        now_us < self.shown_until_us
    }

    /// What is due after a frame.
    pub fn due(&mut self) -> Due {
        let watch = &mut self.watch;
        if !is_due(&mut watch.frames, watch.every) {
            return Due::Nothing;
        }
        if is_due(&mut watch.reports, watch.pictures) {
            Due::Picture
        } else {
            Due::Report
        }
    }

    /// Answers a request, if it has an answer yet.
    pub fn answer<F: AtlasFlash>(
        &mut self,
        request: Request<'_>,
        access: &mut Access<'_, '_, F>,
        now_us: u64,
    ) -> (Option<Reply>, Option<Wish>) {
        let reply = match request {
            Request::Identify => Reply::Identity(identity(access)),
            Request::Frame {
                sequence,
                width,
                height,
            } => return (self.begin_frame(sequence, width, height, now_us), None),
            Request::Pixels { offset, bytes } => {
                return (self.take_pixels(offset, bytes, access, now_us), None);
            }
            Request::Upload(upload) => match write(upload, access) {
                Ok(Some(reply)) => reply,
                Ok(None) => return (None, None),
                Err(error) => rejected(Rejection::Slot(error)),
            },
            Request::Slots => Reply::Slots(*access.slots),
            Request::Go(goals) => match access
                .navigator
                .as_mut()
                .map(|navigator| navigator.go(&goals))
            {
                Some(Ok(())) => Reply::Done,
                Some(Err(error)) => rejected(Rejection::Route(error)),
                None => rejected(Rejection::NoAtlas),
            },
            Request::Watch { every, pictures } => {
                self.watch = Watch {
                    every,
                    pictures,
                    ..Watch::default()
                };
                Reply::Done
            }
            Request::Faults => Reply::Faults(*access.faults.faults()),
            Request::ForgetFaults => {
                let faults = *access.faults.faults();
                access.faults.forget();
                Reply::Faults(faults)
            }
            Request::Restart => return (Some(Reply::Done), Some(Wish::Restart)),
            Request::Provoke(what) => return (None, Some(Wish::Provoke(what))),
        };
        (Some(reply), None)
    }

    fn begin_frame(
        &mut self,
        sequence: u32,
        width: u16,
        height: u16,
        now_us: u64,
    ) -> Option<Reply> {
        let len = usize::from(width) * usize::from(height);
        if len > MAX_FRAME_LEN {
            let room = MAX_FRAME_LEN as u32;
            return Some(rejected_frame(sequence, Rejection::TooLarge { room }));
        }
        let Some(size) = FrameSize::new(width, height) else {
            let error = FrameError::Size { width, height };
            return Some(rejected_frame(sequence, Rejection::Frame(error)));
        };
        self.shown_until_us = now_us + SHOWN_FOR_US;
        self.incoming = Some(Incoming {
            sequence,
            size,
            next: 0,
        });
        None
    }

    fn take_pixels<F>(
        &mut self,
        offset: u32,
        bytes: &[u8],
        access: &mut Access<'_, '_, F>,
        now_us: u64,
    ) -> Option<Reply> {
        let Some(incoming) = &mut self.incoming else {
            return Some(rejected(Rejection::Gap { expected: 0 }));
        };
        let Incoming {
            sequence,
            size,
            next,
        } = *incoming;
        let len = size.len();
        let end = next.saturating_add(bytes.len());
        let room = access.pixels.get_mut(next..end);
        let Some(room) =
            room.filter(|_| offset as usize == next && end <= len && bytes.len() <= PART_LEN)
        else {
            let expected = next as u32;
            return Some(rejected_frame(sequence, Rejection::Gap { expected }));
        };
        for (place, &byte) in room.iter_mut().zip(bytes) {
            *place = byte;
        }
        incoming.next = end;
        self.shown_until_us = now_us + SHOWN_FOR_US;
        if end < len {
            return None;
        }
        self.incoming = None;
        let Some(navigator) = &mut access.navigator else {
            return Some(rejected_frame(sequence, Rejection::NoAtlas));
        };
        Some(match size.frame(access.pixels.as_slice()) {
            Ok(frame) => Reply::Fix {
                sequence,
                fix: navigator.locate_alone(&frame),
            },
            Err(error) => rejected_frame(sequence, Rejection::Frame(error)),
        })
    }
}

/// Counts to `every`, and says whether that was reached; never for 0.
fn is_due(count: &mut u16, every: u16) -> bool {
    *count = count.saturating_add(1);
    let is_due = every > 0 && *count >= every;
    if is_due {
        *count = 0;
    }
    is_due
}

fn identity<F>(access: &Access<'_, '_, F>) -> Identity {
    let atlas: Option<&Atlas<'_>> = access.navigator.as_ref().map(|navigator| navigator.atlas());
    Identity {
        firmware: VERSION,
        atlas: atlas.map(AtlasIdentity::of),
        setup: access.setup,
        stack_bytes: stack::high_water_mark() as u32,
    }
}

/// The firmware's version.
const VERSION: [u8; 3] = [
    number(env!("CARGO_PKG_VERSION_MAJOR")),
    number(env!("CARGO_PKG_VERSION_MINOR")),
    number(env!("CARGO_PKG_VERSION_PATCH")),
];

const fn number(digits: &str) -> u8 {
    match u8::from_str_radix(digits, 10) {
        Ok(number) => number,
        Err(_) => panic!("a version number is 0 to 255"),
    }
}

fn write<F: AtlasFlash>(
    upload: Upload<'_>,
    access: &mut Access<'_, '_, F>,
) -> Result<Option<Reply>, SlotError> {
    let writer = &mut *access.writer;
    let next = match upload {
        // While the slot is erased there is no answer yet.
        Upload::Begin { len, crc, setup } => {
            match writer.begin((*access.target)?, len, crc, setup)? {
                Progress::Erasing => return Ok(None),
                Progress::Writing { next } => next,
            }
        }
        Upload::Chunk { offset, bytes } => writer.chunk(access.flash, offset, bytes)?,
        Upload::Finish => {
            let target = (*access.target)?;
            let slot = target.slot();
            let record = writer.finish(access.flash, |flash| flash.mapped(slot))?;
            if let Some(state) = access.slots.get_mut(slot as usize) {
                *state = SlotState {
                    sequence: Some(record.sequence),
                    atlas: Ok(AtlasIdentity::of_head(&writer.head(access.flash)?)),
                    is_flown: false,
                };
            }
            let mut slots = Slot::BOTH.into_iter().zip(access.slots.iter());
            let flown = slots.find(|(_, state)| state.is_flown);
            *access.target = Ok(target.after_writing(flown.map(|(slot, _)| slot)));
            return Ok(Some(Reply::Slots(*access.slots)));
        }
        Upload::Abandon => {
            writer.abandon();
            return Ok(Some(Reply::Done));
        }
    };
    Ok(Some(Reply::Upload { next }))
}

fn rejected(reason: Rejection) -> Reply {
    Reply::Rejected {
        sequence: None,
        reason,
    }
}

fn rejected_frame(sequence: u32, reason: Rejection) -> Reply {
    Reply::Rejected {
        sequence: Some(sequence),
        reason,
    }
}
