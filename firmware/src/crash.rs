//! What happens when the program cannot go on: it is noted in memory that is kept, and the chip is reset.
//!
//! Faults of all kinds end in the hard fault. Its handler first gives itself the whole stack anew, for the one that there
//! was may be what is wrong. A program that makes no progress is found by the system timer, before the chip's watchdog,
//! which can only reset, does so.

#![expect(
    unsafe_code,
    reason = "handlers of faults begin where the compiler's rules have ended"
)]

use core::{
    arch::naked_asm,
    panic::PanicInfo,
    sync::atomic::{AtomicBool, AtomicU32, Ordering},
};

use cortex_m::peripheral::SCB;
use eigenmark_core::link::Crash;

use crate::faults::{KEPT_LEN, note_crash};

/// Milliseconds without progress that are a hang.
const HANG_MS: u32 = 2500;

/// BFSR in CFSR: the address of the fault is known.
const BFARVALID: u32 = 1 << 15;

/// How far below the stack an access is taken for one of the stack, in bytes.
const BELOW_STACK: u32 = 64 * 1024;

/// Milliseconds since the start.
static NOW_MS: AtomicU32 = AtomicU32::new(0);

/// When progress was last made, and whether anybody watches.
static PROGRESS_MS: AtomicU32 = AtomicU32::new(0);
static IS_WATCHED: AtomicBool = AtomicBool::new(false);

unsafe extern "C" {
    static mut __kept_start: u8;
    static _stack_start: u8;
    static _stack_end: u8;
}

/// What the processor saves when it enters a handler.
#[repr(C)]
struct Saved {
    registers: [u32; 5],
    lr: u32,
    pc: u32,
    status: u32,
}

/// The memory that is kept over resets. Only handlers that never return touch it besides.
///
/// Call it once.
#[must_use]
pub fn kept() -> &'static mut [u8; KEPT_LEN] {
    // SAFETY: memory.x has that much there, where nothing else lies; any byte is valid.
    unsafe { &mut *(&raw mut __kept_start).cast() }
}

/// Writes zeros to the memory that is kept. Before [`kept`].
#[cfg(feature = "stm32h743")]
pub fn clear_kept() {
    // SAFETY: as in `kept`, which was not called yet; whole words, as error correction wants them.
    unsafe {
        let words = (&raw mut __kept_start).cast::<[u64; KEPT_LEN / 8]>();
        words.write_volatile([0; KEPT_LEN / 8]);
    }
}

/// Milliseconds since the start: interrupts of the system timer.
#[must_use]
pub fn now_ms() -> u32 {
    NOW_MS.load(Ordering::Relaxed)
}

/// Says that the program makes progress. From the first time on it has to.
pub fn progress() {
    PROGRESS_MS.store(now_ms(), Ordering::Relaxed);
    IS_WATCHED.store(true, Ordering::Relaxed);
}

/// Says that the next step takes long: until there is progress again, only the chip's watchdog watches.
pub fn begin_long_step() {
    IS_WATCHED.store(false, Ordering::Relaxed);
}

/// Notes a panic, and starts anew.
pub fn panicked(info: &PanicInfo<'_>) -> ! {
    end_by_panic(info.location().map_or(0, |location| location.line()))
}

/// The same without one: nothing that flies can panic, so there is none to provoke.
pub fn end_by_panic(line: u32) -> ! {
    end(Crash::Panic { line })
}

/// Starts anew.
pub fn reset() -> ! {
    SCB::sys_reset()
}

fn end(crash: Crash) -> ! {
    note_crash(kept(), crash);
    // Memory with error correction holds back what was written last until more is written.
    let mut more = 0_u64;
    // SAFETY: it is a variable.
    unsafe {
        (&raw mut more).write_volatile(1);
    }
    reset()
}

/// Every fault.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn HardFault() {
    naked_asm!(
        "mrs r0, msp",
        "ldr r1, =_stack_start",
        "msr msp, r1",
        "b {}",
        sym faulted
    )
}

unsafe extern "C" fn faulted(saved: *const Saved) -> ! {
    // SAFETY: registers can be read at any time.
    let (status, address) = unsafe { ((*SCB::PTR).cfsr.read(), (*SCB::PTR).bfar.read()) };
    let (bottom, top) = (
        (&raw const _stack_end).addr() as u32,
        (&raw const _stack_start).addr() as u32,
    );
    let is_whole = saved.addr() as u32 >= bottom
        && saved.addr() as u32 <= top - size_of::<Saved>() as u32
        && saved.is_aligned();
    let (pc, lr) = if is_whole {
        // SAFETY: it lies on the stack, where the processor has just saved it; any bits are valid.
        unsafe { ((*saved).pc, (*saved).lr) }
    } else {
        (0, 0)
    };
    let is_known = status & BFARVALID != 0;
    let is_below = is_known && address < bottom && address >= bottom - BELOW_STACK;
    end(if is_whole && !is_below {
        Crash::HardFault {
            pc,
            lr,
            status,
            address: if is_known { address } else { 0 },
        }
    } else {
        Crash::StackOverflow { pc, lr }
    })
}

/// The system timer, once per millisecond.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn SysTick() {
    naked_asm!("mrs r0, msp", "b {}", sym tick)
}

unsafe extern "C" fn tick(saved: *const Saved) {
    let now = now_ms().wrapping_add(1);
    NOW_MS.store(now, Ordering::Relaxed);
    let since = now.wrapping_sub(PROGRESS_MS.load(Ordering::Relaxed));
    if IS_WATCHED.load(Ordering::Relaxed) && since > HANG_MS {
        // SAFETY: the processor has just saved it on the stack.
        let (pc, lr) = unsafe { ((*saved).pc, (*saved).lr) };
        end(Crash::Hang { pc, lr });
    }
}
