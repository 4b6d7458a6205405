//! The flash region that holds atlases, as `memory.x` declares it: two slots.

#![expect(
    unsafe_code,
    reason = "the linker's symbols are the only way to the region"
)]

use eigenmark_core::atlas::Atlas;

/// A slot of the atlas region.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub enum Slot {
    /// The first slot; an atlas in it may be as long as the whole region.
    A,
    /// The second slot.
    B,
}

/// Everything from the start of `slot` to the end of the region.
#[must_use]
pub fn bytes(slot: Slot) -> &'static [u8] {
    unsafe extern "C" {
        static __atlas_start: u8;
        static __atlas_slot_b: u8;
        static __atlas_end: u8;
    }
    // SAFETY: the symbols come from memory.x, which asserts that the region is flash that nothing else uses; flash is
    // readable, initialized, and not written while the firmware runs.
    unsafe {
        let start = match slot {
            Slot::A => &raw const __atlas_start,
            Slot::B => &raw const __atlas_slot_b,
        };
        let len = (&raw const __atlas_end).addr() - start.addr();
        core::slice::from_raw_parts(start, len)
    }
}

/// The atlas in the first slot that holds a valid one; says why the others do not.
#[must_use]
pub fn find() -> Option<(Slot, Atlas<'static>)> {
    [Slot::A, Slot::B]
        .into_iter()
        .find_map(|slot| match Atlas::parse(bytes(slot)) {
            Ok(atlas) => Some((slot, atlas)),
            Err(error) => {
                defmt::warn!("slot {}: {}", slot, error);
                None
            }
        })
}
