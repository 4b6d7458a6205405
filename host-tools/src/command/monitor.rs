//! `monitor`: what a live board says, in the terminal, as a page, as JSON lines, and as a log.

use std::{
    io::{self, IsTerminal, Write},
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use anyhow::{Context, bail, ensure};
use clap::{Args, value_parser};
use eigenmark::{
    atlas::AtlasBuffer,
    link::DEFAULT_BAUD,
    map::{BUILTIN_CITY, Map, city, load_color},
    monitor::{
        BoardState, Ended, FlightLog, News, Screen, Terrain, WatchError, WatchSettings, WebServer,
        line, report_json, view, watch,
    },
    output::OutputError,
    simulate::{Ground, Recorder},
};
use eigenmark_core::{
    atlas::Atlas,
    link::{Goals, Reply},
    navigator::MAX_GOALS,
};

use super::{Unmet, print_json, route::Stop};

/// How often the view is drawn again.
const REDRAW: Duration = Duration::from_millis(200);

/// How often a line is printed where nothing can be drawn again.
const LINE: Duration = Duration::from_secs(1);

/// Reports per picture where pictures are of use: at ten frames per second, a serial line of 115,200 bits per second is
/// then half full.
const DEFAULT_PICTURES: u16 = 50;

/// Show a live board: where it is, its fixes, rates, link and faults; optionally as a local page, with a log
#[derive(Debug, Args)]
pub struct Cmd {
    /// The board's link: a serial port, or tcp:HOST:PORT
    #[arg(long, value_name = "PORT")]
    link: String,
    /// Bits per second of a serial port
    #[arg(long, value_name = "BAUD", default_value_t = DEFAULT_BAUD, value_parser = value_parser!(u32).range(1..))]
    baud: u32,
    /// The map it flies over: a PNG, JPEG or TIFF file, or builtin:city
    #[arg(long, value_name = "FILE")]
    map: Option<String>,
    /// The atlas it flies by
    #[arg(long, value_name = "ATLAS")]
    atlas: Option<PathBuf>,
    /// Serve a page with the map and the way; others than this machine see it only at an address of theirs
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, default_missing_value = "127.0.0.1:8400")]
    web: Option<String>,
    /// Log reports and pictures to a directory, for simulate --replay
    #[arg(long, value_name = "DIR", requires = "atlas")]
    log: Option<PathBuf>,
    /// Frames per report
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u16).range(1..))]
    every: u16,
    /// Reports per picture, 0 for none; a replay sees the pictures only [default: 50 with --web or --log, else 0]
    #[arg(long, value_name = "N")]
    pictures: Option<u16>,
    /// Send the vehicle to these places: numbers, or with --atlas X,Y for the nearest
    #[arg(long, value_name = "PLACE", num_args = 1..)]
    go: Vec<Stop>,
    /// Stop after so many seconds; exit with 1 when no report came
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Duration>,
    /// Print every report as a JSON object on a line
    #[arg(long, conflicts_with = "plain")]
    json: bool,
    /// Print a line per second, also to a terminal
    #[arg(long)]
    plain: bool,
}

/// How it is shown on stdout.
enum Shown {
    /// In place.
    View(Screen),
    Lines,
    Json,
}

