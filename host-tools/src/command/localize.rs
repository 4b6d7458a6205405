//! `localize`: the core answers for picture files.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use clap::Args;
use eigenmark::{atlas::AtlasBuffer, map::load};
use eigenmark_core::{
    frame::Frame,
    landmark::{Prior, Sector},
    localizer::{Fix, Localizer},
    preprocess::{Coverage, Pose},
};
use serde::Serialize;

use super::{
    poses::{Degrees, Poses},
    print_json,
};

/// Find picture files on the map, with the code that runs on board
#[derive(Debug, Args)]
pub struct Cmd {
    /// The atlas
    #[arg(long, value_name = "ATLAS")]
    atlas: PathBuf,
    /// Print one JSON object per line and frame
    #[arg(long)]
    json: bool,
    /// Heading of all frames: degrees clockwise from map-up to frame-up, −360 to 360
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    heading: f64,
    /// How far the heading may be wrong: frames are not turned by --heading or the heading of --poses, but only compared
    /// with landmarks at headings that near, or nearest to that; the atlas must have several (`train --headings`). Without
    /// this a known heading is taken for exact
    #[arg(long, value_name = "DEG", value_parser = tolerance)]
    compass_tolerance: Option<f64>,
    /// Altitude of all frames over the nominal altitude, ¼ to 4: a frame's square covers RATIO × footprint
    #[arg(
        long,
        value_name = "RATIO",
        default_value_t = 1.0,
        allow_negative_numbers = true
    )]
    altitude: f64,
    /// Roll of all frames: degrees, right side down, −60 to 60
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    roll: f64,
    /// Pitch of all frames: degrees, nose up, −60 to 60
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pitch: f64,
    /// The camera's field of view over the side of a frame's square, in degrees, 10 to 150; matters when it is tilted
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 60.0,
        allow_negative_numbers = true
    )]
    fov: f64,
    /// Pose of each frame: a file with the columns frame,heading_deg,altitude_ratio and, if need be, roll_deg,pitch_deg
    #[arg(long, value_name = "CSV", conflicts_with_all = ["heading", "altitude", "roll", "pitch"])]
    poses: Option<PathBuf>,
    /// Frames: PNG, JPEG or TIFF files whose largest centered square shows one view's footprint at the nominal pose
    /// [default: all frames of --poses, relative to its folder]
    #[arg(value_name = "FRAME", required_unless_present = "poses")]
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
    /// The vehicle's, clockwise from map-up to frame-up.
    heading_deg: Option<f32>,
    /// The vehicle's, over the nominal altitude.
    altitude_ratio: Option<f32>,
    distance: Option<f32>,
    second: Option<f32>,
    margin: Option<f32>,
    from_feature_space: Option<f32>,
    guaranteed: bool,
    known: bool,
    /// Share of the view that the frame showed.
    seen: f32,
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        let buffer = AtlasBuffer::read(&self.atlas)?;
        let mut localizer = Localizer::new(buffer.atlas());
        let survey = localizer.atlas().survey();
        ensure!(
            self.compass_tolerance.is_none() || survey.headings > 1,
            "{}: expected an atlas of several headings for --compass-tolerance, found one; train it with --headings",
            self.atlas.display()
        );
        let frames = self.frames()?;
        let mut out = io::stdout().lock();
        for ((name, path, pose), index) in frames.iter().zip(0..) {
            let (pose, prior) = self.prior(pose)?;
            let (fix, coverage) = locate(&mut localizer, path, &pose, &prior)?;
            let found = fix.map(|fix| Found::new(fix, &pose));
            if index == 0 && !self.json {
                print_head(&mut out)?;
            }
            if self.json {
                print_json(&mut out, &Line::new(name, found, coverage))?;
            } else {
                print_row(&mut out, name, found, coverage)?;
            }
        }
        Ok(())
    }

    /// The pose that a frame is levelled by, and what is known beside that.
    fn prior(&self, pose: &Pose) -> anyhow::Result<(Pose, Prior)> {
        let Some(tolerance) = self.compass_tolerance else {
            return Ok((*pose, Prior::NONE));
        };
        let levelled = Pose::new(0.0, pose.altitude_ratio())?.with_tilt(pose.tilt());
        let sector = Sector {
            heading_rad: pose.heading_rad(),
            tolerance_rad: tolerance.to_radians() as f32,
        };
        let prior = Prior {
            heading: Some(sector),
            ..Prior::NONE
        };
        Ok((levelled, prior))
    }

    /// The frames to locate: what they are called, where they lie, and how they were taken.
    fn frames(&self) -> anyhow::Result<Vec<(String, PathBuf, Pose)>> {
        let given = |pose: &dyn Fn(&str) -> anyhow::Result<Pose>| {
            self.frames
                .iter()
                .map(|name| Ok((name.clone(), name.into(), pose(name)?)))
                .collect()
        };
        let Some(path) = &self.poses else {
            let degrees = Degrees {
                heading: self.heading,
                altitude_ratio: self.altitude,
                roll: self.roll,
                pitch: self.pitch,
                field_of_view: self.fov,
            };
            let pose = degrees.pose()?;
            return given(&|_| Ok(pose));
        };
        let poses = Poses::read(path, self.fov)?;
        if self.frames.is_empty() {
            return Ok(poses.all());
        }
        given(&|name| poses.of(name))
    }
}

