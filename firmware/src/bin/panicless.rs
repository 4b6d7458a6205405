//! Links only when nothing that flies can panic: its panic handler calls a function that does not exist.
//!
//! It is built, not run. Everything that stands between untrusted bytes and a fix is called with input that the
//! compiler cannot see through: an atlas is parsed, frames come as pixels, over the link, are reduced to views and tracked,
//! belief, route and mission make commands of them, and without an atlas a chart is explored and flown over. Where the
//! optimizer leaves one check that can fail in any of that, the handler is linked and the linker reports that
//! `a_panic_path_is_linked` is undefined.
//!
//! To find the culprit, link all the same, and ask for the calls of the panicking functions and their inlined callers
//! (`llvm-objdump` and `llvm-symbolizer` are in Debian's package `llvm`):
//!
//! ```sh
//! cargo rustc --package eigenmark-firmware --profile firmware --target thumbv7em-none-eabihf --bin panicless \
//!     -- -C link-arg=--defsym=a_panic_path_is_linked=0
//! elf=target/thumbv7em-none-eabihf/firmware/panicless
//! llvm-objdump --disassemble $elf | sed -nE 's/^ *([0-9a-f]+):.*\bbl.*<.*(panicking|_fail).*/0x\1/p' |
//!     llvm-symbolizer --inlines --functions=none --exe $elf
//! ```
//!
//! The feature `panic-path` adds such a path behind all the others, so that a test sees the check fail.

#![no_std]
#![no_main]

use core::{hint::black_box, panic::PanicInfo};

use eigenmark_core::{
    atlas::{Atlas, checksum},
    chart::{self, Exploration, Pattern},
    frame::Frame,
    landmark::{Circle, Point, Prior, Sector},
    link::{MAX_REPLY_LEN, Receiver, Reply, Responder},
    localizer::Localizer,
    navigator::{BOARD_PLACES, BOARD_STATES, Memory, Navigator, Readings},
    preprocess::{Pose, PoseError, View},
    route::Router,
    track::{Covariance, Displacement, Odometry, Placement},
};
use static_cell::ConstStaticCell;
// The interrupt vectors.
use stm32f4 as _;

static RESPONDER: ConstStaticCell<Responder> = ConstStaticCell::new(Responder::new());

type BoardMemory = Memory<BOARD_STATES, BOARD_PLACES>;

/// A chart as large as a board has room for beside a frame of 120×120.
const CHARTED_PLACES: usize = 128;
const CHARTED_LEGS: usize = 1024;

type ChartMemory = chart::Memory<CHARTED_PLACES, CHARTED_LEGS>;

const PATTERN: Pattern = Pattern::Square {
    spacing: 1.0,
    rings: 1,
};

#[cortex_m_rt::entry]
fn main() -> ! {
    if let Some(responder) = RESPONDER.try_take()
        && let Ok(atlas) = Atlas::parse(opaque())
    {
        fly(&mut Localizer::new(atlas), responder);
    }
    if let Some(odometry) = black_box(None) {
        integrate(odometry);
    }
    if let Some(memory) = black_box(None)
        && let Ok(atlas) = Atlas::parse(opaque())
    {
        navigate(Navigator::new(atlas, memory), black_box(&Router::new()));
    }
    if let Some(memory) = black_box(None) {
        explore(Exploration::new(black_box(PATTERN), memory));
    }
    let mut host = Receiver::<MAX_REPLY_LEN>::new();
    loop {
        black_box(host.push::<Reply>(black_box(0)).is_some());
    }
}

