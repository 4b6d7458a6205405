//! Bytes from an interrupt to the program, or back.

use core::sync::atomic::{AtomicU8, AtomicU32, AtomicUsize, Ordering};

/// A queue of at most `N - 1` bytes, for one that puts in and one that takes out.
#[derive(Debug)]
pub struct Ring<const N: usize> {
    bytes: [AtomicU8; N],
    /// Where the next byte is put.
    head: AtomicUsize,
    /// Where the next byte is taken.
    tail: AtomicUsize,
    lost: AtomicU32,
}

impl<const N: usize> Ring<N> {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bytes: [const { AtomicU8::new(0) }; N],
            head: AtomicUsize::new(0),
            tail: AtomicUsize::new(0),
            lost: AtomicU32::new(0),
        }
    }

    /// Puts a byte in. A full queue loses it, counts that, and says `false`.
    pub fn push(&self, byte: u8) -> bool {
        let head = self.head.load(Ordering::Relaxed);
        let next = Self::after(head);
        let place = self.bytes.get(head);
        let Some(place) = place.filter(|_| next != self.tail.load(Ordering::Acquire)) else {
            // The only one that counts.
            let lost = self.lost.load(Ordering::Relaxed);
            self.lost.store(lost.saturating_add(1), Ordering::Relaxed);
            return false;
        };
        place.store(byte, Ordering::Relaxed);
        self.head.store(next, Ordering::Release);
        true
    }

    /// Takes the oldest byte out.
    pub fn pop(&self) -> Option<u8> {
        let tail = self.tail.load(Ordering::Relaxed);
        if tail == self.head.load(Ordering::Acquire) {
            return None;
        }
        let byte = self.bytes.get(tail)?.load(Ordering::Relaxed);
        self.tail.store(Self::after(tail), Ordering::Release);
        Some(byte)
    }

    /// Whether nothing is in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.tail.load(Ordering::Relaxed) == self.head.load(Ordering::Acquire)
    }

    /// Bytes that still fit.
    #[must_use]
    pub fn room(&self) -> usize {
        let (head, tail) = (
            self.head.load(Ordering::Relaxed),
            self.tail.load(Ordering::Acquire),
        );
        let used = if head >= tail {
            head - tail
        } else {
            N - tail + head
        };
        N.saturating_sub(used + 1)
    }

    /// Bytes that were lost so far.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.lost.load(Ordering::Relaxed)
    }

    fn after(place: usize) -> usize {
        if place + 1 < N { place + 1 } else { 0 }
    }
}

impl<const N: usize> Default for Ring<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_out_as_they_went_in_and_what_does_not_fit_is_counted() {
        let ring = Ring::<4>::new();
        for round in 0..10 {
            assert_eq!((ring.room(), ring.pop()), (3, None));
            assert!([1, 2, 3].iter().all(|&byte| ring.push(byte)));
            assert_eq!(ring.room(), 0);
            assert!(!ring.push(4));
            assert_eq!(ring.lost(), round + 1);
            assert_eq!(
                [(); 4].map(|()| ring.pop()),
                [Some(1), Some(2), Some(3), None]
            );
            ring.push(9);
            assert_eq!((ring.room(), ring.is_empty()), (2, false));
            assert_eq!(ring.pop(), Some(9));
        }
    }

    #[test]
    fn nothing_is_lost_between_two_threads() {
        let ring = Ring::<16>::new();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for number in 0..20_000_u32 {
                    while !ring.push(number as u8) {
                        std::thread::yield_now();
                    }
                }
            });
            for number in 0..20_000_u32 {
                let byte = loop {
                    if let Some(byte) = ring.pop() {
                        break byte;
                    }
                    std::thread::yield_now();
                };
                assert_eq!(byte, number as u8);
            }
        });
    }
}
