//! Any board with an STM32F405 whose pins are free: 8 MHz crystal, 168 MHz, 1 MiB of flash.
//!
//! | part | chip | pins |
//! | --- | --- | --- |
//! | host, 115,200 baud | USART1 | PA9 sends, PA10 receives |
//! | autopilot, 921,600 baud | USART2 | PA2 sends, PA3 receives |
//! | camera, Arducam Mega | SPI1, mode 0, 5.25 MHz | PA5 clock, PA6 in, PA7 out, PA4 selects |
//! | lamps, lit when high | | PC0 unfit, PC1 searching, PC2 confident |
//!
//! # Limits
//! - Flash and program are one bank: while a sector is erased, 1 to 4 s, the processor stands still, and so does its
//!   clock. What arrives on the wires meanwhile is lost.
//! - The autopilot's wire runs at 913,043 baud, 0.9 % slow: 42 MHz cannot be divided better.
//! - Without its crystal the chip does not start: there is nothing that could say so.

mod flash;
mod serial;

use cortex_m::asm;
use eigenmark_core::link::{Cause, Provocation};
use embedded_hal_bus::spi::{ExclusiveDevice, NoDelay};
use stm32f4xx_hal::{
    gpio::{ErasedPin, Output, Pin, Speed},
    pac::{Peripherals, RCC, SPI1},
    prelude::*,
    rcc,
    spi::{Mode, Phase, Polarity, Spi},
    watchdog::IndependentWatchdog,
};

use super::{Lamp, Parts, Refused, System, clock};
use crate::{
    camera::{ArducamMega, Encoding, Resolution},
    crash, faults,
};

use flash::Flash;
use serial::{Autopilot, Host};

/// The processor's clock.
pub const CORE_HZ: u32 = 168_000_000;

/// Where the flash's driver has the atlas region: the driver begins at the chip's first sector.
pub const REGION_OFFSET: u32 = 0x40000;

const CRYSTAL_HZ: u32 = 8_000_000;

/// The fastest that is no more than the 8 MHz that the camera's maker recommends: 84 MHz / 16.
const CAMERA_HZ: u32 = 5_250_000;

/// Time without progress after which the chip is reset, if it has not done so itself. Its oscillator may be half as fast
/// again (17 to 47 kHz instead of 32, as the datasheet says): that is 5.4 s, and erasing a sector takes up to 4.
const WATCHDOG_MS: u32 = 8000;

/// RMVF in RCC_CSR: forgets why the chip was reset.
const FORGET_CAUSE: u32 = 1 << 24;

type Clock = clock::Clock<{ CORE_HZ / 1_000_000 }>;

/// An Arducam Mega on SPI1.
pub type Camera = ArducamMega<ExclusiveDevice<Spi<SPI1>, Pin<'A', 4, Output>, NoDelay>>;

/// Clock, rest, lamps and resets.
pub struct Stm32f405 {
    clock: Clock,
    watchdog: IndependentWatchdog,
    is_watched: bool,
    /// In the order of [`Lamp`].
    lamps: [(Lamp, ErasedPin<Output>); 3],
}

/// Starts the board and takes its parts. `None` the second time.
#[must_use]
pub fn take() -> Option<Parts<Camera, Host, Autopilot, Flash, Stm32f405>> {
    let core = cortex_m::Peripherals::take()?;
    let chip = Peripherals::take()?;
    let clocks = rcc::Config::hse(CRYSTAL_HZ.Hz()).sysclk(CORE_HZ.Hz());
    let mut rcc = chip
        .RCC
        .freeze(clocks.pclk1((CORE_HZ / 4).Hz()).pclk2((CORE_HZ / 2).Hz()));
    let clock = Clock::start(core.SYST);
    let a = chip.GPIOA.split(&mut rcc);
    let c = chip.GPIOC.split(&mut rcc);

    let host = serial::host(chip.USART1, (a.pa9, a.pa10), &mut rcc)?;
    let autopilot = serial::autopilot(chip.USART2, (a.pa2, a.pa3), &mut rcc)?;

    let mode = Mode {
        polarity: Polarity::IdleLow,
        phase: Phase::CaptureOnFirstTransition,
    };
    let (clock_pin, input, output) = (a.pa5.into_alternate(), a.pa6, a.pa7.into_alternate());
    let wires = (
        Some(clock_pin.speed(Speed::High)),
        Some(input),
        Some(output.speed(Speed::High)),
    );
    let bus = Spi::new(chip.SPI1, wires, mode, CAMERA_HZ.Hz(), &mut rcc);
    let Ok(camera) = ExclusiveDevice::new_no_delay(bus, a.pa4.into_push_pull_output());

    Some(Parts {
        camera: ArducamMega::new(camera, Encoding::Yuv, Resolution::Square128),
        host,
        autopilot,
        flash: Flash::new(chip.FLASH),
        system: Stm32f405 {
            clock,
            watchdog: IndependentWatchdog::new(chip.IWDG),
            is_watched: false,
            lamps: [
                (Lamp::Unfit, c.pc0.into_push_pull_output().erase()),
                (Lamp::Searching, c.pc1.into_push_pull_output().erase()),
                (Lamp::Confident, c.pc2.into_push_pull_output().erase()),
            ],
        },
    })
}

/// Why the chip was reset. It is asked once: the answer is forgotten then.
#[must_use]
pub fn cause(_: &[u8]) -> Cause {
    #[expect(
        unsafe_code,
        reason = "the clocks' owner has given their registers away"
    )]
    // SAFETY: nothing else uses this register.
    let register = unsafe { &*RCC::ptr() }.csr();
    let flags = register.read().bits();
    #[expect(
        unsafe_code,
        reason = "the register takes any bits, which the PAC calls unsafe"
    )]
    // SAFETY: the other bits are as they were.
    register.modify(|read, w| unsafe { w.bits(read.bits() | FORGET_CAUSE) });
    // Without a flag it was a debugger.
    faults::stm32f4_cause(flags).unwrap_or(Cause::Software)
}

impl System for Stm32f405 {
    fn now_us(&self) -> u64 {
        self.clock.now_us()
    }

    fn feed(&mut self) {
        crash::progress();
        if self.is_watched {
            self.watchdog.feed();
        } else {
            self.watchdog.start(WATCHDOG_MS.millis());
            self.is_watched = true;
        }
    }

    fn rest(&mut self) {
        asm::wfi();
    }

    fn show(&mut self, lamp: Lamp) {
        for (which, pin) in &mut self.lamps {
            if *which == lamp {
                pin.set_high();
            } else {
                pin.set_low();
            }
        }
    }

    fn restart(&mut self) {
        crash::reset();
    }

    fn provoke(&mut self, _: Provocation) -> Result<(), Refused> {
        Err(Refused)
    }
}
