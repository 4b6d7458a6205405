//! Places and legs as they are found: the topological map of a vehicle that was given none.

use heapless::Vec;

use crate::{
    landmark::Point,
    route::{Leg, MAX_PLACES, Place, TopologicalMap},
    track::Covariance,
};

use super::SIDE_PX;

/// A new place is joined to others within this, in sides.
const NEAR: f32 = 1.5;

/// At most `PLACES` places and `LEGS` legs, both ways counted: at least two legs for each place, so that a place can
/// always be reached.
///
/// ```
/// use eigenmark_core::{chart::Chart, landmark::Point, track::Covariance};
/// let mut chart = Chart::<8, 32>::new();
/// let at = |x_px| Point { x_px, y_px: 0.0 };
/// let home = chart.add(at(0.0), &Covariance::zeros(), None);
/// chart.add(at(90.0), &Covariance::zeros(), home);
/// assert_eq!(chart.map().legs(0).map(|leg| leg.length_px()).collect::<Vec<_>>(), [90.0]);
/// ```
#[derive(Clone, Debug)]
pub struct Chart<const PLACES: usize, const LEGS: usize> {
    places: Vec<Place, PLACES>,
    legs: Vec<u16, LEGS>,
    /// How well the vehicle knew where it was when it made each place.
    covariances: Vec<Covariance, PLACES>,
}

impl<const PLACES: usize, const LEGS: usize> Chart<PLACES, LEGS> {
    /// No place.
    #[must_use]
    pub const fn new() -> Self {
        const {
            assert!(PLACES <= MAX_PLACES as usize && LEGS >= 2 * PLACES);
        }
        Self {
            places: Vec::new(),
            legs: Vec::new(),
            covariances: Vec::new(),
        }
    }

    /// No place again, in place.
    pub fn reset(&mut self) {
        self.places.clear();
        self.legs.clear();
        self.covariances.clear();
    }

    /// The chart as a map: places in the order of their discovery, in pixels of the chart.
    #[must_use]
    pub fn map(&self) -> TopologicalMap<'_> {
        TopologicalMap {
            places: &self.places,
            legs: &self.legs,
        }
    }

    /// The covariance of path integration when a place (0-based) was made, in sides and radians.
    #[must_use]
    pub fn covariance(&self, place: u16) -> Option<&Covariance> {
        self.covariances.get(usize::from(place))
    }

    /// Adds a place, joined to the one that was visited before and to near ones; its number, or `None` when the chart is
    /// full. A place exactly where another is has no leg to it.
    pub fn add(
        &mut self,
        point: Point,
        covariance: &Covariance,
        before: Option<u16>,
    ) -> Option<u16> {
        let number = u16::try_from(self.places.len()).ok()?;
        let place = Place {
            x_px: point.x_px,
            y_px: point.y_px,
            first_leg: self.legs.len() as u32,
        };
        self.places.push(place).ok()?;
        // There is as much room for this.
        let _ = self.covariances.push(*covariance);
        if let Some(before) = before {
            self.join(before, number);
        }
        for other in 0..number {
            if self.is_neighbor(other, point) {
                self.link(other, number);
            }
        }
        Some(number)
    }

    /// Joins two places by a leg both ways. `false` when they are joined already, are the same, or no room is left but for
    /// the legs that places to come cannot do without.
    pub fn link(&mut self, from: u16, to: u16) -> bool {
        let kept = 2 * (PLACES - self.places.len().min(PLACES));
        self.legs.len() + 2 + kept <= LEGS && self.join(from, to)
    }

    fn join(&mut self, from: u16, to: u16) -> bool {
        let (Some(start), Some(end)) = (self.map().point(from), self.map().point(to)) else {
            return false;
        };
        let is_new = start.squared_distance(end) > 0.0 && !self.are_joined(from, to);
        if is_new && self.legs.len() + 2 <= LEGS {
            self.insert(from, to);
            self.insert(to, from);
            return true;
        }
        false
    }

    fn are_joined(&self, from: u16, to: u16) -> bool {
        self.map().legs(from).any(|leg: Leg| leg.to == to)
    }

    /// Whether a place is near a point, and no third one is in the circle over the two.
    fn is_neighbor(&self, place: u16, point: Point) -> bool {
        let Some(here) = self.map().point(place) else {
            return false;
        };
        let square = here.squared_distance(point);
        let is_between = |third: &Place| {
            let third = third.point();
            third.squared_distance(here) + third.squared_distance(point) < square
        };
        square <= (NEAR * SIDE_PX) * (NEAR * SIDE_PX) && !self.places.iter().any(is_between)
    }

    /// Puts a leg behind those of its place; there is room.
    fn insert(&mut self, from: u16, to: u16) {
        let after = usize::from(from) + 1;
        let end = self.places.get(after).map(|next| next.first_leg as usize);
        let mut moved = to;
        for leg in self.legs.iter_mut().skip(end.unwrap_or(LEGS)) {
            core::mem::swap(leg, &mut moved);
        }
        if self.legs.push(moved).is_ok() {
            for place in self.places.iter_mut().skip(after) {
                place.first_leg += 1;
            }
        }
    }
}

