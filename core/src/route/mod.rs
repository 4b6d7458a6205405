//! The topological map: places, legs between them, and the shortest way to a goal.
//!
//! **What.** A vehicle that navigates topologically knows places and which of them it can fly between (report 1.1,
//! figure 1.2). Here a [`Place`] is a point of the map that the landmarks around it let it recognize, a [`Leg`] the
//! straight line to another place. Their lengths and headings follow from the points, so a leg takes two bytes of flash.
//!
//! **Method.** Legs lie in the order of the places they start from, as in a compressed sparse row. A [`Router`] finds
//! the shortest ways of all places to one goal (Dijkstra 1959) and keeps their lengths: the next leg of any place is
//! then the one over which the goal is nearest, so that a vehicle blown off its way needs no new plan.
//!
//! **Cost.** A plan takes (p + e)·log p steps for p places and e legs, and 8 bytes per place; a next leg a look at the
//! legs of one place.

mod queue;
mod router;

use core::{error, fmt};

use bytemuck::{Pod, Zeroable};

use crate::{
    landmark::Point,
    math::{heading_of, sqrt},
};

pub use router::{RouteError, Router};

/// The largest number of places of an atlas.
pub const MAX_PLACES: u32 = 8192;

/// The largest number of legs of an atlas.
pub const MAX_LEGS: u32 = 32_768;

/// A place as an atlas stores it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Place {
    /// To the right of the map's left edge, in map pixels.
    pub x_px: f32,
    /// Below the map's top edge, in map pixels.
    pub y_px: f32,
    /// Where its legs begin among all; they end where those of the next place begin.
    pub first_leg: u32,
}

/// A straight line from one place to another. It can be flown both ways: every leg has its reverse.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Leg {
    /// The place it starts from, 0-based.
    pub from: u16,
    /// The place it leads to, 0-based.
    pub to: u16,
    /// Where it starts.
    pub start: Point,
    /// Where it ends.
    pub end: Point,
}

/// Places and legs, borrowed from an atlas and valid by construction.
#[derive(Clone, Copy, Debug, Default)]
pub struct TopologicalMap<'a> {
    pub(crate) places: &'a [Place],
    /// The places that legs lead to.
    pub(crate) legs: &'a [u16],
}

/// What is wrong with places and legs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MapError {
    /// A place is not on the map, or is not a number.
    Place {
        /// Its number, 0-based.
        place: u32,
    },
    /// The legs of a place do not begin where those of the one before end.
    FirstLeg {
        /// The place, 0-based.
        place: u32,
        /// Where its legs begin.
        found: u32,
    },
    /// A leg leads to no place, or not away from where it starts, or no leg leads back.
    Leg {
        /// Its number, 0-based.
        leg: u32,
        /// The place it leads to.
        found: u16,
    },
}

impl Place {
    /// Where it is.
    #[must_use]
    pub fn point(&self) -> Point {
        Point {
            x_px: self.x_px,
            y_px: self.y_px,
        }
    }
}

impl Leg {
    /// Its length, in map pixels.
    #[must_use]
    pub fn length_px(&self) -> f32 {
        self.start.distance_px(self.end)
    }

    /// Its heading in radians, clockwise from map-up, in −π..=π.
    #[must_use]
    pub fn heading_rad(&self) -> f32 {
        heading_of(
            self.end.x_px - self.start.x_px,
            self.end.y_px - self.start.y_px,
        )
    }
}

impl<'a> TopologicalMap<'a> {
    /// Places and legs of a map of some width and height, when they belong together: places on the map, `first_leg`
    /// from 0 on never falling, every leg to a place elsewhere, and one back.
    ///
    /// # Errors
    /// The first check that failed.
    pub fn new(
        places: &'a [Place],
        legs: &'a [u16],
        (width_px, height_px): (u32, u32),
    ) -> Result<Self, MapError> {
        let map = Self { places, legs };
        let mut begin = 0;
        for (place, index) in places.iter().zip(0..) {
            let is_on = |at: f32, side: u32| (0.0..=side as f32).contains(&at);
            if !(is_on(place.x_px, width_px) && is_on(place.y_px, height_px)) {
                return Err(MapError::Place { place: index });
            }
            let found = place.first_leg;
            if found < begin || found as usize > legs.len() || (index == 0 && found != 0) {
                return Err(MapError::FirstLeg {
                    place: index,
                    found,
                });
            }
            begin = found;
        }
        for (place, index) in places.iter().zip(0..) {
            let range = map.range(index);
            let targets = legs.get(range.clone()).unwrap_or_default();
            for (&found, leg) in targets.iter().zip(range) {
                let leads_away = map
                    .point(found)
                    .is_some_and(|end| end.squared_distance(place.point()) > 0.0);
                let back = legs.get(map.range(found.into())).unwrap_or_default().iter();
                if !leads_away || !back.into_iter().any(|&back| usize::from(back) == index) {
                    let leg = leg as u32;
                    return Err(MapError::Leg { leg, found });
                }
            }
        }
        // Legs of no place.
        match legs.first() {
            Some(&found) if places.is_empty() => Err(MapError::Leg { leg: 0, found }),
            _ => Ok(map),
        }
    }

