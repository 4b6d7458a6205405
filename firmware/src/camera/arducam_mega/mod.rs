//! Arducam Mega: a camera with its own frame memory behind SPI, to be bought with 3 or 5 megapixels.
//!
//! # Wiring
//! VCC to the supply that the microcontroller's pins have: Arducam's own examples put it on 3.3 V beside an STM32F103
//! and on 5 V beside an Arduino Uno. SCK, MISO, MOSI and a chip select that is low for the whole of a command. SPI
//! mode 0, most significant bit first, at 8 MHz (recommended in Arducam's application note for the series, September
//! 2023; no maximum is given). Six wires in all; no reset and no interrupt.
//!
//! # Protocol
//! From the same note, and from what Arducam's C library (MIT) does, in our words:
//! - Write a register: its number with bit 7 set, the value. Read one: its number, a byte to wait, the value.
//! - 0x40 says which sensor it is: 0x81 and 0x83 with 5 megapixels, 0x82 and 0x84 with 3.
//! - 0x07 ← 0x40 resets; 0x20 takes the format (2 RGB565, 3 YUV), 0x21 the resolution (1: 320×240, 10: 96×96,
//!   11: 128×128). Each takes a while: then the two low bits of 0x44 are not 2.
//! - 0x04 ← 1 clears what was captured, 0x04 ← 2 captures one frame; bit 2 of 0x44 is set when it lies in memory.
//! - 0x45, 0x46 and 0x47 are its length in bytes, the lowest byte first. For these formats that is two per pixel.
//! - 0x3C reads on from where the last command stopped; the first one after a capture waits a byte first.
//!
//! YUV comes as luminance first (YUYV, as Zephyr's driver, which is Arducam's, declares it), RGB565 with the high byte
//! first (Arducam's note on the format; Zephyr's driver declares the opposite, so both are here). YUV is what to
//! take: it depends on no such order, and the sensor's luminance has 8 bits.
//!
//! # Cost
//! A frame of 128×128 is 32,768 bytes: 33 ms of SPI at 8 MHz, in portions of 1,024 bytes, so that it takes 32 calls of
//! [`take`](Camera::take) beside those that wait, each of about 1 ms. 64 bytes of buffer, on the stack.
//!
//! # Limits
//! Bytes from SPI carry no checksum. A frame counts only when the camera says, before it is read, that it has the right
//! length and, after it was read, that it still is the same camera holding a captured frame: so one that was
//! unplugged, or lost power, meanwhile is torn. A bit that flips on the wire is not noticed.

// The crate `arducam-mega` (0.4.0) was written for a preview of embedded-hal 1.0 and does not compile with 1.0; it also
// waits in loops without end.

use embedded_hal::spi::{Operation, SpiDevice};

use super::{
    Camera, CameraError, FrameSize,
    luminance::{BYTES_PER_PIXEL, Extractor, PixelFormat},
};

/// Added to the number of a register that is written.
const WRITE: u8 = 0x80;

const MEMORY: u8 = 0x04;
const CLEAR: u8 = 0x01;
const CAPTURE: u8 = 0x02;

const CONTROL: u8 = 0x07;
const RESET: u8 = 0x40;

const FORMAT: u8 = 0x20;
const RESOLUTION: u8 = 0x21;

const SENSOR: u8 = 0x40;
const SENSORS: core::ops::RangeInclusive<u8> = 0x81..=0x84;

const STATE: u8 = 0x44;
const BUSY_MASK: u8 = 0x03;
const IDLE: u8 = 0x02;
const CAPTURED: u8 = 0x04;

/// Three registers, the lowest byte first.
const LENGTH: [u8; 3] = [0x45, 0x46, 0x47];
/// What a line that nothing drives looks like.
const ALL_ONES: u32 = 0xFF_FFFF;

const READ_ON: u8 = 0x3C;

/// Bytes that are read at once.
const PIECE_LEN: usize = 64;

/// Pieces that one call of [`take`](Camera::take) reads: 1,024 bytes, 1 ms at 8 MHz.
const PORTION_PIECES: usize = 16;

/// How the camera sends pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Encoding {
    /// YUYV.
    Yuv,
    /// RGB565, the high byte first.
    Rgb565,
    /// RGB565, the low byte first.
    Rgb565LowFirst,
}

