//! The chip's flash, of which only the atlas region can be touched.

use core::ops::Range;

use eigenmark_core::slots::Slot;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, ReadNorFlash, check_erase, check_read, check_write,
};
use stm32f4xx_hal::{
    flash::{FlashExt, LockedFlash, UnlockedFlash},
    pac::FLASH,
};

use super::REGION_OFFSET;
use crate::{
    atlas_region,
    board::{AtlasFlash, flash_error::FlashError},
    crash,
};

/// Flash whose offset 0 is the chip's first sector.
pub struct Flash(LockedFlash);

impl Flash {
    pub fn new(flash: FLASH) -> Self {
        Self(LockedFlash::new(flash))
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
        let found = FlashExt::read(&self.0).get(offset as usize..);
        let found = found.and_then(|found| found.get(..bytes.len()));
        for (place, byte) in bytes.iter_mut().zip(found.ok_or(FlashError::OUTSIDE)?) {
            *place = *byte;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        Self::region().end as usize
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = <UnlockedFlash<'_> as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <UnlockedFlash<'_> as NorFlash>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError)?;
        if !Self::region().contains(&from) {
            return Err(FlashError::OUTSIDE);
        }
        crash::begin_long_step();
        let erased = NorFlash::erase(&mut self.0.unlocked(), from, to);
        forget_cached();
        erased.map_err(|_| FlashError::FAILED)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError)?;
        if !Self::region().contains(&offset) {
            return Err(FlashError::OUTSIDE);
        }
        let written = NorFlash::write(&mut self.0.unlocked(), offset, bytes);
        forget_cached();
        written.map_err(|_| FlashError::FAILED)
    }
}

impl AtlasFlash for Flash {
    fn mapped(&self, slot: Slot) -> Option<&[u8]> {
        atlas_region::slot(slot)
    }
}

/// Empties the data cache in front of flash, which does not see what is written (reference manual RM0090, 3.5.2).
fn forget_cached() {
    #[expect(
        unsafe_code,
        reason = "the flash's driver keeps its registers to itself"
    )]
    // SAFETY: the driver uses this register only when the clocks are set, before this.
    let control = unsafe { &*FLASH::ptr() }.acr();
    control.modify(|_, w| w.dcen().disabled());
    control.modify(|_, w| w.dcrst().reset());
    control.modify(|_, w| w.dcrst().no_reset().dcen().enabled());
}
