//! Himax HM01B0: a sensor of 324×324 pixels that takes a few milliwatts, with I2C to control it and a parallel port for
//! pixels.
//!
//! # Wiring
//! I2C at address 0x24, to 400 kHz. Eight data lines, pixel clock, line and frame sync to a camera interface
//! ([`PixelPort`]); a master clock where the module has no oscillator. Modules with regulators, Arducam's for one, run
//! on 3.3 V; the bare sensor takes less (nominally 2.8 V analog and 1.8 to 2.8 V for its pins: see its datasheet).
//! The pixel clock is gated: it runs only while pixels are valid.
//!
//! # Method
//! The crate `hm01b0` resets the sensor and writes the settings that are known to give a good picture. It knows only
//! the whole array, so the window of 324×244 pixels (0x3010 ← 1) and the sensor's own binning (0x0383, 0x0387 and
//! 0x0390 ← 3), which Zephyr's and OpenMV's drivers use, are written here. The frame rate stays that of the crate.
//!
//! The sensor is sold with and without color filters:
//! - without ([`Filter::None`]), it averages 2×2 pixels itself and sends 162×122 of luminance;
//! - with them ([`Filter::Bayer`]), it cannot. It sends 324×244, of which 2×2 pixels (one blue, two green, one red)
//!   are averaged here. That is (R + 2 G + B) / 4, not luminance as in BT.601, but it is the same wherever the
//!   mosaic begins.
//!
//! Either way the middle 160×120 pixels are the frame.
//!
//! # Cost
//! Setting up blocks for 10 ms, and for about 60 transfers of four bytes over I2C: 6 ms at 400 kHz. The port needs room
//! for what it receives: 19,764 bytes, or 79,056 with color filters.
//!
//! # Limits
//! The first frames after a start are dark or bright until the sensor's exposure has settled.

use embedded_hal::{
    delay::DelayNs,
    i2c::{ErrorKind, I2c},
};
use hm01b0::Mode;

use super::{Camera, CameraError, FrameSize};

/// The sensor's columns, and the rows of its window.
const COLUMNS: usize = 324;
const ROWS: usize = 244;

/// Pixels on either side of the frame that are left out, after averaging.
const MARGIN: usize = 1;

const WIDTH: usize = COLUMNS / 2 - 2 * MARGIN;
const HEIGHT: usize = ROWS / 2 - 2 * MARGIN;

const SIZE: FrameSize = match FrameSize::new(WIDTH as u16, HEIGHT as u16) {
    Some(size) => size,
    None => panic!("the localizer does not accept it"),
};

/// Bytes that a port receives for one frame, at most.
pub const MAX_RAW_LEN: usize = COLUMNS * ROWS;

/// Registers that `hm01b0` does not write, and their values.
const WINDOW: (u16, u8) = (0x3010, 1);
const BINNING: [(u16, u8); 3] = [(0x0383, 3), (0x0387, 3), (0x0390, 3)];

/// What lies over the sensor's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Filter {
    /// Nothing: it sees gray.
    None,
    /// Color filters.
    Bayer,
}

/// A parallel port that receives frames: a DCMI with DMA, for example. It owns the memory for them.
pub trait PixelPort {
    /// Starts to receive the next frame, from its first line on; what was received before is dropped.
    ///
    /// # Errors
    /// When the port does not work.
    fn start(&mut self) -> Result<(), PortError>;

    /// All bytes of the frame, when it has ended; none while it has not. More bytes than the port has room for are
    /// an overrun.
    ///
    /// # Errors
    /// When the frame was not received whole.
    fn frame(&mut self) -> Result<Option<&[u8]>, PortError>;

    /// Stops; what was received is dropped.
    fn stop(&mut self);
}

/// Why a port has no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum PortError {
    /// Bytes came faster than they were fetched, or more than there is room for.
    Overrun,
    /// It does not work.
    Fault,
}

/// An HM01B0 on an I2C bus and a port.
#[derive(Debug)]
pub struct Hm01b0<I, D, P> {
    sensor: hm01b0::Hm01b0<I>,
    delay: D,
    port: P,
    filter: Filter,
    is_set_up: bool,
    is_asked: bool,
}

impl Filter {
    /// Bytes of a frame as the sensor sends it.
    const fn raw_len(self) -> usize {
        match self {
            Self::None => (COLUMNS / 2) * (ROWS / 2),
            Self::Bayer => COLUMNS * ROWS,
        }
    }
}