/// What becomes of the news.
struct Desk<'a> {
    state: &'a Mutex<BoardState>,
    shown: Shown,
    /// Where the page is.
    page: Option<String>,
    log: Option<FlightLog>,
    /// CRC-32 of the atlas that was given.
    atlas_crc: Option<u32>,
    drawn: Option<Duration>,
    events: u64,
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        if let Some(directory) = &self.log {
            Recorder::check(directory)?;
        }
        let map = self.map.as_deref().map(Map::open).transpose()?;
        let buffer = self.atlas.as_deref().map(AtlasBuffer::read).transpose()?;
        let atlas = buffer.as_ref().map(AtlasBuffer::atlas);
        if let (Some(map), Some(atlas), Some(path)) = (&map, &atlas, &self.atlas) {
            let (found, expected) = (atlas.header().map_px, (map.width(), map.height()));
            ensure!(
                found == expected,
                "{}: the atlas is of a map of {}×{} pixels, {} has {}×{}",
                path.display(),
                found.0,
                found.1,
                map.name(),
                expected.0,
                expected.1
            );
        }
        let settings = WatchSettings {
            link: self.link.clone(),
            baud: self.baud,
            every: self.every,
            pictures: self.pictures(),
            goals: self.goals(atlas.as_ref())?,
            duration: self.duration,
        };
        let start = Instant::now();
        let state = Arc::new(Mutex::new(BoardState::new(&self.link, self.every)));
        let stop = stopper()?;
        let server = match &self.web {
            Some(address) => {
                let terrain = terrain(map.as_ref(), atlas.as_ref())?;
                Some(WebServer::start(
                    address,
                    terrain,
                    Arc::clone(&state),
                    start,
                )?)
            }
            None => None,
        };
        let page = server
            .as_ref()
            .map(|server| format!("http://{}/", server.address()));
        if let (Some(page), Some(server)) = (&page, &server) {
            eprintln!("the page is at {page}");
            if !server.address().ip().is_loopback() {
                eprintln!("whoever reaches that address sees it");
            }
        }
        let log = match (&self.log, &atlas) {
            (Some(target), Some(atlas)) => Some(FlightLog::create(
                target,
                ground(map.as_ref(), atlas),
                atlas,
            )?),
            _ => None,
        };
        let mut desk = Desk {
            state: &state,
            shown: self.shown(),
            page,
            log,
            atlas_crc: atlas.as_ref().map(Atlas::crc),
            drawn: None,
            events: 0,
        };
        let ended = watch(&settings, &state, start, &stop, |news, now| {
            desk.take(news, now)
        });
        // Whatever happened, what was logged is kept.
        let kept = desk.close(self.log.as_deref());
        let ended = ended.map_err(|error| match error {
            WatchError::Link(error) => error.into(),
            WatchError::Watcher(error) => error,
        })?;
        kept?;
        let reports = locked(&state).reports();
        match self.duration {
            Some(duration) if ended == Ended::InTime && reports == 0 => Err(Unmet(format!(
                "{}: no report came in {} s",
                self.link,
                duration.as_secs_f64()
            ))
            .into()),
            _ => Ok(()),
        }
    }

    fn pictures(&self) -> u16 {
        let is_of_use = self.web.is_some() || self.log.is_some();
        self.pictures
            .unwrap_or(if is_of_use { DEFAULT_PICTURES } else { 0 })
    }

    fn shown(&self) -> Shown {
        if self.json {
            Shown::Json
        } else if self.plain || !io::stdout().is_terminal() {
            Shown::Lines
        } else {
            Shown::View(Screen::new())
        }
    }

    /// The places (0-based) to fly to.
    fn goals(&self, atlas: Option<&Atlas<'_>>) -> anyhow::Result<Goals> {
        let mut goals = Goals::new();
        for stop in &self.go {
            let place = match (atlas, *stop) {
                (Some(atlas), stop) => stop.resolve(atlas)?,
                (None, Stop::Number(number)) => number
                    .checked_sub(1)
                    .context("place 0; places are numbered from 1")?,
                (None, Stop::Near(_)) => bail!("--go X,Y needs --atlas, which knows the places"),
            };
            if goals.push(place).is_err() {
                bail!(
                    "--go: {} places; expected at most {MAX_GOALS}",
                    self.go.len()
                );
            }
        }
        Ok(goals)
    }
}

