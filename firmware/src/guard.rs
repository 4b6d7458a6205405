//! Room between two runs of bytes that nothing may touch: the memory protection unit notices who does.
//!
//! What assembly reads and writes is not seen by any checker of the compiler, so kernels are run on data that ends where
//! a guard begins. The first access to a guard is noted and takes the guards away, so that the program goes on.

#![expect(
    unsafe_code,
    reason = "the memory protection unit can take away any memory"
)]

use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::{
    asm,
    peripheral::{MPU, Peripherals, SCB, scb::Exception},
};
use eigenmark_core::kernel::EDGE_WORDS;

use crate::room::Begin;

/// Bytes of a guard: the smallest region of the unit, and its alignment.
const GUARD_BYTES: usize = 32;

/// RASR: a region of 2^(4 + 1) bytes, enabled, without any access, not executable.
const NO_ACCESS: u32 = 1 << 28 | 4 << 1 | 1;

/// CTRL: enabled, and what is in no region is as without the unit.
const ENABLED: u32 = 1 << 2 | 1;

static TOUCHED: AtomicBool = AtomicBool::new(false);

/// A room and its guards.
#[repr(C, align(32))]
pub struct Guarded {
    before: [u8; GUARD_BYTES],
    room: [u32; EDGE_WORDS],
    after: [u8; GUARD_BYTES],
}

const _: () = assert!((EDGE_WORDS * size_of::<u32>()).is_multiple_of(GUARD_BYTES));

/// A room whose guards are up.
pub struct Guard {
    guarded: &'static mut Guarded,
    mpu: MPU,
}

impl Begin for Guarded {
    const BEGIN: Self = Self {
        before: [0; GUARD_BYTES],
        room: [0; EDGE_WORDS],
        after: [0; GUARD_BYTES],
    };
}

impl Guard {
    /// Guards a room. `None` when the core's peripherals are taken.
    #[must_use]
    pub fn new(guarded: &'static mut Guarded) -> Option<Self> {
        let mut core = Peripherals::take()?;
        core.SCB.enable(Exception::MemoryManagement);
        let mut guard = Self {
            guarded,
            mpu: core.MPU,
        };
        guard.raise();
        Some(guard)
    }

    /// The room.
    pub fn room(&mut self) -> &mut [u32; EDGE_WORDS] {
        &mut self.guarded.room
    }

    /// Whether nobody has touched the guards.
    #[must_use]
    pub fn is_untouched(&self) -> bool {
        !TOUCHED.load(Ordering::Relaxed)
    }

    /// Whether both guards notice the word that lies next to the room; they are up again afterwards.
    pub fn notices_its_neighbors(&mut self) -> bool {
        let room = self.guarded.room.as_ptr_range();
        [room.start.wrapping_sub(1), room.end].map(|neighbour| {
            // SAFETY: this is a word of the guards, which are initialized.
            unsafe { neighbour.read_volatile() };
            let is_noticed = !self.is_untouched();
            self.raise();
            is_noticed
        }) == [true; 2]
    }

    fn raise(&mut self) {
        let guards = [self.guarded.before.as_ptr(), self.guarded.after.as_ptr()];
        // SAFETY: what is taken away are two runs of bytes that are never used.
        unsafe {
            for (number, start) in (0..).zip(guards) {
                self.mpu.rnr.write(number);
                self.mpu.rbar.write(start.addr() as u32);
                self.mpu.rasr.write(NO_ACCESS);
            }
            self.mpu.ctrl.write(ENABLED);
        }
        TOUCHED.store(false, Ordering::Relaxed);
        asm::dsb();
        asm::isb();
    }
}

/// Notes the access and lets it happen.
#[cortex_m_rt::exception]
unsafe fn MemoryManagement() {
    TOUCHED.store(true, Ordering::Relaxed);
    // SAFETY: without the unit all memory is there again. The bits of the fault's status are cleared by writing them.
    unsafe {
        (*MPU::PTR).ctrl.write(0);
        (*SCB::PTR).cfsr.write(0xff);
    }
}
