//! Instructions per call of everything that has a budget, one JSON object per line.
//!
//! For QEMU with `-icount shift=0`, where an instruction takes a nanosecond and SysTick counts 168 MHz: a tick is
//! 1/0.168 instructions. Calls are repeated so that the tick does not matter, and the empty loop is taken off.
//! The first atlas is the report's table of all views; a second one, if there, has more landmarks. With a dense table
//! in the first slot, only matching among [`DENSE`] landmarks is measured; with one that has places, only flying by it.

#![no_std]
#![no_main]

use core::{hint::black_box, iter::once, panic::PanicInfo};

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use eigenmark_core::{
    atlas::Atlas,
    belief::{Belief, Motion, Observation},
    eigenspace::{Coefficients, MAX_DIMENSIONS},
    explore::{Growth, IncrementalPca},
    frame::Frame,
    landmark::Width,
    localizer::Localizer,
    navigator::{BOARD_PLACES, BOARD_STATES, Memory, Navigator, Readings},
    preprocess::{Pose, PoseError, View, level, reduce},
    slots::Slot,
    track::{MAX_TRACKS, Odometry, Placement, see_ground},
};
use eigenmark_firmware::{
    atlas_region,
    board::CORE_HZ,
    fail, panicked,
    room::{Begin, Room},
    stack, succeed,
};
use static_cell::ConstStaticCell;

eigenmark_firmware::logger!();

/// SysTick counts down from here: 2²⁴ − 1.
const RELOAD: u32 = 0x00ff_ffff;

/// Landmarks that a dense table is matched among. The chip's flash holds fewer of 48 dimensions or more: the table is
/// then matched again, as a whole and in part, until there were as many.
const DENSE: u32 = 8192;

static VIEWS: [[u8; 400]; 28] = test_views();

/// Side of the frames that are tracked, in pixels.
const TRACKED_PX: u16 = 200;

/// Sides of the frames that are flown by.
const FLOWN_PX: (u16, u16) = (160, 120);

/// Frames that are flown by, of which the costliest counts, and the way between two of them, to the right and half as far
/// up, in sides.
const FLOWN_FRAMES: u16 = 60;
const FLOWN: f32 = 0.05;

/// Frames that the camera then leaves out: with the first of those that cannot be related, as many as are waited for.
const SILENT_FRAMES: u16 = 13;

/// Where frames are taken that cannot be related to any before, in sides: the first is passed over.
const LOST_AT: [f32; 2] = [30.0, 60.0];

/// Time between frames, in seconds.
const STEP_S: f32 = 0.033;

/// Path integration, and a frame.
struct Path {
    odometry: Odometry,
    pixels: Pixels<{ TRACKED_PX as usize * TRACKED_PX as usize }>,
}

/// All that flies, and a frame.
struct Flight {
    memory: Memory<BOARD_STATES, BOARD_PLACES>,
    pixels: Pixels<{ FLOWN_PX.0 as usize * FLOWN_PX.1 as usize }>,
}

struct Believed(Belief<BOARD_STATES>);

struct Explored(IncrementalPca<400, 16>);

/// Pixels of a frame, at a whole word as a camera's are.
#[repr(align(4))]
struct Pixels<const LEN: usize>([u8; LEN]);

impl Begin for Path {
    const BEGIN: Self = Self {
        odometry: Odometry::whole(),
        pixels: Pixels([0; _]),
    };
}

impl Begin for Flight {
    const BEGIN: Self = Self {
        memory: Memory::new(),
        pixels: Pixels([0; _]),
    };
}

impl Begin for Believed {
    const BEGIN: Self = Self(Belief::new());
}

impl Begin for Explored {
    const BEGIN: Self = Self(IncrementalPca::new(Growth::Fixed));
}

/// There is no room for all of them at the same time; this is the largest.
static ROOM: ConstStaticCell<Room<{ size_of::<Path>() }>> = ConstStaticCell::new(Room::new());

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(core) = cortex_m::Peripherals::take() else {
        fail()
    };
    let Some(atlas) = atlas_region::in_slot(Slot::A) else {
        fail()
    };
    let mut meter = Meter::new(core.SYST);
    let room = ROOM.take();
    if !atlas.topology().is_empty() {
        let Believed(belief) = room.hold();
        believe(&mut meter, &atlas, belief);
        let Flight { memory, pixels } = room.hold();
        navigate(&mut meter, atlas, memory, &mut pixels.0);
        succeed()
    }
    if atlas.landmarks().len() > DENSE as usize / 4 {
        match_dense(&mut meter, &atlas);
        succeed()
    }
    let Explored(eigenspace) = room.hold();
    explore(&mut meter, eigenspace);
    let Path { odometry, pixels } = room.hold();
    locate(&mut meter, atlas, &mut pixels.0);
    track(&mut meter, odometry, &mut pixels.0);
    succeed()
}

