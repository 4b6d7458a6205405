//! The state model: replies and times go in, everything that is shown comes out.

use std::{collections::VecDeque, time::Duration};

use eigenmark_core::link::{Faults, Identity, Refusal, Reply, Report, SlotState};

use super::{Picture, Rates, Sample, Trail, picture::Album, rates::Window};
use crate::link::rejection;

/// Events that are remembered.
const MAX_EVENTS: usize = 100;

/// Reasons that a board has for refusing a fix.
const REFUSALS: [Refusal; 5] = [
    Refusal::NoAtlas,
    Refusal::NoFrame,
    Refusal::Flat,
    Refusal::Outside,
    Refusal::Unknown,
];

/// Everything that is known of a board. Asks no clock: times are the caller's.
#[derive(Clone, Debug)]
pub struct BoardState {
    link_name: String,
    link: LinkState,
    link_since: Duration,
    last_heard: Option<Duration>,
    identity: Option<Identity>,
    slots: Option<[SlotState; 2]>,
    faults: Option<Faults>,
    report: Option<(Report, Duration)>,
    picture: Option<Picture>,
    album: Album,
    trail: Trail,
    window: Window,
    refusals: [u64; REFUSALS.len()],
    reports: u64,
    lost: u64,
    /// Frames per report, as asked for.
    every: u16,
    restarts: u64,
    openings: u64,
    damaged: u64,
    events: VecDeque<Event>,
    event_count: u64,
}

/// How the link is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkState {
    /// Open, and the board is heard.
    Up,
    /// Open, and nothing comes.
    Silent,
    /// Closed, and why.
    Down(String),
}

/// Something to tell a person once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Event {
    /// When.
    pub at: Duration,
    /// What, in a line.
    pub text: String,
}

/// What a reply brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum News {
    /// A report; whether the board began anew before it.
    Report {
        /// The board began anew, and forgot what it was asked.
        restarted: bool,
    },
    /// A picture is whole.
    Picture,
    /// Something else, or a part.
    Other,
}

impl BoardState {
    /// Of a board behind the link of that name, which is not open yet, asked to report every so many frames.
    #[must_use]
    pub fn new(link_name: &str, every: u16) -> Self {
        Self {
            link_name: link_name.to_owned(),
            link: LinkState::Down("not opened yet".to_owned()),
            link_since: Duration::ZERO,
            last_heard: None,
            identity: None,
            slots: None,
            faults: None,
            report: None,
            picture: None,
            album: Album::default(),
            trail: Trail::default(),
            window: Window::default(),
            refusals: [0; REFUSALS.len()],
            reports: 0,
            lost: 0,
            every: every.max(1),
            restarts: 0,
            openings: 0,
            damaged: 0,
            events: VecDeque::new(),
            event_count: 0,
        }
    }

    /// The link is open; whether the board is there is not known yet.
    pub fn opened(&mut self, now: Duration) {
        self.openings += 1;
        let text = match self.openings {
            1 => "link opened",
            _ => "link opened again",
        };
        self.tell(now, format!("{}: {text}", self.link_name));
        self.set_link(LinkState::Silent, now);
    }

    /// The link is closed.
    pub fn closed(&mut self, why: &str, now: Duration) {
        let state = LinkState::Down(why.to_owned());
        if self.link != state {
            self.tell(now, format!("{}: {why}", self.link_name));
            self.set_link(state, now);
        }
    }

    /// Nothing comes over the open link.
    pub fn silent(&mut self, now: Duration) {
        if self.link == LinkState::Up {
            self.tell(now, format!("{}: nothing comes any more", self.link_name));
            self.set_link(LinkState::Silent, now);
        }
    }

    /// So many packets came damaged.
    pub fn damaged(&mut self, packets: u64) {
        self.damaged += packets;
    }

    /// Something that whoever watches found out.
    pub fn note(&mut self, text: &str, now: Duration) {
        self.tell(now, text.to_owned());
    }

    /// Takes what the board said.
    pub fn take(&mut self, reply: &Reply, now: Duration) -> News {
        if self.link != LinkState::Up {
            self.set_link(LinkState::Up, now);
        }
        self.last_heard = Some(now);
        match reply {
            Reply::Identity(identity) => self.identity = Some(*identity),
            Reply::Slots(slots) => self.slots = Some(*slots),
            Reply::Faults(faults) => self.faults = Some(*faults),
            Reply::Report(report) => {
                return News::Report {
                    restarted: self.report(report, now),
                };
            }
            Reply::Picture { .. } => {
                if let Some(picture) = self.album.take(reply) {
                    self.picture = Some(picture);
                    return News::Picture;
                }
            }
            Reply::Rejected { reason, .. } => {
                self.tell(now, format!("not done: {}", rejection(reason)));
            }
            Reply::Fix { .. } | Reply::Upload { .. } | Reply::Done => {}
        }
        News::Other
    }

