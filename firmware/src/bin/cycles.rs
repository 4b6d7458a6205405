//! Instructions per call of everything that has a budget, one JSON object per line.
//!
//! For QEMU with `-icount shift=0`, where an instruction takes a nanosecond and SysTick counts 168 MHz: a tick is
//! 1/0.168 instructions. Calls are repeated so that the tick does not matter, and the empty loop is taken off.
//! The first atlas is the report's table of all views; a second one, if there, has more landmarks.

#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use eigenmark_core::{
    atlas::Atlas,
    frame::Frame,
    localizer::Localizer,
    preprocess::{Pose, PoseError, View, level, reduce},
};
use eigenmark_firmware::{
    atlas_region::{self, Slot},
    board::{Board, CORE_HZ},
    fail, succeed,
};

/// SysTick counts down from here: 2²⁴ − 1.
const RELOAD: u32 = 0x00ff_ffff;

static FRAME: [u8; 160 * 120] = test_frame();

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(board) = Board::take() else { fail() };
    let Ok(atlas) = Atlas::parse(atlas_region::bytes(Slot::A)) else {
        defmt::error!("slot A holds no valid atlas");
        fail()
    };
    let mut meter = Meter::new(board.systick);
    let Ok(frame) = Frame::new(&FRAME, 160, 120, 160) else {
        fail()
    };
    let (side, k) = (atlas.eigenspace().side(), atlas.eigenspace().dimensions());

    let mut view = View::black(side);
    meter.measure(format_args!("reduce_160x120_{side}"), 20, || {
        reduce(black_box(&frame), black_box(&mut view));
    });
    let Ok(pose) = test_pose() else { fail() };
    let mut levelled = View::black(side);
    meter.measure(format_args!("view_general_160x120_{side}"), 20, || {
        black_box(level(
            black_box(&frame),
            black_box(&pose),
            black_box(&mut levelled),
        ));
    });
    meter.measure(format_args!("project_{side}x{side}_{k}"), 50, || {
        black_box(atlas.eigenspace().project(black_box(&view)));
    });
    let Some(projection) = atlas.eigenspace().project(&view) else {
        fail()
    };
    for count in [8, atlas.landmarks().len()] {
        let table = atlas.landmarks().prefix(count);
        meter.measure(format_args!("match_{}_{k}", table.len()), 50, || {
            black_box(table.nearest(black_box(&projection.coefficients)));
        });
    }
    if let Ok(dense) = Atlas::parse(atlas_region::bytes(Slot::B)) {
        let table = dense.landmarks().prefix(1024);
        meter.measure(format_args!("match_{}_{k}", table.len()), 10, || {
            black_box(table.nearest(black_box(&projection.coefficients)));
        });
    }
    let landmarks = atlas.landmarks().len();
    let mut localizer = Localizer::new(atlas);
    meter.measure(format_args!("fix_160x120_{landmarks}"), 20, || {
        black_box(localizer.locate(black_box(&frame)));
    });
    succeed()
}

/// Heading 30°, altitude ratio 1.1, roll 5°, pitch −4°, field of view 60°.
fn test_pose() -> Result<Pose, PoseError> {
    Pose::new(30_f32.to_radians(), 1.1)?.tilted(
        5_f32.to_radians(),
        -4_f32.to_radians(),
        60_f32.to_radians(),
    )
}

struct Meter {
    systick: SYST,
    /// Ticks of an empty loop, per 1024 turns.
    empty: u32,
}

impl Meter {
    fn new(mut systick: SYST) -> Self {
        systick.set_clock_source(SystClkSource::Core);
        systick.set_reload(RELOAD);
        systick.clear_current();
        systick.enable_counter();
        let mut meter = Self { systick, empty: 0 };
        meter.empty = meter.ticks(1024, || {});
        meter
    }

    /// Prints the instructions of one call of `work`.
    fn measure(&mut self, name: core::fmt::Arguments<'_>, turns: u32, work: impl FnMut()) {
        let ticks = self
            .ticks(turns, work)
            .saturating_sub(self.empty * turns / 1024);
        // An instruction takes a nanosecond.
        let instructions = u64::from(ticks) * 1_000_000_000 / u64::from(CORE_HZ) / u64::from(turns);
        defmt::println!(
            "{{\"name\":\"{}\",\"instructions\":{}}}",
            defmt::Display2Format(&name),
            instructions
        );
    }

    fn ticks(&mut self, turns: u32, mut work: impl FnMut()) -> u32 {
        work(); // what happens once does not count
        self.systick.clear_current();
        while SYST::get_current() == 0 {}
        let before = SYST::get_current();
        for _ in 0..turns {
            work();
        }
        let after = SYST::get_current();
        if self.systick.has_wrapped() {
            defmt::error!("the work of {} turns is too long for the timer", turns);
            fail()
        }
        before - after
    }
}

/// Something like a view from above: gradients and blocks.
const fn test_frame() -> [u8; 160 * 120] {
    let mut pixels = [0; 160 * 120];
    let mut i = 0;
    while i < pixels.len() {
        let (x, y) = (i % 160, i / 160);
        pixels[i] = ((x / 12 * 37 + y / 9 * 59 + x + y) % 256) as u8;
        i += 1;
    }
    pixels
}
