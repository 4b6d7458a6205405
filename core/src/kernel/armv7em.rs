//! The kernels for Cortex-M4 and M7: UXTB16 unpacks two pixels, SMLAD multiplies and adds two pairs, USADA8 adds four
//! bytes, LDM loads several words in one instruction.
//!
//! Registers r6 and r7 belong to the compiler and cannot be named as operands; where they are needed they are pushed
//! and popped around the loop.

#![expect(unsafe_code, reason = "these instructions exist only in assembly")]

use core::{
    arch::{asm, naked_asm},
    mem::MaybeUninit,
};

use super::{
    BATCH, Cuts, Greatest, PAIRS_PER_GROUP, PIXELS_PER_GROUP, Pair, Pixels, ROWS_PER_BLOCK, SIX,
    Weights, Width, portable,
};

/// See [`portable::add_blocks`]: for blocks of whole words 4 instructions per word and 5 per block.
pub fn add_blocks(row: &[u8], block: usize, sums: &mut [u32]) {
    let count = row.len().checked_div(block).unwrap_or(0).min(sums.len());
    if !block.is_multiple_of(PIXELS_PER_GROUP) || count == 0 {
        return portable::add_blocks(row, block, sums);
    }
    // SAFETY: the loops read `count` runs of `block` bytes, a multiple of four and not zero, from `row`, which is at
    // least that long, and as many sums. LDR needs no alignment.
    unsafe {
        asm!(
            "2:",
            "ldr    {sum}, [{sums}]",
            "add    {end}, {at}, {block}",
            "3:",
            "ldr    {word}, [{at}], #4",
            "usada8 {sum}, {word}, {zero}, {sum}",
            "cmp    {at}, {end}",
            "bne    3b",
            "str    {sum}, [{sums}], #4",
            "cmp    {sums}, {last}",
            "bne    2b",
            at = inout(reg) row.as_ptr() => _,
            sums = inout(reg) sums.as_mut_ptr() => _,
            last = in(reg) sums.as_ptr().wrapping_add(count),
            block = in(reg) block,
            zero = in(reg) 0,
            sum = out(reg) _,
            end = out(reg) _,
            word = out(reg) _,
            options(nostack),
        );
    }
}

/// See [`portable::sum_cuts`]: about 16 instructions per column, an instruction per pixel, and 4 for each that does not
/// fill a word.
pub fn sum_cuts(row: &[u8], cuts: &Cuts, sums: &mut [u32]) {
    let slice = cuts.as_slice();
    if row.len() < cuts.pixels() || sums.len() < slice.len() {
        return portable::sum_cuts(row, cuts, sums);
    }
    let range = slice.as_ptr_range();
    // SAFETY: the loop reads the cuts, which are never none, as many pixels as they take together, which `row` holds as
    // was just checked, and writes as many sums, for which there is room. LDR and LDRH need no alignment here.
    unsafe {
        asm!(
            "2:",
            "ldrh   r9, [r1], #2",
            "ldrh   r10, [r1], #2",
            "ldrh   r12, [r1], #2",
            "mul    r9, r9, r8",
            "mov    r11, #0",
            "subs   r10, r10, #4",
            "blt    4f",
            "3:",
            "ldr    lr, [r0], #4",
            "usada8 r11, lr, r5, r11",
            "subs   r10, r10, #4",
            "bge    3b",
            "4:",
            "adds   r10, r10, #4",
            "beq    6f",
            "5:",
            "ldrb   lr, [r0], #1",
            "subs   r10, r10, #1",
            "add    r11, r11, lr",
            "bne    5b",
            "6:",
            "mla    r9, r11, r4, r9",
            "cmp    r12, #0",
            "beq    7f",
            "ldrb   r8, [r0], #1",
            "mla    r9, r12, r8, r9",
            "7:",
            "str    r9, [r2], #4",
            "cmp    r1, r3",
            "bne    2b",
            inout("r0") row.as_ptr() => _,
            inout("r1") range.start => _,
            inout("r2") sums.as_mut_ptr() => _,
            in("r3") range.end,
            in("r4") cuts.unit(),
            in("r5") 0,
            inout("r8") 0 => _,
            out("r9") _,
            out("r10") _,
            out("r11") _,
            out("r12") _,
            out("lr") _,
            options(nostack),
        );
    }
}

