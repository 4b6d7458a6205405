//! Wires: USART1 to the host, USART2 to the autopilot. Interrupts move bytes between registers and queues.

use core::ops::Deref;

use cortex_m::peripheral::NVIC;
use stm32f4xx_hal::{
    Listen,
    gpio::{Input, Pin},
    pac::{Interrupt, USART1, USART2, interrupt, usart1::RegisterBlock},
    prelude::*,
    rcc::Rcc,
    serial::{Config, Event, Serial},
};

use crate::{
    crash,
    ring::Ring,
    wire::{Line, Wire},
};

/// As the host's tools have it.
const HOST_BAUD: u32 = 115_200;

/// As autopilots have it for companion computers.
const AUTOPILOT_BAUD: u32 = 921_600;

static FROM_HOST: Ring<2048> = Ring::new();
static TO_HOST: Ring<1024> = Ring::new();
static FROM_AUTOPILOT: Ring<4096> = Ring::new();
static TO_AUTOPILOT: Ring<1024> = Ring::new();

/// A wire to the host.
pub type Host = Wire<Usart<USART1>, 2048, 1024>;

/// A wire to the autopilot.
pub type Autopilot = Wire<Usart<USART2>, 4096, 1024>;

/// One of the two, after it was set up.
#[derive(Debug)]
pub struct Usart<U>(U);

/// Starts the host's.
pub fn host(
    usart: USART1,
    pins: (Pin<'A', 9, Input>, Pin<'A', 10, Input>),
    rcc: &mut Rcc,
) -> Option<Host> {
    let config = Config::default().baudrate(HOST_BAUD.bps());
    let mut serial = Serial::<_, u8>::new(usart, pins, config, rcc).ok()?;
    serial.listen(Event::RxNotEmpty);
    unmask(Interrupt::USART1);
    let (usart, _) = serial.release();
    Some(Wire::new(Usart(usart), &FROM_HOST, &TO_HOST))
}

/// Starts the autopilot's.
pub fn autopilot(
    usart: USART2,
    pins: (Pin<'A', 2, Input>, Pin<'A', 3, Input>),
    rcc: &mut Rcc,
) -> Option<Autopilot> {
    let config = Config::default().baudrate(AUTOPILOT_BAUD.bps());
    let mut serial = Serial::<_, u8>::new(usart, pins, config, rcc).ok()?;
    serial.listen(Event::RxNotEmpty);
    unmask(Interrupt::USART2);
    let (usart, _) = serial.release();
    Some(Wire::new(Usart(usart), &FROM_AUTOPILOT, &TO_AUTOPILOT))
}

#[interrupt]
fn USART1() {
    #[expect(unsafe_code, reason = "the handler shares the register block")]
    // SAFETY: what both change, the program changes while interrupts are off.
    serve(unsafe { &*USART1::ptr() }, &FROM_HOST, &TO_HOST);
}

#[interrupt]
fn USART2() {
    #[expect(unsafe_code, reason = "the handler shares the register block")]
    // SAFETY: what both change, the program changes while interrupts are off.
    serve(unsafe { &*USART2::ptr() }, &FROM_AUTOPILOT, &TO_AUTOPILOT);
}

impl<U: Deref<Target = RegisterBlock>> Line for Usart<U> {
    fn send(&mut self) {
        // The handler changes this register, too.
        cortex_m::interrupt::free(|_| self.0.cr1().modify(|_, w| w.txeie().enabled()));
    }

    fn is_quiet(&self) -> bool {
        self.0.sr().read().tc().bit_is_set()
    }

    fn now_ms(&self) -> u32 {
        crash::now_ms()
    }
}

fn unmask(interrupt: Interrupt) {
    #[expect(
        unsafe_code,
        reason = "unmasking an interrupt can break critical sections"
    )]
    // SAFETY: the handlers only touch their queues and registers.
    unsafe {
        NVIC::unmask(interrupt);
    }
}

fn serve<const R: usize, const S: usize>(
    usart: &RegisterBlock,
    received: &Ring<R>,
    sent: &Ring<S>,
) {
    let status = usart.sr().read();
    // To read the data is also what ends an overrun, which interrupts as well.
    if status.rxne().bit_is_set() || status.ore().bit_is_set() {
        let byte = usart.dr().read().bits() as u8;
        if status.rxne().bit_is_set() {
            received.push(byte);
        }
    }
    if status.txe().bit_is_set() && usart.cr1().read().txeie().bit_is_set() {
        match sent.pop() {
            Some(byte) => {
                #[expect(
                    unsafe_code,
                    reason = "the register takes any nine bits, which the PAC calls unsafe"
                )]
                // SAFETY: a byte is a valid value of the data register.
                usart.dr().write(|w| unsafe { w.bits(byte.into()) });
            }
            None => {
                usart.cr1().modify(|_, w| w.txeie().disabled());
            }
        }
    }
}
