//! An atlas goes to a board, part by part.

use std::time::{Duration, Instant};

use eigenmark_core::{
    link::{PART_LEN, Rejection, Reply, Request, SlotState, Upload},
    slots::{Setup, SlotError},
};

use super::{BoardLink, LinkError, words};
use crate::{atlas::AtlasBuffer, output::Progress};

/// How long a board may take for its answers.
#[derive(Clone, Copy, Debug)]
struct Patience {
    /// To a question that costs nothing.
    asking: Duration,
    /// Until the slot is erased.
    erasing: Duration,
    /// Until a part is written, read back and acknowledged.
    writing: Duration,
    /// Until the whole atlas is checked.
    checking: Duration,
}

/// Three sectors of an STM32F405 take up to 4 s each to be erased; the rest is many times what it takes.
const PATIENCE: Patience = Patience {
    asking: Duration::from_secs(1),
    erasing: Duration::from_secs(15),
    writing: Duration::from_secs(1),
    checking: Duration::from_secs(10),
};

/// How often the same step is tried before it is given up.
const TRIES: u32 = 10;

/// An upload that succeeded.
#[derive(Clone, Debug, PartialEq)]
pub struct Uploaded {
    /// The slot that holds the atlas now: 0 or 1.
    pub slot: usize,
    /// Its number in the order of writing.
    pub sequence: u32,
    /// Bytes that the board had from an interrupted upload of the same atlas.
    pub resumed_at: u32,
    /// Parts that were sent more than once.
    pub repeated: u64,
}

/// Why an upload failed. What was flown by is as it was.
#[derive(Debug, thiserror::Error)]
pub enum UploadError {
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The board does not take the atlas.
    #[error(
        "{name}: the board does not take the atlas: {}",
        words::rejection(reason)
    )]
    Rejected {
        /// The link.
        name: String,
        /// Why.
        reason: Rejection,
    },
    /// One step was tried again and again.
    #[error(
        "{name}: the upload does not get past byte {offset} of {len}: tried {TRIES} times; the same command goes on there"
    )]
    Stuck {
        /// The link.
        name: String,
        /// Bytes that the board has.
        offset: u32,
        /// Bytes of the atlas.
        len: u32,
    },
    /// The board says that it is done, and does not hold the atlas.
    #[error("{name}: the board ended the upload, but no slot holds the atlas with CRC {crc:08x}")]
    Missing {
        /// The link.
        name: String,
        /// CRC-32 of the atlas.
        crc: u32,
    },
}

/// Brings `atlas` and `setup` into the slot that the board does not fly by, and has it checked there. The board flies by
/// it after its next start.
///
/// Parts that are not acknowledged in time are sent again, those that the board misses too; an upload of the same atlas
/// that was interrupted goes on where it was.
///
/// # Errors
/// When the link fails, the board refuses, or it stops to get on.
pub fn upload(
    link: &mut BoardLink,
    atlas: &AtlasBuffer,
    setup: &Setup,
    progress: &Progress,
) -> Result<Uploaded, UploadError> {
    let atlas_bytes = atlas.bytes();
    let transfer = Transfer {
        link,
        bytes: atlas_bytes,
        len: atlas_bytes.len() as u32,
        crc: atlas.atlas().crc(),
        setup: *setup,
        patience: PATIENCE,
        tries: 0,
        repeated: 0,
    };
    transfer.run(progress)
}

/// What became of a part, or of the end.
enum Step {
    /// The next part begins there.
    At(u32),
    /// The board knows of no upload: it was started anew.
    NotBegun,
    /// The atlas was checked, and is in a slot.
    Finished([SlotState; 2]),
}

struct Transfer<'a> {
    link: &'a mut BoardLink,
    bytes: &'a [u8],
    len: u32,
    crc: u32,
    setup: Setup,
    patience: Patience,
    /// How often the step at hand was tried.
    tries: u32,
    repeated: u64,
}

