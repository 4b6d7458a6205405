//! What flies: camera and instruments → the navigator → the autopilot, with a host beside it.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use eigenmark_core::{link::MAX_FRAME_LEN, navigator::BoardMemory, slots::Writer};
use eigenmark_firmware::{atlas_region, board, crash, faults::FaultLog, flight::Flight};
use static_cell::ConstStaticCell;

eigenmark_firmware::logger!();

static MEMORY: ConstStaticCell<BoardMemory> = ConstStaticCell::new(BoardMemory::new());
static PIXELS: ConstStaticCell<Pixels> = ConstStaticCell::new(Pixels([0; MAX_FRAME_LEN]));

/// Pixels of a frame, at a whole word: the fast kernels ask for that.
#[repr(align(4))]
struct Pixels([u8; MAX_FRAME_LEN]);

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(parts) = board::take() else {
        crash::reset()
    };
    let kept = crash::kept();
    let faults = FaultLog::begin(kept, board::cause(kept));
    let region = board::reading(atlas_region::read);
    match region.choose() {
        Some(choice) => defmt::info!(
            "slot {}: atlas {:08x}, {} landmarks",
            choice.slot,
            choice.atlas.crc(),
            choice.atlas.landmarks().len()
        ),
        None => defmt::warn!("no slot holds a valid atlas"),
    }
    let writer = Writer::new(board::REGION_OFFSET, atlas_region::slot_len() as u32);
    let (Some(memory), Some(pixels)) = (MEMORY.try_take(), PIXELS.try_take()) else {
        crash::reset()
    };
    Flight::new(parts, &region, writer, memory, &mut pixels.0, faults).fly()
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    crash::panicked(info)
}
