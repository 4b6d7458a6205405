//! Memory for large things of which one is needed after the other.
//!
//! Assigning a value to a static can build it on the stack first, and what is large does not fit there. Here it is
//! written in place: its bytes are known when the program is built, and nearly all of them are zeros.

#![expect(
    unsafe_code,
    reason = "the same bytes are of one type, and later of another"
)]

use core::mem::MaybeUninit;

/// What something is when it begins. Where that is all zeros, no copy of it is in flash.
pub trait Begin {
    /// As it begins.
    const BEGIN: Self;
}

/// Room for one thing of at most so many bytes.
#[repr(C, align(32))]
pub struct Room<const BYTES: usize>([MaybeUninit<u8>; BYTES]);

impl<const BYTES: usize> Room<BYTES> {
    /// Nothing is in it.
    #[must_use]
    #[expect(clippy::new_without_default, reason = "only ever a static")]
    pub const fn new() -> Self {
        Self([MaybeUninit::zeroed(); BYTES])
    }

    /// Lends the room to something, as it begins. What was in it before is gone, and not dropped.
    pub fn hold<T: Begin>(&mut self) -> &mut T {
        const {
            assert!(size_of::<T>() <= BYTES, "there is no room for it");
            assert!(
                align_of::<T>() <= align_of::<Self>(),
                "it does not lie there"
            );
        }
        let place = self.0.as_mut_ptr().cast::<T>();
        // SAFETY: the room is as large and as aligned as it has to be; it is borrowed for as long as the reference lives.
        unsafe {
            place.write(const { T::BEGIN });
            &mut *place
        }
    }
}
