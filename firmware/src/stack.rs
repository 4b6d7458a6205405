//! How deep the stack has been: cortex-m-rt paints it at reset, and what is no longer painted was used.

#![expect(unsafe_code, reason = "the stack's bounds are linker symbols")]

/// The word that cortex-m-rt paints free stack with.
const PAINT: u32 = 0xcccc_cccc;

/// Bytes of stack that have been used since reset, at most.
#[must_use]
pub fn high_water_mark() -> usize {
    unsafe extern "C" {
        static _stack_start: u32;
        static _stack_end: u32;
    }
    // SAFETY: both symbols come from memory.x and bound RAM that nothing but the stack uses. Reads are
    // volatile because the words are written behind the compiler's back.
    unsafe {
        let (top, mut word) = (&raw const _stack_start, &raw const _stack_end);
        while word < top && word.read_volatile() == PAINT {
            word = word.add(1);
        }
        top.addr() - word.addr()
    }
}
