//! The places that a search has reached and not yet left, nearest first: a binary heap that knows where each place is,
//! so that a place which a shorter way was found to moves up.

/// Not in the queue. An empty queue is nothing but zeros, and a static one needs no copy in flash.
const ABSENT: u16 = 0;

/// At most `N` places, below 65,535, with the lengths of their ways kept by the caller.
#[derive(Clone, Debug)]
pub(super) struct Queue<const N: usize> {
    /// The heap.
    places: [u16; N],
    len: u16,
    /// Where in the heap each place is, counted from one.
    slots: [u16; N],
}

impl<const N: usize> Queue<N> {
    pub(super) const fn new() -> Self {
        Self {
            places: [0; N],
            len: 0,
            slots: [ABSENT; N],
        }
    }

    pub(super) fn clear(&mut self) {
        self.len = 0;
        self.slots.fill(ABSENT);
    }

    /// Takes in a place below `N`, or moves it up after its length fell.
    pub(super) fn raise(&mut self, place: u16, lengths: &[f32; N]) {
        let slot = match self.slots.get(usize::from(place)) {
            Some(&ABSENT) if usize::from(self.len) < N => {
                self.len += 1;
                self.len - 1
            }
            Some(&slot) if slot != ABSENT => slot - 1,
            _ => return,
        };
        self.sift_up(place, slot, lengths);
    }

    /// The nearest place, which leaves the queue.
    pub(super) fn pop(&mut self, lengths: &[f32; N]) -> Option<u16> {
        let first = *self.places.first()?;
        self.len = self.len.checked_sub(1)?;
        self.note(first, ABSENT);
        let last = *self.places.get(usize::from(self.len))?;
        if self.len > 0 {
            self.sift_down(last, lengths);
        }
        Some(first)
    }

    fn sift_up(&mut self, place: u16, mut slot: u16, lengths: &[f32; N]) {
        while slot > 0 {
            let above = (slot - 1) / 2;
            let other = self.at(above);
            if length(lengths, other) <= length(lengths, place) {
                break;
            }
            self.put(other, slot);
            slot = above;
        }
        self.put(place, slot);
    }

    fn sift_down(&mut self, place: u16, lengths: &[f32; N]) {
        let mut slot = 0;
        loop {
            let left = 2 * u32::from(slot) + 1;
            if left >= u32::from(self.len) {
                break;
            }
            let mut below = left as u16;
            let right = below + 1;
            if right < self.len && length(lengths, self.at(right)) < length(lengths, self.at(below))
            {
                below = right;
            }
            let other = self.at(below);
            if length(lengths, place) <= length(lengths, other) {
                break;
            }
            self.put(other, slot);
            slot = below;
        }
        self.put(place, slot);
    }

    fn at(&self, slot: u16) -> u16 {
        self.places.get(usize::from(slot)).copied().unwrap_or(0)
    }

    fn put(&mut self, place: u16, slot: u16) {
        if let Some(target) = self.places.get_mut(usize::from(slot)) {
            *target = place;
        }
        self.note(place, slot + 1);
    }

    fn note(&mut self, place: u16, slot: u16) {
        if let Some(target) = self.slots.get_mut(usize::from(place)) {
            *target = slot;
        }
    }
}

fn length<const N: usize>(lengths: &[f32; N], place: u16) -> f32 {
    let length = lengths.get(usize::from(place));
    length.copied().unwrap_or(f32::INFINITY)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn places_come_out_by_length(
            pushed in proptest::collection::vec((0_u16..32, 0.0_f32..100.0), 0..80),
        ) {
            let mut lengths = [f32::INFINITY; 32];
            let mut queue = Queue::<32>::new();
            for (place, length) in pushed {
                // Lengths only fall, as in a search.
                if length < lengths[usize::from(place)] {
                    lengths[usize::from(place)] = length;
                    queue.raise(place, &lengths);
                }
            }
            let mut left = lengths.iter().filter(|length| length.is_finite()).count();
            let mut before = 0.0;
            while let Some(place) = queue.pop(&lengths) {
                prop_assert!(lengths[usize::from(place)] >= before);
                before = lengths[usize::from(place)];
                left -= 1;
            }
            prop_assert_eq!(left, 0);
        }
    }
}
