//! Checks on the target what must hold there, and prints the numbers that a host compares with its own.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use eigenmark_core::{
    atlas::{Atlas, AtlasError},
    explore, kernel,
    localizer::{DIGEST_LEN, Localizer, digest, reduction_matches_reference},
    navigator::{self, BOARD_PLACES, BOARD_STATES, Memory},
    slots::Slot,
    track::{self, Odometry},
};
use eigenmark_firmware::{
    atlas_region, fail,
    guard::Guard,
    panicked,
    room::{Begin, Room},
    stack, succeed,
};
use static_cell::ConstStaticCell;

eigenmark_firmware::logger!();

/// Budget of the stack of a fix, in bytes.
const STACK_BYTES: usize = 8 * 1024;

/// Pseudo-random cases in which the fast kernels are compared with the portable ones; more where the environment of the
/// build says so.
const TWIN_CASES: u32 = match option_env!("EIGENMARK_TWIN_CASES") {
    None => 2000,
    Some(cases) => match u32::from_str_radix(cases, 10) {
        Ok(cases) => cases,
        Err(_) => panic!("EIGENMARK_TWIN_CASES is not a number"),
    },
};

/// The same with what they read and write at the edges of a guarded room.
const EDGE_CASES: u32 = 500;

/// Path integration, and its frames.
struct Path {
    odometry: Odometry,
    pixels: Pixels,
}

/// All that flies, and its frames.
struct Flight {
    memory: Memory<BOARD_STATES, BOARD_PLACES>,
    pixels: Pixels,
}

/// Pixels of a frame, at a whole word as a camera's are.
#[repr(align(4))]
struct Pixels([u8; DIGEST_LEN]);

impl Begin for Path {
    const BEGIN: Self = Self {
        odometry: Odometry::whole(),
        pixels: Pixels::BEGIN,
    };
}

impl Begin for Flight {
    const BEGIN: Self = Self {
        memory: Memory::new(),
        pixels: Pixels::BEGIN,
    };
}

impl Begin for Pixels {
    const BEGIN: Self = Self([0; _]);
}

const ROOM_LEN: usize = size_of::<Path>();

static ROOM: ConstStaticCell<Room<ROOM_LEN>> = ConstStaticCell::new(Room::new());

#[cortex_m_rt::entry]
fn main() -> ! {
    let room = ROOM.take();
    // What needs more of the stack comes later.
    let Path { odometry, pixels } = room.hold();
    let track = track::digest(odometry, &mut pixels.0);
    let odometry_stack = stack::high_water_mark();
    let Some(atlas) = atlas_region::in_slot(Slot::A) else {
        fail()
    };
    let flash = atlas_region::bytes();
    let len = atlas.total_len() as usize;
    check(
        "an atlas that is cut short is refused",
        matches!(
            Atlas::parse(&flash[..len - 1]),
            Err(AtlasError::Truncated { .. })
        ),
    );
    check(
        "an atlas that is not aligned is refused",
        matches!(
            Atlas::parse(&flash[4..]),
            Err(AtlasError::Misaligned { offset: 4 })
        ),
    );
    let Path { pixels, .. } = room.hold();
    let Pixels(pixels) = pixels;
    check(
        "the reduction matches its reference",
        reduction_matches_reference(pixels),
    );

    let digest = digest(&atlas, pixels);
    let stack = stack::high_water_mark();
    check("the stack stays within its budget", stack <= STACK_BYTES);
    let Flight { memory, pixels } = room.hold();
    let navigate = navigator::digest(atlas.clone(), memory, &mut pixels.0);
    let navigator_stack = stack::high_water_mark();
    if let Err(kernel) = kernel::compare(1, TWIN_CASES) {
        defmt::error!("the twins of a kernel disagree: {}", kernel);
        fail()
    }
    defmt::info!("kernels match their twins in {} cases: ok", TWIN_CASES);
    stay_within_edges(room);
    defmt::println!(
        "{{\"atlas\":\"{:08x}\",\"digest\":\"{:08x}\",\"explore\":\"{:08x}\",\"track\":\"{:08x}\",\"navigate\":\"{:08x}\",\"localizer_bytes\":{},\"stack_bytes\":{},\"odometry_bytes\":{},\"odometry_stack_bytes\":{},\"navigator_bytes\":{},\"navigator_stack_bytes\":{}}}",
        atlas.crc(),
        digest,
        explore::digest(),
        track,
        navigate,
        size_of::<Localizer<'_>>(),
        stack,
        size_of::<Odometry>(),
        odometry_stack,
        size_of::<Memory<BOARD_STATES, BOARD_PLACES>>(),
        navigator_stack,
    );
    succeed()
}

/// Runs kernels at the edges of a guarded room.
#[inline(never)] // its room is not the caller's
fn stay_within_edges(room: &'static mut Room<ROOM_LEN>) {
    let Some(mut guard) = Guard::new(room.hold()) else {
        fail()
    };
    check("guards are noticed", guard.notices_its_neighbors());
    if let Err(kernel) = kernel::compare_at_edges(1, EDGE_CASES, guard.room()) {
        defmt::error!("the twins of a kernel disagree at an edge: {}", kernel);
        fail()
    }
    check("kernels stay within their slices", guard.is_untouched());
}

fn check(what: &'static str, holds: bool) {
    if !holds {
        defmt::error!("{=str}: failed", what);
        fail()
    }
    defmt::info!("{=str}: ok", what);
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    panicked(info)
}