/// Twelve pixels of one row at r0: r11 and r12 collect the sums of the first and the last four, the halves of lr those
/// of the two and two between. `$load` brings them into r8, r9, r10, `$next` moves on to the next row.
macro_rules! twelve {
    ($load:literal, $next:literal) => {
        concat!(
            $load,
            $next,
            "usada8  r11, r8, r2, r11\n",
            "usada8  r12, r10, r2, r12\n",
            "uxtab16 lr, lr, r9\n",
            "uxtab16 lr, lr, r9, ror #8\n",
        )
    };
}

/// One row of view pixels, two by two.
macro_rules! sixfold {
    ($load:literal, $load_last:literal, $source:ident, $stride:ident, $view:ident) => {
        asm!(
            "2:",
            $load,
            "add     r0, r0, r1",
            "usad8   r11, r8, r2",
            "usad8   r12, r10, r2",
            "uxtb16  lr, r9",
            "uxtab16 lr, lr, r9, ror #8",
            twelve!($load, "add r0, r0, r1\n"),
            twelve!($load, "add r0, r0, r1\n"),
            twelve!($load, "add r0, r0, r1\n"),
            twelve!($load, "add r0, r0, r1\n"),
            twelve!($load_last, "sub r0, r0, r1, lsl #2\nsub r0, r0, r1\n"),
            "uxtah   r11, r11, lr",
            "add     r12, r12, lr, lsr #16",
            "smmulr  r11, r11, r3",
            "smmulr  r12, r12, r3",
            "strb    r11, [r4], #1",
            "strb    r12, [r4], #1",
            "cmp     r4, r5",
            "bne     2b",
            inout("r0") $source.as_ptr() => _,
            in("r1") $stride,
            in("r2") 0,
            in("r3") RECIPROCAL_OF_36,
            inout("r4") $view.start => _,
            in("r5") $view.end,
            out("r8") _,
            out("r9") _,
            out("r10") _,
            out("r11") _,
            out("r12") _,
            out("lr") _,
            options(nostack),
        )
    };
}

/// ⌈2³²/36⌉: SMMULR with it divides by 36 and rounds half up, exactly for sums up to 2³¹/36.
const RECIPROCAL_OF_36: u32 = 119_304_648;

/// See [`portable::reduce_sixfold`]: 45 instructions per two blocks, or 0.63 per pixel; 58 when rows do not start at
/// whole words, where LDM may not load.
pub fn reduce_sixfold(source: &[u8], stride: usize, view: &mut [u8]) {
    let is_whole = view.len().is_multiple_of(2) && !view.is_empty();
    let needed = stride
        .saturating_mul(SIX - 1)
        .saturating_add(view.len() * SIX);
    if !is_whole || source.len() < needed {
        return portable::reduce_sixfold(source, stride, view);
    }
    let is_aligned = source.as_ptr().cast::<u32>().is_aligned() && stride.is_multiple_of(4);
    let view = view.as_mut_ptr_range();
    // SAFETY: the loops read six runs of as many bytes as `needed` counts, which `source` holds as was just checked,
    // `stride` apart, and write the view's bytes, an even number and not zero. LDM is used at aligned addresses only;
    // LDR needs no alignment.
    unsafe {
        if is_aligned {
            sixfold!(
                "ldm r0, {{r8, r9, r10}}\n",
                "ldm r0!, {{r8, r9, r10}}\n",
                source,
                stride,
                view
            );
        } else {
            sixfold!(
                "ldr r8, [r0]\nldr r9, [r0, #4]\nldr r10, [r0, #8]\n",
                "ldr r8, [r0]\nldr r9, [r0, #4]\nldr r10, [r0, #8]\nadd r0, r0, #12\n",
                source,
                stride,
                view
            );
        }
    }
}

