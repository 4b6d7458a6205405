//! A board starts anew, and flies by the atlas that was uploaded.

use std::time::{Duration, Instant};

use eigenmark_core::link::{Rejection, Reply, Request};

use super::{BoardLink, LinkError, words};

/// How long a board may take to answer a question, or to start.
const ANSWERING: Duration = Duration::from_secs(2);

/// Why a board does not fly by the atlas.
#[derive(Debug, thiserror::Error)]
pub enum RestartError {
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The board does not start anew.
    #[error("{name}: the board does not start anew: {}", words::rejection(reason))]
    Rejected {
        /// The link.
        name: String,
        /// Why.
        reason: Rejection,
    },
    /// It flies by another atlas, or by none.
    #[error(
        "{name}: expected the board to fly by the atlas with CRC {expected:08x} after its start, found {}",
        found.map_or_else(|| "none".to_owned(), |crc| format!("{crc:08x}"))
    )]
    Other {
        /// The link.
        name: String,
        /// CRC-32 of the atlas.
        expected: u32,
        /// CRC-32 of the one that is flown by.
        found: Option<u32>,
    },
}

/// Starts the board anew, and sees that it flies by the atlas with that CRC-32.
///
/// # Errors
/// When the link fails, the board refuses, or it flies by something else.
pub fn restart(link: &mut BoardLink, crc: u32) -> Result<(), RestartError> {
    restart_within(ANSWERING, link, crc)
}

fn restart_within(patience: Duration, link: &mut BoardLink, crc: u32) -> Result<(), RestartError> {
    link.send(&Request::Restart)?;
    // It may be gone before its answer is.
    let deadline = Instant::now() + patience;
    while let Some(reply) = link.receive(deadline.saturating_duration_since(Instant::now()))? {
        match reply {
            Reply::Rejected { reason, .. } => {
                let name = link.name().to_owned();
                return Err(RestartError::Rejected { name, reason });
            }
            Reply::Done => break,
            _ if Instant::now() > deadline => break,
            _ => {}
        }
    }
    let is_identity = |reply: &Reply| matches!(reply, Reply::Identity(_));
    let found = match link.ask(&Request::Identify, patience, is_identity)? {
        Reply::Identity(identity) => identity.atlas.map(|atlas| atlas.crc),
        _ => None,
    };
    if found == Some(crc) {
        return Ok(());
    }
    Err(RestartError::Other {
        name: link.name().to_owned(),
        expected: crc,
        found,
    })
}

#[cfg(test)]
mod tests {
    use eigenmark_core::{
        link::{AtlasIdentity, SlotState},
        slots::SlotError,
    };

    use super::{
        super::simulated::{Flash, Trouble, serve},
        *,
    };

    const CRC: u32 = 0x00c0_ffee;

    /// A board that flies by nothing, with an atlas in its second slot.
    fn flash() -> Flash {
        let mut flash = Flash::default();
        flash.slots[1] = SlotState {
            sequence: Some(3),
            atlas: Ok(AtlasIdentity {
                crc: CRC,
                map_crc: 0,
                landmarks: 1,
                view_side: 10,
                dimensions: 5,
            }),
            is_flown: false,
        };
        flash
    }

    fn restarted(flash: Flash, trouble: Trouble) -> Result<(), RestartError> {
        let (name, _board) = serve(flash, trouble);
        let mut link = BoardLink::open(&name, 0).expect("listens");
        restart_within(Duration::from_millis(500), &mut link, CRC)
    }

    #[test]
    fn the_board_flies_by_the_newest_atlas_whether_it_says_so_or_not() {
        restarted(flash(), Trouble::default()).expect("flies by it");
        let is_silent = Trouble {
            reply_lost: 1,
            ..Trouble::default()
        };
        let error = restarted(flash(), is_silent).expect_err("is silent");
        assert!(
            matches!(error, RestartError::Link(LinkError::Silent { .. })),
            "{error}"
        );
        let is_gone_first = Trouble {
            restart_lost: true,
            ..Trouble::default()
        };
        restarted(flash(), is_gone_first).expect("flies by it");
    }

    #[test]
    fn another_atlas_or_none_is_told() {
        let mut other = flash();
        other.slots[0] = SlotState {
            sequence: Some(9),
            ..other.slots[1]
        };
        if let Ok(atlas) = &mut other.slots[0].atlas {
            atlas.crc = 1;
        }
        let error = restarted(other, Trouble::default())
            .expect_err("is another")
            .to_string();
        assert!(
            error.ends_with("with CRC 00c0ffee after its start, found 00000001"),
            "{error}"
        );

        let mut none = flash();
        none.slots[1].atlas = Err(SlotError::Empty);
        let error = restarted(none, Trouble::default())
            .expect_err("is none")
            .to_string();
        assert!(error.ends_with("found none"), "{error}");
    }

    #[test]
    fn a_board_that_flies_refuses() {
        let flies = Trouble {
            refuses_restart: true,
            ..Trouble::default()
        };
        let error = restarted(flash(), flies).expect_err("refuses").to_string();
        assert!(
            error.ends_with("does not start anew: boards that fly do not do that"),
            "{error}"
        );
    }
}
