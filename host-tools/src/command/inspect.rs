//! `inspect`: everything in an atlas, and the memory it needs.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

use clap::Args;
use eigenmark::atlas::{AtlasBuffer, Summary};

use super::print_json;

/// Show what is in an atlas, and the flash and RAM it needs
#[derive(Debug, Args)]
pub struct Cmd {
    /// The atlas
    #[arg(value_name = "ATLAS")]
    atlas: PathBuf,
    /// Print it as JSON
    #[arg(long)]
    json: bool,
}

/// Landmarks that are listed for people; JSON has all.
const LISTED: usize = 100;

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        let buffer = AtlasBuffer::read(&self.atlas)?;
        let summary = Summary::of(&buffer.atlas());
        let mut out = io::stdout().lock();
        if self.json {
            print_json(&mut out, &summary)
        } else {
            print(&mut out, &self.atlas, &summary)
        }
    }
}

/// Prints a summary for people.
pub fn print(out: &mut impl Write, path: &Path, summary: &Summary) -> anyhow::Result<()> {
    let settings = &summary.settings;
    let side = summary.view_side;
    writeln!(out, "{}  (CRC {})", path.display(), summary.crc)?;
    writeln!(out, "  flash      {} bytes", summary.flash_bytes)?;
    writeln!(
        out,
        "  RAM        {} bytes, frames not included",
        summary.ram_bytes
    )?;
    writeln!(
        out,
        "  map        {}×{} pixels (CRC {})",
        summary.map.width, summary.map.height, summary.map.crc
    )?;
    writeln!(
        out,
        "  views      {side}×{side} pixels of a {} pixel window, {}, normalization {}",
        settings.view_size, settings.blur, settings.normalize
    )?;
    let is_layered = settings.headings > 1 || settings.altitudes != [1.0];
    if is_layered {
        let altitudes: Vec<String> = settings.altitudes.iter().map(f32::to_string).collect();
        writeln!(
            out,
            "  seen at    {} headings, altitude {}",
            settings.headings,
            altitudes.join(", ")
        )?;
    }
    if settings.highpass > 0.0 || settings.whiten > 0.0 {
        writeln!(
            out,
            "  filters    high-pass sigma {}, whitening {}",
            settings.highpass, settings.whiten
        )?;
    }
    writeln!(
        out,
        "  eigenspace {} dimensions, {:.1} % of the variance of {} views",
        summary.dims,
        100.0 * summary.covered_variance,
        summary.candidates
    )?;
    writeln!(
        out,
        "  matching   {}, {} coefficients",
        settings.metric, settings.coefficients
    )?;
    writeln!(
        out,
        "  known      distance up to {:.4}, distance from feature space up to {:.4e}",
        summary.known.distance, summary.known.from_feature_space
    )?;
    writeln!(
        out,
        "  places     {}, {} legs between them",
        summary.places, summary.legs
    )?;
    writeln!(out, "  landmarks  {}", summary.landmarks)?;
    let of_layer = |heading: &str, altitude: &str| {
        if is_layered {
            format!("{heading:>9}{altitude:>10}")
        } else {
            String::new()
        }
    };
    writeln!(
        out,
        "{:>8}{:>8}{:>20}{}{:>12}",
        "rank",
        "view",
        "place (map pixels)",
        of_layer("heading", "altitude"),
        "radius"
    )?;
    for landmark in summary.table.iter().take(LISTED) {
        let [x, y] = landmark.place;
        let place = format!("{x}, {y}");
        let heading = format!("{:.1}°", landmark.heading_deg);
        let layer = of_layer(&heading, &landmark.altitude_ratio.to_string());
        writeln!(
            out,
            "{:>8}{:>8}{place:>20}{layer}{:>12.4}",
            landmark.landmark, landmark.view, landmark.radius
        )?;
    }
    if summary.table.len() > LISTED {
        writeln!(
            out,
            "{:>8} {} more; --json lists all",
            "…",
            summary.table.len() - LISTED
        )?;
    }
    Ok(())
}