/// The camera's resolutions that are frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Resolution {
    /// 96×96 pixels.
    Square96,
    /// 128×128 pixels: the largest that the reference board has room for.
    Square128,
    /// 320×240 pixels.
    Qvga,
}

/// An Arducam Mega on an SPI device.
#[derive(Debug)]
pub struct ArducamMega<S> {
    spi: S,
    encoding: Encoding,
    resolution: Resolution,
    state: State,
}

/// ```text
///    begin: who are you? reset                          ┌── begin ── Ready ◀─┐
/// Unknown ─────▶ Resetting ▶ TakingFormat ▶ TakingResolution ▶ Capturing ▶ Reading
///    ▲                                                             │          │
///    └─── recover, the bus fails, nobody answers ──────────────────┴──────────┘
/// ```
#[derive(Clone, Copy, Debug)]
enum State {
    /// Nothing is known.
    Unknown,
    /// Reset was written; the format is next.
    Resetting,
    /// The format was written; the resolution is next.
    TakingFormat,
    /// The resolution was written.
    TakingResolution,
    /// It is set up, and does nothing.
    Ready,
    /// It was told to capture.
    Capturing,
    /// It has captured, and is being read.
    Reading {
        extractor: Extractor,
        /// Bytes read.
        bytes: usize,
        /// Pixels put to the buffer.
        pixels: usize,
    },
}

impl Encoding {
    fn register(self) -> u8 {
        match self {
            Self::Rgb565 | Self::Rgb565LowFirst => 2,
            Self::Yuv => 3,
        }
    }

    fn pixel_format(self) -> PixelFormat {
        match self {
            Self::Yuv => PixelFormat::Yuyv,
            Self::Rgb565 => PixelFormat::Rgb565HighFirst,
            Self::Rgb565LowFirst => PixelFormat::Rgb565LowFirst,
        }
    }
}

impl Resolution {
    /// Width and height.
    #[must_use]
    pub const fn size(self) -> FrameSize {
        const fn accepted(width: u16, height: u16) -> FrameSize {
            match FrameSize::new(width, height) {
                Some(size) => size,
                None => panic!("the localizer does not accept it"),
            }
        }
        match self {
            Self::Square96 => const { accepted(96, 96) },
            Self::Square128 => const { accepted(128, 128) },
            Self::Qvga => const { accepted(320, 240) },
        }
    }

    fn register(self) -> u8 {
        match self {
            Self::Qvga => 1,
            Self::Square96 => 10,
            Self::Square128 => 11,
        }
    }

    /// Bytes of a frame.
    fn len(self) -> usize {
        self.size().len() * BYTES_PER_PIXEL
    }
}

impl<S: SpiDevice> ArducamMega<S> {
    /// A camera of which nothing is known yet: the first [`begin`](Camera::begin) looks for it.
    pub const fn new(spi: S, encoding: Encoding, resolution: Resolution) -> Self {
        Self {
            spi,
            encoding,
            resolution,
            state: State::Unknown,
        }
    }

    /// Forgets everything when the bus failed or nobody answered.
    fn keep<T>(&mut self, result: Result<T, CameraError>) -> Result<T, CameraError> {
        if let Err(CameraError::Bus | CameraError::Absent) = result {
            self.state = State::Unknown;
        }
        result
    }

    fn ask(&mut self) -> Result<(), CameraError> {
        match self.state {
            State::Unknown => {
                self.identify()?;
                self.write(CONTROL, RESET)?;
                self.state = State::Resetting;
                Ok(())
            }
            State::Resetting | State::TakingFormat | State::TakingResolution => Ok(()),
            State::Ready | State::Capturing | State::Reading { .. } => self.capture(),
        }
    }

    fn advance(&mut self, pixels: &mut [u8]) -> Result<Option<FrameSize>, CameraError> {
        match self.state {
            State::Unknown | State::Ready => {}
            State::Resetting => {
                self.set(FORMAT, self.encoding.register(), State::TakingFormat)?;
            }
            State::TakingFormat => {
                let resolution = self.resolution.register();
                self.set(RESOLUTION, resolution, State::TakingResolution)?;
            }
            State::TakingResolution => {
                if self.is_idle()? {
                    self.capture()?;
                }
            }
            State::Capturing => {
                if self.read(STATE)? & CAPTURED != 0 {
                    self.state = State::Ready;
                    self.check_length()?;
                    self.state = State::Reading {
                        extractor: Extractor::new(self.encoding.pixel_format()),
                        bytes: 0,
                        pixels: 0,
                    };
                }
            }
            State::Reading {
                extractor,
                bytes,
                pixels: at,
            } => return self.read_on(extractor, bytes, at, pixels),
        }
        Ok(None)
    }