impl<I: I2c, D: DelayNs, P: PixelPort> Hm01b0<I, D, P> {
    /// A sensor of which nothing is known yet: the first [`begin`](Camera::begin) looks for it.
    pub fn new(i2c: I, delay: D, port: P, filter: Filter) -> Self {
        Self {
            sensor: hm01b0::Hm01b0::new(i2c),
            delay,
            port,
            filter,
            is_set_up: false,
            is_asked: false,
        }
    }

    /// Looks for the sensor, resets it and starts it.
    fn set_up(&mut self) -> Result<(), hm01b0::Error<I::Error>> {
        // Asked first, because a reset of a sensor that is not there takes ten times as long.
        self.sensor.verify_identity()?;
        self.sensor.init(&mut self.delay)?;
        let binning: &[_] = match self.filter {
            Filter::None => &BINNING,
            Filter::Bayer => &[],
        };
        for &(register, value) in [WINDOW].iter().chain(binning) {
            self.sensor.write_register(register, value)?;
        }
        self.sensor.set_mode(Mode::Streaming)
    }

    fn receive(&mut self, pixels: &mut [u8]) -> Result<Option<FrameSize>, CameraError> {
        let pixels = SIZE.room(pixels)?;
        let Some(raw) = self.port.frame()? else {
            return Ok(None);
        };
        let (found, expected) = (raw.len(), self.filter.raw_len());
        if found < expected {
            return Err(CameraError::Short {
                expected: expected as u32,
                found: found as u32,
            });
        }
        if found > expected {
            return Err(CameraError::Torn);
        }
        match self.filter {
            Filter::None => crop(raw, pixels),
            Filter::Bayer => average(raw, pixels),
        }
        Ok(Some(SIZE))
    }
}

impl<I: I2c, D: DelayNs, P: PixelPort> Camera for Hm01b0<I, D, P> {
    fn begin(&mut self) -> Result<(), CameraError> {
        self.is_asked = false;
        if !self.is_set_up {
            self.set_up().map_err(|error| why(&error))?;
            self.is_set_up = true;
        }
        self.port.start()?;
        self.is_asked = true;
        Ok(())
    }

    fn take(&mut self, pixels: &mut [u8]) -> Result<Option<FrameSize>, CameraError> {
        if !self.is_asked {
            return Ok(None);
        }
        let received = self.receive(pixels);
        if !matches!(received, Ok(None)) {
            self.is_asked = false;
            self.port.stop();
        }
        received
    }

    fn recover(&mut self) {
        self.port.stop();
        (self.is_set_up, self.is_asked) = (false, false);
    }
}

impl From<PortError> for CameraError {
    fn from(error: PortError) -> Self {
        match error {
            PortError::Overrun => Self::Torn,
            PortError::Fault => Self::Bus,
        }
    }
}

/// A bus on which nobody acknowledges has no camera.
fn why<E: embedded_hal::i2c::Error>(error: &hm01b0::Error<E>) -> CameraError {
    match error {
        hm01b0::Error::ModelId { .. } => CameraError::Absent,
        hm01b0::Error::I2c(error) if matches!(error.kind(), ErrorKind::NoAcknowledge(_)) => {
            CameraError::Absent
        }
        _ => CameraError::Bus,
    }
}

/// The middle of a frame that the sensor has averaged.
fn crop(raw: &[u8], pixels: &mut [u8]) {
    let (lines, _) = raw.as_chunks::<{ COLUMNS / 2 }>();
    let (rows, _) = pixels.as_chunks_mut::<WIDTH>();
    for (line, row) in lines.iter().skip(MARGIN).zip(rows) {
        for (pixel, place) in line.iter().skip(MARGIN).zip(row) {
            *place = *pixel;
        }
    }
}

/// The middle of a mosaic's averages of 2×2 pixels, rounded to nearest with halves up.
fn average(raw: &[u8], pixels: &mut [u8]) {
    let (lines, _) = raw.as_chunks::<COLUMNS>();
    let (pairs, _) = lines.as_chunks();
    let (rows, _) = pixels.as_chunks_mut::<WIDTH>();
    for ([upper, lower], row) in pairs.iter().skip(MARGIN).zip(rows) {
        let cells = upper.as_chunks().0.iter().zip(lower.as_chunks().0);
        for (([a, b], [c, d]), place) in cells.skip(MARGIN).zip(row) {
            let sum = u16::from(*a) + u16::from(*b) + u16::from(*c) + u16::from(*d);
            *place = ((sum + 2) / 4) as u8;
        }
    }
}

#[cfg(test)]
mod tests;
