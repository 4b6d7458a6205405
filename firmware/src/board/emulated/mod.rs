//! Netduino Plus 2 (STM32F405) as QEMU gives it.
//!
//! Wires, timers, memory and resets are the chip's. What the emulator has not is a file of the machine that runs it, in
//! the directory where it was started: `camera.bin` is the camera, `flash.bin` the flash of the atlas region.
//!
//! The chip runs from its internal 16 MHz oscillator after reset and is left so; the emulated one counts 168 MHz.

mod camera;
mod file;
mod flash;
mod serial;

use cortex_m::asm;
use cortex_m_semihosting::debug::{EXIT_SUCCESS, exit};
use eigenmark_core::link::{Cause, Provocation};

use super::{Lamp, Parts, Refused, System, clock};
use crate::crash;

pub use camera::FileCamera;
pub use flash::Flash;
pub use serial::{Autopilot, Host};

/// The clock that SysTick counts on the emulated board.
pub const CORE_HZ: u32 = 168_000_000;

/// Where the flash's driver has the atlas region.
pub const REGION_OFFSET: u32 = 0;

/// Instructions that rest takes.
const REST: u32 = 10_000;

type Clock = clock::Clock<{ CORE_HZ / 1_000_000 }>;

/// Clock, rest and resets.
#[derive(Debug)]
pub struct Emulated(Clock);

/// Starts the board and takes its parts. `None` the second time.
#[must_use]
pub fn take() -> Option<Parts<FileCamera, Host, Autopilot, Flash, Emulated>> {
    let core = cortex_m::Peripherals::take()?;
    let chip = stm32f4::stm32f405::Peripherals::take()?;
    let clock = Clock::start(core.SYST);
    let (host, autopilot) = serial::start(chip);
    Some(Parts {
        camera: FileCamera::new(),
        host,
        autopilot,
        flash: Flash::open(),
        system: Emulated(clock),
    })
}

/// Why the board was reset, as far as the emulator tells: it has no flags of resets, but it keeps memory over those that
/// the program asks for.
#[must_use]
pub fn cause(kept: &[u8]) -> Cause {
    if kept.iter().all(|&byte| byte == 0) {
        Cause::PowerOn
    } else {
        Cause::Software
    }
}

impl System for Emulated {
    fn now_us(&self) -> u64 {
        self.0.now_us()
    }

    fn feed(&mut self) {
        crash::progress();
    }

    /// Awake: to put the emulated processor to sleep and to wake it takes longer than a byte on the wire.
    fn rest(&mut self) {
        for _ in 0..REST {
            asm::nop();
        }
    }

    fn show(&mut self, _: Lamp) {}

    /// Ends the emulator: whoever runs it starts it again, with what is in flash by now.
    fn restart(&mut self) {
        exit(EXIT_SUCCESS);
    }

    fn provoke(&mut self, what: Provocation) -> Result<(), Refused> {
        match what {
            Provocation::HardFault => {
                #[expect(unsafe_code, reason = "that is the point")]
                // SAFETY: there is nothing, and the processor says so.
                unsafe {
                    core::ptr::with_exposed_provenance::<u32>(0x6000_0000).read_volatile();
                }
            }
            Provocation::StackOverflow => {
                core::hint::black_box(sink(0));
            }
            Provocation::Hang => loop {
                asm::nop();
            },
            Provocation::Panic => crash::end_by_panic(line!()),
        }
        Ok(())
    }
}

/// Calls itself until the stack is full.
#[expect(unconditional_recursion, reason = "that is the point")]
#[inline(never)]
fn sink(depth: u32) -> u32 {
    let room = core::hint::black_box([depth; 64]);
    sink(depth.wrapping_add(1)).wrapping_add(room.iter().sum())
}
