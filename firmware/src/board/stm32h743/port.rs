//! The parallel port: DCMI, from which DMA fetches one frame at a time.
//!
//! | signal | pin |
//! | --- | --- |
//! | data 0 to 7 | PC6, PC7, PE0, PE1, PE4, PB6, PE5, PE6 |
//! | frame (VSYNC), line (HSYNC), clock (PIXCLK) | PB7, PA4, PA6 |
//!
//! Data is valid while frame and line are high, and taken when the clock falls: as an HM01B0 sends it after a reset. The
//! HAL's own driver of the port knows frames of one length only, and never ends when one is shorter; here its parts are
//! used: DMA is started, and [`frame`](PixelPort::frame) looks how far it is. Nothing waits.

#![expect(
    unsafe_code,
    reason = "DMA writes behind the compiler's back, and to memory that nothing else can have"
)]

use core::{
    mem::{MaybeUninit, forget, transmute},
    slice,
    sync::atomic::{AtomicBool, Ordering, fence},
};

use embassy_stm32::{
    Peri,
    dcmi::{
        D0Pin, D1Pin, D2Pin, D3Pin, D4Pin, D5Pin, D6Pin, D7Pin, FrameDma, HSyncPin, PixClkPin,
        VSyncPin,
    },
    dma::{Channel, Request, Transfer, TransferOptions},
    gpio::{AfType, Flex, Pin, Pull},
    pac,
    peripherals::{DCMI, DMA1_CH0, PA4, PA6, PB6, PB7, PC6, PC7, PE0, PE1, PE4, PE5, PE6},
    rcc,
};

use super::Handlers;
use crate::camera::{MAX_RAW_LEN, PixelPort, PortError};

/// Pixels come four at a time.
const PIXELS_PER_WORD: usize = size_of::<u32>();

const WORDS: usize = MAX_RAW_LEN / PIXELS_PER_WORD;
const _: () = assert!(MAX_RAW_LEN.is_multiple_of(PIXELS_PER_WORD) && WORDS < 1 << 16);

/// Where DMA writes. It lies where DMA reaches, and is not initialized by the start.
#[unsafe(link_section = ".dma")]
static mut RECEIVED: MaybeUninit<[u32; WORDS]> = MaybeUninit::uninit();

static IS_TAKEN: AtomicBool = AtomicBool::new(false);

/// The port's pins.
pub struct Pins {
    pub d0: Peri<'static, PC6>,
    pub d1: Peri<'static, PC7>,
    pub d2: Peri<'static, PE0>,
    pub d3: Peri<'static, PE1>,
    pub d4: Peri<'static, PE4>,
    pub d5: Peri<'static, PB6>,
    pub d6: Peri<'static, PE5>,
    pub d7: Peri<'static, PE6>,
    pub frame: Peri<'static, PB7>,
    pub line: Peri<'static, PA4>,
    pub clock: Peri<'static, PA6>,
}

/// The port.
pub struct Port {
    /// Ends before the channel and the words are used for anything else.
    transfer: Option<Transfer<'static>>,
    channel: Channel<'static>,
    request: Request,
    words: *mut [u32; WORDS],
}

impl Pins {
    fn attach(self) {
        attach(D0Pin::<DCMI>::af_num(&*self.d0), self.d0);
        attach(D1Pin::<DCMI>::af_num(&*self.d1), self.d1);
        attach(D2Pin::<DCMI>::af_num(&*self.d2), self.d2);
        attach(D3Pin::<DCMI>::af_num(&*self.d3), self.d3);
        attach(D4Pin::<DCMI>::af_num(&*self.d4), self.d4);
        attach(D5Pin::<DCMI>::af_num(&*self.d5), self.d5);
        attach(D6Pin::<DCMI>::af_num(&*self.d6), self.d6);
        attach(D7Pin::<DCMI>::af_num(&*self.d7), self.d7);
        attach(VSyncPin::<DCMI>::af_num(&*self.frame), self.frame);
        attach(HSyncPin::<DCMI>::af_num(&*self.line), self.line);
        attach(PixClkPin::<DCMI>::af_num(&*self.clock), self.clock);
    }
}