impl Transfer<'_> {
    fn run(mut self, progress: &Progress) -> Result<Uploaded, UploadError> {
        let newest_before = newest(&self.slots()?);
        let resumed_at = {
            let _step = progress.step("erasing the slot");
            self.begin()?
        };
        let bar = progress.bar("uploading", u64::from(self.len - resumed_at));
        let (mut next, mut farthest) = (resumed_at, resumed_at);
        // How often it went back, be it that the board was started anew, since it got farther than ever.
        let mut setbacks = 0;
        let slots = loop {
            let step = if next < self.len {
                self.chunk(next)?
            } else {
                self.finish()?
            };
            let to = match step {
                Step::Finished(slots) => break slots,
                Step::At(offset) => offset,
                Step::NotBegun => self.begin()?,
            };
            if to > farthest {
                bar.inc(u64::from(to - farthest));
                (farthest, setbacks) = (to, 0);
            } else if to <= next {
                setbacks += 1;
            }
            if setbacks > TRIES {
                return Err(self.stuck(to));
            }
            next = to;
        };
        let held = slots.iter().enumerate().filter_map(|(slot, state)| {
            let is_it = state.atlas.is_ok_and(|atlas| atlas.crc == self.crc);
            state
                .sequence
                .filter(|_| is_it)
                .map(|sequence| (sequence, slot))
        });
        match held.max() {
            Some((sequence, slot)) if Some(sequence) > newest_before => Ok(Uploaded {
                slot,
                sequence,
                resumed_at,
                repeated: self.repeated,
            }),
            _ => Err(UploadError::Missing {
                name: self.link.name().to_owned(),
                crc: self.crc,
            }),
        }
    }

    /// What is in the slots.
    fn slots(&mut self) -> Result<[SlotState; 2], UploadError> {
        let is_answer = |reply: &Reply| matches!(reply, Reply::Slots(_));
        match self
            .link
            .ask(&Request::Slots, self.patience.asking, is_answer)?
        {
            Reply::Slots(slots) => Ok(slots),
            _ => Err(self.stuck(0)),
        }
    }

    /// Announces the atlas; gives where to go on.
    fn begin(&mut self) -> Result<u32, UploadError> {
        let begin = Request::Upload(Upload::Begin {
            len: self.len,
            crc: self.crc,
            setup: self.setup,
        });
        let is_answer =
            |reply: &Reply| matches!(reply, Reply::Upload { .. } | Reply::Rejected { .. });
        self.tries = 0;
        loop {
            match self.link.ask(&begin, self.patience.erasing, is_answer)? {
                Reply::Upload { next } if next <= self.len => return Ok(next),
                Reply::Rejected { reason, .. } if !is_damaged(&reason) => {
                    return Err(self.rejected(reason));
                }
                _ => self.try_again(0)?,
            }
        }
    }

    /// Sends the part at `offset`, and waits until the board says where it goes on.
    fn chunk(&mut self, offset: u32) -> Result<Step, UploadError> {
        let rest = self.bytes.get(offset as usize..).unwrap_or_default();
        let bytes = rest.get(..PART_LEN).unwrap_or(rest);
        self.tries = 0;
        loop {
            self.link
                .send(&Request::Upload(Upload::Chunk { offset, bytes }))?;
            if let Some(step) = self.answer(offset)? {
                return Ok(step);
            }
            self.repeated += 1;
            self.try_again(offset)?;
        }
    }

    /// What the board says of the part at `offset`; none when it should be sent again.
    ///
    /// Late answers to earlier parts say where this one begins: they are passed over, or every part that was sent twice
    /// would be followed by another that is.
    fn answer(&mut self, offset: u32) -> Result<Option<Step>, UploadError> {
        let deadline = Instant::now() + self.patience.writing;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let next = match self.link.receive(left)? {
                None => return Ok(None),
                Some(Reply::Upload { next }) => next,
                Some(Reply::Rejected { reason, .. }) => match reason {
                    Rejection::Damaged(_) => return Ok(None),
                    Rejection::Slot(SlotError::NotBegun) => return Ok(Some(Step::NotBegun)),
                    reason => missing_from(&reason).ok_or_else(|| self.rejected(reason))?,
                },
                Some(_) => offset,
            };
            if next != offset && next <= self.len {
                return Ok(Some(Step::At(next)));
            }
            if left.is_zero() {
                return Ok(None);
            }
        }
    }

    /// Has the whole atlas checked.
    fn finish(&mut self) -> Result<Step, UploadError> {
        let is_answer = |reply: &Reply| matches!(reply, Reply::Slots(_) | Reply::Rejected { .. });
        self.tries = 0;
        loop {
            let finish = Request::Upload(Upload::Finish);
            match self.link.ask(&finish, self.patience.checking, is_answer)? {
                Reply::Slots(slots) => return Ok(Step::Finished(slots)),
                Reply::Rejected { reason, .. } => match reason {
                    // It may have been finished, and the answer lost.
                    Rejection::Slot(SlotError::NotBegun) => {
                        return Ok(Step::Finished(self.slots()?));
                    }
                    reason if is_damaged(&reason) => {}
                    reason => match missing_from(&reason) {
                        Some(offset) if offset < self.len => return Ok(Step::At(offset)),
                        // The last part came twice, and that is said of the second.
                        Some(_) => {}
                        None => return Err(self.rejected(reason)),
                    },
                },
                _ => {}
            }
            self.try_again(self.len)?;
        }
    }

    fn try_again(&mut self, offset: u32) -> Result<(), UploadError> {
        self.tries += 1;
        if self.tries < TRIES {
            Ok(())
        } else {
            Err(self.stuck(offset))
        }
    }

    fn stuck(&self, offset: u32) -> UploadError {
        UploadError::Stuck {
            name: self.link.name().to_owned(),
            offset,
            len: self.len,
        }
    }

    fn rejected(&self, reason: Rejection) -> UploadError {
        UploadError::Rejected {
            name: self.link.name().to_owned(),
            reason,
        }
    }
}

/// The largest number in the order of writing.
fn newest(slots: &[SlotState; 2]) -> Option<u32> {
    slots.iter().filter_map(|state| state.sequence).max()
}

fn is_damaged(reason: &Rejection) -> bool {
    matches!(reason, Rejection::Damaged(_))
}

/// Where the part that the board misses begins.
fn missing_from(reason: &Rejection) -> Option<u32> {
    match reason {
        Rejection::Gap { expected } | Rejection::Slot(SlotError::Gap { expected }) => {
            Some(*expected)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests;
