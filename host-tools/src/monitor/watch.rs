//! The loop over the link: asks, listens, opens again what closed or went silent.

use std::{
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use eigenmark_core::link::{Goals, Reply, Request};

use super::{BoardState, News};
use crate::link::{BoardLink, LinkError};

/// How long is listened before anything else is looked at.
const SLICE: Duration = Duration::from_millis(50);

/// A board that says nothing for so long is asked again.
const ASK_AGAIN: Duration = Duration::from_secs(2);

/// A link over which nothing comes for so long is closed and opened again.
const SILENCE: Duration = Duration::from_secs(10);

/// How long is waited before a link is opened again, at first and at most; each time twice as long.
const WAIT: [Duration; 2] = [Duration::from_millis(250), Duration::from_secs(5)];

/// What is watched, and for how long.
#[derive(Clone, Debug)]
pub struct WatchSettings {
    /// The link: a serial port, or `tcp:HOST:PORT`.
    pub link: String,
    /// Bits per second of a serial port.
    pub baud: u32,
    /// Frames per report; at least 1.
    pub every: u16,
    /// Reports per picture; 0 for no pictures.
    pub pictures: u16,
    /// Where to send the vehicle, once; not at all when empty.
    pub goals: Goals,
    /// How long; else until `stop`.
    pub duration: Option<Duration>,
}

/// How watching ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The time was over.
    InTime,
    /// It was asked to stop.
    Stopped,
}

/// Why a board cannot be watched.
#[derive(Debug, thiserror::Error)]
pub enum WatchError<E> {
    /// The link cannot be opened for the first time.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Whoever is told of the news cannot go on.
    #[error("{0}")]
    Watcher(E),
}

/// Watches a board. `state` is up to date whenever `tell` is called: with each reply and its news, and with neither at
/// least twenty times a second while there is none.
///
/// # Errors
/// When the link cannot be opened for the first time, and what `tell` gives. A link that breaks later is none: it is
/// opened again.
pub fn watch<E>(
    settings: &WatchSettings,
    state: &Mutex<BoardState>,
    start: Instant,
    stop: &AtomicBool,
    mut tell: impl FnMut(Option<(&Reply, News)>, Duration) -> Result<(), E>,
) -> Result<Ended, WatchError<E>> {
    let mut watch = Watch {
        settings,
        state,
        start,
        stop,
        has_sent_goals: false,
    };
    let mut wait = WAIT[0];
    let mut is_first = true;
    loop {
        match BoardLink::open(&settings.link, settings.baud) {
            Ok(mut link) => {
                is_first = false;
                lock(state).opened(start.elapsed());
                match watch.listen(&mut link, &mut wait, &mut tell)? {
                    Left::Ended(ended) => return Ok(ended),
                    Left::Lost(why) => lock(state).closed(&why, start.elapsed()),
                }
            }
            Err(error) if is_first => return Err(error.into()),
            Err(error) => lock(state).closed(&reason(&error), start.elapsed()),
        }
        let until = start.elapsed() + wait;
        wait = (2 * wait).min(WAIT[1]);
        while start.elapsed() < until {
            if let Some(ended) = watch.is_over() {
                return Ok(ended);
            }
            tell(None, start.elapsed()).map_err(WatchError::Watcher)?;
            thread::sleep(SLICE.min(until.saturating_sub(start.elapsed())));
        }
    }
}

/// The state, whatever happened to who held it before.
pub(super) fn lock(state: &Mutex<BoardState>) -> MutexGuard<'_, BoardState> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Why a link was left.
enum Left {
    Ended(Ended),
    Lost(String),
}

struct Watch<'a> {
    settings: &'a WatchSettings,
    state: &'a Mutex<BoardState>,
    start: Instant,
    stop: &'a AtomicBool,
    has_sent_goals: bool,
}

impl Watch<'_> {
    fn is_over(&self) -> Option<Ended> {
        if self.stop.load(Ordering::Relaxed) {
            return Some(Ended::Stopped);
        }
        let duration = self.settings.duration?;
        (self.start.elapsed() >= duration).then_some(Ended::InTime)
    }

    /// Listens until the end, or until the link is lost.
    fn listen<E>(
        &mut self,
        link: &mut BoardLink,
        wait: &mut Duration,
        tell: &mut impl FnMut(Option<(&Reply, News)>, Duration) -> Result<(), E>,
    ) -> Result<Left, WatchError<E>> {
        if let Err(error) = self.ask(link) {
            return Ok(Left::Lost(reason(&error)));
        }
        let (mut heard, mut asked, mut damaged) = (self.start.elapsed(), self.start.elapsed(), 0);
        loop {
            if let Some(ended) = self.is_over() {
                // It need not go on for nobody; when that does not arrive, it does.
                let _ = link.send(&Request::Watch {
                    every: 0,
                    pictures: 0,
                });
                return Ok(Left::Ended(ended));
            }
            let received = link.receive(SLICE);
            let now = self.start.elapsed();
            lock(self.state).damaged(link.damaged() - damaged);
            damaged = link.damaged();
            let reply = match received {
                Ok(reply) => reply,
                Err(error) => return Ok(Left::Lost(reason(&error))),
            };
            let Some(reply) = reply else {
                tell(None, now).map_err(WatchError::Watcher)?;
                if now - heard >= SILENCE {
                    let why = format!("nothing came for {} s", SILENCE.as_secs());
                    return Ok(Left::Lost(why));
                }
                if now - heard >= ASK_AGAIN && now - asked >= ASK_AGAIN {
                    lock(self.state).silent(now);
                    asked = now;
                    if let Err(error) = self.ask(link) {
                        return Ok(Left::Lost(reason(&error)));
                    }
                }
                continue;
            };
            (heard, *wait) = (now, WAIT[0]);
            let news = lock(self.state).take(&reply, now);
            tell(Some((&reply, news)), now).map_err(WatchError::Watcher)?;
            // Whoever began anew may have another atlas and new faults; whoever answers and does not report was not
            // asked to, or did not hear it.
            let is_mute = lock(self.state)
                .report_age(now)
                .is_none_or(|age| age >= ASK_AGAIN);
            let has_restarted = news == News::Report { restarted: true };
            if (has_restarted && now - asked >= WAIT[0]) || (is_mute && now - asked >= ASK_AGAIN) {
                asked = now;
                if let Err(error) = self.ask(link) {
                    return Ok(Left::Lost(reason(&error)));
                }
            }
        }
    }

    /// Asks for everything that is shown; sends the goals once.
    fn ask(&mut self, link: &mut BoardLink) -> Result<(), LinkError> {
        link.send(&Request::Identify)?;
        link.send(&Request::Slots)?;
        link.send(&Request::Faults)?;
        if !self.has_sent_goals && !self.settings.goals.is_empty() {
            link.send(&Request::Go(self.settings.goals.clone()))?;
            self.has_sent_goals = true;
        }
        link.send(&Request::Watch {
            every: self.settings.every.max(1),
            pictures: self.settings.pictures,
        })
    }
}

/// What happened, without the link's name, which is said before it.
fn reason(error: &LinkError) -> String {
    match error {
        LinkError::Open { source, .. } => format!("cannot be opened: {source}"),
        LinkError::Broken { source, .. } => format!("broke: {source}"),
        LinkError::Closed { .. } => "the board hung up".to_owned(),
        other => other.to_string(),
    }
}
