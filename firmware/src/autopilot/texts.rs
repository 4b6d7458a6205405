//! When it is time to say why a fix is refused.

use eigenmark_core::link::Refusal;
use mavlink::dialects::common::MavSeverity;

/// Between two texts, at least.
const PAUSE_MS: u32 = 1000;

/// A reason that comes back after this time without any is said again.
const FORGET_MS: u32 = 5000;

/// What was said, and when.
#[derive(Clone, Debug)]
pub(super) struct Texts {
    said: Option<Refusal>,
    said_ms: Option<u32>,
    refused_ms: u32,
}

impl Texts {
    pub const fn new() -> Self {
        Self {
            said: None,
            said_ms: None,
            refused_ms: 0,
        }
    }

    /// Takes in a frame's reason, and hands it back when it is to be said.
    pub fn due(&mut self, refusal: Option<Refusal>, now_ms: u32) -> Option<Refusal> {
        let Some(reason) = refusal else {
            if now_ms.wrapping_sub(self.refused_ms) >= FORGET_MS {
                self.said = None;
            }
            return None;
        };
        self.refused_ms = now_ms;
        let is_time = self
            .said_ms
            .is_none_or(|at_ms| now_ms.wrapping_sub(at_ms) >= PAUSE_MS);
        if self.said == refusal || !is_time {
            return None;
        }
        self.said = refusal;
        self.said_ms = Some(now_ms);
        Some(reason)
    }
}

/// How bad it is.
pub(super) fn severity(refusal: Refusal) -> MavSeverity {
    match refusal {
        Refusal::NoAtlas | Refusal::NoFrame => MavSeverity::MAV_SEVERITY_WARNING,
        Refusal::Flat | Refusal::Unknown => MavSeverity::MAV_SEVERITY_NOTICE,
        Refusal::Outside => MavSeverity::MAV_SEVERITY_INFO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_are_said_when_they_change_and_at_most_every_second() {
        let mut texts = Texts::new();
        let (flat, unknown) = (Some(Refusal::Flat), Some(Refusal::Unknown));
        assert_eq!(texts.due(flat, 0), flat);
        assert_eq!(texts.due(flat, 33), None);
        // A new one waits, and is said if it still holds.
        assert_eq!(texts.due(unknown, 999), None);
        assert_eq!(texts.due(unknown, 1000), unknown);
        assert_eq!(texts.due(unknown, 9000), None);
        // One that comes and goes is not said over and over.
        assert_eq!(texts.due(None, 9033), None);
        assert_eq!(texts.due(unknown, 9066), None);
        assert_eq!(texts.due(None, 14_066), None);
        assert_eq!(texts.due(unknown, 14_099), unknown);
    }

    #[test]
    fn a_text_per_second_is_the_most_whatever_changes() {
        let reasons = [Refusal::NoFrame, Refusal::Flat, Refusal::Outside];
        let mut texts = Texts::new();
        let frames = (0..300_u32).zip(reasons.iter().cycle());
        // Times come round.
        let start = u32::MAX - 5000;
        let said = frames.filter(|&(frame, &reason)| {
            let now_ms = start.wrapping_add(frame * 33);
            texts.due(Some(reason), now_ms).is_some()
        });
        assert_eq!(said.count(), 10);
    }
}