/// A fix, and what it says of the vehicle.
#[derive(Clone, Copy)]
struct Found {
    fix: Fix,
    /// In degrees.
    heading: f32,
    altitude_ratio: f32,
}

impl Found {
    fn new(fix: Fix, pose: &Pose) -> Self {
        Self {
            fix,
            heading: thousandths(fix.heading_from(pose).to_degrees()) % 360.0,
            altitude_ratio: fix.altitude_from(pose),
        }
    }
}

impl<'a> Line<'a> {
    fn new(frame: &'a str, found: Option<Found>, coverage: Coverage) -> Self {
        let fix = found.map(|found| found.fix);
        Self {
            frame,
            landmark: fix.map(|fix| fix.landmark + 1),
            view: fix.map(|fix| fix.view),
            place: fix.map(|fix| [fix.place.x_px, fix.place.y_px]),
            position: fix.map(|fix| [fix.position.x_px, fix.position.y_px]),
            heading_deg: found.map(|found| found.heading),
            altitude_ratio: found.map(|found| found.altitude_ratio),
            distance: fix.map(|fix| fix.distance),
            second: fix.map(|fix| fix.second),
            margin: fix.map(|fix| fix.margin),
            from_feature_space: fix.map(|fix| fix.from_feature_space),
            guaranteed: fix.is_some_and(|fix| fix.guaranteed),
            known: fix.is_some_and(|fix| fix.known),
            seen: coverage.share(),
        }
    }
}

fn locate(
    localizer: &mut Localizer<'_>,
    path: &Path,
    pose: &Pose,
    prior: &Prior,
) -> anyhow::Result<(Option<Fix>, Coverage)> {
    let picture = load(path)?;
    // A side that does not fit 16 bits is longer than any frame's.
    let side = |length: u32| u16::try_from(length).unwrap_or(u16::MAX);
    let (width, height) = (side(picture.width()), side(picture.height()));
    let frame = Frame::new(picture.as_raw(), width, height, picture.width() as usize)
        .with_context(|| path.display().to_string())?;
    let atlas = localizer.atlas();
    let plausible = atlas.landmarks().plausible(atlas.survey(), prior);
    let fix = localizer.locate_among(&frame, pose, plausible);
    Ok((fix, localizer.coverage()))
}

/// As exact as single precision is about angles.
fn thousandths(degrees: f32) -> f32 {
    (degrees * 1000.0).round() / 1000.0
}

fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(degrees) if (0.0..=180.0).contains(&degrees) => Ok(degrees),
        _ => Err("expected a number of degrees from 0 to 180".to_owned()),
    }
}

fn print_head(out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "{:>8}{:>8}{:>20}{:>9}{:>9}{:>10}{:>10}  {:<12}{:<8}{:>5}  frame",
        "landmark",
        "view",
        "position",
        "heading",
        "altitude",
        "distance",
        "margin",
        "guaranteed",
        "known",
        "seen"
    )
}

fn print_row(
    out: &mut impl Write,
    name: &str,
    found: Option<Found>,
    coverage: Coverage,
) -> anyhow::Result<()> {
    let seen = format!("{:.0} %", 100.0 * coverage.share());
    let Some(found) = found else {
        writeln!(
            out,
            "{:>8}{:>8}{:>20}{:>9}{:>9}{:>10}{:>10}  {:<12}{:<8}{seen:>5}  {name}",
            "-", "-", "-", "-", "-", "-", "-", "no", "no"
        )?;
        return Ok(());
    };
    let fix = found.fix;
    let yes = |judgement: bool| if judgement { "yes" } else { "no" };
    let position = format!("{}, {}", fix.position.x_px, fix.position.y_px);
    let margin = if fix.margin < 1e4 {
        format!("{:.2}", fix.margin)
    } else {
        ">10000".to_owned()
    };
    writeln!(
        out,
        "{:>8}{:>8}{position:>20}{:>8.1}°{:>9.2}{:>10.4}{margin:>10}  {:<12}{:<8}{seen:>5}  {name}",
        fix.landmark + 1,
        fix.view,
        found.heading,
        found.altitude_ratio,
        fix.distance,
        yes(fix.guaranteed),
        yes(fix.known)
    )?;
    Ok(())
}
