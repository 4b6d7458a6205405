//! `simulate`: flights over a map by an atlas, in a closed loop with the vehicle's own software.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use clap::{Args, value_parser};
use eigenmark::{
    atlas::AtlasBuffer,
    map::Map,
    output::Progress,
    simulate::{
        Camera, End, Flight, FlightPicture, FlightSettings, Onboard, Plan, Recorder, Recording,
        Statistics, Step, Totals, World, fly_all, fly_recorded, plan_flights, plan_route,
    },
};
use eigenmark_core::{atlas::Atlas, landmark::Point};
use serde_json::json;

use super::{
    Unmet, print_json,
    route::{Stop, with_places},
};

/// Fly a simulated blimp over a map: the vehicle's own software, in wind and changing light
#[derive(Debug, Args)]
pub struct Cmd {
    /// Aerial map: a PNG, JPEG or TIFF file, or builtin:city
    #[arg(long, value_name = "FILE")]
    map: String,
    /// The atlas to fly by
    #[arg(long, value_name = "ATLAS")]
    atlas: PathBuf,
    /// Meters per map pixel
    #[arg(long, value_name = "M", default_value_t = 1.0, value_parser = positive)]
    meters_per_px: f64,
    /// Places to fly through, the first of which is the start: numbers, or X,Y for the nearest [default: places at random]
    #[arg(long, value_name = "PLACE", num_args = 2..)]
    route: Vec<Stop>,
    /// Flights at random places
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u32).range(1..=1000), conflicts_with = "route")]
    flights: u32,
    /// Shortest way of a flight at random places, in meters
    #[arg(long, value_name = "M", default_value_t = 1000.0, value_parser = positive, conflicts_with = "route")]
    distance: f64,
    /// Do not carry the vehicle off halfway; on a route it never is
    #[arg(long)]
    no_kidnapping: bool,
    /// Fly without a compass, for atlases of several headings (`train --headings`)
    #[arg(long)]
    no_compass: bool,
    /// Seed of routes, wind, light, noise and everything else
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Frames per second
    #[arg(long, value_name = "HZ", default_value_t = 10.0, value_parser = positive)]
    rate: f64,
    /// Width and height of frames, in pixels
    #[arg(long, value_name = "WxH", default_value = "160x120", value_parser = size)]
    frame: (u16, u16),
    /// Draw the (first) flight over the map, as PNG or JPEG
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Record the flight: frames, truth, instruments, what the vehicle thought
    #[arg(long, value_name = "DIR", conflicts_with_all = ["flights", "replay"])]
    record: Option<PathBuf>,
    /// Show a recorded flight to the vehicle's software instead of flying; the recording knows its scale and camera
    #[arg(long, value_name = "DIR", conflicts_with_all = ["meters_per_px", "route", "flights", "distance", "no_kidnapping", "no_compass", "seed", "rate", "frame"])]
    replay: Option<PathBuf>,
    /// Exit with 1 when fewer flights arrive, in percent
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    min_arrived: Option<f64>,
    /// Print the results as JSON
    #[arg(long)]
    json: bool,
}

/// A flight, flown or read.
struct Flown {
    steps: Vec<Step>,
    end: Option<End>,
    goal: Option<Point>,
    what: String,
}

impl From<Flight> for Flown {
    fn from(flight: Flight) -> Self {
        Self {
            steps: flight.steps,
            end: Some(flight.end),
            goal: flight.settings.goal,
            what: format!("seed {}", flight.settings.seed),
        }
    }
}

/// A recording, and where it lies.
struct Recorded<'a> {
    directory: &'a Path,
    recording: Recording,
}

impl<'a> Recorded<'a> {
    fn open(directory: &'a Path) -> anyhow::Result<Self> {
        let recording = Recording::open(directory)?;
        Ok(Self {
            directory,
            recording,
        })
    }

