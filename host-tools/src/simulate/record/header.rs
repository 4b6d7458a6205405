//! What a recording says about the whole flight.

use eigenmark_core::{atlas::Atlas, slots::Setup};
use serde::{Deserialize, Serialize};

use crate::simulate::{End, FlightSettings, World};

/// What `format` says.
pub(super) const FORMAT: &str = "eigenmark flight";

/// The version that is written, and the only one that is read.
const VERSION: u32 = 1;

/// The largest side of a frame, in pixels.
const MAX_SIDE_PX: u16 = 4096;

/// The contents of `flight.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    format: String,
    version: u32,
    /// What it was flown over.
    pub map: Ground,
    /// CRC-32 of the atlas that the pilot used, if any.
    #[serde(default)]
    pub atlas_crc: Option<u32>,
    /// Meters per map pixel.
    pub meters_per_px: f64,
    /// What the frame's square covers at nominal altitude, in map pixels.
    pub footprint_px: f64,
    /// Angle over the side of the frame's square, in radians.
    pub field_of_view_rad: f64,
    /// Width and height of every frame, in pixels.
    pub frame_px: [u16; 2],
    /// Number of steps.
    pub steps: u64,
    /// How the flight ended, if known.
    #[serde(default)]
    pub end: Option<End>,
    /// What it was flown with, if simulated.
    #[serde(default)]
    pub settings: Option<FlightSettings>,
}

/// A map, as a recording knows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ground {
    /// What it was opened as.
    pub name: String,
    /// CRC-32 of its luminance.
    pub crc: u32,
}

impl Header {
    /// Of a simulated flight that did not begin yet.
    #[must_use]
    pub fn new(world: &World<'_>, settings: &FlightSettings, atlas_crc: Option<u32>) -> Self {
        Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            map: Ground {
                name: world.map.name().to_owned(),
                crc: world.map.crc(),
            },
            atlas_crc,
            meters_per_px: world.meters_per_px,
            footprint_px: world.camera.footprint_px(),
            field_of_view_rad: world.camera.field_of_view_rad(),
            frame_px: world.camera.size(),
            steps: 0,
            end: None,
            settings: Some(*settings),
        }
    }

    /// Of a real flight that did not begin yet: over a map, by an atlas, with frames of that size.
    #[must_use]
    pub fn of_board(map: Ground, atlas: &Atlas<'_>, setup: Setup, frame_px: [u16; 2]) -> Self {
        Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            map,
            atlas_crc: Some(atlas.crc()),
            meters_per_px: setup.meters_per_px.into(),
            footprint_px: atlas.header().footprint_px.into(),
            field_of_view_rad: setup.field_of_view_rad.into(),
            frame_px,
            steps: 0,
            end: None,
            settings: None,
        }
    }

    /// What is wrong with it.
    pub(super) fn check(&self) -> Result<(), String> {
        if self.format != FORMAT {
            let found: String = self.format.chars().take(40).collect();
            return Err(format!(
                "expected the format \"{FORMAT}\", found \"{found}\""
            ));
        }
        if self.version != VERSION {
            return Err(format!(
                "expected version {VERSION}, found {}",
                self.version
            ));
        }
        let [width, height] = self.frame_px;
        if !(1..=MAX_SIDE_PX).contains(&width) || !(1..=MAX_SIDE_PX).contains(&height) {
            return Err(format!(
                "expected frames of 1 to {MAX_SIDE_PX} pixels a side, found {width}×{height}"
            ));
        }
        for (name, found) in [
            ("meters_per_px", self.meters_per_px),
            ("footprint_px", self.footprint_px),
            ("field_of_view_rad", self.field_of_view_rad),
        ] {
            if !(found > 0.0 && found.is_finite()) {
                return Err(format!("expected a positive {name}, found {found}"));
            }
        }
        Ok(())
    }
}
