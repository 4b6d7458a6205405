//! Why flash was not read or written, on every board.

use embedded_storage::nor_flash::{NorFlashError, NorFlashErrorKind};

/// Why flash was not read or written.
#[derive(Clone, Copy, Debug)]
pub struct FlashError(pub NorFlashErrorKind);

impl FlashError {
    /// It would touch more than the atlas region.
    #[cfg(not(feature = "emulated"))]
    pub const OUTSIDE: Self = Self(NorFlashErrorKind::OutOfBounds);
    /// The flash did not do it.
    pub const FAILED: Self = Self(NorFlashErrorKind::Other);
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}
