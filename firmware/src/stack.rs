//! How deep the stack has been: cortex-m-rt paints it at reset, and what is no longer painted was used.

/// The word that cortex-m-rt paints free stack with.
#[cfg(target_os = "none")]
const PAINT: u32 = 0xcccc_cccc;

/// Bytes of stack that have been used since reset, at most; 0 on a host, where nothing paints it.
#[must_use]
pub fn high_water_mark() -> usize {
    #[cfg(target_os = "none")]
    #[expect(unsafe_code, reason = "the stack's bounds are linker symbols")]
    {
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
    #[cfg(not(target_os = "none"))]
    0
}