    /// Shows it to the vehicle's software; says when that is another flight than the one that was recorded.
    fn replay(&self, map: &Map, atlas: &Atlas<'_>) -> anyhow::Result<Flown> {
        let header = self.recording.header();
        let directory = self.directory.display();
        if header.map.crc != map.crc() {
            eprintln!(
                "{directory}: recorded over {} ({:08x}), measured and drawn over {} ({:08x})",
                header.map.name,
                header.map.crc,
                map.name(),
                map.crc()
            );
        }
        if let Some(crc) = header.atlas_crc.filter(|&crc| crc != atlas.crc()) {
            eprintln!(
                "{directory}: recorded with atlas {crc:08x}, shown to a vehicle that flies by {:08x}",
                atlas.crc()
            );
        }
        let goal = header.settings.and_then(|settings| settings.goal);
        let place = goal.and_then(|goal| atlas.topology().nearest(goal));
        let goals: Vec<u16> = place.into_iter().collect();
        let mut pilot = Onboard::new(atlas.clone(), &goals, header.field_of_view_rad)?;
        let steps = self.recording.replay(&mut pilot)?;
        if !steps.is_empty() && steps.iter().all(|step| step.truth.is_none()) {
            eprintln!(
                "{directory}: where the vehicle really was is not on record, so errors cannot be measured"
            );
        }
        Ok(Flown {
            end: header.end,
            goal,
            what: format!("recorded in {directory}"),
            steps,
        })
    }
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        if let Some(picture) = &self.picture {
            FlightPicture::check(picture)?;
        }
        if let Some(directory) = &self.record {
            Recorder::check(directory)?;
        }
        let recorded = self.replay.as_deref().map(Recorded::open).transpose()?;
        let map = Map::open(&self.map)?;
        let buffer = AtlasBuffer::read(&self.atlas)?;
        let (found, expected) = (buffer.atlas().header().map_px, (map.width(), map.height()));
        ensure!(
            found == expected,
            "{}: the atlas is of a map of {}×{} pixels, {} has {}×{}",
            self.atlas.display(),
            found.0,
            found.1,
            self.map,
            expected.0,
            expected.1
        );
        let buffer = with_places(buffer, &self.atlas, Some(&map))?;
        let atlas = buffer.atlas();
        let (width, height) = self.frame;
        let world = World {
            map: &map,
            meters_per_px: recorded
                .as_ref()
                .map_or(self.meters_per_px, |it| it.recording.header().meters_per_px),
            camera: Camera::sized(width, height, atlas.header().footprint_px.into()),
        };
        let flights = match &recorded {
            Some(recorded) => vec![recorded.replay(&map, &atlas)?],
            None => self.fly(&world, &atlas)?,
        };
        self.deliver(&world, &atlas, &flights)
    }

    /// The flights that are asked for.
    fn plan(&self, world: &World<'_>, atlas: &Atlas<'_>) -> anyhow::Result<Vec<Plan>> {
        ensure!(
            !self.no_compass || atlas.header().survey.headings > 1,
            "{}: without a compass, landmarks must be stored at several headings (train --headings); expected at least 2, \
             this atlas has 1",
            self.atlas.display()
        );
        let mut plans = if self.route.is_empty() {
            let is_kidnapped = !self.no_kidnapping;
            plan_flights(
                world,
                atlas,
                self.flights,
                self.distance,
                is_kidnapped,
                self.seed,
            )?
        } else {
            let stops = self.route.iter().map(|stop| stop.resolve(atlas));
            let stops = stops.collect::<anyhow::Result<Vec<u16>>>()?;
            vec![plan_route(world, atlas, &stops, self.seed)?]
        };
        for plan in &mut plans {
            plan.settings.frame_rate_hz = self.rate;
            if self.no_compass {
                plan.settings.instruments.heading_rad = None;
            }
        }
        Ok(plans)
    }

    /// Plans and flies.
    fn fly(&self, world: &World<'_>, atlas: &Atlas<'_>) -> anyhow::Result<Vec<Flown>> {
        let plans = self
            .plan(world, atlas)
            .with_context(|| self.atlas.display().to_string())?;
        let pilot = |plan: &Plan| {
            Onboard::new(atlas.clone(), &plan.goals, world.camera.field_of_view_rad())
        };
        if let (Some(directory), Some(plan)) = (&self.record, plans.first()) {
            let flight = fly_recorded(
                world,
                &plan.settings,
                &mut pilot(plan)?,
                Some(atlas.crc()),
                directory,
            )?;
            return Ok(vec![flight.into()]);
        }
        let settings: Vec<FlightSettings> = plans.iter().map(|plan| plan.settings).collect();
        let bar = Progress::Stderr.bar("flying", plans.len() as u64);
        let planned = |index: usize, _: &FlightSettings| {
            pilot(&plans[index]).expect("its goals were planned to already")
        };
        let flights = fly_all(world, &settings, planned, |_| bar.inc(1))?;
        Ok(flights.into_iter().map(Flown::from).collect())
    }

    /// Prints, and draws.
    fn deliver(
        &self,
        world: &World<'_>,
        atlas: &Atlas<'_>,
        flights: &[Flown],
    ) -> anyhow::Result<()> {
        let side_px = f64::from(atlas.header().footprint_px);
        let statistics: Vec<Statistics> = flights
            .iter()
            .map(|flight| Statistics::of(&flight.steps, flight.end, world.meters_per_px, side_px))
            .collect();
        let totals = Totals::of(&statistics);
        if let (Some(path), Some(flight), Some(of)) =
            (&self.picture, flights.first(), statistics.first())
        {
            draw(world, atlas, flight, of, path)?;
        }
        let mut out = io::stdout().lock();
        if self.json {
            let mut value = serde_json::to_value(&totals)?;
            if let Some(object) = value.as_object_mut() {
                object.insert("each".to_owned(), json!(statistics));
            }
            print_json(&mut out, &value)?;
        } else {
            print(&mut out, &statistics, &totals)?;
        }
        let arrived = 100.0 * totals.arrived as f64 / totals.flights.max(1) as f64;
        match self.min_arrived {
            Some(expected) if arrived < expected => Err(Unmet(format!(
                "{arrived:.1} % of the flights arrived; {expected} % were asked for"
            ))
            .into()),
            _ => Ok(()),
        }
    }
}

