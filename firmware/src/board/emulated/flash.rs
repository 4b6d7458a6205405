//! The atlas region as a file: what is written shows in memory after the next start of the emulator, which loads it there.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, ReadNorFlash, check_erase, check_read, check_write,
};

use eigenmark_core::slots::Slot;

use super::file::File;
use crate::board::{AtlasFlash, flash_error::FlashError};

/// Bytes of the smallest part that can be erased: as of the chip's large sectors.
const SECTOR_LEN: u32 = 128 * 1024;

/// Bytes at a time.
const PIECE_LEN: usize = 256;

/// Flash whose offset 0 is the start of the atlas region. Without a file it has no capacity.
#[derive(Debug)]
pub struct Flash {
    file: Option<File>,
}

impl Flash {
    pub fn open() -> Self {
        Self {
            file: File::open(c"flash.bin"),
        }
    }
}

impl ErrorType for Flash {
    type Error = FlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError)?;
        let file = self.file.as_ref().ok_or(FlashError::FAILED)?;
        let found = file.read(offset as usize, bytes);
        if found == bytes.len() {
            Ok(())
        } else {
            Err(FlashError::FAILED)
        }
    }

    fn capacity(&self) -> usize {
        self.file.as_ref().and_then(File::len).unwrap_or(0)
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR_LEN as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError)?;
        let file = self.file.as_ref().ok_or(FlashError::FAILED)?;
        for offset in (from..to).step_by(PIECE_LEN) {
            if !file.write(offset as usize, &[0xff; PIECE_LEN]) {
                return Err(FlashError::FAILED);
            }
        }
        Ok(())
    }

    /// Only clears bits, as flash does.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError)?;
        let mut offset = offset as usize;
        for piece in bytes.chunks(PIECE_LEN) {
            let mut kept = [0; PIECE_LEN];
            let file = self.file.as_ref().ok_or(FlashError::FAILED)?;
            let kept = kept.get_mut(..piece.len()).ok_or(FlashError::FAILED)?;
            if file.read(offset, kept) != piece.len() {
                return Err(FlashError::FAILED);
            }
            for (kept, byte) in kept.iter_mut().zip(piece) {
                *kept &= byte;
            }
            if !file.write(offset, kept) {
                return Err(FlashError::FAILED);
            }
            offset += piece.len();
        }
        Ok(())
    }
}

impl AtlasFlash for Flash {
    fn mapped(&self, _: Slot) -> Option<&[u8]> {
        None
    }
}