    /// Number of places.
    #[must_use]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is no place.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// All places.
    #[must_use]
    pub fn places(&self) -> &'a [Place] {
        self.places
    }

    /// The places that all legs lead to, in the order of the places they start from.
    #[must_use]
    pub fn stored_legs(&self) -> &'a [u16] {
        self.legs
    }

    /// Where place `index` (0-based) is.
    #[must_use]
    pub fn point(&self, index: u16) -> Option<Point> {
        self.places.get(usize::from(index)).map(Place::point)
    }

    /// The legs that start from place `index` (0-based).
    pub fn legs(&self, index: u16) -> impl Iterator<Item = Leg> + use<'a> {
        let (places, start) = (self.places, self.point(index));
        let range = self.range(index.into());
        let targets = self.legs.get(range).unwrap_or_default();
        targets.iter().filter_map(move |&to| {
            Some(Leg {
                from: index,
                to,
                start: start?,
                end: places.get(usize::from(to))?.point(),
            })
        })
    }

    /// The place nearest to a point, 0-based; the first of several. `None` when there is no place.
    #[must_use]
    pub fn nearest(&self, point: Point) -> Option<u16> {
        let mut nearest = None;
        let mut least = f32::INFINITY;
        for (place, index) in self.places.iter().zip(0..) {
            let distance = place.point().squared_distance(point);
            if distance < least {
                (least, nearest) = (distance, Some(index));
            }
        }
        nearest
    }

    /// Where the legs of a place lie.
    fn range(&self, index: usize) -> core::ops::Range<usize> {
        let begin = |index: usize| {
            let place = self.places.get(index);
            place.map_or(self.legs.len(), |place| place.first_leg as usize)
        };
        begin(index)..begin(index + 1)
    }
}

impl fmt::Display for MapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Place { place } => write!(f, "place {} is not on the map", place + 1),
            Self::FirstLeg { place, found } => write!(
                f,
                "the legs of place {} begin with number {found}, which is not where those before end",
                place + 1
            ),
            Self::Leg { leg, found } => write!(
                f,
                "leg {} to place {} leads nowhere, or none leads back",
                leg + 1,
                u32::from(found) + 1
            ),
        }
    }
}

impl error::Error for MapError {}

impl Point {
    /// How far away another point is, in map pixels.
    #[must_use]
    pub fn distance_px(self, other: Self) -> f32 {
        sqrt(self.squared_distance(other))
    }

    /// The square of that.
    pub(crate) fn squared_distance(self, other: Self) -> f32 {
        let (x, y) = (self.x_px - other.x_px, self.y_px - other.y_px);
        x * x + y * y
    }
}

#[cfg(test)]
mod tests {
    use core::f32::consts::{FRAC_PI_2, PI};
    use std::vec::Vec;

    use super::*;

    pub(super) fn place(x_px: f32, y_px: f32, first_leg: u32) -> Place {
        Place {
            x_px,
            y_px,
            first_leg,
        }
    }

    #[test]
    fn legs_lead_to_their_places() {
        let places = [
            place(10.0, 10.0, 0),
            place(40.0, 50.0, 2),
            place(10.0, 0.0, 3),
        ];
        let map = TopologicalMap::new(&places, &[1, 2, 0, 0], (100, 100)).expect("valid");
        let legs: Vec<Leg> = map.legs(0).collect();
        assert_eq!([legs[0].to, legs[1].to], [1, 2]);
        assert_eq!([legs[0].length_px(), legs[1].length_px()], [50.0, 10.0]);
        assert_eq!(legs[1].heading_rad(), 0.0);
        assert_eq!(map.legs(1).count(), 1);
        assert_eq!(
            map.legs(2).next().map(|leg| leg.heading_rad().abs()),
            Some(PI)
        );
        assert_eq!(map.legs(3).count(), 0);
        let right = Leg {
            end: Point {
                x_px: 90.0,
                y_px: 10.0,
            },
            ..legs[0]
        };
        assert!((right.heading_rad() - FRAC_PI_2).abs() < 1e-6);
        assert_eq!(
            map.nearest(Point {
                x_px: 30.0,
                y_px: 40.0
            }),
            Some(1)
        );
    }

    #[test]
    fn what_does_not_belong_together_is_refused() {
        let check = |places: &[Place], legs: &[u16]| {
            TopologicalMap::new(places, legs, (100, 50)).map(|map| map.len())
        };
        let two = [place(0.0, 50.0, 0), place(100.0, 0.0, 1)];
        assert_eq!(check(&two, &[1, 0]), Ok(2));
        assert_eq!(check(&[], &[]), Ok(0));
        for (x, y) in [
            (-0.1, 0.0),
            (100.1, 0.0),
            (0.0, 51.0),
            (f32::NAN, 0.0),
            (0.0, f32::INFINITY),
        ] {
            assert_eq!(
                check(&[place(x, y, 0)], &[]),
                Err(MapError::Place { place: 0 })
            );
        }
        let first = |place, found| Err(MapError::FirstLeg { place, found });
        assert_eq!(
            check(&[place(0.0, 0.0, 1), place(9.0, 0.0, 1)], &[1]),
            first(0, 1)
        );
        assert_eq!(
            check(&[two[0], two[1], place(0.0, 0.0, 0)], &[1, 0]),
            first(2, 0)
        );
        assert_eq!(check(&[two[0], place(0.0, 0.0, 3)], &[1, 0]), first(1, 3));
        let leg = |leg, found| Err(MapError::Leg { leg, found });
        assert_eq!(check(&two, &[2, 0]), leg(0, 2));
        assert_eq!(check(&two, &[0, 0]), leg(0, 0));
        assert_eq!(check(&two, &[1]), leg(0, 1), "one way");
        let same = [place(3.0, 3.0, 0), place(3.0, 3.0, 1)];
        assert_eq!(check(&same, &[1, 0]), leg(0, 1), "without length");
        assert_eq!(check(&[], &[0]), leg(0, 0));
    }
}
