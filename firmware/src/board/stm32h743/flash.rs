//! The chip's flash, of which only the atlas region can be touched.

use core::{arch::asm, ops::Range};

use cortex_m::peripheral::SCB;
use eigenmark_core::slots::Slot;
use embassy_stm32::{
    Peri,
    flash::{self, Blocking, MAX_ERASE_SIZE, WRITE_SIZE},
    pac,
    peripherals::FLASH,
};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, ReadNorFlash, check_erase, check_read, check_write,
};

use super::REGION_OFFSET;
use crate::{
    atlas_region,
    board::{AtlasFlash, flash_error::FlashError},
    crash,
};

/// BFHFNMIGN in CCR: a read that fails gives anything where nothing but a reset can interrupt.
const IGNORE_BUS_FAULTS: u32 = 1 << 8;

/// The bank of the atlas region.
const BANK: usize = 1;

/// Flash whose offset 0 is the chip's first sector.
pub struct Flash(flash::Flash<'static, Blocking>);

/// Reads flash that a power cut may have left unreadable: what cannot be read is anything, and checksums find that.
///
/// Meanwhile nothing interrupts, and a fault of another kind stops the processor until somebody resets it.
pub fn reading<T>(read: impl FnOnce() -> T) -> T {
    set_ignoring(true);
    let value = read();
    set_ignoring(false);
    forget_errors();
    value
}

#[expect(unsafe_code, reason = "there is no safe way to mask faults")]
fn set_ignoring(is_ignored: bool) {
    // SAFETY: only this code changes that bit and the mask of faults; both only hold interrupts back.
    unsafe {
        let scb = &*SCB::PTR;
        if is_ignored {
            asm!("cpsid f", options(nostack, preserves_flags));
            scb.ccr.modify(|bits| bits | IGNORE_BUS_FAULTS);
        } else {
            scb.ccr.modify(|bits| bits & !IGNORE_BUS_FAULTS);
        }
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    if !is_ignored {
        // SAFETY: as above.
        unsafe {
            asm!("cpsie f", options(nostack, preserves_flags));
        }
    }
}

/// The chip keeps errors of reading until it is told; the driver would take them for its own.
fn forget_errors() {
    pac::FLASH.bank(BANK).ccr().write(|w| {
        w.set_clr_wrperr(true);
        w.set_clr_pgserr(true);
        w.set_clr_strberr(true);
        w.set_clr_incerr(true);
        w.set_clr_operr(true);
        w.set_clr_rdperr(true);
        w.set_clr_rdserr(true);
        w.set_clr_sneccerr(true);
        w.set_clr_dbeccerr(true);
    });
}

impl Flash {
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        Self(flash::Flash::new_blocking(flash))
    }

    /// Offsets that can be touched.
    fn region() -> Range<u32> {
        REGION_OFFSET..REGION_OFFSET.saturating_add(atlas_region::bytes().len() as u32)
    }
}

impl ErrorType for Flash {
    type Error = FlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError)?;
        let start = offset
            .checked_sub(REGION_OFFSET)
            .ok_or(FlashError::OUTSIDE)? as usize;
        let found = atlas_region::bytes().get(start..);
        let found = found.and_then(|found| found.get(..bytes.len()));
        let found = found.ok_or(FlashError::OUTSIDE)?;
        reading(|| {
            for (place, byte) in bytes.iter_mut().zip(found) {
                *place = *byte;
            }
        });
        Ok(())
    }

    fn capacity(&self) -> usize {
        Self::region().end as usize
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WRITE_SIZE;
    const ERASE_SIZE: usize = MAX_ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError)?;
        if !Self::region().contains(&from) {
            return Err(FlashError::OUTSIDE);
        }
        forget_errors();
        crash::begin_long_step();
        self.0
            .blocking_erase(from, to)
            .map_err(|_| FlashError::FAILED)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError)?;
        if !Self::region().contains(&offset) {
            return Err(FlashError::OUTSIDE);
        }
        forget_errors();
        self.0
            .blocking_write(offset, bytes)
            .map_err(|_| FlashError::FAILED)
    }
}

impl AtlasFlash for Flash {
    fn mapped(&self, slot: Slot) -> Option<&[u8]> {
        atlas_region::slot(slot)
    }
}
