//! Links only when nothing that flies can panic: its panic handler calls a function that does not exist.
//!
//! It is built, not run, and, unlike what flies, made fast: only then does the compiler see all that cannot fail.
//! Everything that stands between untrusted bytes and a fix is called with input that the compiler cannot see through:
//! an atlas is parsed, frames come as pixels, are reduced to views and tracked, belief, route and mission make commands
//! of them, and without an atlas a chart is explored and flown over; then all of the flight, with cameras on buses,
//! both wires, and flash that is read and written. Where the optimizer leaves one check that can fail in any of that,
//! the handler is linked and the linker reports that `a_panic_path_is_linked` is undefined.
//!
//! To find the culprit, link all the same, and ask for the calls of the panicking functions and their inlined callers
//! (`llvm-objdump` and `llvm-symbolizer` are in Debian's package `llvm`):
//!
//! ```sh
//! cargo rustc --package eigenmark-firmware --profile firmware --target thumbv7em-none-eabihf --bin panicless \
//!     --features panicless --config profile.firmware.opt-level=3 \
//!     --config profile.firmware.package.eigenmark-core.opt-level=3 \
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
    link::{Cause, MAX_REPLY_LEN, Provocation, Receiver, Reply},
    localizer::Localizer,
    navigator::{BOARD_PLACES, BoardNavigator, Navigator, Readings},
    preprocess::{Pose, PoseError, View},
    route::Router,
    slots::{Region, Slot, Writer},
    track::{BoardOdometry, Covariance, Displacement, Placement},
};
use eigenmark_firmware::{
    board::{AtlasFlash, Lamp, Parts, Refused, System},
    camera::{
        ArducamMega, Camera, CameraError, Encoding, Filter, FrameSize, Hm01b0, PixelPort,
        PortError, Resolution,
    },
    faults::FaultLog,
    flight::Flight,
};
use embedded_hal::{
    delay::DelayNs,
    i2c::{self, I2c},
    spi::{self, SpiDevice},
};
use embedded_io::{Read, ReadReady, Write};
use embedded_storage::nor_flash::{self, NorFlash, NorFlashErrorKind, ReadNorFlash};

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
    if let Ok(atlas) = Atlas::parse(opaque()) {
        locate(&mut Localizer::new(atlas));
    }
    fly();
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

/// One camera or the other: all of the flight twice would not fit.
enum Either {
    Mega(ArducamMega<Opaque>),
    Hm01b0(Hm01b0<Opaque, Opaque, Opaque>),
}

impl Camera for Either {
    fn begin(&mut self) -> Result<(), CameraError> {
        match self {
            Self::Mega(camera) => camera.begin(),
            Self::Hm01b0(camera) => camera.begin(),
        }
    }

    fn take(&mut self, pixels: &mut [u8]) -> Result<Option<FrameSize>, CameraError> {
        match self {
            Self::Mega(camera) => camera.take(pixels),
            Self::Hm01b0(camera) => camera.take(pixels),
        }
    }

    fn recover(&mut self) {
        match self {
            Self::Mega(camera) => camera.recover(),
            Self::Hm01b0(camera) => camera.recover(),
        }
    }
}

/// All of it.
fn fly() {
    let (encoding, resolution) = (black_box(Encoding::Yuv), black_box(Resolution::Square128));
    let camera = if black_box(true) {
        Either::Mega(ArducamMega::new(Opaque, encoding, resolution))
    } else {
        Either::Hm01b0(Hm01b0::new(
            Opaque,
            Opaque,
            Opaque,
            black_box(Filter::Bayer),
        ))
    };
    let (Some(memory), Some(pixels), Some(kept)) =
        (black_box(None), black_box(None), black_box(None))
    else {
        return;
    };
    let parts = Parts {
        camera,
        host: Opaque,
        autopilot: Opaque,
        flash: Opaque,
        system: Opaque,
    };
    let region = Region::read(opaque(), black_box(0));
    let writer = Writer::new(black_box(0), black_box(0));
    let faults = FaultLog::begin(kept, black_box(Cause::PowerOn));
    let mut flight = Flight::new(parts, &region, writer, memory, pixels, faults);
    while black_box(true) {
        black_box(flight.turn());
    }
}

