//! `route`: the shortest way between two places of an atlas.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
    str::FromStr,
};

use anyhow::{Context, bail, ensure};
use clap::Args;
use eigenmark::{atlas::AtlasBuffer, map::Map, output::Progress, topology};
use eigenmark_core::{
    atlas::Atlas,
    landmark::Point,
    route::{Leg, MAX_PLACES, Router},
};
use serde_json::json;

use super::print_json;

/// Print the shortest way between places of an atlas: every leg with its heading and length
#[derive(Debug, Args)]
pub struct Cmd {
    /// The atlas
    #[arg(long, value_name = "ATLAS")]
    atlas: PathBuf,
    /// Where to start: the number of a place, or X,Y in map pixels for the place nearest to it
    #[arg(long, value_name = "PLACE", requires = "to")]
    from: Option<Stop>,
    /// Where to go, likewise; several are visited one after the other
    #[arg(long, value_name = "PLACE", num_args = 1.., requires = "from")]
    to: Vec<Stop>,
    /// Print JSON: without --from all places and legs, else the route
    #[arg(long)]
    json: bool,
}

/// A place as a user names it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// Its number, from 1.
    Number(u16),
    /// The one nearest to a point of the map.
    Near(Point),
}

impl FromStr for Stop {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || format!("expected the number of a place, or X,Y, found {text:?}");
        let coordinate = |text: &str| {
            let number: Option<f32> = text.trim().parse().ok();
            number.filter(|number| number.is_finite()).ok_or_else(wrong)
        };
        match text.split_once(',') {
            Some((x, y)) => Ok(Self::Near(Point {
                x_px: coordinate(x)?,
                y_px: coordinate(y)?,
            })),
            None => text.parse().map(Self::Number).map_err(|_| wrong()),
        }
    }
}

impl Stop {
    /// The place (0-based).
    pub fn resolve(self, atlas: &Atlas<'_>) -> anyhow::Result<u16> {
        let map = atlas.topology();
        match self {
            Self::Number(number) => {
                let places = map.len();
                ensure!(
                    number >= 1 && usize::from(number) <= places,
                    "place {number}; the atlas has places 1 to {places}"
                );
                Ok(number - 1)
            }
            Self::Near(point) => {
                let (width, height) = atlas.header().map_px;
                let is_on = (0.0..=width as f32).contains(&point.x_px)
                    && (0.0..=height as f32).contains(&point.y_px);
                ensure!(
                    is_on,
                    "({}, {}) is not on the map of {width}×{height} pixels",
                    point.x_px,
                    point.y_px
                );
                map.nearest(point).context("the atlas has no places")
            }
        }
    }
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        let buffer = AtlasBuffer::read(&self.atlas)?;
        let buffer = with_places(buffer, &self.atlas, None)?;
        let atlas = buffer.atlas();
        let Some(from) = self.from else {
            return self.list(&atlas);
        };
        let legs = self
            .legs(&atlas, from)
            .with_context(|| self.atlas.display().to_string())?;
        self.print(&legs)
    }

    /// The legs through all stops.
    fn legs(&self, atlas: &Atlas<'_>, from: Stop) -> anyhow::Result<Vec<Leg>> {
        let mut place = from.resolve(atlas)?;
        let mut legs = Vec::new();
        for stop in &self.to {
            let goal = stop.resolve(atlas)?;
            legs.extend(way(atlas, place, goal)?);
            place = goal;
        }
        Ok(legs)
    }

    /// All places and legs.
    fn list(&self, atlas: &Atlas<'_>) -> anyhow::Result<()> {
        let map = atlas.topology();
        let mut out = io::stdout().lock();
        let number = |place: u16| u32::from(place) + 1;
        let both_ways = (0..map.len() as u16).flat_map(|place| map.legs(place));
        let legs: Vec<Leg> = both_ways.filter(|leg| leg.from < leg.to).collect();
        if self.json {
            let places = map
                .places()
                .iter()
                .map(|place| json!({"x_px": place.x_px, "y_px": place.y_px}));
            let legs = legs
                .iter()
                .map(|leg| json!([number(leg.from), number(leg.to)]));
            let value = json!({
                "places": places.collect::<Vec<_>>(), "legs": legs.collect::<Vec<_>>(),
            });
            return print_json(&mut out, &value);
        }
        writeln!(out, "{} places, {} legs", map.len(), legs.len())?;
        writeln!(out, "place      x      y  legs to")?;
        for (place, index) in map.places().iter().zip(0..) {
            let to: Vec<String> = map
                .legs(index)
                .map(|leg| number(leg.to).to_string())
                .collect();
            writeln!(
                out,
                "{:>5} {:>6.0} {:>6.0}  {}",
                number(index),
                place.x_px,
                place.y_px,
                to.join(" ")
            )?;
        }
        Ok(())
    }

    fn print(&self, legs: &[Leg]) -> anyhow::Result<()> {
        let mut out = io::stdout().lock();
        let heading = |leg: &Leg| leg.heading_rad().to_degrees().rem_euclid(360.0);
        let number = |place: u16| u32::from(place) + 1;
        // A sum of nothing would be −0.
        let total = legs.iter().map(Leg::length_px).fold(0.0, |a, b| a + b);
        if self.json {
            let legs = legs.iter().map(|leg| {
                json!({
                    "from": number(leg.from), "to": number(leg.to),
                    "start": [leg.start.x_px, leg.start.y_px], "end": [leg.end.x_px, leg.end.y_px],
                    "heading_deg": heading(leg), "length_px": leg.length_px(),
                })
            });
            let value = json!({"length_px": total, "legs": legs.collect::<Vec<_>>()});
            return print_json(&mut out, &value);
        }
        for leg in legs {
            writeln!(
                out,
                "{:>5} → {:<5} heading {:>5.1}°, {:>7.1} map pixels, to ({:.0}, {:.0})",
                number(leg.from),
                number(leg.to),
                heading(leg),
                leg.length_px(),
                leg.end.x_px,
                leg.end.y_px
            )?;
        }
        writeln!(out, "{} legs, {total:.1} map pixels", legs.len())?;
        Ok(())
    }
}

