//! What is answered to which request.

use std::{
    net::{IpAddr, SocketAddr},
    sync::{Arc, Mutex},
    time::Instant,
};

use eigenmark_core::atlas::Atlas;
use image::DynamicImage;
use serde_json::{Value, json};

use crate::{
    monitor::{BoardState, json::state_json, watch::lock},
    output::{fitted, jpeg, png},
    report,
    simulate::CameraFrame,
};

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Width of the map's picture at most, in pixels.
const MAP_WIDTH_PX: u32 = 1600;

const HTML: &str = "text/html; charset=utf-8";
const TEXT: &str = "text/plain; charset=utf-8";
const JSON: &str = "application/json";

/// What the vehicle flies over, as far as it is known.
#[derive(Clone, Debug, Default)]
pub struct Terrain {
    size_px: Option<[u32; 2]>,
    picture: Option<Vec<u8>>,
    footprint_px: Option<f32>,
    places: Vec<[f32; 2]>,
    legs: Vec<[u16; 2]>,
}

/// What is answered.
#[derive(Debug)]
pub(super) struct Answer {
    pub(super) status: u16,
    pub(super) kind: &'static str,
    pub(super) body: Vec<u8>,
}

/// Everything that is served.
#[derive(Debug)]
pub(super) struct Site {
    port: u16,
    terrain: Terrain,
    state: Arc<Mutex<BoardState>>,
    start: Instant,
}

impl Terrain {
    /// Nothing but what the board says.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// With the atlas's map size, footprint, places and legs.
    #[must_use]
    pub fn with_atlas(mut self, atlas: &Atlas<'_>) -> Self {
        let header = atlas.header();
        let (width, height) = header.map_px;
        self.size_px.get_or_insert([width, height]);
        self.footprint_px = Some(header.footprint_px);
        let topology = atlas.topology();
        self.places = topology
            .places()
            .iter()
            .map(|place| place.point())
            .map(|point| [point.x_px, point.y_px])
            .collect();
        self.legs = (0..self.places.len() as u16)
            .flat_map(|place| topology.legs(place))
            .filter(|leg| leg.from < leg.to)
            .map(|leg| [leg.from, leg.to])
            .collect();
        self
    }

    /// With a picture of the map, as a person would like to see it.
    #[must_use]
    pub fn with_picture(mut self, map: &DynamicImage) -> Self {
        self.size_px = Some([map.width(), map.height()]);
        self.picture = Some(jpeg(&fitted(map, MAP_WIDTH_PX)));
        self
    }

    fn json(&self) -> Value {
        json!({
            "size_px": self.size_px,
            "has_picture": self.picture.is_some(),
            "footprint_px": self.footprint_px,
            "places": self.places,
            "legs": self.legs,
        })
    }
}

impl Answer {
    fn ok(kind: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Self {
            status: 200,
            kind,
            body: body.into(),
        }
    }

    fn error(status: u16, text: &str) -> Self {
        Self {
            status,
            kind: TEXT,
            body: format!("{text}\n").into_bytes(),
        }
    }
}

impl Site {
    pub(super) fn new(
        port: u16,
        terrain: Terrain,
        state: Arc<Mutex<BoardState>>,
        start: Instant,
    ) -> Self {
        Self {
            port,
            terrain,
            state,
            start,
        }
    }

    /// The answer to a request with these values of its `Host` headers.
    pub(super) fn answer(&self, method: &str, url: &str, hosts: &[&str]) -> Answer {
        match hosts {
            [host] if is_here(host, self.port) => {}
            _ => return Answer::error(403, "expected an address or localhost as host"),
        }
        let (path, query) = match url.split_once('?') {
            Some((path, query)) => (path, Some(query)),
            None => (url, None),
        };
        let found = match (method, path, query) {
            ("GET", "/", None) => Some(Answer::ok(HTML, PAGE)),
            ("GET", "/page.css", None) => Some(Answer::ok(
                "text/css; charset=utf-8",
                [report::STYLE, STYLE].concat(),
            )),
            ("GET", "/page.js", None) => Some(Answer::ok("text/javascript; charset=utf-8", SCRIPT)),
            ("GET", "/terrain.json", None) => {
                Some(Answer::ok(JSON, self.terrain.json().to_string()))
            }
            ("GET", "/map.jpg", None) => {
                let picture = self.terrain.picture.clone();
                picture.map(|bytes| Answer::ok("image/jpeg", bytes))
            }
            ("GET", "/state.json", query) => number(query, "from").map(|from| self.state(from)),
            ("GET", "/picture.png", query) => {
                number(query, "sequence").and_then(|_| self.picture())
            }
            _ => None,
        };
        found.unwrap_or_else(|| Answer::error(404, "there is nothing here"))
    }

    fn state(&self, from: u64) -> Answer {
        let value = state_json(&lock(&self.state), self.start.elapsed(), from);
        Answer::ok(JSON, value.to_string())
    }

    fn picture(&self) -> Option<Answer> {
        let CameraFrame {
            pixels,
            width,
            height,
        } = lock(&self.state).picture()?.frame.clone();
        let picture = image::GrayImage::from_raw(width.into(), height.into(), pixels)?;
        Some(Answer::ok("image/png", png(&picture)))
    }
}

/// The number that a query gives to `name`; 0 without a query.
fn number(query: Option<&str>, name: &str) -> Option<u64> {
    match query {
        None => Some(0),
        Some(query) => query.strip_prefix(name)?.strip_prefix('=')?.parse().ok(),
    }
}

/// Whether a `Host` header names this server by an address, or as `localhost`.
fn is_here(host: &str, port: u16) -> bool {
    if let Ok(address) = host.parse::<SocketAddr>() {
        return address.port() == port;
    }
    let (name, named_port) = match host.rsplit_once(':') {
        Some((name, digits)) if !name.ends_with(':') && !host.ends_with(']') => {
            (name, digits.parse().ok())
        }
        _ => (host, Some(80)),
    };
    let bare = name.trim_start_matches('[').trim_end_matches(']');
    let is_name = name.eq_ignore_ascii_case("localhost") || bare.parse::<IpAddr>().is_ok();
    is_name && named_port == Some(port)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_addresses_and_localhost_lead_here() {
        for host in [
            "127.0.0.1:8400",
            "localhost:8400",
            "LocalHost:8400",
            "[::1]:8400",
            "192.168.1.5:8400",
        ] {
            assert!(is_here(host, 8400), "{host}");
        }
        for host in [
            "",
            "127.0.0.1",
            "127.0.0.1:8401",
            "localhost",
            "localhost:",
            "rebound.example:8400",
            "127.0.0.1.example:8400",
            "localhost.example:8400",
            "localhost:8400:8400",
            "[::1]",
            "::1",
        ] {
            assert!(!is_here(host, 8400), "{host}");
        }
        assert!(is_here("127.0.0.1", 80) && is_here("localhost", 80) && is_here("[::1]", 80));
    }
}