fn attach(function: u8, pin: Peri<'static, impl Pin>) {
    let mut pin = Flex::new(pin);
    pin.set_as_af_unchecked(function, AfType::input(Pull::None));
    // It would be detached again.
    forget(pin);
}

impl Port {
    /// Sets the port up. `None` the second time.
    pub fn new(
        _port: Peri<'static, DCMI>,
        pins: Pins,
        channel: Peri<'static, DMA1_CH0>,
    ) -> Option<Self> {
        if IS_TAKEN.swap(true, Ordering::Relaxed) {
            return None;
        }
        let words = (&raw mut RECEIVED).cast::<[u32; WORDS]>();
        // SAFETY: this runs once, and nothing else knows the words. Every bit is written before any is read.
        unsafe {
            words.write_bytes(0, 1);
        }
        rcc::enable_and_reset::<DCMI>();
        pins.attach();
        pac::DCMI.cr().modify(|w| {
            // One frame, eight bits, of every frame; the polarities are those of the module's text.
            w.set_cm(true);
            w.set_pckpol(false);
            w.set_vspol(false);
            w.set_hspol(false);
            w.set_edm(0);
            w.set_fcrc(0);
        });
        Some(Self {
            transfer: None,
            request: FrameDma::<DCMI>::request(&*channel),
            channel: Channel::new(channel, Handlers),
            words,
        })
    }

    fn end(&mut self) {
        pac::DCMI.cr().modify(|w| {
            w.set_capture(false);
            w.set_enable(false);
        });
        // This stops the DMA, and waits until it has written its last word.
        self.transfer = None;
        fence(Ordering::SeqCst);
    }
}

impl PixelPort for Port {
    fn start(&mut self) -> Result<(), PortError> {
        self.end();
        let source = pac::DCMI.dr().as_ptr().cast::<u32>();
        // SAFETY: the port owns channel and words as long as there is a transfer, and nobody has a reference to the words:
        // that of `frame` borrows the port.
        self.transfer = Some(unsafe {
            let transfer = self.channel.read_raw(
                self.request,
                source,
                self.words as *mut [u32],
                TransferOptions::default(),
            );
            transmute::<Transfer<'_>, Transfer<'static>>(transfer)
        });
        pac::DCMI.icr().write(|w| {
            w.set_ovr_isc(true);
            w.set_err_isc(true);
            w.set_frame_isc(true);
        });
        pac::DCMI.cr().modify(|w| w.set_enable(true));
        pac::DCMI.cr().modify(|w| w.set_capture(true));
        Ok(())
    }

    fn frame(&mut self) -> Result<Option<&[u8]>, PortError> {
        let flags = pac::DCMI.ris().read();
        if flags.ovr_ris() {
            return Err(PortError::Overrun);
        }
        if flags.err_ris() {
            return Err(PortError::Fault);
        }
        let Some(transfer) = &mut self.transfer else {
            return Ok(None);
        };
        if !flags.frame_ris() {
            return Ok(None);
        }
        // The last words may still be on their way: they are fetched while the port has some.
        if transfer.is_running() && pac::DCMI.sr().read().fne() {
            return Ok(None);
        }
        let missing = transfer.get_remaining_transfers() as usize;
        self.end();
        let len = WORDS.saturating_sub(missing) * PIXELS_PER_WORD;
        // SAFETY: the words were initialized, and no DMA writes to them any more. As long as the slice lives the port is
        // borrowed, so none is started.
        Ok(Some(unsafe {
            slice::from_raw_parts(self.words.cast::<u8>(), len)
        }))
    }

    fn stop(&mut self) {
        self.end();
    }
}
