//! The state as a page on this machine.
//!
//! The page polls `state.json`; map and pictures come as files of their own. Only `GET` of the paths below is answered,
//! and only when it is asked for by an address or `localhost`: no name that somebody else's page could make its own
//! (DNS rebinding) leads here. Pages from elsewhere can neither frame nor read it.
//!
//! | path | holds |
//! | --- | --- |
//! | `/`, `/page.css`, `/page.js` | the page |
//! | `/terrain.json`, `/map.jpg` | what does not change: the map, places, legs |
//! | `/state.json?from=N` | the state, and the samples from number N on |
//! | `/picture.png` | the camera's last picture |

mod site;

use std::{
    net::{SocketAddr, ToSocketAddrs},
    sync::{Arc, Mutex},
    thread,
    time::Instant,
};

use tiny_http::{Header, Request, Response, Server};

use super::BoardState;
use site::{Answer, Site};

pub use site::Terrain;

/// Threads that answer: one browser asks for a few things at once.
const WORKERS: usize = 4;

/// What every answer says: nothing from elsewhere runs, nobody frames it, nobody keeps it.
const HEADERS: [(&str, &str); 5] = [
    (
        "Content-Security-Policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    ("X-Content-Type-Options", "nosniff"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Referrer-Policy", "no-referrer"),
    ("Cache-Control", "no-store"),
];

/// Why the page cannot be served.
#[derive(Debug, thiserror::Error)]
#[error("{address}: cannot serve the page: {reason}")]
pub struct WebError {
    /// Where.
    address: String,
    /// What the system says.
    reason: String,
}

/// Serves the page until it is dropped.
pub struct WebServer {
    address: SocketAddr,
    server: Arc<Server>,
}

impl WebServer {
    /// Serves the page at `ADDRESS:PORT`; port 0 takes any that is free. `start` is what the state's times are since.
    ///
    /// # Errors
    /// When there is no such address, or somebody else serves there.
    pub fn start(
        address: &str,
        terrain: Terrain,
        state: Arc<Mutex<BoardState>>,
        start: Instant,
    ) -> Result<Self, WebError> {
        let error = |reason: String| WebError {
            address: address.to_owned(),
            reason,
        };
        let resolved = address
            .to_socket_addrs()
            .map_err(|source| error(source.to_string()))?
            .next()
            .ok_or_else(|| error("no such address".to_owned()))?;
        let server = Server::http(resolved).map_err(|source| error(source.to_string()))?;
        let address = server
            .server_addr()
            .to_ip()
            .ok_or_else(|| error("expected an IP address".to_owned()))?;
        let server = Arc::new(server);
        let site = Arc::new(Site::new(address.port(), terrain, state, start));
        for _ in 0..WORKERS {
            let (server, site) = (Arc::clone(&server), Arc::clone(&site));
            thread::spawn(move || {
                while let Ok(request) = server.recv() {
                    respond(request, &site);
                }
            });
        }
        Ok(Self { address, server })
    }

    /// Where it is served.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for WebServer {
    fn drop(&mut self) {
        (0..WORKERS).for_each(|_| self.server.unblock());
    }
}

fn respond(request: Request, site: &Site) {
    let hosts: Vec<&str> = request
        .headers()
        .iter()
        .filter(|header| header.field.equiv("Host"))
        .map(|header| header.value.as_str())
        .collect();
    let Answer { status, kind, body } =
        site.answer(request.method().as_str(), request.url(), &hosts);
    let mut response = Response::from_data(body).with_status_code(status);
    let kind = ("Content-Type", kind);
    for (name, value) in HEADERS.into_iter().chain([kind]) {
        if let Ok(header) = Header::from_bytes(name, value) {
            response.add_header(header);
        }
    }
    // Whoever went away needs no answer.
    let _ = request.respond(response);
}