/// From a frame to a fix.
#[inline(never)] // its localizer is not the callers
fn locate(meter: &mut Meter, atlas: Atlas<'_>, pixels: &mut [u8]) {
    fill_test_frame(pixels);
    let Ok(frame) = Frame::new(pixels, 160, 120, 160) else {
        fail()
    };
    let side = atlas.eigenspace().side();
    // Ratios that the general kernels reduce: whole, 4, and fractional, 7.5.
    for side in [side, 30, 16] {
        reduce_to(meter, &frame, side);
    }
    level_to(meter, &frame, side);
    project_and_match(meter, &atlas, &frame);
    let landmarks = atlas.landmarks().len();
    let mut localizer = Localizer::new(atlas);
    meter.measure(format_args!("fix_160x120_{landmarks}"), 20, || {
        black_box(localizer.locate(black_box(&frame)));
    });
}

#[inline(never)] // its view is not the caller's
fn reduce_to(meter: &mut Meter, frame: &Frame<'_>, side: u8) {
    let mut view = View::black(side);
    meter.measure(format_args!("reduce_160x120_{side}"), 20, || {
        reduce(black_box(frame), black_box(&mut view));
    });
}

#[inline(never)]
fn level_to(meter: &mut Meter, frame: &Frame<'_>, side: u8) {
    let Ok(pose) = test_pose() else { fail() };
    let mut view = View::black(side);
    meter.measure(format_args!("view_general_160x120_{side}"), 20, || {
        black_box(level(
            black_box(frame),
            black_box(&pose),
            black_box(&mut view),
        ));
    });
}

#[inline(never)]
fn project_and_match(meter: &mut Meter, atlas: &Atlas<'_>, frame: &Frame<'_>) {
    let (side, k) = (atlas.eigenspace().side(), atlas.eigenspace().dimensions());
    let mut view = View::black(side);
    let mut coefficients = Coefficients::zeros(k);
    reduce(frame, &mut view);
    meter.measure(format_args!("project_{side}x{side}_{k}"), 50, || {
        black_box(
            atlas
                .eigenspace()
                .project(black_box(&view), &mut coefficients),
        );
    });
    for count in [8, atlas.landmarks().len()] {
        let table = atlas.landmarks().prefix(count);
        meter.measure(format_args!("match_{}_{k}", table.len()), 50, || {
            black_box(table.nearest(black_box(&coefficients), table.everywhere()));
        });
    }
    if let Some(dense) = atlas_region::in_slot(Slot::B) {
        let table = dense.landmarks().prefix(1024);
        meter.measure(format_args!("match_{}_{k}", table.len()), 10, || {
            black_box(table.nearest(black_box(&coefficients), table.everywhere()));
        });
    }
}

fn explore(meter: &mut Meter, eigenspace: &mut IncrementalPca<400, 16>) {
    let mut views = VIEWS.iter().cycle();
    let mut explore = || {
        if let Some(view) = views.next() {
            black_box(eigenspace.update_20x20(black_box(view)));
        }
    };
    // The first is the mean, fifteen make dimensions; from there on every one grows to sixteen and drops one.
    (0..16).for_each(|_| explore());
    meter.measure(format_args!("ipca_step_400_15"), 10, explore);
}

