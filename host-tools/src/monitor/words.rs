//! Parts of what a board says, in words.

use std::fmt::Write;

use eigenmark_core::link::{AtlasIdentity, Camera, Cause, Crash, Faults, SlotState};

use crate::link::slot_error;

pub(super) fn camera(camera: Camera) -> &'static str {
    match camera {
        Camera::Frame => "frame",
        Camera::Late => "late",
        Camera::Short => "short",
        Camera::Torn => "torn",
        Camera::Absent => "absent",
    }
}

pub(super) fn atlas(atlas: &AtlasIdentity) -> String {
    format!(
        "atlas {:08x} of map {:08x}: {} landmarks, {} dimensions, views of {side}×{side}",
        atlas.crc,
        atlas.map_crc,
        atlas.landmarks,
        atlas.dimensions,
        side = atlas.view_side
    )
}

pub(super) fn slot(slot: &SlotState) -> String {
    let mut text = match &slot.atlas {
        Ok(found) => atlas(found),
        Err(error) => slot_error(error),
    };
    if let Some(sequence) = slot.sequence {
        let _ = write!(text, ", number {sequence}");
    }
    if slot.is_flown {
        text.push_str(", flown by");
    }
    text
}

fn cause(cause: Cause) -> &'static str {
    match cause {
        Cause::PowerOn => "power switched on",
        Cause::BrownOut => "low power",
        Cause::Pin => "the reset pin",
        Cause::Software => "the program itself",
        Cause::Watchdog => "the watchdog",
    }
}

fn crash(crash: Crash) -> String {
    match crash {
        Crash::HardFault {
            pc,
            lr,
            status,
            address,
        } => format!(
            "hard fault at {pc:#010x}, from {lr:#010x}, status {status:#010x}, address {address:#010x}"
        ),
        Crash::StackOverflow { pc, lr } => {
            format!("stack overflow at {pc:#010x}, from {lr:#010x}")
        }
        Crash::Hang { pc, lr } => {
            format!("no progress at {pc:#010x}, from {lr:#010x}")
        }
        Crash::Panic { line } => format!("panic in line {line}"),
    }
}

/// What went wrong, one thing per line; the first says why the board was reset last.
pub(super) fn faults(faults: &Faults) -> Vec<String> {
    let mut lines = vec![format!("last reset by {}", cause(faults.cause))];
    if faults.resets > 0 {
        lines.push(format!(
            "{} resets, {} by the watchdog, {} by low power",
            faults.resets, faults.by_watchdog, faults.by_brown_out
        ));
    }
    lines.extend(faults.crash.map(|it| format!("last crash: {}", crash(it))));
    for (count, what) in [
        (faults.camera_losses, "times the camera was lost"),
        (faults.link_storms, "storms on a link"),
        (faults.worn_pages, "worn pages of flash"),
    ] {
        if count > 0 {
            lines.push(format!("{count} {what}"));
        }
    }
    lines
}
