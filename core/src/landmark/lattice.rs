//! Where windows lie on the map.
//!
//! Windows lie on one or two regular lattices, row by row, the second lattice after the first. The report's layout
//! (section 3.1, corrected) is 8×6 windows side by side, then 7×5 windows centered on the inner corners of the first. A
//! dense table is one lattice with a small stride.
//!
//! Map coordinates: pixels, x to the right, y down, origin at the top-left corner of the map; the place of a window
//! is its center.

use heapless::Vec;
use serde::{Deserialize, Serialize};

/// A point on the map, in map pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Point {
    /// To the right of the map's left edge.
    pub x_px: f32,
    /// Below the map's top edge.
    pub y_px: f32,
}

/// A regular grid of window centers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    /// Center of the first window.
    pub origin: Point,
    /// Distance between neighbouring centers, in map pixels; positive.
    pub stride_px: f32,
    /// Windows per row; at least one.
    pub columns: u16,
    /// Rows of windows; at least one.
    pub rows: u16,
}

/// The lattices of a map, in the order of their numbers.
pub type Lattices = Vec<Lattice, 2>;

impl Lattice {
    /// Number of windows.
    #[must_use]
    pub fn count(&self) -> u32 {
        u32::from(self.columns) * u32::from(self.rows)
    }

    /// Center of the window at `column` and `row`, 0-based.
    #[must_use]
    pub fn point(&self, column: u32, row: u32) -> Point {
        Point {
            x_px: self.origin.x_px + column as f32 * self.stride_px,
            y_px: self.origin.y_px + row as f32 * self.stride_px,
        }
    }
}