/// One group of pixels at r0 times five rows of weights at r1, added to r3, r4, r5, r8, r9: 16 instructions.
macro_rules! block_group {
    () => {
        "
        ldr    r11, [r0], #4
        uxtb16 r10, r11
        uxtb16 r11, r11, ror #8
        ldm    r1!, {{r6, r7, r12, lr}}
        smlad  r3, r6, r10, r3
        smlad  r3, r7, r11, r3
        smlad  r4, r12, r10, r4
        smlad  r4, lr, r11, r4
        ldm    r1!, {{r6, r7, r12, lr}}
        smlad  r5, r6, r10, r5
        smlad  r5, r7, r11, r5
        smlad  r8, r12, r10, r8
        smlad  r8, lr, r11, r8
        ldm    r1!, {{r6, r7}}
        smlad  r9, r6, r10, r9
        smlad  r9, r7, r11, r9
        "
    };
}

/// See [`portable::block_dots`].
///
/// 16 instructions per group and half an instruction for the loop; of those, 10 multiply.
pub fn block_dots(pixels: &[Pixels], weights: &[Pair]) -> [i32; ROWS_PER_BLOCK] {
    let groups = pixels.len().min(weights.len() / PAIRS_PER_GROUP);
    let (mut d0, mut d1, mut d2, mut d3, mut d4) = (0, 0, 0, 0, 0);
    // SAFETY: the loops read `groups` words from `pixels` and ten times as many from `weights`, which are at least
    // that long. r6 and r7 are restored, everything else that changes
    // is an operand.
    unsafe {
        asm!(
            "push   {{r6, r7}}",
            "ands   r10, r2, #3",
            "beq    3f",
            "2:",
            block_group!(),
            "sub    r2, r2, #1",
            "ands   r10, r2, #3",
            "bne    2b",
            "3:",
            "cmp    r2, #0",
            "beq    5f",
            "4:",
            block_group!(),
            block_group!(),
            block_group!(),
            block_group!(),
            "subs   r2, r2, #4",
            "bne    4b",
            "5:",
            "pop    {{r6, r7}}",
            inout("r0") pixels.as_ptr() => _,
            inout("r1") weights.as_ptr() => _,
            inout("r2") groups => _,
            inout("r3") d0,
            inout("r4") d1,
            inout("r5") d2,
            inout("r8") d3,
            inout("r9") d4,
            out("r10") _,
            out("r11") _,
            out("r12") _,
            out("lr") _,
            options(readonly),
        );
    }
    [d0, d1, d2, d3, d4]
}

/// Four pixels at r0 times four 8-bit weights at r1, added to r3: 8 instructions.
macro_rules! mean_group {
    ($pixels:literal, $weights:literal) => {
        concat!(
            "uxtb16 r8, ",
            $pixels,
            "\n",
            "sxtb16 r9, ",
            $weights,
            "\n",
            "smlad  r3, r8, r9, r3\n",
            "uxtb16 r8, ",
            $pixels,
            ", ror #8\n",
            "sxtb16 r9, ",
            $weights,
            ", ror #8\n",
            "smlad  r3, r8, r9, r3\n",
        )
    };
}

/// See [`portable::mean_dot`].
pub fn mean_dot(pixels: &[Pixels], weights: &[Weights]) -> i32 {
    let groups = pixels.len().min(weights.len());
    let whole = groups & !3;
    let rest = whole..groups;
    let mut dot = portable::mean_dot(&pixels[rest.clone()], &weights[rest]);
    if whole > 0 {
        // SAFETY: the loop reads `whole` words, a multiple of four and not zero, from slices that are at least that
        // long.
        unsafe {
            asm!(
                "2:",
                "ldm    r0!, {{r4, r5, r10, r11}}",
                "ldm    r1!, {{r12, lr}}",
                mean_group!("r4", "r12"),
                mean_group!("r5", "lr"),
                "ldm    r1!, {{r12, lr}}",
                mean_group!("r10", "r12"),
                mean_group!("r11", "lr"),
                "subs   r2, r2, #4",
                "bne    2b",
                inout("r0") pixels.as_ptr() => _,
                inout("r1") weights.as_ptr() => _,
                inout("r2") whole => _,
                inout("r3") dot,
                out("r4") _,
                out("r5") _,
                out("r8") _,
                out("r9") _,
                out("r10") _,
                out("r11") _,
                out("r12") _,
                out("lr") _,
                options(readonly, nostack),
            );
        }
    }
    dot
}

