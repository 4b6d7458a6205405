//! An Arducam Mega as it behaves on its wires: registers, frame memory, and all that can go wrong.

use core::cell::RefCell;
use std::{collections::VecDeque, rc::Rc, vec, vec::Vec};

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};

/// What happens at a transaction.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// The camera is pulled off.
    Unplug,
    /// It is put on again, as after power-on.
    Plug,
    /// Its power fails for a moment.
    Blip,
    /// The bus fails, and nothing is transferred.
    BusError,
}

/// What becomes of a capture.
#[derive(Clone, Copy, Debug)]
pub enum Capture {
    /// So many bytes too few, at most.
    Short(usize),
    /// So many bytes too many.
    Long(usize),
    /// Nothing, and it is said to be captured.
    Empty,
    /// It never ends.
    Never,
}

/// The camera. A test keeps it, a driver has its wires ([`Wires`]).
#[derive(Debug)]
pub struct Mega {
    /// What register 0x40 says.
    pub sensor: u8,
    /// Looks at the state after a setting until it is taken.
    pub busy_after_setting: u32,
    /// Looks at the state after a capture began until it is there.
    pub busy_after_capture: u32,
    /// What the line is when nothing drives it.
    pub floating: u8,
    /// What becomes of the next captures; after them, all are good.
    pub captures: VecDeque<Capture>,
    /// What happens at which transaction, in order.
    pub events: VecDeque<(u64, Event)>,
    /// Transactions so far.
    pub transactions: u64,
    /// Bytes of the last capture that ended.
    pub captured: Vec<u8>,
    is_plugged: bool,
    power: Power,
    /// Captures since the beginning.
    count: u8,
    /// Bytes that came in the transaction.
    command: Vec<u8>,
}

/// What is gone without power.
#[derive(Debug)]
struct Power {
    format: u8,
    resolution: u8,
    busy: u32,
    /// Looks left until the capture ends.
    capturing: Option<u32>,
    is_captured: bool,
    memory: Vec<u8>,
    at: usize,
    is_read: bool,
}

impl Power {
    /// JPEG of the largest size.
    fn on() -> Self {
        Self {
            format: 1,
            resolution: 9,
            busy: 3,
            capturing: None,
            is_captured: false,
            memory: vec![],
            at: 0,
            is_read: false,
        }
    }
}

/// The SPI device that leads to a [`Mega`].
#[derive(Clone, Debug)]
pub struct Wires(Rc<RefCell<Mega>>);

impl Mega {
    pub fn new() -> (Rc<RefCell<Self>>, Wires) {
        let mega = Rc::new(RefCell::new(Self {
            sensor: 0x81,
            busy_after_setting: 2,
            busy_after_capture: 3,
            floating: 0xFF,
            captures: VecDeque::new(),
            events: VecDeque::new(),
            transactions: 0,
            captured: vec![],
            is_plugged: true,
            power: Power::on(),
            count: 0,
            command: vec![],
        }));
        (mega.clone(), Wires(mega))
    }

    pub fn happen(&mut self, event: Event) {
        match event {
            Event::Unplug => self.is_plugged = false,
            Event::Plug => (self.is_plugged, self.power) = (true, Power::on()),
            Event::Blip => self.power = Power::on(),
            Event::BusError => {}
        }
    }

    /// Luminance of the last capture, if it is a whole YUV frame.
    pub fn luminance(&self) -> Vec<u8> {
        self.captured.iter().copied().step_by(2).collect()
    }

    fn select(&mut self) -> Result<(), ErrorKind> {
        self.transactions += 1;
        self.command.clear();
        while let Some(&(at, event)) = self.events.front()
            && at <= self.transactions
        {
            self.events.pop_front();
            self.happen(event);
            if matches!(event, Event::BusError) {
                return Err(ErrorKind::Other);
            }
        }
        Ok(())
    }