impl Desk<'_> {
    /// Shows and logs the news, if there are any.
    fn take(&mut self, news: Option<(&Reply, News)>, now: Duration) -> anyhow::Result<()> {
        match news {
            Some((Reply::Report(report), News::Report { restarted })) => {
                if let Some(log) = &mut self.log {
                    log.report(report, restarted, now)?;
                }
                if let Shown::Json = self.shown {
                    print_json(&mut io::stdout().lock(), &report_json(report))?;
                }
            }
            Some((_, News::Picture)) => {
                if let (Some(log), Some(picture)) = (&mut self.log, locked(self.state).picture()) {
                    log.picture(picture);
                }
            }
            Some((Reply::Identity(identity), _)) => {
                let flown = identity.atlas.map(|atlas| atlas.crc);
                if let (Some(expected), Some(found)) = (self.atlas_crc, flown)
                    && expected != found
                {
                    let text =
                        format!("the board flies by atlas {found:08x}; --atlas is {expected:08x}");
                    locked(self.state).note(&text, now);
                }
            }
            _ => {}
        }
        self.show(now)
    }

    /// Brings stdout up to date, when it is time.
    fn show(&mut self, now: Duration) -> anyhow::Result<()> {
        let state = locked(self.state);
        if !matches!(self.shown, Shown::View(_)) {
            for event in state.events_since(self.events) {
                eprintln!("{:.1} s: {}", event.at.as_secs_f64(), event.text);
            }
            self.events = state.event_count();
        }
        let pause = match self.shown {
            Shown::View(_) => REDRAW,
            Shown::Lines => LINE,
            Shown::Json => return Ok(()),
        };
        if self.drawn.is_some_and(|drawn| now < drawn + pause) {
            return Ok(());
        }
        self.drawn = Some(now);
        match &mut self.shown {
            Shown::View(screen) => {
                let mut lines = view(&state, now);
                lines.extend(self.page.as_ref().map(|page| format!("page      {page}")));
                screen.draw(&lines)?;
            }
            Shown::Lines => writeln!(io::stdout().lock(), "{}", line(&state, now))?,
            Shown::Json => {}
        }
        Ok(())
    }

    /// Ends the log.
    fn close(self, target: Option<&Path>) -> Result<(), OutputError> {
        let (Some(log), Some(target)) = (self.log, target) else {
            return Ok(());
        };
        let [steps, frames] = log.counts();
        if steps == 0 {
            eprintln!("{}: no report came, so there is no log", target.display());
            return Ok(());
        }
        let identity = locked(self.state).identity().copied();
        if identity.is_none() {
            eprintln!(
                "{}: the board did not say its setup; the log has 1 m per pixel and 60°",
                target.display()
            );
        }
        let crc = identity.and_then(|identity| Some(identity.atlas?.crc));
        log.finish(identity.map(|identity| identity.setup), crc)?;
        eprintln!(
            "{}: logged {steps} steps, {frames} of them with frames",
            target.display()
        );
        Ok(())
    }
}

fn locked(state: &Mutex<BoardState>) -> std::sync::MutexGuard<'_, BoardState> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Becomes true when the user or the system asks to stop.
fn stopper() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))
        .context("signals cannot be handled")?;
    Ok(stop)
}

/// What the page draws under the way; the map in color, if it has any.
fn terrain(map: Option<&Map>, atlas: Option<&Atlas<'_>>) -> anyhow::Result<Terrain> {
    let mut terrain = Terrain::new();
    if let Some(map) = map {
        let picture = match map.name() {
            BUILTIN_CITY => city::draw(),
            name => load_color(name.as_ref())?,
        };
        terrain = terrain.with_picture(&picture.into());
    }
    if let Some(atlas) = atlas {
        terrain = terrain.with_atlas(atlas);
    }
    Ok(terrain)
}

/// What a log says of the map: that one, or the atlas's.
fn ground(map: Option<&Map>, atlas: &Atlas<'_>) -> Ground {
    match map {
        Some(map) => Ground {
            name: map.name().to_owned(),
            crc: map.crc(),
        },
        None => Ground {
            name: "unnamed".to_owned(),
            crc: atlas.header().training.map_crc,
        },
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|number| *number > 0.0)
        .and_then(|number| Duration::try_from_secs_f64(number).ok())
        .ok_or_else(|| format!("expected a positive number of seconds, found {text:?}"))
}
