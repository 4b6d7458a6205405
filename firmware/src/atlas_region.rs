//! The flash region that holds atlases, as `memory.x` declares it: two slots of equal length.

#![expect(
    unsafe_code,
    reason = "the linker's symbols are the only way to the region"
)]

use eigenmark_core::{
    atlas::Atlas,
    slots::{Found, Region, Slot},
};

unsafe extern "C" {
    static __atlas_start: u8;
    static __atlas_slot_b: u8;
    static __atlas_end: u8;
}

/// The whole region.
#[must_use]
pub fn bytes() -> &'static [u8] {
    // SAFETY: the symbols come from memory.x, which asserts that the region is flash that nothing else uses; flash is
    // readable and initialized. Who writes to a slot reads it anew afterwards.
    unsafe {
        let start = &raw const __atlas_start;
        let len = (&raw const __atlas_end).addr() - start.addr();
        core::slice::from_raw_parts(start, len)
    }
}

/// Bytes of a slot.
#[must_use]
pub fn slot_len() -> usize {
    (&raw const __atlas_slot_b).addr() - (&raw const __atlas_start).addr()
}

/// A slot's bytes.
#[must_use]
pub fn slot(slot: Slot) -> Option<&'static [u8]> {
    let (a, b) = bytes().split_at_checked(slot_len())?;
    Some(match slot {
        Slot::A => a,
        Slot::B => b,
    })
}

/// What is in the slots. Why there is no atlas in one is asked over the link: to log every reason takes 2 KiB of flash.
#[must_use]
pub fn read() -> Region<'static> {
    let region = Region::read(bytes(), slot_len());
    for slot in Slot::BOTH {
        if region.found(slot).atlas.is_err() {
            defmt::warn!("slot {}: no valid atlas, the link says why", slot);
        }
    }
    region
}

/// The atlas in a slot, whether or not it goes on in the next one; says why there is none.
#[must_use]
#[inline(never)] // what it looks at leaves the stack when it returns
pub fn in_slot(slot: Slot) -> Option<Atlas<'static>> {
    match Found::read(bytes(), slot_len(), slot).atlas {
        Ok(atlas) => Some(atlas),
        Err(error) => {
            defmt::warn!("slot {}: {}", slot, error);
            None
        }
    }
}