/// Σy of a register into r3 and Σy² into r4; r2 is zero.
macro_rules! statistics_group {
    ($pixels:literal) => {
        concat!(
            "usada8 r3, ",
            $pixels,
            ", r2, r3\n",
            "uxtb16 r12, ",
            $pixels,
            "\n",
            "smlad  r4, r12, r12, r4\n",
            "uxtb16 r12, ",
            $pixels,
            ", ror #8\n",
            "smlad  r4, r12, r12, r4\n",
        )
    };
}

/// See [`portable::dot_pair`]: one instruction.
#[inline(always)]
pub fn dot_pair(a: u32, b: u32, sum: i32) -> i32 {
    let result;
    // SAFETY: it reads and writes registers only; overflow sets a flag that nothing reads.
    unsafe {
        asm!(
            "smlad {result}, {a}, {b}, {sum}",
            result = lateout(reg) result,
            a = in(reg) a,
            b = in(reg) b,
            sum = in(reg) sum,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    result
}

/// See [`portable::subtract_pairs`]: one instruction.
#[inline(always)]
pub fn subtract_pairs(a: u32, b: u32) -> u32 {
    let result;
    // SAFETY: it reads and writes registers only.
    unsafe {
        asm!(
            "ssub16 {result}, {a}, {b}",
            result = lateout(reg) result,
            a = in(reg) a,
            b = in(reg) b,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    result
}

/// See [`portable::statistics`].
pub fn statistics(pixels: &[Pixels]) -> (u32, u32) {
    let whole = pixels.len() & !3;
    let (mut sum, mut squares) = portable::statistics(&pixels[whole..]);
    if whole > 0 {
        // SAFETY: the loop reads `whole` words, a multiple of four and not zero, from a slice that is at least that
        // long.
        unsafe {
            asm!(
                "2:",
                "ldm    r0!, {{r5, r8, r9, r10}}",
                statistics_group!("r5"),
                statistics_group!("r8"),
                statistics_group!("r9"),
                statistics_group!("r10"),
                "subs   r1, r1, #4",
                "bne    2b",
                inout("r0") pixels.as_ptr() => _,
                inout("r1") whole => _,
                in("r2") 0,
                inout("r3") sum,
                inout("r4") squares,
                out("r5") _,
                out("r8") _,
                out("r9") _,
                out("r10") _,
                out("r12") _,
                options(readonly, nostack),
            );
        }
    }
    (sum, squares)
}

/// The row at r0 times the eight words of the view in r2 to r5 and r8 to r11, stored at r1: 12 instructions.
macro_rules! row_of_eight_words {
    () => {
        "
        ldm    r0!, {{r6, r7, r12, lr}}
        smuad  r6, r6, r2
        smlad  r6, r7, r3, r6
        smlad  r6, r12, r4, r6
        smlad  r6, lr, r5, r6
        ldm    r0!, {{r7, r12, lr}}
        smlad  r6, r7, r8, r6
        smlad  r6, r12, r9, r6
        smlad  r6, lr, r10, r6
        ldr    r7, [r0], #4
        smlad  r6, r7, r11, r6
        str    r6, [r1], #4
        "
    };
}

/// Room for the dot products of a batch: not initialized before it is used, because that takes as long as ten rows.
pub struct Dots([MaybeUninit<i32>; BATCH]);

impl Dots {
    pub fn new() -> Self {
        Self([MaybeUninit::uninit(); BATCH])
    }

    /// See [`portable::Dots::of`].
    #[inline]
    pub fn of(&mut self, width: Width, view: &[Pair], rows: &[Pair], count: usize) -> &[i32] {
        let (len, count) = (width.words(view), count.min(BATCH));
        let dots = &mut self.0[..count];
        if rows.len() < count * len {
            return &[];
        }
        match width {
            Width::I16 if len == 8 => eight_words(view, rows, dots),
            Width::I16 if len > 0 => dots_i16(view, rows, dots),
            Width::I8 if len > 0 => dots_i8(view, rows, dots),
            _ => dots.fill(MaybeUninit::new(0)),
        }
        // SAFETY: all of them have been written.
        unsafe { initialized(dots) }
    }
}

/// The numbers themselves.
///
/// # Safety
/// All of them have been written.
unsafe fn initialized(dots: &[MaybeUninit<i32>]) -> &[i32] {
    // SAFETY: by the contract, and because the layout is the same.
    unsafe { &*(core::ptr::from_ref(dots) as *const [i32]) }
}

/// See [`portable::dots_i16`]. The view is read once for two rows: 1.5 instructions per two coefficients, and 5 per
/// row.
#[inline(never)]
fn dots_i16(view: &[Pair], rows: &[Pair], dots: &mut [MaybeUninit<i32>]) {
    in_pairs(rows, view.len(), dots, |a, b, pairs, dots| {
        // SAFETY: the caller gives pairs of rows inside of `rows`, each as long as `view`, and two dots per pair.
        unsafe { pairs_i16(view.as_ptr(), a, b, view.len(), dots, pairs) }
    });
}

/// See [`portable::dots_i8`]: 2 instructions per two coefficients, and 5 per row.
#[inline(never)]
fn dots_i8(view: &[Pair], rows: &[Pair], dots: &mut [MaybeUninit<i32>]) {
    let words = view.len() / 2;
    in_pairs(rows, words, dots, |a, b, pairs, dots| {
        // SAFETY: the caller gives pairs of rows inside of `rows`, each half as long as `view`, and two dots per
        // pair.
        unsafe { pairs_i8(view.as_ptr(), a, b, words, dots, pairs) }
    });
    for dot in dots {
        // SAFETY: `in_pairs` has written all of them.
        dot.write(unsafe { dot.assume_init() } >> 8);
    }
}

/// Hands rows of `words` words, as many as there are dots, to `work(a, b, pairs, dots)`: pairs that follow each
/// other from `a` and `b` on, then an odd last row as a pair of itself. All dots are zero when there are fewer rows.
fn in_pairs(
    rows: &[Pair],
    words: usize,
    dots: &mut [MaybeUninit<i32>],
    work: impl Fn(*const Pair, *const Pair, usize, *mut i32),
) {
    if rows.len() < dots.len() * words {
        return dots.fill(MaybeUninit::new(0));
    }
    let row = |index: usize| rows.as_ptr().wrapping_add(index * words);
    let even = dots.len() & !1;
    let (dots, last) = dots.split_at_mut(even);
    if even > 0 {
        work(row(0), row(1), even / 2, dots.as_mut_ptr().cast());
    }
    if let [dot] = last {
        let mut both = [0; 2];
        work(row(even), row(even), 1, both.as_mut_ptr());
        dot.write(both[0]);
    }
}

/// Rows of sixteen coefficients, one after the other: 13 instructions per row, because the view stays in registers.
#[inline(never)] // once in flash
fn eight_words(view: &[Pair], rows: &[Pair], dots: &mut [MaybeUninit<i32>]) {
    if dots.is_empty() {
        return;
    }
    // SAFETY: the loops read eight words of `view`, and eight of `rows` and one of `dots` as often as `dots` is long;
    // its caller made sure of their lengths. The number of rows left is kept on the stack while no
    // register is free. r6 and r7 are restored, everything else that changes is an operand.
    unsafe {
        asm!(
            "push   {{r6, r7}}",
            "push   {{r2, r3}}",
            "ldm    r12, {{r2, r3, r4, r5, r8, r9, r10, r11}}",
            "ldr    r6, [sp]",
            "ands   r6, r6, #3",
            "beq    3f",
            "2:",
            row_of_eight_words!(),
            "ldr    r6, [sp]",
            "sub    r6, r6, #1",
            "str    r6, [sp]",
            "ands   r6, r6, #3",
            "bne    2b",
            "3:",
            "ldr    r6, [sp]",
            "cmp    r6, #0",
            "beq    5f",
            "4:",
            row_of_eight_words!(),
            row_of_eight_words!(),
            row_of_eight_words!(),
            row_of_eight_words!(),
            "ldr    r6, [sp]",
            "subs   r6, r6, #4",
            "str    r6, [sp]",
            "bne    4b",
            "5:",
            "add    sp, sp, #8",
            "pop    {{r6, r7}}",
            inout("r0") rows.as_ptr() => _,
            inout("r1") dots.as_mut_ptr().cast::<i32>() => _,
            inout("r2") dots.len() => _,
            out("r3") _,
            out("r4") _,
            out("r5") _,
            out("r8") _,
            out("r9") _,
            out("r10") _,
            out("r11") _,
            inout("r12") view.as_ptr() => _,
            out("lr") _,
        );
    }
}

/// The loop over pairs of rows: `$four` multiplies four words of the view at r2 with those of the rows at r0 and r1,
/// `$one` one word; r4 and r5 collect the dot products.
///
/// On the stack: where the next dots go, the row's length in bytes, the end of the dots, the view, its words.
macro_rules! pairs {
    ($four:expr, $one:expr, $view:ident, $a:ident, $b:ident, $words:ident, $row_bytes:expr, $dots:ident, $pairs:ident) => {
        asm!(
            "push   {{r6, r7}}",
            "push   {{r4, r5}}",
            "push   {{r8, r9, r10}}",
            "2:",
            "ldrd   r2, r3, [sp, #12]",
            "mov    r4, #0",
            "mov    r5, #0",
            "subs   r3, r3, #8",
            "blt    4f",
            "3:",
            $four,
            $four,
            "subs   r3, r3, #8",
            "bge    3b",
            "4:",
            "adds   r3, r3, #8",
            "beq    6f",
            "tst    r3, #4",
            "beq    5f",
            $four,
            "subs   r3, r3, #4",
            "beq    6f",
            "5:",
            $one,
            "subs   r3, r3, #1",
            "bne    5b",
            "6:",
            "ldm    sp, {{r6, r7, r12}}",
            "stm    r6!, {{r4, r5}}",
            "str    r6, [sp]",
            "mov    r0, r1",
            "add    r1, r1, r7",
            "cmp    r6, r12",
            "bne    2b",
            "add    sp, sp, #20",
            "pop    {{r6, r7}}",
            inout("r0") $a => _,
            inout("r1") $b => _,
            out("r2") _,
            out("r3") _,
            inout("r4") $view => _,
            inout("r5") $words => _,
            inout("r8") $dots => _,
            inout("r9") $row_bytes => _,
            inout("r10") $dots.wrapping_add(2 * $pairs) => _,
            out("r11") _,
            out("r12") _,
            out("lr") _,
        )
    };
}

/// Dot products of pairs of rows.
///
/// # Safety
/// `view` points to `words` words, `a` and `b` to the first two rows of `pairs` pairs of as many each;
/// `dots` has room for two numbers per pair; neither `words` nor `pairs` is zero.
unsafe fn pairs_i16(
    view: *const Pair,
    a: *const Pair,
    b: *const Pair,
    words: usize,
    dots: *mut i32,
    pairs: usize,
) {
    // SAFETY: by the contract all addresses that are read and written are inside of what the pointers point to. r6
    // and r7 and the stack are restored, everything else that changes is an operand.
    unsafe {
        pairs!(
            "
            ldm    r2!, {{r8, r9, r10, r11}}
            ldm    r0!, {{r6, r7, r12, lr}}
            smlad  r4, r6, r8, r4
            smlad  r4, r7, r9, r4
            smlad  r4, r12, r10, r4
            smlad  r4, lr, r11, r4
            ldm    r1!, {{r6, r7, r12, lr}}
            smlad  r5, r6, r8, r5
            smlad  r5, r7, r9, r5
            smlad  r5, r12, r10, r5
            smlad  r5, lr, r11, r5
            ",
            "
            ldr    r8, [r2], #4
            ldr    r6, [r0], #4
            ldr    r7, [r1], #4
            smlad  r4, r6, r8, r4
            smlad  r5, r7, r8, r5
            ",
            view,
            a,
            b,
            words,
            words * 4,
            dots,
            pairs
        );
    }
}

/// Two words of 8-bit coefficients at r0 and at r1 times four words of the view at r2: 15 instructions.
macro_rules! pairs_of_two_words {
    () => {
        "
        ldm    r2!, {{r8, r9, r10, r11}}
        ldm    r0!, {{r6, r7}}
        smlad  r4, r6, r8, r4
        sxtb16 r6, r6
        smlad  r4, r6, r9, r4
        smlad  r4, r7, r10, r4
        sxtb16 r7, r7
        smlad  r4, r7, r11, r4
        ldm    r1!, {{r12, lr}}
        smlad  r5, r12, r8, r5
        sxtb16 r12, r12
        smlad  r5, r12, r9, r5
        smlad  r5, lr, r10, r5
        sxtb16 lr, lr
        smlad  r5, lr, r11, r5
        "
    };
}

/// 256 times the dot products of pairs of rows.
///
/// # Safety
/// As of [`pairs_i16`], but `view` points to twice as many words.
unsafe fn pairs_i8(
    view: *const Pair,
    a: *const Pair,
    b: *const Pair,
    words: usize,
    dots: *mut i32,
    pairs: usize,
) {
    // SAFETY: as in `pairs_i16`.
    unsafe {
        pairs!(
            concat!(pairs_of_two_words!(), pairs_of_two_words!()),
            "
            ldm    r2!, {{r8, r9}}
            ldr    r6, [r0], #4
            ldr    r12, [r1], #4
            smlad  r4, r6, r8, r4
            sxtb16 r6, r6
            smlad  r4, r6, r9, r4
            smlad  r5, r12, r8, r5
            sxtb16 r12, r12
            smlad  r5, r12, r9, r5
            ",
            view,
            a,
            b,
            words,
            words * 4,
            dots,
            pairs
        );
    }
}

/// See [`portable::keep_greatest`]: 9 instructions per row, and up to 11 for one that is taken in.
///
/// m·(offset + norm) − dot·c is negative when dot/(offset + norm) is greater than m/c; c is kept negated. Rows are kept
/// as what r0 is after their dot product was read.
#[inline]
pub fn keep_greatest(
    dots: &[i32],
    norms: &[u32],
    offset: i32,
    start: u32,
    greatest: &mut Greatest,
) {
    let range = dots[..dots.len().min(norms.len())].as_ptr_range();
    if range.is_empty() {
        return;
    }
    let Greatest { first, second } = greatest;
    let (mut first_at, mut second_at) = (core::ptr::null::<i32>(), core::ptr::null::<i32>());
    let row_of = |at: *const i32| start + ((at.addr() - range.start.addr()) / 4) as u32 - 1;
    let first_before = *first;
    // SAFETY: the loop reads as many numbers from `norms` as from `dots`, up to its end; both are at least that long.
    // r6 and r7 hold the rows and are restored; they begin as r10 and r11, where they end as well.
    unsafe {
        asm!(
            "push   {{r6, r7}}",
            "mov    r6, r10",
            "mov    r7, r11",
            "2:",
            "ldr    r8, [r0], #4",
            "ldr    r9, [r1], #4",
            "add    r9, r9, r2",
            "smull  r10, r11, r9, r4",
            "smlal  r10, r11, r8, r5",
            "cmp    r11, #0",
            "blt    4f",
            "3:",
            "cmp    r0, r3",
            "bne    2b",
            "b      6f",
            "4:",
            "smull  r10, r11, r9, r12",
            "smlal  r10, r11, r8, lr",
            "cmp    r11, #0",
            "blt    5f",
            "mov    r4, r8",
            "rsb    r5, r9, #0",
            "mov    r7, r0",
            "b      3b",
            "5:",
            "mov    r4, r12",
            "mov    r5, lr",
            "mov    r7, r6",
            "mov    r12, r8",
            "rsb    lr, r9, #0",
            "mov    r6, r0",
            "b      3b",
            "6:",
            "mov    r10, r6",
            "mov    r11, r7",
            "pop    {{r6, r7}}",
            inout("r0") range.start => _,
            inout("r1") norms.as_ptr() => _,
            in("r2") offset,
            in("r3") range.end,
            inout("r4") second.numerator,
            inout("r5") -second.denominator => second.denominator,
            out("r8") _,
            out("r9") _,
            inout("r10") first_at,
            inout("r11") second_at,
            inout("r12") first.numerator,
            inout("lr") -first.denominator => first.denominator,
            options(readonly),
        );
    }
    first.denominator = -first.denominator;
    second.denominator = -second.denominator;
    // A null pointer is a row from before; the first of them may have become the second.
    if !second_at.is_null() {
        second.row = row_of(second_at);
    } else if !first_at.is_null() {
        second.row = first_before.row;
    }
    if !first_at.is_null() {
        first.row = row_of(first_at);
    }
}

/// One row of four: whether the square in `$square` reaches `$limit`.
macro_rules! reaches {
    ($square:literal, $limit:literal, $found:literal) => {
        concat!(
            "vcmp.f32 ",
            $square,
            ", ",
            $limit,
            "\n",
            "vmrs    APSR_nzcv, fpscr\n",
            "bge     ",
            $found,
            "f\n",
        )
    };
}

/// See [`portable::find_square`]: 8 instructions per row.
pub fn find_square(dots: &[i32], norms: &[u32], least: f32) -> usize {
    let count = dots.len().min(norms.len());
    let whole = count & !3;
    if whole > 0 {
        let mut at = dots.as_ptr();
        let end = at.wrapping_add(whole);
        // SAFETY: the loop reads `whole` numbers, a multiple of four and not zero, from both slices, which are at least
        // that long.
        unsafe {
            asm!(
                "vmov    s8, r3",
                "2:",
                "vldmia  r0!, {{s0, s1, s2, s3}}",
                "vldmia  r1!, {{s4, s5, s6, s7}}",
                "vcvt.f32.s32 s0, s0",
                "vcvt.f32.s32 s1, s1",
                "vcvt.f32.s32 s2, s2",
                "vcvt.f32.s32 s3, s3",
                "vcvt.f32.s32 s4, s4",
                "vcvt.f32.s32 s5, s5",
                "vcvt.f32.s32 s6, s6",
                "vcvt.f32.s32 s7, s7",
                "vmul.f32 s0, s0, s0",
                "vmul.f32 s1, s1, s1",
                "vmul.f32 s2, s2, s2",
                "vmul.f32 s3, s3, s3",
                "vmul.f32 s4, s4, s8",
                "vmul.f32 s5, s5, s8",
                "vmul.f32 s6, s6, s8",
                "vmul.f32 s7, s7, s8",
                reaches!("s0", "s4", "3"),
                reaches!("s1", "s5", "4"),
                reaches!("s2", "s6", "5"),
                reaches!("s3", "s7", "6"),
                "cmp     r0, r2",
                "bne     2b",
                "b       7f",
                "3:",
                "sub     r0, r0, #4",
                "4:",
                "sub     r0, r0, #4",
                "5:",
                "sub     r0, r0, #4",
                "6:",
                "sub     r0, r0, #4",
                "7:",
                inout("r0") at,
                inout("r1") norms.as_ptr() => _,
                in("r2") end,
                in("r3") least.to_bits(),
                out("s0") _,
                out("s1") _,
                out("s2") _,
                out("s3") _,
                out("s4") _,
                out("s5") _,
                out("s6") _,
                out("s7") _,
                out("s8") _,
                options(readonly, nostack),
            );
        }
        if at != end {
            return (at.addr() - dots.as_ptr().addr()) / size_of::<i32>();
        }
    }
    whole + portable::find_square(&dots[whole..count], &norms[whole..count], least)
}

/// See [`portable::square_root`]: one instruction, which rounds as IEEE 754 asks for. Called as a function, whose
/// argument is in s0 already: `asm!` has no floating-point registers on this target, and four more instructions would
/// bring it there and back.
#[inline(always)]
pub fn square_root(x: f32) -> f32 {
    // SAFETY: argument and result of this calling convention are in s0, and nothing else is touched. The assembler is
    // not told by the target which floating-point unit there is.
    #[unsafe(naked)]
    extern "C" fn root(x: f32) -> f32 {
        naked_asm!(".fpu fpv4-sp-d16", "vsqrt.f32 s0, s0", "bx lr")
    }
    root(x)
}
