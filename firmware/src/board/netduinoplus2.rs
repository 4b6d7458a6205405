//! Netduino Plus 2 (STM32F405): the link to the host on USART1, pins PA9 (out) and PA10 (in).
//!
//! Waiting for a byte is sleeping: the receiver's interrupt wakes the core, but no handler runs.
//!
//! The chip runs from its internal 16 MHz oscillator after reset and is left so; the emulated one counts 168 MHz.

use core::convert::Infallible;

use cortex_m::peripheral::{NVIC, SYST};
use embedded_io::{ErrorType, Read, Write};
use stm32f4::stm32f405::{Interrupt, Peripherals, USART1};

/// The clock that SysTick counts on the emulated board.
pub const CORE_HZ: u32 = 168_000_000;

/// Clock of USART1 after reset.
const USART_HZ: u32 = 16_000_000;

/// Speed of the link.
const BAUD: u32 = 115_200;

/// Clock ticks per bit, 139: the receiver samples 16 times per bit, and the register counts sixteenths of that.
const DIVIDER: u16 = ((USART_HZ + BAUD / 2) / BAUD) as u16;

/// Alternate function of PA9 and PA10 that is USART1.
const AF_USART1: u8 = 7;

/// The board's parts, taken once.
pub struct Board {
    /// The link to the host.
    pub link: Link,
    /// The system timer.
    pub systick: SYST,
}

/// Bytes to and from the host.
pub struct Link {
    usart: USART1,
}

impl Board {
    /// Takes the board and starts its parts. `None` the second time.
    #[must_use]
    pub fn take() -> Option<Self> {
        let core = cortex_m::Peripherals::take()?;
        let chip = Peripherals::take()?;
        chip.RCC.ahb1enr().modify(|_, w| w.gpioaen().enabled());
        chip.RCC.apb2enr().modify(|_, w| w.usart1en().enabled());
        chip.GPIOA
            .moder()
            .modify(|_, w| w.moder9().alternate().moder10().alternate());
        #[expect(
            unsafe_code,
            reason = "the register's fields take any four bits, which the PAC calls unsafe"
        )]
        // SAFETY: AF7 is a valid value of both fields.
        chip.GPIOA
            .afrh()
            .modify(|_, w| unsafe { w.afrh9().bits(AF_USART1).afrh10().bits(AF_USART1) });

        #[expect(
            unsafe_code,
            reason = "the register takes any sixteen bits, which the PAC calls unsafe"
        )]
        // SAFETY: 139 is a valid divider.
        chip.USART1.brr().write(|w| unsafe { w.bits(DIVIDER) });
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
        cortex_m::interrupt::disable();
        #[expect(
            unsafe_code,
            reason = "unmasking an interrupt can break critical sections"
        )]
        // SAFETY: all interrupts are masked: this one only ends sleep, and no handler runs.
        unsafe {
            NVIC::unmask(Interrupt::USART1);
        }
        Some(Self {
            link: Link { usart: chip.USART1 },
            systick: core.SYST,
        })
    }
}

impl ErrorType for Link {
    type Error = Infallible;
}

impl Read for Link {
    /// Waits for at least one byte.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let Some(first) = buffer.first_mut() else {
            return Ok(0);
        };
        while self.usart.sr().read().rxne().bit_is_clear() {
            // Interrupts are masked, but a pending one still ends the sleep.
            cortex_m::asm::wfi();
            NVIC::unpend(Interrupt::USART1);
        }
        *first = self.usart.dr().read().bits() as u8;
        Ok(1)
    }
}

impl Write for Link {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        for &byte in bytes {
            while self.usart.sr().read().txe().bit_is_clear() {}
            #[expect(
                unsafe_code,
                reason = "the register takes any nine bits, which the PAC calls unsafe"
            )]
            // SAFETY: a byte is a valid value of the data register.
            self.usart.dr().write(|w| unsafe { w.bits(byte.into()) });
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        while self.usart.sr().read().tc().bit_is_clear() {}
        Ok(())
    }
}
