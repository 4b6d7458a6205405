//! Shortest ways of all places to one goal.

use core::{error, fmt};

use super::{Leg, TopologicalMap, queue::Queue};

/// Shortest ways to a goal, for maps of at most `PLACES` places: 8 bytes for each.
///
/// # Examples
/// ```
/// use eigenmark_core::route::{Place, Router, TopologicalMap};
/// let place = |x_px, first_leg| Place { x_px, y_px: 0.0, first_leg };
/// // 0 ⇄ 1 ⇄ 2
/// let places = [place(0.0, 0), place(30.0, 1), place(70.0, 3)];
/// let map = TopologicalMap::new(&places, &[1, 0, 2, 1], (100, 100)).expect("valid");
/// let mut router = Router::<8>::new();
/// router.plan(&map, 2)?;
/// assert_eq!(router.length_px(0), Some(70.0));
/// assert_eq!(router.route(&map, 0).map(|leg| leg.to).collect::<Vec<_>>(), [1, 2]);
/// # Ok::<(), eigenmark_core::route::RouteError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Router<const PLACES: usize> {
    goal: Option<u16>,
    /// Length of the shortest way to the goal, if there is one; infinite where there is none.
    lengths: [f32; PLACES],
    queue: Queue<PLACES>,
}

/// Why there is no plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RouteError {
    /// There is no such place.
    NoSuchPlace {
        /// The place asked for, 0-based.
        place: u16,
        /// How many there are.
        places: u32,
    },
    /// The map has more places than the router has room for.
    TooManyPlaces {
        /// How many there are.
        places: u32,
        /// How many there is room for.
        room: u32,
    },
}

impl<const PLACES: usize> Router<PLACES> {
    /// A router without a goal.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            goal: None,
            lengths: [0.0; PLACES],
            queue: Queue::new(),
        }
    }

    /// Without a goal again, in place.
    pub fn reset(&mut self) {
        self.goal = None;
    }

    /// Finds the shortest ways from everywhere to place `goal` (0-based).
    ///
    /// # Errors
    /// When there is no such place, or no room for so many; there is no goal then.
    #[inline(never)]
    pub fn plan(&mut self, map: &TopologicalMap<'_>, goal: u16) -> Result<(), RouteError> {
        self.goal = None;
        let places = map.len() as u32;
        if map.len() > PLACES {
            let room = PLACES as u32;
            return Err(RouteError::TooManyPlaces { places, room });
        }
        if usize::from(goal) >= map.len() {
            let place = goal;
            return Err(RouteError::NoSuchPlace { place, places });
        }
        self.goal = Some(goal);
        self.lengths.fill(f32::INFINITY);
        self.queue.clear();
        self.shorten(goal, 0.0);
        while let Some(place) = self.queue.pop(&self.lengths) {
            // Every leg can be flown both ways.
            let length = self.length_px(place).unwrap_or(f32::INFINITY);
            for leg in map.legs(place) {
                self.shorten(leg.to, length + leg.length_px());
            }
        }
        Ok(())
    }

    /// The goal of the last plan, 0-based.
    #[must_use]
    pub fn goal(&self) -> Option<u16> {
        self.goal
    }

    /// How far the goal is from a place (0-based) along legs, in map pixels; `None` when no way leads there.
    #[must_use]
    pub fn length_px(&self, place: u16) -> Option<f32> {
        self.goal?;
        let length = *self.lengths.get(usize::from(place))?;
        length.is_finite().then_some(length)
    }

    /// The leg of a place over which the goal is nearest; `None` at the goal, and when no way leads there.
    #[must_use]
    #[inline(never)]
    pub fn next_leg(&self, map: &TopologicalMap<'_>, place: u16) -> Option<Leg> {
        let goal = self.goal?;
        if place == goal {
            return None;
        }
        let mut best = None;
        let mut least = f32::INFINITY;
        for leg in map.legs(place) {
            let Some(rest) = self.length_px(leg.to) else {
                continue;
            };
            // Never away from the goal, whatever rounding did to the lengths.
            let length = rest + leg.length_px();
            if length < least && rest < self.length_px(place).unwrap_or(f32::INFINITY) {
                (least, best) = (length, Some(leg));
            }
        }
        best
    }

    /// The way from a place (0-based) to the goal, leg by leg; nothing when there is none.
    pub fn route<'r>(
        &'r self,
        map: &'r TopologicalMap<'r>,
        from: u16,
    ) -> impl Iterator<Item = Leg> + use<'r, PLACES> {
        let mut place = from;
        // Every leg leads nearer to the goal, so no place comes twice.
        core::iter::from_fn(move || {
            let leg = self.next_leg(map, place)?;
            place = leg.to;
            Some(leg)
        })
    }

    /// A way of that length was found.
    fn shorten(&mut self, place: u16, length: f32) {
        if let Some(known) = self.lengths.get_mut(usize::from(place))
            && length < *known
        {
            *known = length;
            self.queue.raise(place, &self.lengths);
        }
    }
}

