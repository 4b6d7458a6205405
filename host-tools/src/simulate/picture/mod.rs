//! A flight over the map, as a picture.
//!
//! The map is dimmed, in colors of night; over it lie places and legs, the true way as a pale band, what path
//! integration alone believes, and what the pilot believes: bright where it relies on it, dotted where it does not, red
//! where it does and is wrong. Below stand a title, a caption, the legend of what there is, and a scale bar.

mod canvas;
mod font;
mod legend;
mod ways;

use std::{
    io::{self, Write},
    path::Path,
};

use eigenmark_core::landmark::Point;
use image::{
    ExtendedColorType, ImageEncoder, Rgb, RgbImage,
    codecs::{jpeg::JpegEncoder, png::PngEncoder},
    imageops::FilterType,
};

use super::Step;
use crate::{
    map::Map,
    output::{OutputError, check_target, write_file},
};
use canvas::{Canvas, Ink, Line, dashes};
use legend::Sign;
use ways::{Trust, Ways};

/// The width that small maps are enlarged to, in pixels, and how much at most.
const WIDTH_PX: f32 = 1600.0;
const MAX_SCALE: f32 = 2.5;

/// Quality of JPEG files, in percent.
const JPEG_QUALITY: u8 = 82;

/// What shines through a black map.
const NIGHT: [f32; 3] = [11.0, 14.0, 19.0];

/// Share of the map's light that is left, by color.
const MOONLIGHT: [f32; 3] = [0.40, 0.43, 0.48];

const DARK: Ink = Ink::new([8, 10, 14]);
const PALE: Ink = Ink::new([236, 240, 246]);
const AMBER: Ink = Ink::new([255, 178, 36]);
const RED: Ink = Ink::new([255, 70, 70]);
const CYAN: Ink = Ink::new([64, 208, 236]);
const GREEN: Ink = Ink::new([98, 220, 120]);
const VIOLET: Ink = Ink::new([214, 120, 255]);
const STEEL: Ink = Ink::new([150, 168, 196]);

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct FlightPicture<'a> {
    /// The map flown over.
    pub map: &'a Map,
    /// Meters per map pixel.
    pub meters_per_px: f64,
    /// Side of a view, in map pixels.
    pub footprint_px: f64,
    /// The flight.
    pub steps: &'a [Step],
    /// Where it should end.
    pub goal: Option<Point>,
    /// Places of the topological map.
    pub places: &'a [Point],
    /// Its legs, as pairs of indices of places.
    pub legs: &'a [[usize; 2]],
    /// What it is, in a line.
    pub title: &'a str,
    /// More about it, in a line.
    pub caption: &'a str,
}

/// What a picture is stored as.
#[derive(Clone, Copy, Debug)]
enum Format {
    Png,
    Jpeg,
}

impl Format {
    /// As a name ends.
    fn of(path: &Path) -> Result<Self, OutputError> {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("png") => Ok(Self::Png),
            Some("jpg" | "jpeg") => Ok(Self::Jpeg),
            _ => Err(OutputError {
                path: path.to_owned(),
                source: io::Error::other("expected a name that ends in .png, .jpg or .jpeg"),
            }),
        }
    }

    fn encode(self, picture: &RgbImage, file: &mut dyn Write) -> io::Result<()> {
        let (width, height) = picture.dimensions();
        let color = ExtendedColorType::Rgb8;
        match self {
            Self::Png => PngEncoder::new(file).write_image(picture, width, height, color),
            Self::Jpeg => JpegEncoder::new_with_quality(file, JPEG_QUALITY)
                .write_image(picture, width, height, color),
        }
        .map_err(io::Error::other)
    }
}

