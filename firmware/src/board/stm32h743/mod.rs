//! An STM32H743 with an HM01B0 on its parallel port, wired as OpenMV Cam H7: 12 MHz crystal, 400 MHz, 2 MiB of flash.
//!
//! | part | chip | pins (and those of OpenMV Cam H7) |
//! | --- | --- | --- |
//! | host, 115,200 baud | USART1 | PB14 sends (P1), PB15 receives (P0) |
//! | autopilot, 921,600 baud | USART3 | PB10 sends (P4), PB11 receives (P5) |
//! | camera's control, 400 kHz | I2C1 | PB8 SCL, PB9 SDA |
//! | camera's pixels | DCMI, DMA1 stream 0 | see [`port`] |
//! | camera's clock, 12 MHz | MCO1 | PA8 |
//! | camera's reset, power down | | PA10 (high: runs), PD7 (low: has power) |
//! | lamps, lit when low | | PC0 unfit (red), PC1 confident (green), PC2 searching (blue) |
//!
//! The program lies in bank 1 of the flash, atlases in bank 2, so the processor runs on while a sector is erased; but the
//! driver waits for the end of that. Memory is coupled to the core, the cache of data is off and that of instructions on.
//!
//! Flash has error correction: a word whose writing a power cut has ended may not be readable, which is a fault of the
//! bus. [`reading`] reads in spite of that.

mod flash;
mod port;

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::asm;
use eigenmark_core::link::{Cause, Provocation};
use embassy_stm32::{
    Config, Peri, bind_interrupts, dma,
    gpio::{AnyPin, Level, Output, Speed},
    i2c::{self, I2c, Master},
    mode::Blocking,
    pac,
    peripherals::{self, IWDG1},
    rcc::{self, AHBPrescaler, APBPrescaler, Mco, McoConfig},
    time::Hertz,
    usart::{self, BufferedInterruptHandler, BufferedUart},
    wdg::IndependentWatchdog,
};
use embassy_time::{Delay, Duration};
use static_cell::ConstStaticCell;

use super::{Lamp, Parts, Refused, System, clock};
use crate::{
    camera::{Filter, Hm01b0},
    crash, faults,
};

use flash::Flash;
use port::Port;

pub use flash::reading;

/// The processor's clock.
pub const CORE_HZ: u32 = 400_000_000;

/// Where the flash's driver has the atlas region: the driver begins at the chip's first sector.
pub const REGION_OFFSET: u32 = 0x10_0000;

const CRYSTAL_HZ: u32 = 12_000_000;

/// As the host's tools have it.
const HOST_BAUD: u32 = 115_200;

/// As autopilots have it for companion computers.
const AUTOPILOT_BAUD: u32 = 921_600;

/// The fastest that the camera takes.
const CAMERA_HZ: u32 = 400_000;

/// A transfer to the camera takes 0.1 ms.
const CAMERA_PATIENCE: Duration = Duration::from_millis(20);

/// What lies over the camera's pixels.
const FILTER: Filter = Filter::None;

/// Time without progress after which the chip is reset, if it has not done so itself: longer than erasing a sector takes,
/// though the watchdog's oscillator be fast.
const WATCHDOG_US: u32 = 8_000_000;

type Clock = clock::Clock<{ CORE_HZ / 1_000_000 }>;

/// An HM01B0 on I2C1 and the parallel port.
pub type Camera = Hm01b0<I2c<'static, Blocking, Master>, Delay, Port>;

/// A wire. Writing waits until all of it is in its queue, which the transmitter empties whatever happens.
pub type Wire = BufferedUart<'static>;

/// Clock, rest, lamps and resets.
pub struct Stm32h743 {
    clock: Clock,
    watchdog: IndependentWatchdog<'static, IWDG1>,
    is_watched: bool,
    lamps: [(Lamp, Output<'static>); 3],
    /// They are as they are as long as these live.
    _camera: (
        Output<'static>,
        Output<'static>,
        Mco<'static, peripherals::MCO1>,
    ),
}

/// RCC_RSR at the start.
static CAUSE: AtomicU32 = AtomicU32::new(0);

static FROM_HOST: ConstStaticCell<[u8; 2048]> = ConstStaticCell::new([0; 2048]);
static TO_HOST: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);
static FROM_AUTOPILOT: ConstStaticCell<[u8; 4096]> = ConstStaticCell::new([0; 4096]);
static TO_AUTOPILOT: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);

use handlers::Handlers;

mod handlers {
    use super::*;

    bind_interrupts!(pub struct Handlers {
        USART1 => BufferedInterruptHandler<peripherals::USART1>;
        USART3 => BufferedInterruptHandler<peripherals::USART3>;
        DMA1_STREAM0 => dma::InterruptHandler<peripherals::DMA1_CH0>;
    });
}