impl<const PLACES: usize, const LEGS: usize> Default for Chart<PLACES, LEGS> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::route::Router;

    fn at(x_px: f32, y_px: f32) -> Point {
        Point { x_px, y_px }
    }

    /// Places of a grid, visited row by row, to and fro.
    fn lawn<const PLACES: usize, const LEGS: usize>(
        columns: u16,
        rows: u16,
    ) -> Chart<PLACES, LEGS> {
        let mut chart = Chart::new();
        let mut before = None;
        for index in 0..columns * rows {
            let (row, step) = (index / columns, index % columns);
            let column = if row % 2 == 0 {
                step
            } else {
                columns - 1 - step
            };
            let point = at(60.0 * f32::from(column), 60.0 * f32::from(row));
            before = chart.add(point, &Covariance::zeros(), before);
        }
        chart
    }

    fn check<const PLACES: usize, const LEGS: usize>(chart: &Chart<PLACES, LEGS>) {
        let map = chart.map();
        TopologicalMap::new(map.places(), map.stored_legs(), (1000, 1000)).expect("valid");
    }

    #[test]
    fn a_chart_of_a_grid_has_the_grids_legs() {
        let chart = lawn::<32, 128>(4, 3);
        check(&chart);
        let map = chart.map();
        // Those across a square are as long as its circle: corners lie on it, not in it, but for rounding.
        let short = |place| map.legs(place).filter(|leg| leg.length_px() < 61.0).count();
        assert_eq!((0..12).map(short).sum::<usize>(), 2 * (3 * 3 + 4 * 2));
        assert!((0..12).all(|place| map.legs(place).all(|leg| leg.length_px() < 90.0)));
        let mut router = Router::<32>::new();
        router.plan(&map, 0).expect("a goal");
        // The last of the third row is three to the right and two down: less than the way it came.
        let length = router.length_px(11).expect("joined");
        assert!(length <= 300.0, "{length}");
    }

    #[test]
    fn every_place_is_reached_however_few_legs_there_are() {
        let mut chart = lawn::<12, 24>(4, 3);
        check(&chart);
        assert_eq!(chart.map().len(), 12);
        let mut router = Router::<12>::new();
        router.plan(&chart.map(), 0).expect("a goal");
        assert!((0..12).all(|place| router.length_px(place).is_some()));
        assert_eq!(
            chart.add(at(500.0, 0.0), &Covariance::zeros(), Some(0)),
            None
        );
        assert!(chart.map().stored_legs().len() <= 24);
    }

    #[test]
    fn what_cannot_be_joined_is_not() {
        let mut chart = lawn::<32, 128>(4, 1);
        let before = chart.map().stored_legs().len();
        assert!(!chart.link(0, 1), "joined already");
        assert!(!chart.link(2, 2));
        assert!(!chart.link(0, 9));
        assert_eq!(chart.map().stored_legs().len(), before);
        assert!(chart.link(3, 0));
        check(&chart);
        chart.add(at(0.0, 0.0), &Covariance::zeros(), Some(0));
        check(&chart);
        assert!(!chart.are_joined(0, 4));
    }
}