    /// One byte each way.
    fn exchange(&mut self, byte: u8) -> u8 {
        if !self.is_plugged {
            return self.floating;
        }
        self.command.push(byte);
        match self.command[..] {
            [0x3C] => 0,
            [0x3C, ..] => self.read_on(),
            [register, value] if register & 0x80 != 0 => {
                self.write(register & 0x7F, value);
                0
            }
            [register, _, _] if register & 0x80 == 0 => self.read(register),
            _ => 0,
        }
    }

    fn read_on(&mut self) -> u8 {
        if !self.power.is_read {
            self.power.is_read = true;
            return 0x5A;
        }
        let byte = self.power.memory.get(self.power.at).copied();
        self.power.at += 1;
        byte.unwrap_or(0)
    }

    fn write(&mut self, register: u8, value: u8) {
        match (register, value) {
            (0x07, 0x40) => self.power = Power::on(),
            // Settings are lost on a camera that is busy.
            (0x20 | 0x21, _) if self.power.busy > 0 => return,
            (0x20, _) => self.power.format = value,
            (0x21, _) => self.power.resolution = value,
            (0x04, 1) => (self.power.is_captured, self.power.memory) = (false, vec![]),
            (0x04, 2) if self.power.busy == 0 => {
                self.power.capturing = Some(self.busy_after_capture);
                return;
            }
            _ => return,
        }
        if register != 0x04 {
            self.power.busy = self.busy_after_setting;
        }
    }

    fn read(&mut self, register: u8) -> u8 {
        let [low, middle, high, _] = (self.power.memory.len() as u32).to_le_bytes();
        match register {
            0x40 => self.sensor,
            0x44 => self.look(),
            0x45 => low,
            0x46 => middle,
            0x47 => high,
            _ => 0,
        }
    }

    fn look(&mut self) -> u8 {
        match self.power.capturing {
            Some(0) => self.capture(),
            Some(looks) => self.power.capturing = Some(looks - 1),
            None => {}
        }
        let state = if self.power.busy == 0 { 2 } else { 1 };
        self.power.busy = self.power.busy.saturating_sub(1);
        state | u8::from(self.power.is_captured) << 2
    }

    fn capture(&mut self) {
        let pixels = match (self.power.format, self.power.resolution) {
            (2 | 3, 1) => 320 * 240,
            (2 | 3, 10) => 96 * 96,
            (2 | 3, 11) => 128 * 128,
            // JPEG, of any length.
            _ => 1_234,
        };
        let whole = 2 * pixels;
        let len = match self.captures.pop_front() {
            None => whole,
            Some(Capture::Short(by)) => whole - by.clamp(1, whole - 1),
            Some(Capture::Long(by)) => whole + by.max(1),
            Some(Capture::Empty) => 0,
            Some(Capture::Never) => {
                self.power.capturing = None;
                return;
            }
        };
        self.count = self.count.wrapping_add(1);
        let mut seed = u32::from(self.count) + 1;
        self.captured = (0..len)
            .map(|_| {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (seed >> 24) as u8
            })
            .collect();
        self.power = Power {
            capturing: None,
            is_captured: true,
            memory: self.captured.clone(),
            at: 0,
            is_read: false,
            ..self.power
        };
    }
}

impl ErrorType for Wires {
    type Error = ErrorKind;
}

impl SpiDevice for Wires {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let mega = &mut *self.0.borrow_mut();
        mega.select()?;
        for operation in operations {
            match operation {
                Operation::Write(bytes) => bytes.iter().for_each(|&byte| {
                    mega.exchange(byte);
                }),
                Operation::Read(bytes) => {
                    bytes.iter_mut().for_each(|byte| *byte = mega.exchange(0));
                }
                Operation::TransferInPlace(bytes) => bytes
                    .iter_mut()
                    .for_each(|byte| *byte = mega.exchange(*byte)),
                Operation::Transfer(..) | Operation::DelayNs(_) => panic!("not used"),
            }
        }
        Ok(())
    }
}