    /// Writes the next setting and goes on to `next`, when the one before has been taken.
    fn set(&mut self, register: u8, value: u8, next: State) -> Result<(), CameraError> {
        if self.is_idle()? {
            self.write(register, value)?;
            self.state = next;
        }
        Ok(())
    }

    fn capture(&mut self) -> Result<(), CameraError> {
        self.write(MEMORY, CLEAR)?;
        self.write(MEMORY, CAPTURE)?;
        self.state = State::Capturing;
        Ok(())
    }

    fn check_length(&mut self) -> Result<(), CameraError> {
        let mut bytes = [0; 4];
        for (byte, register) in bytes.iter_mut().zip(LENGTH) {
            *byte = self.read(register)?;
        }
        let (found, expected) = (u32::from_le_bytes(bytes), self.resolution.len() as u32);
        match found {
            0 | ALL_ONES => Err(CameraError::Absent),
            _ if found < expected => Err(CameraError::Short { expected, found }),
            _ if found > expected => Err(CameraError::Torn),
            _ => Ok(()),
        }
    }

    /// Reads a portion; at the end, checks that it was of one frame.
    fn read_on(
        &mut self,
        mut extractor: Extractor,
        mut bytes: usize,
        mut at: usize,
        pixels: &mut [u8],
    ) -> Result<Option<FrameSize>, CameraError> {
        let (size, len) = (self.resolution.size(), self.resolution.len());
        self.state = State::Ready;
        let pixels = size.room(pixels)?;
        let mut buffer = [0; PIECE_LEN];
        for _ in 0..PORTION_PIECES {
            let piece_len = len.saturating_sub(bytes).min(PIECE_LEN);
            let Some(piece @ [_, ..]) = buffer.get_mut(..piece_len) else {
                break;
            };
            let command: &[u8] = if bytes == 0 {
                &[READ_ON, 0]
            } else {
                &[READ_ON]
            };
            self.spi
                .transaction(&mut [Operation::Write(command), Operation::Read(piece)])
                .map_err(|_| CameraError::Bus)?;
            bytes += piece_len;
            at += extractor.extract(piece, pixels.get_mut(at..).unwrap_or_default());
        }
        if bytes < len {
            self.state = State::Reading {
                extractor,
                bytes,
                pixels: at,
            };
            return Ok(None);
        }
        let is_captured = self.read(STATE)? & CAPTURED != 0;
        if !is_captured || self.identify().is_err() {
            // Not the camera, or the capture, of the beginning: nothing is known of its settings either.
            self.state = State::Unknown;
            return Err(CameraError::Torn);
        }
        Ok(Some(size))
    }

    fn identify(&mut self) -> Result<(), CameraError> {
        let sensor = self.read(SENSOR)?;
        SENSORS
            .contains(&sensor)
            .then_some(())
            .ok_or(CameraError::Absent)
    }

    fn is_idle(&mut self) -> Result<bool, CameraError> {
        Ok(self.read(STATE)? & BUSY_MASK == IDLE)
    }

    fn read(&mut self, register: u8) -> Result<u8, CameraError> {
        let mut bytes = [register, 0, 0];
        self.spi
            .transfer_in_place(&mut bytes)
            .map_err(|_| CameraError::Bus)?;
        Ok(bytes[2])
    }

    fn write(&mut self, register: u8, value: u8) -> Result<(), CameraError> {
        self.spi
            .write(&[register | WRITE, value])
            .map_err(|_| CameraError::Bus)
    }
}

impl<S: SpiDevice> Camera for ArducamMega<S> {
    fn begin(&mut self) -> Result<(), CameraError> {
        let asked = self.ask();
        self.keep(asked)
    }

    fn take(&mut self, pixels: &mut [u8]) -> Result<Option<FrameSize>, CameraError> {
        let taken = self.advance(pixels);
        self.keep(taken)
    }

    fn recover(&mut self) {
        self.state = State::Unknown;
    }
}

#[cfg(test)]
mod simulated;
#[cfg(test)]
mod tests;
