//! `localize`: the core answers for picture files.

use std::{
    io::{self, Write},
    path::PathBuf,
};

use anyhow::Context;
use clap::Args;
use eigenmark::{atlas::AtlasBuffer, map::load};
use eigenmark_core::{
    frame::Frame,
    localizer::{Fix, Localizer},
};
use serde::Serialize;

use super::print_json;

/// Find picture files on the map, with the code that runs on board
#[derive(Debug, Args)]
pub struct Cmd {
    /// The atlas
    #[arg(long, value_name = "ATLAS")]
    atlas: PathBuf,
    /// Print one JSON object per line and frame
    #[arg(long)]
    json: bool,
    /// Frames: PNG, JPEG or TIFF files whose largest centred square shows one view's footprint
    #[arg(value_name = "FRAME", required = true)]
    frames: Vec<String>,
}

/// What is printed per frame. Without a fix everything but the name is null or false.
#[derive(Debug, Serialize)]
struct Line<'a> {
    frame: &'a str,
    landmark: Option<u32>,
    view: Option<u32>,
    place: Option<[f32; 2]>,
    position: Option<[f32; 2]>,
    distance: Option<f32>,
    second: Option<f32>,
    margin: Option<f32>,
    from_feature_space: Option<f32>,
    guaranteed: bool,
    known: bool,
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        let buffer = AtlasBuffer::read(&self.atlas)?;
        let mut localizer = Localizer::new(buffer.atlas());
        let mut out = io::stdout().lock();
        for (name, index) in self.frames.iter().zip(0..) {
            let fix = locate(&mut localizer, name)?;
            if index == 0 && !self.json {
                print_head(&mut out)?;
            }
            if self.json {
                print_json(&mut out, &Line::new(name, fix))?;
            } else {
                print_row(&mut out, name, fix)?;
            }
        }
        Ok(())
    }
}

impl<'a> Line<'a> {
    fn new(frame: &'a str, fix: Option<Fix>) -> Self {
        Self {
            frame,
            landmark: fix.map(|fix| fix.landmark + 1),
            view: fix.map(|fix| fix.view),
            place: fix.map(|fix| [fix.place.x_px, fix.place.y_px]),
            position: fix.map(|fix| [fix.position.x_px, fix.position.y_px]),
            distance: fix.map(|fix| fix.distance),
            second: fix.map(|fix| fix.second),
            margin: fix.map(|fix| fix.margin),
            from_feature_space: fix.map(|fix| fix.from_feature_space),
            guaranteed: fix.is_some_and(|fix| fix.guaranteed),
            known: fix.is_some_and(|fix| fix.known),
        }
    }
}

fn locate(localizer: &mut Localizer<'_>, name: &str) -> anyhow::Result<Option<Fix>> {
    let picture = load(name.as_ref())?;
    // A side that does not fit 16 bits is longer than any frame's.
    let side = |length: u32| u16::try_from(length).unwrap_or(u16::MAX);
    let (width, height) = (side(picture.width()), side(picture.height()));
    let frame = Frame::new(picture.as_raw(), width, height, picture.width() as usize)
        .with_context(|| name.to_owned())?;
    Ok(localizer.locate(&frame))
}

fn print_head(out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "{:>8}{:>8}{:>20}{:>10}{:>10}  {:<12}{:<8}frame",
        "landmark", "view", "position", "distance", "margin", "guaranteed", "known"
    )
}

fn print_row(out: &mut impl Write, name: &str, fix: Option<Fix>) -> anyhow::Result<()> {
    let Some(fix) = fix else {
        writeln!(
            out,
            "{:>8}{:>8}{:>20}{:>10}{:>10}  {:<12}{:<8}{name}",
            "-", "-", "-", "-", "-", "no", "no"
        )?;
        return Ok(());
    };
    let yes = |judgement: bool| if judgement { "yes" } else { "no" };
    let position = format!("{}, {}", fix.position.x_px, fix.position.y_px);
    let margin = if fix.margin < 1e4 {
        format!("{:.2}", fix.margin)
    } else {
        ">10000".to_owned()
    };
    writeln!(
        out,
        "{:>8}{:>8}{position:>20}{:>10.4}{margin:>10}  {:<12}{:<8}{name}",
        fix.landmark + 1,
        fix.view,
        fix.distance,
        yes(fix.guaranteed),
        yes(fix.known)
    )?;
    Ok(())
}
