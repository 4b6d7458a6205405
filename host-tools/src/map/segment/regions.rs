//! Small regions take the color around them.

use std::cmp::Reverse;

/// Regions of fewer pixels are removed.
pub const MIN_REGION_PX: usize = 32;

/// Merges every region of equal labels, connected by edges, of fewer than [`MIN_REGION_PX`] pixels into what surrounds it:
/// it takes the label with which it shares the longest border, the lowest of several. Again, until there is no such
/// region, or nothing around it.
pub(super) fn merge_small(labels: &mut [u8], width: usize) {
    let mut regions = Regions {
        width,
        is_seen: vec![false; labels.len()],
        pixels: Vec::new(),
    };
    // Every region that is merged is one less.
    while regions.merge(labels) {}
}

struct Regions {
    width: usize,
    is_seen: Vec<bool>,
    /// Of the region that is looked at.
    pixels: Vec<usize>,
}

impl Regions {
    /// Merges small regions in the order of their first pixels; whether there was any.
    fn merge(&mut self, labels: &mut [u8]) -> bool {
        self.is_seen.fill(false);
        let mut is_merged = false;
        for first in 0..labels.len() {
            if self.is_seen[first] {
                continue;
            }
            self.flood(labels, first);
            if self.pixels.len() >= MIN_REGION_PX {
                continue;
            }
            if let Some(label) = self.around(labels, labels[first]) {
                for &pixel in &self.pixels {
                    labels[pixel] = label;
                }
                is_merged = true;
            }
        }
        is_merged
    }

    /// Finds the pixels of the region of `first`. Those that have become part of it are left to the next time.
    fn flood(&mut self, labels: &[u8], first: usize) {
        self.pixels.clear();
        self.pixels.push(first);
        self.is_seen[first] = true;
        let mut next = 0;
        while let Some(&pixel) = self.pixels.get(next) {
            next += 1;
            for neighbor in neighbors(pixel, self.width, labels.len()) {
                if !self.is_seen[neighbor] && labels[neighbor] == labels[first] {
                    self.is_seen[neighbor] = true;
                    self.pixels.push(neighbor);
                }
            }
        }
    }

    /// The label around the region; `None` when there is none, or when the region has grown meanwhile.
    fn around(&self, labels: &[u8], own: u8) -> Option<u8> {
        let mut borders = [0_u32; 256];
        for &pixel in &self.pixels {
            for neighbor in neighbors(pixel, self.width, labels.len()) {
                if labels[neighbor] != own {
                    borders[usize::from(labels[neighbor])] += 1;
                } else if !self.pixels.contains(&neighbor) {
                    return None;
                }
            }
        }
        let longest = (0..=255_u8)
            .zip(borders)
            .max_by_key(|&(label, border)| (border, Reverse(label)));
        longest
            .filter(|&(_, border)| border > 0)
            .map(|(label, _)| label)
    }
}

/// The pixels that share an edge with one.
#[inline]
fn neighbors(pixel: usize, width: usize, count: usize) -> impl Iterator<Item = usize> {
    let column = pixel % width;
    let left = (column > 0).then(|| pixel - 1);
    let right = (column + 1 < width).then(|| pixel + 1);
    let above = pixel.checked_sub(width);
    let below = Some(pixel + width).filter(|&below| below < count);
    [above, left, right, below].into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of digits becomes another.
    fn merged(rows: &[&str]) -> Vec<String> {
        let width = rows[0].len();
        let mut labels: Vec<u8> = rows.concat().bytes().map(|digit| digit - b'0').collect();
        merge_small(&mut labels, width);
        let row = |row: &[u8]| row.iter().map(|label| char::from(label + b'0')).collect();
        labels.chunks_exact(width).map(row).collect()
    }

    #[test]
    fn holes_take_the_color_around_them() {
        let found = merged(&[
            "00000000111111",
            "02000000111111",
            "02200000113111",
            "00000000111111",
            "00000000111111",
            "00000000111111",
            "00000000111111",
            "00000000111111",
        ]);
        assert_eq!(found, ["00000000111111"; 8]);
    }

    #[test]
    fn the_longest_border_decides() {
        // 2 has six edges with 1, and two with 0.
        let mut rows = vec!["00000000001111111111"; 8];
        rows[3] = "00000000002211111111";
        rows[4] = "00000000002111111111";
        let found = merged(&rows);
        assert_eq!(found, ["00000000001111111111"; 8]);
    }

    #[test]
    fn holes_in_holes_go_with_them() {
        let mut rows = vec!["0000000000"; 8];
        rows[2] = "0011100000";
        rows[3] = "0012100000";
        rows[4] = "0011100000";
        assert_eq!(merged(&rows), ["0000000000"; 8]);
    }

    #[test]
    fn large_regions_and_lonely_ones_stay() {
        // Forty pixels each.
        let rows = ["0000011111"; 8];
        assert_eq!(merged(&rows), rows);
        // Nothing is around it.
        assert_eq!(merged(&["00", "00"]), ["00", "00"]);
        // Whoever comes first goes: both are small.
        assert_eq!(merged(&["01"]), ["11"]);
    }

    #[test]
    fn nothing_small_remains_of_noise() {
        use rand::RngExt;
        let mut random = crate::simulate::seeded(3, 1);
        let mut labels: Vec<u8> = (0..90 * 70).map(|_| random.random_range(0..5)).collect();
        merge_small(&mut labels, 90);
        let mut regions = Regions {
            width: 90,
            is_seen: vec![false; labels.len()],
            pixels: Vec::new(),
        };
        for first in 0..labels.len() {
            if !regions.is_seen[first] {
                regions.flood(&labels, first);
                assert!(regions.pixels.len() >= MIN_REGION_PX);
            }
        }
    }
}
