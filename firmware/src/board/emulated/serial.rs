//! Wires: USART1 to the host (pins PA9 and PA10), USART2 to the autopilot (PA2 and PA3).
//!
//! Interrupts put what arrives into rings. What is sent goes out at once: the emulated transmitter is always ready.

use core::convert::Infallible;

use cortex_m::peripheral::NVIC;
use embedded_io::{ErrorType, Read, ReadReady, Write};
use stm32f4::stm32f405::{Interrupt, Peripherals, USART1, USART2, interrupt};

use crate::ring::Ring;

/// Clock of both after reset: the internal oscillator, which the emulator does not look at.
const USART_HZ: u32 = 16_000_000;

const BAUD: u32 = 115_200;

/// Clock ticks per bit, 139: the receiver samples 16 times per bit, and the register counts sixteenths of that.
const DIVIDER: u16 = ((USART_HZ + BAUD / 2) / BAUD) as u16;

/// Alternate function of the four pins.
const AF_USART: u8 = 7;

static FROM_HOST: Ring<2048> = Ring::new();
static FROM_AUTOPILOT: Ring<1024> = Ring::new();

/// A wire to the host.
#[derive(Debug)]
pub struct Host(USART1);

/// A wire to the autopilot.
#[derive(Debug)]
pub struct Autopilot(USART2);

/// Starts both.
pub fn start(chip: Peripherals) -> (Host, Autopilot) {
    chip.RCC.ahb1enr().modify(|_, w| w.gpioaen().enabled());
    chip.RCC.apb1enr().modify(|_, w| w.usart2en().enabled());
    chip.RCC.apb2enr().modify(|_, w| w.usart1en().enabled());
    chip.GPIOA.moder().modify(|_, w| {
        let w = w.moder2().alternate().moder3().alternate();
        w.moder9().alternate().moder10().alternate()
    });
    #[expect(
        unsafe_code,
        reason = "the registers take any bits, which the PAC calls unsafe"
    )]
    // SAFETY: AF7 is a valid value of all four fields, 139 a valid divider.
    unsafe {
        chip.GPIOA
            .afrl()
            .modify(|_, w| w.afrl2().bits(AF_USART).afrl3().bits(AF_USART));
        chip.GPIOA
            .afrh()
            .modify(|_, w| w.afrh9().bits(AF_USART).afrh10().bits(AF_USART));
        chip.USART1.brr().write(|w| w.bits(DIVIDER));
        chip.USART2.brr().write(|w| w.bits(DIVIDER));
    }
    chip.USART1.cr1().write(|w| {
        w.ue()
            .enabled()
            .te()
            .enabled()
            .re()
            .enabled()
            .rxneie()
            .enabled()
    });
    chip.USART2.cr1().write(|w| {
        w.ue()
            .enabled()
            .te()
            .enabled()
            .re()
            .enabled()
            .rxneie()
            .enabled()
    });
    #[expect(
        unsafe_code,
        reason = "unmasking an interrupt can break critical sections"
    )]
    // SAFETY: the handlers only touch their rings and registers.
    unsafe {
        NVIC::unmask(Interrupt::USART1);
        NVIC::unmask(Interrupt::USART2);
    }
    (Host(chip.USART1), Autopilot(chip.USART2))
}

#[interrupt]
fn USART1() {
    #[expect(unsafe_code, reason = "the handler shares the register block")]
    // SAFETY: the data register is read here only.
    let usart = unsafe { &*USART1::ptr() };
    if usart.sr().read().rxne().bit_is_set() {
        FROM_HOST.push(usart.dr().read().bits() as u8);
    }
}

#[interrupt]
fn USART2() {
    #[expect(unsafe_code, reason = "the handler shares the register block")]
    // SAFETY: the data register is read here only.
    let usart = unsafe { &*USART2::ptr() };
    if usart.sr().read().rxne().bit_is_set() {
        FROM_AUTOPILOT.push(usart.dr().read().bits() as u8);
    }
}

macro_rules! wire {
    ($wire:ident, $ring:ident) => {
        impl ErrorType for $wire {
            type Error = Infallible;
        }

        impl ReadReady for $wire {
            fn read_ready(&mut self) -> Result<bool, Infallible> {
                Ok(!$ring.is_empty())
            }
        }

        impl Read for $wire {
            /// What has arrived; nothing when nothing has.
            fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
                let mut len = 0;
                for place in bytes {
                    let Some(byte) = $ring.pop() else { break };
                    *place = byte;
                    len += 1;
                }
                Ok(len)
            }
        }

        impl Write for $wire {
            fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
                for &byte in bytes {
                    while self.0.sr().read().txe().bit_is_clear() {}
                    #[expect(
                        unsafe_code,
                        reason = "the register takes any nine bits, which the PAC calls unsafe"
                    )]
                    // SAFETY: a byte is a valid value of the data register.
                    self.0.dr().write(|w| unsafe { w.bits(byte.into()) });
                }
                Ok(bytes.len())
            }

            fn flush(&mut self) -> Result<(), Infallible> {
                while self.0.sr().read().tc().bit_is_clear() {}
                Ok(())
            }
        }
    };
}

wire!(Host, FROM_HOST);
wire!(Autopilot, FROM_AUTOPILOT);
