//! Files of the machine that runs the emulator, over semihosting.

#![expect(unsafe_code, reason = "semihosting calls take addresses")]

use core::ffi::CStr;

use cortex_m_semihosting::{nr, syscall};

/// An open file.
#[derive(Debug)]
pub struct File {
    handle: usize,
}

impl Drop for File {
    fn drop(&mut self) {
        // SAFETY: the call takes a handle.
        unsafe {
            syscall(nr::CLOSE, &[self.handle]);
        }
    }
}

impl File {
    /// Opens a file that exists, to read and write it. `None` when there is none.
    pub fn open(name: &CStr) -> Option<Self> {
        let arguments = [
            name.as_ptr().addr(),
            nr::open::RW_BINARY,
            name.count_bytes(),
        ];
        // SAFETY: the name lives until the call returns.
        let handle = unsafe { syscall(nr::OPEN, &arguments) };
        (handle != usize::MAX).then_some(Self { handle })
    }

    /// Bytes of the file.
    pub fn len(&self) -> Option<usize> {
        // SAFETY: the call takes a handle.
        let len = unsafe { syscall(nr::FLEN, &[self.handle]) };
        (len != usize::MAX).then_some(len)
    }

    /// Reads from `offset` on, and gives how many bytes there were.
    pub fn read(&self, offset: usize, bytes: &mut [u8]) -> usize {
        if !self.seek(offset) {
            return 0;
        }
        let arguments = [self.handle, bytes.as_mut_ptr().addr(), bytes.len()];
        // SAFETY: so many bytes can be written there.
        let missing = unsafe { syscall(nr::READ, &arguments) };
        bytes.len().saturating_sub(missing)
    }

    /// Writes all at `offset`.
    pub fn write(&self, offset: usize, bytes: &[u8]) -> bool {
        let arguments = [self.handle, bytes.as_ptr().addr(), bytes.len()];
        // SAFETY: so many bytes can be read there.
        self.seek(offset) && unsafe { syscall(nr::WRITE, &arguments) } == 0
    }

    fn seek(&self, offset: usize) -> bool {
        // SAFETY: the call takes a handle and a number.
        unsafe { syscall(nr::SEEK, &[self.handle, offset]) == 0 }
    }
}
