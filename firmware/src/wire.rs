//! A wire whose bytes interrupts put into one queue and take out of another.

use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write};

use crate::ring::Ring;

/// How long a full queue may stay full, in milliseconds: a byte leaves within 0.1 ms at 115,200 baud.
const PATIENCE_MS: u32 = 20;

/// What the hardware does for a wire.
pub trait Line {
    /// Has interrupts take what is to be sent out of its queue, until that is empty.
    fn send(&mut self);

    /// Whether the last bit has been sent.
    fn is_quiet(&self) -> bool;

    /// Milliseconds since some time.
    fn now_ms(&self) -> u32;
}

/// A wire. Reading never waits. Writing waits while there is no room, 20 ms at most; then it fails.
#[derive(Debug)]
pub struct Wire<L, const RECEIVED: usize, const SENT: usize> {
    line: L,
    received: &'static Ring<RECEIVED>,
    sent: &'static Ring<SENT>,
}

impl<L: Line, const RECEIVED: usize, const SENT: usize> Wire<L, RECEIVED, SENT> {
    /// A wire whose interrupts fill `received` and empty `sent`.
    pub const fn new(
        line: L,
        received: &'static Ring<RECEIVED>,
        sent: &'static Ring<SENT>,
    ) -> Self {
        Self {
            line,
            received,
            sent,
        }
    }

    /// Waits, but not for ever.
    fn wait_until(&self, is_so: impl Fn(&Self) -> bool) -> Result<(), ErrorKind> {
        let begin_ms = self.line.now_ms();
        while !is_so(self) {
            if self.line.now_ms().wrapping_sub(begin_ms) > PATIENCE_MS {
                return Err(ErrorKind::TimedOut);
            }
        }
        Ok(())
    }
}

impl<L, const RECEIVED: usize, const SENT: usize> ErrorType for Wire<L, RECEIVED, SENT> {
    type Error = ErrorKind;
}

impl<L: Line, const RECEIVED: usize, const SENT: usize> ReadReady for Wire<L, RECEIVED, SENT> {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.received.is_empty())
    }
}

impl<L: Line, const RECEIVED: usize, const SENT: usize> Read for Wire<L, RECEIVED, SENT> {
    /// What has arrived; nothing when nothing has.
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        let mut len = 0;
        for place in bytes {
            let Some(byte) = self.received.pop() else {
                break;
            };
            *place = byte;
            len += 1;
        }
        Ok(len)
    }
}

impl<L: Line, const RECEIVED: usize, const SENT: usize> Write for Wire<L, RECEIVED, SENT> {
    /// As many bytes as there is room for: at least one.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        if bytes.is_empty() {
            return Ok(0);
        }
        self.wait_until(|wire| wire.sent.room() > 0)?;
        let len = bytes.len().min(self.sent.room());
        for &byte in bytes.iter().take(len) {
            self.sent.push(byte);
        }
        self.line.send();
        Ok(len)
    }

    /// Waits until all has been sent, as long as bytes leave.
    fn flush(&mut self) -> Result<(), ErrorKind> {
        while !self.sent.is_empty() {
            let room = self.sent.room();
            self.wait_until(|wire| wire.sent.room() != room)?;
        }
        self.wait_until(|wire| wire.line.is_quiet())
    }
}

#[cfg(test)]
mod tests {
    use core::cell::Cell;
    use std::vec::Vec;

    use super::*;

    /// Sends a byte whenever somebody looks at the clock, unless it is cut.
    struct Simulated {
        sent: &'static Ring<8>,
        has_left: Vec<Cell<Option<u8>>>,
        left: Cell<usize>,
        now_ms: Cell<u32>,
        is_cut: bool,
        is_sending: bool,
    }

    impl Simulated {
        fn new(sent: &'static Ring<8>, is_cut: bool) -> Self {
            Self {
                sent,
                has_left: std::vec![Cell::new(None); 64],
                left: Cell::new(0),
                now_ms: Cell::new(u32::MAX - 3),
                is_cut,
                is_sending: false,
            }
        }

        fn has_left(&self) -> Vec<u8> {
            self.has_left.iter().filter_map(Cell::get).collect()
        }
    }

    impl Line for Simulated {
        fn send(&mut self) {
            self.is_sending = true;
        }

        fn is_quiet(&self) -> bool {
            self.sent.is_empty()
        }

        fn now_ms(&self) -> u32 {
            if self.is_sending
                && !self.is_cut
                && let Some(byte) = self.sent.pop()
            {
                self.has_left[self.left.get()].set(Some(byte));
                self.left.set(self.left.get() + 1);
            }
            self.now_ms.set(self.now_ms.get().wrapping_add(1));
            self.now_ms.get()
        }
    }

    #[test]
    fn what_is_written_leaves_in_order_though_the_queue_is_shorter() {
        static RECEIVED: Ring<8> = Ring::new();
        static SENT: Ring<8> = Ring::new();
        let mut wire = Wire::new(Simulated::new(&SENT, false), &RECEIVED, &SENT);
        let bytes: Vec<u8> = (0..40).collect();
        wire.write_all(&bytes).expect("leaves");
        wire.flush().expect("leaves");
        assert_eq!(wire.line.has_left(), bytes);
    }

    #[test]
    fn a_wire_that_sends_nothing_fails_in_time() {
        static RECEIVED: Ring<8> = Ring::new();
        static SENT: Ring<8> = Ring::new();
        let mut wire = Wire::new(Simulated::new(&SENT, true), &RECEIVED, &SENT);
        assert_eq!(wire.write(&[0; 40]), Ok(7));
        let begin = wire.line.now_ms.get();
        assert_eq!(wire.write(&[0; 40]), Err(ErrorKind::TimedOut));
        assert_eq!(wire.flush(), Err(ErrorKind::TimedOut));
        let took = wire.line.now_ms.get().wrapping_sub(begin);
        assert!(took <= 2 * (PATIENCE_MS + 2), "{took} ms");
        assert_eq!(wire.write(&[]), Ok(0));
    }

    #[test]
    fn reading_takes_what_has_arrived_and_never_waits() {
        static RECEIVED: Ring<8> = Ring::new();
        static SENT: Ring<8> = Ring::new();
        let mut wire = Wire::new(Simulated::new(&SENT, true), &RECEIVED, &SENT);
        let mut bytes = [0; 4];
        assert_eq!(
            (wire.read_ready(), wire.read(&mut bytes)),
            (Ok(false), Ok(0))
        );
        for byte in 1..=6 {
            RECEIVED.push(byte);
        }
        assert_eq!(
            (wire.read_ready(), wire.read(&mut bytes)),
            (Ok(true), Ok(4))
        );
        assert_eq!(bytes, [1, 2, 3, 4]);
        assert_eq!(wire.read(&mut bytes), Ok(2));
    }
}