/// The atlas with places: its own, or those that its landmarks make, of which is told on stderr. With the map they are
/// tried first.
pub fn with_places(
    buffer: AtlasBuffer,
    path: &Path,
    map: Option<&Map>,
) -> anyhow::Result<AtlasBuffer> {
    if !buffer.atlas().topology().is_empty() {
        return Ok(buffer);
    }
    let network = match map {
        Some(map) => topology::lay_out(map, &buffer.atlas(), &Progress::Stderr),
        None => topology::of_landmarks(&buffer.atlas()),
    };
    ensure!(
        !network.places.is_empty(),
        "{}: the atlas has no places, and no landmark of it is recognized well enough to be one",
        path.display()
    );
    eprintln!(
        "{}: the atlas has no places; {} of its landmarks are taken (train --places auto stores them)",
        path.display(),
        network.places.len()
    );
    Ok(network.add_to(&buffer.atlas())?)
}

/// The legs from one place (0-based) to another.
fn way(atlas: &Atlas<'_>, from: u16, goal: u16) -> anyhow::Result<Vec<Leg>> {
    let mut router = Box::new(Router::<{ MAX_PLACES as usize }>::new());
    router.plan(atlas.topology(), goal)?;
    if router.length_px(from).is_none() {
        bail!(
            "no way leads from place {} to place {}",
            u32::from(from) + 1,
            u32::from(goal) + 1
        );
    }
    Ok(router.route(atlas.topology(), from).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stops_are_numbers_or_points() {
        assert_eq!("7".parse(), Ok(Stop::Number(7)));
        let near = Stop::Near(Point {
            x_px: 12.5,
            y_px: 3.0,
        });
        assert_eq!("12.5, 3".parse(), Ok(near));
        for wrong in ["", "a", "1,", "-3", "1,nan", "70000"] {
            assert!(wrong.parse::<Stop>().is_err(), "{wrong}");
        }
    }
}