fn fly(localizer: &mut Localizer<'_>, responder: &mut Responder) {
    let (atlas, index) = (localizer.atlas(), black_box(0));
    let landmarks = atlas.landmarks().prefix(index);
    black_box(landmarks.coefficients(index).next());
    black_box(atlas.thumbnail(index));
    black_box(atlas.eigenspace().weight(index, index));
    black_box(checksum(opaque()));
    if let Ok(frame) = Frame::new(opaque(), black_box(0), black_box(0), black_box(0)) {
        black_box(localizer.locate(&frame));
        if let Ok(pose) = pose() {
            let atlas = localizer.atlas();
            let place = Point {
                x_px: black_box(0.0),
                y_px: black_box(0.0),
            };
            let prior = black_box(Prior {
                circle: Some(Circle {
                    center: place,
                    radius_px: black_box(0.0),
                }),
                heading: Some(Sector {
                    heading_rad: black_box(0.0),
                    tolerance_rad: black_box(0.0),
                }),
                altitude: Some([black_box(0.0); 2]),
            });
            let plausible = atlas.landmarks().plausible(atlas.survey(), &prior);
            if let Some(fix) = localizer.locate_among(&frame, &pose, plausible) {
                black_box((fix.heading_from(&pose), fix.altitude_from(&pose)));
            }
        }
    }
    if let Some(view) = View::from_pixels(opaque()) {
        black_box(localizer.locate_view(&view));
    }
    while black_box(true) {
        black_box(responder.push(black_box(0), localizer));
    }
    #[cfg(feature = "panic-path")]
    black_box(opaque()[black_box(0)]);
}

fn integrate(odometry: &mut Odometry) {
    let any = || black_box(0.0);
    let covariance = black_box(Covariance::zeros());
    while black_box(true) {
        if let Ok(frame) = Frame::new(opaque(), black_box(0), black_box(0), black_box(0)) {
            let tilt = pose().ok().and_then(|pose| pose.tilt());
            black_box(odometry.advance(&frame, tilt));
        }
        black_box(odometry.correct_heading(any(), any()));
        black_box(odometry.correct_altitude(any(), any()));
        black_box(odometry.skip(&Displacement {
            forward: any(),
            right: any(),
            yaw_rad: any(),
            scale: any(),
            covariance,
            tracked: 0,
            inliers: 0,
        }));
        let start = Placement {
            x: any(),
            y: any(),
            heading_rad: any(),
            altitude_ratio: any(),
        };
        black_box(odometry.restart(start, &covariance));
        black_box((
            odometry.placement(),
            odometry.covariance(),
            odometry.tracks(),
        ));
    }
}

/// Belief, route and mission among it.
fn navigate(
    mut navigator: Navigator<'_, &mut BoardMemory, BOARD_STATES, BOARD_PLACES>,
    router: &Router<BOARD_PLACES>,
) {
    while black_box(true) {
        black_box(navigator.go(black_box(&[])).is_ok());
        let frame = Frame::new(opaque(), black_box(0), black_box(0), black_box(0));
        black_box(navigator.advance(frame.ok().as_ref(), &readings(), black_box(0.0)));
        black_box((navigator.goals_left(), navigator.belief().weights()));
        let map = navigator.atlas().topology();
        black_box(router.route(map, black_box(0)).count());
    }
}

/// Pattern, eigenspace and chart, and the way back over it.
fn explore(mut exploration: Exploration<&mut ChartMemory, CHARTED_PLACES, CHARTED_LEGS>) {
    while black_box(true) {
        let frame = Frame::new(opaque(), black_box(0), black_box(0), black_box(0));
        let advanced = exploration.advance(frame.ok().as_ref(), &readings(), black_box(0.0));
        black_box(advanced);
        black_box(exploration.go(black_box(0)).is_ok());
    }
    black_box((exploration.chart(), exploration.odometry()));
}

/// What the instruments may say, or not.
fn readings() -> Readings {
    Readings {
        heading_rad: black_box(None),
        tilt: pose().ok().and_then(|pose| pose.tilt()),
        altitude_ratio: black_box(None),
    }
}

fn pose() -> Result<Pose, PoseError> {
    let any = || black_box(0.0);
    Pose::new(any(), any())?.tilted(any(), any(), any())
}

/// Bytes of which nothing is known.
fn opaque() -> &'static [u8] {
    black_box(&[])
}

#[panic_handler]
#[expect(unsafe_code, reason = "a function that does not exist is declared")]
fn panic(_: &PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn a_panic_path_is_linked() -> !;
    }
    // SAFETY: it cannot be called: what refers to it does not link.
    unsafe { a_panic_path_is_linked() }
}
