//! Frames from parts.

use eigenmark_core::{frame::Frame, link::Reply};

use crate::simulate::CameraFrame;

/// Pixels of a picture that is collected, at most.
const MAX_LEN: usize = 320 * 240;

/// A frame that came whole.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Number of the report that it belongs to.
    pub sequence: u32,
    /// Its pixels: of a size that the core takes.
    pub frame: CameraFrame,
}

/// Collects the parts of one picture at a time.
#[derive(Clone, Debug, Default)]
pub(super) struct Album {
    begun: Option<Picture>,
    /// Pictures that did not come whole.
    broken: u64,
}

impl Album {
    /// Takes a part; gives the picture with its last one. A part that does not follow the one before breaks the picture.
    pub(super) fn take(&mut self, reply: &Reply) -> Option<Picture> {
        let Reply::Picture {
            sequence,
            width,
            height,
            offset,
            bytes,
        } = reply
        else {
            return None;
        };
        let goes_on = self.begun.as_ref().is_some_and(|begun| {
            let frame = &begun.frame;
            (begun.sequence, frame.width, frame.height) == (*sequence, *width, *height)
                && frame.pixels.len() == *offset as usize
        });
        if !goes_on {
            self.broken += u64::from(self.begun.take().is_some());
            if *offset != 0 {
                return None;
            }
            self.begun = Some(Picture {
                sequence: *sequence,
                frame: CameraFrame {
                    pixels: Vec::new(),
                    width: *width,
                    height: *height,
                },
            });
        }
        let frame = &mut self.begun.as_mut()?.frame;
        frame.pixels.extend_from_slice(bytes);
        let len = usize::from(*width) * usize::from(*height);
        if frame.pixels.len() < len && len <= MAX_LEN {
            return None;
        }
        let whole = self.begun.take()?;
        let CameraFrame {
            pixels,
            width,
            height,
        } = &whole.frame;
        let is_frame = Frame::new(pixels, *width, *height, usize::from(*width)).is_ok();
        if pixels.len() == len && is_frame {
            return Some(whole);
        }
        self.broken += 1;
        None
    }

    /// Pictures that did not come whole, or are none.
    pub(super) fn broken(&self) -> u64 {
        self.broken
    }
}