fn locate(localizer: &mut Localizer<'_>) {
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
    #[cfg(feature = "panic-path")]
    black_box(opaque()[black_box(0)]);
}

fn integrate(odometry: &mut BoardOdometry) {
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
fn navigate(mut navigator: BoardNavigator<'_>, router: &Router<BOARD_PLACES>) {
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

/// A part of a board of which nothing is known.
#[derive(Clone, Copy, Debug)]
struct Opaque;

/// Why it fails, if it does.
#[derive(Clone, Copy, Debug)]
struct Fails;

impl Opaque {
    fn or_fails<T>(self, value: T) -> Result<T, Fails> {
        if black_box(true) {
            Ok(value)
        } else {
            Err(Fails)
        }
    }
}

impl core::fmt::Display for Fails {
    fn fmt(&self, _: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        Ok(())
    }
}

impl core::error::Error for Fails {}

impl embedded_io::Error for Fails {
    fn kind(&self) -> embedded_io::ErrorKind {
        embedded_io::ErrorKind::Other
    }
}

impl nor_flash::NorFlashError for Fails {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl spi::Error for Fails {
    fn kind(&self) -> spi::ErrorKind {
        spi::ErrorKind::Other
    }
}

impl i2c::Error for Fails {
    fn kind(&self) -> i2c::ErrorKind {
        i2c::ErrorKind::Other
    }
}

impl embedded_io::ErrorType for Opaque {
    type Error = Fails;
}

impl nor_flash::ErrorType for Opaque {
    type Error = Fails;
}

impl spi::ErrorType for Opaque {
    type Error = Fails;
}

impl i2c::ErrorType for Opaque {
    type Error = Fails;
}

impl ReadReady for Opaque {
    fn read_ready(&mut self) -> Result<bool, Fails> {
        self.or_fails(black_box(false))
    }
}

impl Read for Opaque {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Fails> {
        black_box(bytes);
        self.or_fails(black_box(0))
    }
}

impl Write for Opaque {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fails> {
        self.or_fails(black_box(bytes).len())
    }

    fn flush(&mut self) -> Result<(), Fails> {
        self.or_fails(())
    }
}

impl ReadNorFlash for Opaque {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Fails> {
        black_box((offset, bytes));
        self.or_fails(())
    }

    fn capacity(&self) -> usize {
        black_box(0)
    }
}

impl NorFlash for Opaque {
    const WRITE_SIZE: usize = 32;
    const ERASE_SIZE: usize = 128 * 1024;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Fails> {
        black_box((from, to));
        self.or_fails(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Fails> {
        black_box((offset, bytes));
        self.or_fails(())
    }
}

impl AtlasFlash for Opaque {
    fn mapped(&self, slot: Slot) -> Option<&[u8]> {
        black_box(slot);
        black_box(Some(opaque()))
    }
}

impl SpiDevice for Opaque {
    fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), Fails> {
        black_box(operations);
        self.or_fails(())
    }
}

impl I2c for Opaque {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [i2c::Operation<'_>],
    ) -> Result<(), Fails> {
        black_box((address, operations));
        self.or_fails(())
    }
}

impl DelayNs for Opaque {
    fn delay_ns(&mut self, ns: u32) {
        black_box(ns);
    }
}

impl PixelPort for Opaque {
    fn start(&mut self) -> Result<(), PortError> {
        black_box(Ok(()))
    }

    fn frame(&mut self) -> Result<Option<&[u8]>, PortError> {
        black_box(Ok(Some(opaque())))
    }

    fn stop(&mut self) {}
}

impl System for Opaque {
    fn now_us(&self) -> u64 {
        black_box(0)
    }

    fn feed(&mut self) {}

    fn rest(&mut self) {}

    fn show(&mut self, lamp: Lamp) {
        black_box(lamp);
    }

    fn restart(&mut self) {}

    fn provoke(&mut self, what: Provocation) -> Result<(), Refused> {
        black_box(what);
        black_box(Err(Refused))
    }
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