/// Starts the board and takes its parts. `None` the second time.
#[must_use]
pub fn take() -> Option<Parts<Camera, Wire, Wire, Flash, Stm32h743>> {
    let mut core = cortex_m::Peripherals::take()?;
    let flags = pac::RCC.rsr().read().0;
    CAUSE.store(flags, Ordering::Relaxed);
    pac::RCC.rsr().modify(|w| w.set_rmvf(true));
    if faults::stm32h7_cause(flags) == Some(Cause::PowerOn) {
        // With error correction, memory is written before it is read.
        crash::clear_kept();
    }
    core.SCB.enable_icache();
    let chip = embassy_stm32::init(clocks());
    let clock = Clock::start(core.SYST);

    let host = BufferedUart::new(
        chip.USART1,
        chip.PB15,
        chip.PB14,
        TO_HOST.try_take()?,
        FROM_HOST.try_take()?,
        Handlers,
        baud(HOST_BAUD),
    );
    let autopilot = BufferedUart::new(
        chip.USART3,
        chip.PB11,
        chip.PB10,
        TO_AUTOPILOT.try_take()?,
        FROM_AUTOPILOT.try_take()?,
        Handlers,
        baud(AUTOPILOT_BAUD),
    );

    let mut control = i2c::Config::default();
    control.frequency = Hertz(CAMERA_HZ);
    control.timeout = CAMERA_PATIENCE;
    let control = I2c::new_blocking(chip.I2C1, chip.PB8, chip.PB9, control);
    let pins = port::Pins {
        d0: chip.PC6,
        d1: chip.PC7,
        d2: chip.PE0,
        d3: chip.PE1,
        d4: chip.PE4,
        d5: chip.PB6,
        d6: chip.PE5,
        d7: chip.PE6,
        frame: chip.PB7,
        line: chip.PA4,
        clock: chip.PA6,
    };
    let port = Port::new(chip.DCMI, pins, chip.DMA1_CH0)?;
    let camera = (
        Output::new(chip.PD7, Level::Low, Speed::Low),
        Output::new(chip.PA10, Level::High, Speed::Low),
        Mco::new(
            chip.MCO1,
            chip.PA8,
            pac::rcc::vals::Mco1sel::HSE,
            McoConfig::default(),
        ),
    );

    Some(Parts {
        camera: Hm01b0::new(control, Delay, port, FILTER),
        host: host.ok()?,
        autopilot: autopilot.ok()?,
        flash: Flash::new(chip.FLASH),
        system: Stm32h743 {
            clock,
            watchdog: IndependentWatchdog::new(chip.IWDG1, WATCHDOG_US),
            is_watched: false,
            lamps: [
                (Lamp::Unfit, lamp(chip.PC0.into())),
                (Lamp::Confident, lamp(chip.PC1.into())),
                (Lamp::Searching, lamp(chip.PC2.into())),
            ],
            _camera: camera,
        },
    })
}

/// Why the chip was reset.
#[must_use]
pub fn cause(_: &[u8]) -> Cause {
    // Without a flag it was a debugger.
    faults::stm32h7_cause(CAUSE.load(Ordering::Relaxed)).unwrap_or(Cause::Software)
}

/// 12 MHz / 3 × 200 / 2 for the core, half of that for buses, a quarter for what is on them.
fn clocks() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(rcc::Hse {
        freq: Hertz(CRYSTAL_HZ),
        mode: rcc::HseMode::Oscillator,
    });
    rcc.pll1 = Some(rcc::Pll {
        source: rcc::PllSource::HSE,
        prediv: rcc::PllPreDiv::DIV3,
        mul: rcc::PllMul::MUL200,
        fracn: None,
        divp: Some(rcc::PllDiv::DIV2),
        divq: None,
        divr: None,
    });
    rcc.sys = rcc::Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV2;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    rcc.voltage_scale = rcc::VoltageScale::Scale1;
    config
}

/// A lamp that is off.
fn lamp(pin: Peri<'static, AnyPin>) -> Output<'static> {
    Output::new(pin, Level::High, Speed::Low)
}

fn baud(rate: u32) -> usart::Config {
    let mut config = usart::Config::default();
    config.baudrate = rate;
    config
}

impl System for Stm32h743 {
    fn now_us(&self) -> u64 {
        self.clock.now_us()
    }

    fn feed(&mut self) {
        crash::progress();
        if self.is_watched {
            self.watchdog.pet();
        } else {
            self.watchdog.unleash();
            self.is_watched = true;
        }
    }

    fn rest(&mut self) {
        asm::wfi();
    }

    fn show(&mut self, lamp: Lamp) {
        for (which, pin) in &mut self.lamps {
            pin.set_level(if *which == lamp {
                Level::Low
            } else {
                Level::High
            });
        }
    }

    fn restart(&mut self) {
        crash::reset();
    }

    fn provoke(&mut self, _: Provocation) -> Result<(), Refused> {
        Err(Refused)
    }
}
