//! Wires that bring more damage than messages.

/// Damages within a second that are a storm, if messages are fewer.
const STORM: u32 = 24;

/// How long they are counted together, in microseconds.
const WINDOW_US: u64 = 1_000_000;

/// How long a wire is ignored, in microseconds.
pub const IGNORED_US: u64 = 1_000_000;

/// Watches one wire, which is calm at first.
#[derive(Debug, Default)]
pub struct Storm {
    since_us: u64,
    damages: u32,
    messages: u32,
    ignored_until_us: u64,
    damaged: u32,
}

impl Storm {
    /// An intact message came.
    pub fn message(&mut self) {
        self.messages = self.messages.saturating_add(1);
    }

    /// Something damaged came. Says whether that makes a storm: the wire is ignored for a while from now on.
    pub fn damage(&mut self, now_us: u64) -> bool {
        self.damaged = self.damaged.saturating_add(1);
        if now_us.saturating_sub(self.since_us) > WINDOW_US {
            (self.since_us, self.damages, self.messages) = (now_us, 0, 0);
        }
        self.damages += 1;
        let is_storm = self.damages >= STORM && self.damages > self.messages;
        if is_storm {
            (self.damages, self.messages) = (0, 0);
            self.ignored_until_us = now_us.saturating_add(IGNORED_US);
        }
        is_storm
    }

    /// Whether the wire is not listened to.
    #[must_use]
    pub fn is_ignored(&self, now_us: u64) -> bool {
        now_us < self.ignored_until_us
    }

    /// What came damaged since the start.
    #[must_use]
    pub fn damaged(&self) -> u32 {
        self.damaged
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn much_damage_is_a_storm_and_it_passes() {
        let mut storm = Storm::default();
        let begins = (0..STORM)
            .map(|number| storm.damage(u64::from(number)))
            .collect::<std::vec::Vec<_>>();
        assert_eq!(begins.iter().filter(|&&begins| begins).count(), 1);
        assert!(begins[STORM as usize - 1] && storm.is_ignored(500_000));
        assert!(!storm.is_ignored(2_000_000));
        assert_eq!(storm.damaged(), STORM);
    }

    #[test]
    fn some_damage_among_messages_is_not() {
        let mut storm = Storm::default();
        for number in 0..10_000 {
            storm.message();
            storm.message();
            assert!(!storm.damage(number));
        }
        // Nor is damage now and then.
        for second in 1..1000 {
            assert!(!storm.damage(second * 1_100_000));
        }
    }
}
