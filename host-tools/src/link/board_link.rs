//! Requests to a board, and its replies.

use std::{
    fmt, io,
    time::{Duration, Instant},
};

use eigenmark_core::link::{
    Damage, MAX_REPLY_LEN, MAX_REQUEST_LEN, Receiver, Reply, Request, encode,
};

use super::wire::{self, Wire};

/// How often [`BoardLink::ask`] asks before it gives up.
pub const ATTEMPTS: u32 = 3;

/// Bytes that are read at once, at most.
const READ_LEN: usize = 1024;

/// The shortest time-out that systems take for one.
const SHORTEST: Duration = Duration::from_millis(1);

/// A link to a board.
pub struct BoardLink {
    name: String,
    wire: Box<dyn Wire>,
    receiver: Box<Receiver<MAX_REPLY_LEN>>,
    /// What was read, and how much of it was looked at.
    read: Vec<u8>,
    taken: usize,
    damaged: u64,
}

/// Why a board cannot be talked with.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// There is no link of that name, or it is taken.
    #[error("{name}: cannot open the link (a serial port, or tcp:HOST:PORT): {source}")]
    Open {
        /// The link.
        name: String,
        /// What the system says.
        source: io::Error,
    },
    /// Reading or writing failed.
    #[error("{name}: the link broke: {source}")]
    Broken {
        /// The link.
        name: String,
        /// What the system says.
        source: io::Error,
    },
    /// The other side ended the connection.
    #[error("{name}: the board hung up")]
    Closed {
        /// The link.
        name: String,
    },
    /// Questions stay unanswered.
    #[error("{name}: no answer from the board: asked {ATTEMPTS} times, waited {:.1} s each", patience.as_secs_f32())]
    Silent {
        /// The link.
        name: String,
        /// How long was waited each time.
        patience: Duration,
    },
    /// The request has a longer part than a packet carries.
    #[error("a request does not fit into a packet of {MAX_REQUEST_LEN} bytes: {0}")]
    Request(Damage),
}

impl BoardLink {
    /// Opens `name`: a serial port at `baud` bits per second (8 bits, no parity, one stop bit), or `tcp:HOST:PORT`.
    ///
    /// # Errors
    /// [`LinkError::Open`].
    pub fn open(name: &str, baud: u32) -> Result<Self, LinkError> {
        let wire = wire::open(name, baud).map_err(|source| LinkError::Open {
            name: name.to_owned(),
            source,
        })?;
        Ok(Self::over(name, wire))
    }

    /// A link over what is open already; errors call it `name`.
    #[must_use]
    pub fn over(name: &str, wire: Box<dyn Wire>) -> Self {
        Self {
            name: name.to_owned(),
            wire,
            receiver: Box::default(),
            read: Vec::new(),
            taken: 0,
            damaged: 0,
        }
    }

    /// What it was opened as.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How many packets arrived damaged.
    #[must_use]
    pub fn damaged(&self) -> u64 {
        self.damaged
    }

    /// Sends a request. That it went does not say that it arrived.
    ///
    /// # Errors
    /// [`LinkError::Request`] when a part of it is too long, and what broke the link.
    pub fn send(&mut self, request: &Request<'_>) -> Result<(), LinkError> {
        let (mut scratch, mut packet) = ([0; MAX_REQUEST_LEN], [0; MAX_REQUEST_LEN]);
        let packet = encode(request, &mut scratch, &mut packet).map_err(LinkError::Request)?;
        // The zero ends whatever noise came before.
        let sent = self
            .wire
            .write_all(&[0])
            .and_then(|()| self.wire.write_all(packet))
            .and_then(|()| self.wire.flush());
        sent.map_err(|source| self.broken(source))
    }

    /// The next intact reply, waited for as long as `timeout`; none when there is none in time.
    ///
    /// # Errors
    /// What broke the link.
    pub fn receive(&mut self, timeout: Duration) -> Result<Option<Reply>, LinkError> {
        let deadline = Instant::now() + timeout;
        loop {
            if let Some(reply) = self.next_of_read() {
                return Ok(Some(reply));
            }
            let left = deadline.saturating_duration_since(Instant::now());
            self.read_more(left.max(SHORTEST))?;
            if left.is_zero() {
                return Ok(self.next_of_read());
            }
        }
    }

    /// Sends a request and waits for a reply that `matches`, as long as `timeout`; asks again, [`ATTEMPTS`] times in all.
    /// Other replies that arrive meanwhile are dropped, rejections that do not match among them.
    ///
    /// What does harm when it is done twice, or is answered otherwise then, is better sent once.
    ///
    /// # Errors
    /// [`LinkError::Silent`] when there is no such reply, and those of [`send`](Self::send).
    pub fn ask(
        &mut self,
        request: &Request<'_>,
        timeout: Duration,
        matches: impl Fn(&Reply) -> bool,
    ) -> Result<Reply, LinkError> {
        for _ in 0..ATTEMPTS {
            self.send(request)?;
            let deadline = Instant::now() + timeout;
            while let Some(reply) =
                self.receive(deadline.saturating_duration_since(Instant::now()))?
            {
                if matches(&reply) {
                    return Ok(reply);
                }
                if Instant::now() > deadline {
                    break;
                }
            }
        }
        Err(LinkError::Silent {
            name: self.name.clone(),
            patience: timeout,
        })
    }

    /// The next intact reply among the bytes that were read.
    fn next_of_read(&mut self) -> Option<Reply> {
        while let Some(&byte) = self.read.get(self.taken) {
            self.taken += 1;
            match self.receiver.push(byte) {
                Some(Ok(reply)) => return Some(reply),
                Some(Err(_)) => self.damaged += 1,
                None => {}
            }
        }
        None
    }

    /// Waits for bytes, of which there may be none.
    fn read_more(&mut self, timeout: Duration) -> Result<(), LinkError> {
        use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
        self.read.resize(READ_LEN, 0);
        let read = self
            .wire
            .set_patience(timeout)
            .and_then(|()| self.wire.read(&mut self.read));
        self.taken = 0;
        self.read.truncate(*read.as_ref().unwrap_or(&0));
        match read {
            Ok(0) => Err(LinkError::Closed {
                name: self.name.clone(),
            }),
            Ok(_) => Ok(()),
            Err(error) if matches!(error.kind(), TimedOut | WouldBlock | Interrupted) => Ok(()),
            Err(error) => Err(self.broken(error)),
        }
    }

    fn broken(&self, source: io::Error) -> LinkError {
        LinkError::Broken {
            name: self.name.clone(),
            source,
        }
    }
}

impl fmt::Debug for BoardLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BoardLink")
            .field("name", &self.name)
            .field("damaged", &self.damaged)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests;