/// From one frame to the next over a made-up ground: the second finds all corners again, replaces the reference and
/// looks for new ones.
fn track(meter: &mut Meter, odometry: &mut Odometry, pixels: &mut [u8]) {
    let mut see = |placement: Placement| {
        see_ground(&placement, TRACKED_PX, pixels);
        let side = TRACKED_PX;
        let Ok(frame) = Frame::new(pixels, side, side, side.into()) else {
            fail()
        };
        let mut displacement = None;
        let ticks = meter.once(|| displacement = odometry.advance(black_box(&frame), None));
        (displacement, ticks)
    };
    see(Placement::ORIGIN);
    let (displacement, ticks) = see(Placement {
        x: 0.02,
        y: -0.035,
        heading_rad: 0.03,
        altitude_ratio: 1.01,
    });
    let Some(displacement) = displacement else {
        defmt::error!("the frames are not found to overlap");
        fail()
    };
    defmt::info!(
        "{} of {} corners agree",
        displacement.inliers,
        displacement.tracked
    );
    let name = format_args!("track_{TRACKED_PX}x{TRACKED_PX}_{MAX_TRACKS}");
    print(name, ticks, 1);
    // The most that a frame can take: for the second time nothing is found, neither where it should be nor where it was.
    let mut most = 0;
    for x in LOST_AT {
        let (displacement, ticks) = see(Placement {
            x,
            ..Placement::ORIGIN
        });
        if displacement.is_some() {
            defmt::error!("frames of different places are found to overlap");
            fail()
        }
        most = most.max(ticks);
    }
    print(format_args!("{}_lost", name), most, 1);
}

/// Every step of a belief over an atlas.
#[inline(never)]
fn believe(meter: &mut Meter, atlas: &Atlas<'_>, belief: &mut Belief<BOARD_STATES>) {
    belief.begin(atlas);
    let states = belief.cells().states();
    let side_px = belief.cells().side_px();
    // By a cell, and as uncertain as spreads at all, or as much as is done at once.
    let motion = Motion {
        forward_px: side_px,
        right_px: side_px,
        yaw_rad: 0.02,
        variance_px2: 0.06 * side_px * side_px,
        variance_rad2: 1e-6,
        carried_away: 1e-4,
    };
    meter.measure(format_args!("belief_predict_{states}"), 5, || {
        belief.predict(black_box(&motion), black_box(0.0));
    });
    let far = Motion {
        variance_px2: 100.0 * side_px * side_px,
        ..motion
    };
    meter.measure(format_args!("belief_predict_{states}_spread"), 5, || {
        belief.predict(black_box(&far), black_box(0.0));
    });
    let (k, landmarks) = (atlas.eigenspace().dimensions(), atlas.landmarks().len());
    let Some(coefficients) = middle_landmark(atlas) else {
        fail()
    };
    let observation = Observation {
        independent_px: atlas.header().footprint_px,
        least_worth: 0.1,
    };
    let name = format_args!("belief_observe_{landmarks}_{k}{}_{states}", width(atlas));
    meter.measure(name, 5, || {
        belief.observe(atlas, black_box(&coefficients), &observation);
    });
    let footprint_px = atlas.header().footprint_px;
    meter.measure(format_args!("belief_estimate_{states}"), 5, || {
        black_box(belief.estimate(black_box(footprint_px)));
    });
}

/// A whole step from a frame to a command: the costliest of a flight, then the most that one can take. The camera was
/// silent, and shows somewhere else: no corner is found again, neither where it should be nor where it was, new ones are
/// looked for, and the belief is spread as often as it ever is.
#[inline(never)]
fn navigate(
    meter: &mut Meter,
    atlas: Atlas<'_>,
    memory: &mut Memory<BOARD_STATES, BOARD_PLACES>,
    pixels: &mut [u8],
) {
    let (landmarks, k) = (atlas.landmarks().len(), atlas.eigenspace().dimensions());
    let (width, goal) = (width(&atlas), atlas.topology().len() - 1);
    let mut navigator = Navigator::new(atlas, memory);
    if navigator.go(&[goal as u16]).is_err() {
        fail()
    }
    let Some(tilt) = test_pose().ok().and_then(|pose| pose.tilt()) else {
        fail()
    };
    let mut see = |navigator: &mut Navigator<'_, _, BOARD_STATES, BOARD_PLACES>, x: f32| {
        let placement = Placement {
            x,
            y: -x / 2.0,
            heading_rad: 0.3 + x / 16.0,
            altitude_ratio: 1.05,
        };
        see_ground(&placement, FLOWN_PX.0, pixels);
        let (width, height) = FLOWN_PX;
        let Ok(frame) = Frame::new(pixels, width, height, width.into()) else {
            fail()
        };
        let readings = Readings {
            heading_rad: Some(placement.heading_rad),
            tilt: Some(tilt),
            altitude_ratio: Some(placement.altitude_ratio),
        };
        let mut guidance = None;
        let ticks = meter.once(|| {
            guidance = Some(navigator.advance(black_box(Some(&frame)), &readings, STEP_S));
        });
        let Some(guidance) = guidance.filter(|guidance| guidance.fix.is_some()) else {
            defmt::error!("a frame is not located");
            fail()
        };
        (ticks, guidance.displacement.is_some())
    };
    see(&mut navigator, 0.0);
    let mut ticks = 0;
    for number in 1..FLOWN_FRAMES {
        let (taken, is_tracked) = see(&mut navigator, FLOWN * f32::from(number));
        if !is_tracked {
            defmt::error!("frames are not found to overlap");
            fail()
        }
        ticks = ticks.max(taken);
    }
    let (wide, high) = FLOWN_PX;
    let name = format_args!("navigate_{wide}x{high}_{landmarks}_{k}{width}");
    print(name, ticks, 1);
    for _ in 0..SILENT_FRAMES {
        navigator.advance(None, &Readings::default(), STEP_S);
    }
    let mut most = 0;
    for x in LOST_AT {
        let (ticks, is_tracked) = see(&mut navigator, x);
        if is_tracked {
            defmt::error!("frames of different places are found to overlap");
            fail()
        }
        most = most.max(ticks);
    }
    print(format_args!("{name}_lost"), most, 1);
    defmt::info!("stack: {} bytes", stack::high_water_mark());
}

