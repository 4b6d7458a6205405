//! Checks on the target what must hold there, and prints the numbers that a host compares with its own.

#![no_std]
#![no_main]

use eigenmark_core::{
    atlas::{Atlas, AtlasError},
    explore, kernel,
    localizer::{Localizer, digest, reduction_matches_reference},
    navigator::{self, BOARD_PLACES, BOARD_STATES, Memory},
    track::{self, Odometry},
};
use eigenmark_firmware::{
    atlas_region::{self, Slot},
    fail,
    guard::{Guard, Guarded},
    stack, succeed,
};
use static_cell::ConstStaticCell;

/// Budget of the stack, in bytes; the digest's frame of 19,200 bytes lies on it besides.
const STACK_BYTES: usize = 8 * 1024 + 160 * 120;

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

/// What the frame of the odometry's digest and of the navigator's takes of the stack, in bytes.
const TRACKED_BYTES: usize = 96 * 96;

/// What the navigator's digest is of; not all that a board has room for, which the localizer's digest needs.
type SmallMemory = Memory<2048, 64>;

/// What there is no room for at the same time.
#[expect(
    clippy::large_enum_variant,
    reason = "both are large, and there is one"
)]
#[repr(u8)]
enum Room {
    Nothing,
    Odometry(Odometry),
    Navigator(SmallMemory),
}

static ROOM: ConstStaticCell<Room> = ConstStaticCell::new(Room::Nothing);

static GUARDED: ConstStaticCell<Guarded> = ConstStaticCell::new(Guarded::new());

#[cortex_m_rt::entry]
fn main() -> ! {
    // First, for what follows needs more.
    let room = ROOM.take();
    *room = Room::Odometry(Odometry::new());
    let Room::Odometry(odometry) = room else {
        fail()
    };
    let track = track::digest(odometry);
    let odometry_stack = stack::high_water_mark() - TRACKED_BYTES;
    let Some((slot, atlas)) = atlas_region::find() else {
        defmt::error!("no slot holds a valid atlas");
        fail()
    };
    check("the first slot is used", slot == Slot::A);
    let flash = atlas_region::bytes(slot);
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
    check(
        "the reduction matches its reference",
        reduction_matches_reference(),
    );

    *room = Room::Navigator(SmallMemory::new());
    let Room::Navigator(memory) = room else {
        fail()
    };
    let navigate = navigator::digest(atlas.clone(), memory);
    let navigator_stack = stack::high_water_mark() - TRACKED_BYTES;
    let digest = digest(&atlas);
    let stack = stack::high_water_mark();
    check("the stack stays within its budget", stack <= STACK_BYTES);
    if let Err(kernel) = kernel::compare(1, TWIN_CASES) {
        defmt::error!("the twins of a kernel disagree: {}", kernel);
        fail()
    }
    defmt::info!("kernels match their twins in {} cases: ok", TWIN_CASES);
    let Some(mut guard) = Guard::new(GUARDED.take()) else {
        fail()
    };
    check("guards are noticed", guard.notices_its_neighbors());
    if let Err(kernel) = kernel::compare_at_edges(1, EDGE_CASES, guard.room()) {
        defmt::error!("the twins of a kernel disagree at an edge: {}", kernel);
        fail()
    }
    check("kernels stay within their slices", guard.is_untouched());
    defmt::println!(
        "{{\"atlas\":\"{:08x}\",\"digest\":\"{:08x}\",\"explore\":\"{:08x}\",\"track\":\"{:08x}\",\"navigate\":\"{:08x}\",\"localizer_bytes\":{},\"stack_bytes\":{},\"odometry_bytes\":{},\"odometry_stack_bytes\":{},\"navigator_bytes\":{},\"navigator_stack_bytes\":{}}}",
        atlas.crc(),
        digest,
        explore::digest(),
        track,
        navigate,
        size_of::<Localizer<'_>>(),
        stack - 160 * 120,
        size_of::<Odometry>(),
        odometry_stack,
        size_of::<Memory<BOARD_STATES, BOARD_PLACES>>(),
        navigator_stack,
    );
    succeed()
}

fn check(what: &'static str, holds: bool) {
    if !holds {
        defmt::error!("{=str}: failed", what);
        fail()
    }
    defmt::info!("{=str}: ok", what);
}