impl FlightPicture<'_> {
    /// Draws it: as wide as the map, or up to 1600 pixels for smaller maps.
    #[must_use]
    pub fn draw(&self) -> RgbImage {
        let size = [self.map.width(), self.map.height()].map(|side| side as f32);
        let scale = (WIDTH_PX / size[0]).clamp(1.0, MAX_SCALE);
        let [width, height] = size.map(|side| (side * scale).round() as u32);
        let ways = Ways::of(self.steps, self.footprint_px, scale);
        let signs = self.signs(&ways);
        let panel = legend::Panel::new(&signs, width);
        let mut picture = RgbImage::new(width, height + panel.height());
        dimmed(self.map, [width, height], &mut picture);
        let mut canvas = Canvas::new(picture);
        self.draw_places(&mut canvas, scale);
        draw_ways(&mut canvas, &ways);
        self.draw_marks(&mut canvas, &ways, scale);
        let bar = legend::ScaleBar::new(self.meters_per_px / f64::from(scale));
        panel.draw(&mut canvas, height, [self.title, self.caption], &bar);
        canvas.into_picture()
    }

    /// Checks that a picture of that name could be written: before long work, not after it.
    ///
    /// # Errors
    /// When the name ends otherwise than in `.png`, `.jpg` or `.jpeg`, or its directory does not exist.
    pub fn check(path: &Path) -> Result<(), OutputError> {
        check_target(path)?;
        Format::of(path).map(drop)
    }

    /// Draws it into a file, PNG or JPEG as its name ends.
    ///
    /// # Errors
    /// When the name ends otherwise, or the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        let format = Format::of(path)?;
        let picture = self.draw();
        write_file(path, |file| format.encode(&picture, file))
    }

    /// What the legend has to explain.
    fn signs(&self, ways: &Ways) -> Vec<Sign> {
        let has = |trust: Trust| ways.belief.iter().any(|(found, _)| *found == trust);
        let all = [
            (self.start().is_some() || self.steps.is_empty(), Sign::Truth),
            (has(Trust::Confident), Sign::Belief),
            (has(Trust::Unsure), Sign::Unsure),
            (has(Trust::Wrong), Sign::Wrong),
            (!ways.odometry.is_empty(), Sign::Odometry),
            (!self.places.is_empty(), Sign::Places),
            (self.start().is_some(), Sign::Start),
            (self.goal.is_some(), Sign::Goal),
            (!ways.jumps.is_empty(), Sign::Kidnapping),
        ];
        all.into_iter()
            .filter_map(|(is_there, sign)| is_there.then_some(sign))
            .collect()
    }

    /// Where it began, if that is known.
    fn start(&self) -> Option<Point> {
        Some(self.steps.first()?.truth?.place())
    }

    fn draw_places(&self, canvas: &mut Canvas, scale: f32) {
        let at = |index: usize| self.places.get(index).map(|&place| scaled(place, scale));
        let legs: Vec<Line> = self
            .legs
            .iter()
            .filter_map(|&[from, to]| Some(vec![at(from)?, at(to)?]))
            .collect();
        canvas.stroke(&legs, 1.5, STEEL.faint(0.45));
        let places: Vec<Line> = self
            .places
            .iter()
            .map(|&place| vec![scaled(place, scale)])
            .collect();
        canvas.stroke(&places, 9.0, DARK.faint(0.6));
        canvas.stroke(&places, 6.0, STEEL.faint(0.9));
    }

    fn draw_marks(&self, canvas: &mut Canvas, ways: &Ways, scale: f32) {
        for &[from, to] in &ways.jumps {
            legend::arrow(canvas, from, to);
        }
        if let Some(first) = self.start() {
            let at = scaled(first, scale);
            legend::start(canvas, at);
            label(canvas, at, "start");
        }
        if let Some(goal) = self.goal {
            let at = scaled(goal, scale);
            legend::goal(canvas, at);
            label(canvas, at, "goal");
        }
    }
}

/// The ways, the widest first.
fn draw_ways(canvas: &mut Canvas, ways: &Ways) {
    canvas.stroke(&ways.truth, 9.0, DARK.faint(0.55));
    canvas.stroke(&ways.truth, 6.0, PALE.faint(0.85));
    canvas.stroke(&ways.odometry, 4.0, DARK.faint(0.6));
    canvas.stroke(&ways.odometry, 2.2, CYAN);
    for trust in [Trust::Unsure, Trust::Confident, Trust::Wrong] {
        let of = ways.belief.iter().filter(|(found, _)| *found == trust);
        let lines: Vec<Line> = match trust {
            Trust::Unsure => of.flat_map(|(_, line)| dashes(line, 4.0)).collect(),
            _ => of.map(|(_, line)| line.clone()).collect(),
        };
        let ink = if trust == Trust::Wrong { RED } else { AMBER };
        canvas.stroke(&lines, 4.6, DARK.faint(0.6));
        canvas.stroke(&lines, 2.8, ink);
    }
}

/// A word beside a mark.
fn label(canvas: &mut Canvas, [x, y]: [f32; 2], text: &str) {
    const CAP_PX: f32 = 12.0;
    let at = [x + 16.0, y + CAP_PX / 2.0];
    canvas.stroke(&font::lines(at, CAP_PX, text), 6.0, DARK.faint(0.75));
    canvas.text(at, CAP_PX, PALE, text);
}

fn scaled(point: Point, scale: f32) -> [f32; 2] {
    [point.x_px * scale, point.y_px * scale]
}

/// The map at night, at the top of the picture.
fn dimmed(map: &Map, [width, height]: [u32; 2], picture: &mut RgbImage) {
    let enlarged;
    let gray = if [map.width(), map.height()] == [width, height] {
        map.luminance()
    } else {
        enlarged = image::imageops::resize(map.luminance(), width, height, FilterType::Triangle);
        &enlarged
    };
    for (x, y, pixel) in gray.enumerate_pixels() {
        let level = f32::from(pixel.0[0]);
        let color = [0, 1, 2].map(|channel| (NIGHT[channel] + level * MOONLIGHT[channel]) as u8);
        picture.put_pixel(x, y, Rgb(color));
    }
}

#[cfg(test)]
mod tests;