    /// Takes a report. Gives whether the board began anew before it.
    fn report(&mut self, report: &Report, now: Duration) -> bool {
        let mut restarted = false;
        if let Some((last, _)) = &self.report {
            restarted = report.sequence <= last.sequence || report.time_ms < last.time_ms;
            if !restarted {
                let passed = report.sequence - last.sequence;
                self.lost += u64::from((passed - 1) / u32::from(self.every));
            }
        }
        if restarted {
            self.restarts += 1;
            self.window.clear();
            self.tell(now, "the board began anew".to_owned());
        }
        self.reports += 1;
        if let Some(refusal) = report.refusal {
            let place = REFUSALS.iter().position(|it| *it == refusal);
            if let Some(count) = place.and_then(|place| self.refusals.get_mut(place)) {
                *count += 1;
            }
        }
        self.window.push(report, now);
        self.trail.push(Sample::of(report, restarted));
        self.report = Some((*report, now));
        restarted
    }

    fn set_link(&mut self, state: LinkState, now: Duration) {
        self.link = state;
        self.link_since = now;
    }

    fn tell(&mut self, at: Duration, text: String) {
        if self.events.len() >= MAX_EVENTS {
            self.events.pop_front();
        }
        self.events.push_back(Event { at, text });
        self.event_count += 1;
    }

    /// What the link was opened as.
    #[must_use]
    pub fn link_name(&self) -> &str {
        &self.link_name
    }

    /// How the link is.
    #[must_use]
    pub fn link(&self) -> &LinkState {
        &self.link
    }

    /// Since when it is like that.
    #[must_use]
    pub fn link_since(&self) -> Duration {
        self.link_since
    }

    /// When anything came over the link last.
    #[must_use]
    pub fn last_heard(&self) -> Option<Duration> {
        self.last_heard
    }

    /// Who the board is.
    #[must_use]
    pub fn identity(&self) -> Option<&Identity> {
        self.identity.as_ref()
    }

    /// What is in its slots.
    #[must_use]
    pub fn slots(&self) -> Option<&[SlotState; 2]> {
        self.slots.as_ref()
    }

    /// What went wrong on it.
    #[must_use]
    pub fn faults(&self) -> Option<&Faults> {
        self.faults.as_ref()
    }

    /// The last report.
    #[must_use]
    pub fn last_report(&self) -> Option<&Report> {
        self.report.as_ref().map(|(report, _)| report)
    }

    /// Time since the last report came.
    #[must_use]
    pub fn report_age(&self, now: Duration) -> Option<Duration> {
        let (_, at) = self.report.as_ref()?;
        Some(now.saturating_sub(*at))
    }

    /// The last picture that came whole.
    #[must_use]
    pub fn picture(&self) -> Option<&Picture> {
        self.picture.as_ref()
    }

    /// Pictures that did not come whole.
    #[must_use]
    pub fn broken_pictures(&self) -> u64 {
        self.album.broken()
    }

    /// Where the vehicle was.
    #[must_use]
    pub fn trail(&self) -> &Trail {
        &self.trail
    }

    /// Rates over the ten seconds until `now`.
    #[must_use]
    pub fn rates(&self, now: Duration) -> Rates {
        self.window.rates(now)
    }

    /// Why fixes were refused, and how often; only reasons that there were.
    pub fn refusals(&self) -> impl Iterator<Item = (Refusal, u64)> {
        let counted = REFUSALS.into_iter().zip(self.refusals);
        counted.filter(|(_, count)| *count > 0)
    }

    /// Reports that came.
    #[must_use]
    pub fn reports(&self) -> u64 {
        self.reports
    }

    /// Reports that are missing between those that came.
    #[must_use]
    pub fn lost_reports(&self) -> u64 {
        self.lost
    }

    /// How often the board began anew.
    #[must_use]
    pub fn restarts(&self) -> u64 {
        self.restarts
    }

    /// Packets that came damaged.
    #[must_use]
    pub fn damaged_packets(&self) -> u64 {
        self.damaged
    }

    /// How much happened so far.
    #[must_use]
    pub fn event_count(&self) -> u64 {
        self.event_count
    }

    /// What happened after the first `count` events, as far as it is remembered, the oldest first.
    pub fn events_since(&self, count: u64) -> impl Iterator<Item = &Event> {
        let new = usize::try_from(self.event_count.saturating_sub(count)).unwrap_or(usize::MAX);
        self.events
            .iter()
            .skip(self.events.len().saturating_sub(new))
    }

    /// What happened, the oldest first.
    pub fn events(&self) -> impl DoubleEndedIterator<Item = &Event> {
        self.events.iter()
    }
}