fn width(atlas: &Atlas<'_>) -> &'static str {
    match atlas.landmarks().width() {
        Width::I16 => "",
        Width::I8 => "_i8",
    }
}

/// A landmark's own coefficients, from the middle of the table: nearer and nearer ones come before it.
fn middle_landmark(atlas: &Atlas<'_>) -> Option<Coefficients> {
    let table = atlas.landmarks();
    let mut values = [0; MAX_DIMENSIONS as usize];
    for (value, stored) in values.iter_mut().zip(table.coefficients(table.len() / 2)) {
        *value = stored;
    }
    Coefficients::from_values(values.get(..atlas.eigenspace().dimensions().into())?)
}

fn match_dense(meter: &mut Meter, atlas: &Atlas<'_>) {
    let (table, width) = (atlas.landmarks(), width(atlas));
    let k = atlas.eigenspace().dimensions();
    let Some(coefficients) = middle_landmark(atlas) else {
        fail()
    };
    let len = table.len() as u32;
    meter.measure(format_args!("match_{DENSE}_{k}{width}"), 5, || {
        for done in (0..DENSE).step_by(table.len()) {
            let rest = 0..len.min(DENSE - done);
            black_box(table.nearest(black_box(&coefficients), once(rest)));
        }
    });
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
        print(name, ticks, turns);
    }

    /// Ticks of what is done once.
    fn once(&mut self, work: impl FnOnce()) -> u32 {
        self.systick.clear_current();
        while SYST::get_current() == 0 {}
        let before = SYST::get_current();
        work();
        let after = SYST::get_current();
        if self.systick.has_wrapped() {
            defmt::error!("the work is too long for the timer");
            fail()
        }
        before - after
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

/// Prints the instructions of one of `turns` that took so many ticks. An instruction takes a nanosecond.
fn print(name: core::fmt::Arguments<'_>, ticks: u32, turns: u32) {
    let instructions = u64::from(ticks) * 1_000_000_000 / u64::from(CORE_HZ) / u64::from(turns);
    defmt::println!(
        "{{\"name\":\"{}\",\"instructions\":{}}}",
        defmt::Display2Format(&name),
        instructions
    );
}

/// Something like a view from above in 160×120 pixels: gradients and blocks.
fn fill_test_frame(pixels: &mut [u8]) {
    for (i, pixel) in pixels.iter_mut().enumerate().take(160 * 120) {
        let (x, y) = (i % 160, i / 160);
        *pixel = ((x / 12 * 37 + y / 9 * 59 + x + y) % 256) as u8;
    }
}

/// Twenty-eight views of 20×20 pixels that span more than 16 dimensions.
const fn test_views() -> [[u8; 400]; 28] {
    let mut views = [[0; 400]; 28];
    let mut i = 0;
    while i < 28 * 400 {
        let (view, pixel) = (i / 400, i % 400);
        views[view][pixel] = ((pixel * 37 + 11) * (view * 29 + 5) / 16 % 256) as u8;
        i += 1;
    }
    views
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    panicked(info)
}
