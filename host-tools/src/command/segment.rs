//! `segment`: a map in color becomes a map of a few grays.

use std::{
    io::{self, Cursor, Write},
    path::PathBuf,
};

use anyhow::Context;
use clap::{Args, value_parser};
use eigenmark::{
    map::{MAX_COLORS, PaletteColor, Segmentation, open_color},
    output::{Progress, check_target, write_file},
};
use image::ImageFormat;
use serde::Serialize;

use super::print_json;

/// Reduce a map in color to a few grays, a map for `train` like any other
#[derive(Debug, Args)]
pub struct Cmd {
    /// Aerial map: a PNG, JPEG or TIFF file, or builtin:city
    #[arg(long, value_name = "FILE")]
    map: String,
    /// Where to write the gray map
    #[arg(long, value_name = "PNG")]
    out: PathBuf,
    /// Colors of the palette, which become equally spaced grays
    #[arg(long, value_name = "C", default_value_t = 6, value_parser = value_parser!(u8).range(2..=MAX_COLORS as i64))]
    colors: u8,
    /// Seed of the palette
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print the palette as JSON
    #[arg(long)]
    json: bool,
}

/// What is printed as JSON.
#[derive(Serialize)]
struct Report<'a> {
    map: &'a str,
    width: u32,
    height: u32,
    seed: u64,
    palette: &'a [PaletteColor],
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        check_target(&self.out)?;
        let picture = open_color(&self.map)?;
        let step = Progress::Stderr.step("segmenting");
        let segmentation = Segmentation::new(&picture, usize::from(self.colors), self.seed)
            .with_context(|| self.map.clone())?;
        let mut png = Cursor::new(Vec::new());
        segmentation.gray().write_to(&mut png, ImageFormat::Png)?;
        drop(step);
        write_file(&self.out, |file| file.write_all(png.get_ref()))?;

        let mut out = io::stdout().lock();
        let report = Report {
            map: &self.map,
            width: picture.width(),
            height: picture.height(),
            seed: self.seed,
            palette: segmentation.palette(),
        };
        if self.json {
            return print_json(&mut out, &report);
        }
        writeln!(
            out,
            "{}: {}×{} pixels of {} colors",
            self.out.display(),
            report.width,
            report.height,
            report.palette.len()
        )?;
        writeln!(out, "{:>6}{:>9}  rgb", "gray", "share")?;
        for color in report.palette {
            let [red, green, blue] = color.rgb;
            writeln!(
                out,
                "{:>6}{:>7.1} %  #{red:02x}{green:02x}{blue:02x}",
                color.gray,
                100.0 * color.share
            )?;
        }
        Ok(())
    }
}