impl<const PLACES: usize> Default for Router<PLACES> {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Display for RouteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NoSuchPlace { place, places } => {
                write!(f, "place {}; the atlas has {places}", u32::from(place) + 1)
            }
            Self::TooManyPlaces { places, room } => {
                write!(f, "{places} places; there is room for {room}")
            }
        }
    }
}

impl error::Error for RouteError {}

#[cfg(test)]
mod tests {
    use std::{vec, vec::Vec};

    use proptest::prelude::*;

    use super::*;
    use crate::route::{Place, tests::place};

    /// Places at random, and both directions of random legs.
    fn network() -> impl Strategy<Value = (Vec<Place>, Vec<u16>)> {
        let points = proptest::collection::vec((0.0_f32..100.0, 0.0_f32..100.0), 2..24);
        points.prop_flat_map(|points| {
            let count = points.len() as u16;
            let pairs = proptest::collection::btree_set((0..count, 0..count), 0..60);
            pairs.prop_map(move |pairs| {
                let mut targets = vec![Vec::new(); points.len()];
                for (a, b) in pairs {
                    if a < b {
                        targets[usize::from(a)].push(b);
                        targets[usize::from(b)].push(a);
                    }
                }
                let mut legs = Vec::new();
                let mut places = Vec::new();
                for (&(x, y), targets) in points.iter().zip(targets) {
                    places.push(place(x, y, legs.len() as u32));
                    legs.extend(targets);
                }
                (places, legs)
            })
        })
    }

    /// Bellman (1958) and Ford: shorten every leg until nothing changes.
    fn reference(map: &TopologicalMap<'_>, goal: u16) -> Vec<f32> {
        let mut lengths = vec![f32::INFINITY; map.len()];
        lengths[usize::from(goal)] = 0.0;
        for _ in 0..map.len() {
            for from in 0..map.len() as u16 {
                for leg in map.legs(from) {
                    let length = lengths[usize::from(leg.to)] + leg.length_px();
                    let known = &mut lengths[usize::from(from)];
                    *known = known.min(length);
                }
            }
        }
        lengths
    }

    proptest! {
        #[test]
        fn plan_matches_reference((places, legs) in network(), goal in 0_u16..2) {
            let map = TopologicalMap::new(&places, &legs, (100, 100)).expect("valid");
            let mut router = Router::<24>::new();
            router.plan(&map, goal).expect("a goal");
            for (expected, from) in reference(&map, goal).into_iter().zip(0..) {
                let found = router.length_px(from).unwrap_or(f32::INFINITY);
                prop_assert!((found - expected).abs() <= 1e-3 || found == expected, "{found} {expected}");
                // The way has the length that it is said to have, and leads to the goal.
                let route: Vec<Leg> = router.route(&map, from).collect();
                prop_assert!(route.windows(2).all(|legs| legs[0].to == legs[1].from));
                if expected.is_finite() {
                    let length: f32 = route.iter().map(Leg::length_px).sum();
                    prop_assert!((length - expected).abs() <= 1e-3);
                    prop_assert_eq!(route.last().map_or(from, |leg| leg.to), goal);
                } else {
                    prop_assert!(route.is_empty());
                }
            }
        }
    }

    #[test]
    fn goals_that_are_not_there_are_named() {
        let places = [place(0.0, 0.0, 0), place(9.0, 0.0, 1)];
        let map = TopologicalMap::new(&places, &[1, 0], (100, 100)).expect("valid");
        let mut router = Router::<2>::new();
        assert_eq!(router.plan(&map, 1), Ok(()));
        assert_eq!(
            router.plan(&map, 2),
            Err(RouteError::NoSuchPlace {
                place: 2,
                places: 2
            })
        );
        assert_eq!(router.next_leg(&map, 0), None, "the old goal is forgotten");
        assert_eq!(
            Router::<1>::new().plan(&map, 0),
            Err(RouteError::TooManyPlaces { places: 2, room: 1 })
        );
    }
}