/// Draws a flight over the map.
fn draw(
    world: &World<'_>,
    atlas: &Atlas<'_>,
    flight: &Flown,
    of: &Statistics,
    path: &Path,
) -> anyhow::Result<()> {
    let topology = atlas.topology();
    let places: Vec<Point> = topology
        .places()
        .iter()
        .map(|place| place.point())
        .collect();
    let legs: Vec<[usize; 2]> = (0..places.len() as u16)
        .flat_map(|place| topology.legs(place))
        .filter(|leg| leg.from < leg.to)
        .map(|leg| [leg.from.into(), leg.to.into()])
        .collect();
    let title = format!("{}, {}", world.map.title(), flight.what);
    let side_px = f64::from(atlas.header().footprint_px);
    let caption = format!(
        "{} m in {:.0} s, median error {} map pixels of a view's {side_px}",
        known(of.distance_m, 0),
        of.duration_s,
        known(of.median_error_px, 1)
    );
    let picture = FlightPicture {
        map: world.map,
        meters_per_px: world.meters_per_px,
        footprint_px: side_px,
        steps: &flight.steps,
        goal: flight.goal,
        places: &places,
        legs: &legs,
        title: &title,
        caption: &caption,
    };
    picture
        .write(path)
        .with_context(|| path.display().to_string())
}

fn print(out: &mut impl Write, each: &[Statistics], totals: &Totals) -> anyhow::Result<()> {
    let number = |value: Option<f64>| known(value, 1);
    writeln!(
        out,
        "flight  end           way (m)   time (s)  error (px)  drift (%)  confident (%)  wrong (%)  recovery (frames)"
    )?;
    for (flight, index) in each.iter().zip(1..) {
        let end = flight.end.map_or("–".to_owned(), |end| format!("{end:?}"));
        writeln!(
            out,
            "{index:>6}  {end:<10} {:>10} {:>10.0} {:>11} {:>10} {:>14.1} {:>10} {:>18}",
            known(flight.distance_m, 0),
            flight.duration_s,
            number(flight.median_error_px),
            number(flight.drift_percent),
            flight.confident_percent,
            known(flight.confident_wrong_percent, 2),
            flight
                .recovery_frames
                .map_or("–".to_owned(), |frames| frames.to_string()),
        )?;
    }
    writeln!(
        out,
        "{} of {} flights arrived; median error {} map pixels, drift {} %, {} % of confident estimates wrong, recovery {} frames",
        totals.arrived,
        totals.flights,
        number(totals.median_error_px),
        number(totals.drift_percent),
        known(totals.confident_wrong_percent, 2),
        totals
            .recovery_frames_median
            .map_or("–".to_owned(), |frames| frames.to_string()),
    )?;
    Ok(())
}

/// A number with so many digits after the point, or a dash.
fn known(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".to_owned(), |value| format!("{value:.digits$}"))
}

fn positive(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|number| *number > 0.0 && number.is_finite())
        .ok_or_else(|| format!("expected a positive number, found {text:?}"))
}

fn percent(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|number| (0.0..=100.0).contains(number))
        .ok_or_else(|| format!("expected 0 to 100, found {text:?}"))
}

/// Frames as the core takes them.
fn size(text: &str) -> Result<(u16, u16), String> {
    let sides = text.split_once('x').and_then(|(width, height)| {
        Some((width.parse::<u16>().ok()?, height.parse::<u16>().ok()?))
    });
    sides
        .filter(|(width, height)| (32..=320).contains(width) && (32..=240).contains(height))
        .ok_or_else(|| format!("expected 32x32 to 320x240, found {text:?}"))
}
