//! A camera that is a file: whoever runs the emulator puts one frame after the other into it.
//!
//! ```text
//! 0 number u32   4 zero u32   8 time u64, µs   16 width u16   18 height u16   20 luminance   after it: number u32
//! ```
//! Numbers are little-endian. A frame is there when its number changes; one whose numbers differ is torn.

use super::file::File;
use crate::camera::{Camera, CameraError, FrameSize};

const HEADER_LEN: usize = 20;

/// The camera.
#[derive(Debug)]
pub struct FileCamera {
    file: Option<File>,
    last: u32,
    taken_us: Option<u64>,
}

/// What stands before the pixels.
struct Header {
    number: u32,
    time_us: u64,
    size: Option<FrameSize>,
}

impl FileCamera {
    pub const fn new() -> Self {
        Self {
            file: None,
            last: 0,
            taken_us: None,
        }
    }
}

impl Camera for FileCamera {
    fn begin(&mut self) -> Result<(), CameraError> {
        if self.file.is_none() {
            self.file = File::open(c"camera.bin");
        }
        let file = self.file.as_ref().ok_or(CameraError::Absent)?;
        match file.len() {
            None | Some(0) => Err(CameraError::Absent),
            Some(_) => Ok(()),
        }
    }

    fn take(&mut self, pixels: &mut [u8]) -> Result<Option<FrameSize>, CameraError> {
        let file = self.file.as_ref().ok_or(CameraError::Absent)?;
        let mut header = [0; HEADER_LEN];
        match file.read(0, &mut header) {
            HEADER_LEN => {}
            0 => return Err(CameraError::Absent),
            _ => return Err(CameraError::Torn),
        }
        let header = Header::of(&header).ok_or(CameraError::Torn)?;
        if header.number == self.last {
            return Ok(None);
        }
        self.last = header.number;
        let size = header.size.ok_or(CameraError::Torn)?;
        let len = size.len();
        let have = pixels.len() as u32;
        let pixels = pixels.get_mut(..len).ok_or(CameraError::Room {
            needed: len as u32,
            have,
        })?;
        let found = file.read(HEADER_LEN, pixels);
        if found != len {
            return Err(CameraError::Short {
                expected: len as u32,
                found: found as u32,
            });
        }
        let mut number = [0; 4];
        file.read(HEADER_LEN + len, &mut number);
        if u32::from_le_bytes(number) != header.number {
            return Err(CameraError::Torn);
        }
        self.taken_us = Some(header.time_us);
        Ok(Some(size))
    }

    fn recover(&mut self) {
        // Another file may have its name by now.
        self.file = None;
    }

    fn taken_us(&self) -> Option<u64> {
        self.taken_us
    }
}

impl Header {
    fn of(bytes: &[u8; HEADER_LEN]) -> Option<Self> {
        let (number, rest) = bytes.split_first_chunk()?;
        let (_, rest) = rest.split_first_chunk::<4>()?;
        let (time, rest) = rest.split_first_chunk()?;
        let (width, rest) = rest.split_first_chunk()?;
        let (height, _) = rest.split_first_chunk()?;
        Some(Self {
            number: u32::from_le_bytes(*number),
            time_us: u64::from_le_bytes(*time),
            size: FrameSize::new(u16::from_le_bytes(*width), u16::from_le_bytes(*height)),
        })
    }
}
