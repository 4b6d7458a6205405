//! Peaks of a localization matrix: where on the map a view could be taken for another; report section 4.2.
//!
//! **What.** A peak is a local minimum of dissimilarity and the positions that flow together in it.
//!
//! **Notation.** p positions up to the threshold.
//!
//! **Method.** The report's flooding (after L. Vincent and P. Soille, *Watersheds in digital spaces*, 1991): positions in
//! ascending order of their value; one that lies next to a peak's belongs to that peak, whose mark it spreads to its
//! neighbors, and any other is a peak of its own. Of two peaks that want the same position, the first to mark it gets it.
//! Where regions meet, the shallower peak ends: its depth is how far it lies below that level.
//!
//! **Cost.** p·log p.

use serde::Serialize;

use super::LocalizationMatrix;

/// Where flooding ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flooding {
    /// Positions with larger values belong to no peak.
    pub threshold: f32,
    /// Peaks that are found at most, lowest first.
    pub most: usize,
}

/// A local minimum of a localization matrix.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Peak {
    /// Top-left pixel of its window.
    pub corner: [u32; 2],
    /// Dissimilarity there.
    pub value: f32,
    /// Positions that belong to it: an area in map pixels.
    pub size_px: u64,
    /// How far it lies below the level where its region meets that of a lower peak; for a peak that meets none, below the
    /// level where flooding ended: at least.
    pub depth: f32,
    /// Whether it met none.
    pub is_deeper: bool,
    /// Rise of its region per map pixel of distance: the least-squares slope of a cone.
    pub slope: f32,
}

/// The peaks of a matrix, lowest first, and whose every position is.
#[derive(Clone, Debug, PartialEq)]
pub struct Peaks {
    /// Lowest first; the first is the global minimum.
    pub peaks: Vec<Peak>,
    /// By position, row-major: the number of a peak, 0-based, or [`NO_PEAK`].
    pub regions: Vec<u32>,
}

/// A position that belongs to no peak.
pub const NO_PEAK: u32 = u32::MAX;

impl Flooding {
    /// Up to half the mean dissimilarity, of windows that have one, and up to a thousand peaks.
    #[must_use]
    pub fn of(matrix: &LocalizationMatrix) -> Self {
        let values = matrix.values().iter().filter(|value| value.is_finite());
        let (sum, count) = values.fold((0.0, 0.0_f64), |(sum, count), &value| {
            (sum + f64::from(value), count + 1.0)
        });
        Self {
            threshold: (0.5 * sum / count.max(1.0)) as f32,
            most: 1000,
        }
    }
}

/// Finds the peaks of a matrix.
#[must_use]
pub fn find_peaks(matrix: &LocalizationMatrix, flooding: Flooding) -> Peaks {
    let values = matrix.values();
    let mut order: Vec<u32> = (0..values.len() as u32)
        .filter(|&index| values[index as usize] <= flooding.threshold)
        .collect();
    // The sort is stable in effect: equal values stand in the order of their positions.
    order.sort_unstable_by(|&a, &b| {
        let (one, two) = (values[a as usize], values[b as usize]);
        one.total_cmp(&two).then(a.cmp(&b))
    });

    let mut found: Vec<Flooded> = Vec::new();
    let mut marks = vec![NO_PEAK; values.len()];
    let mut is_flooded = vec![false; values.len()];
    let mut end = flooding.threshold;
    for index in order {
        let index = index as usize;
        let value = values[index];
        if marks[index] == NO_PEAK {
            if found.len() == flooding.most {
                end = value;
                break;
            }
            marks[index] = found.len() as u32;
            found.push(Flooded::new(index, value, found.len()));
        }
        let mark = marks[index];
        found[mark as usize].positions += 1;
        is_flooded[index] = true;
        for neighbor in matrix.neighbors(index) {
            if is_flooded[neighbor] {
                join(&mut found, mark, marks[neighbor], value);
            } else if marks[neighbor] == NO_PEAK {
                marks[neighbor] = mark;
            }
        }
    }
    // Marks that were not reached are no regions.
    for (mark, is_flooded) in marks.iter_mut().zip(&is_flooded) {
        if !is_flooded {
            *mark = NO_PEAK;
        }
    }
    let slopes = slopes(matrix, &found, &marks);
    let peaks = found.iter().zip(slopes).map(|(peak, slope)| Peak {
        corner: matrix.corner(peak.index),
        value: peak.value,
        size_px: peak.positions * matrix.cell_px(),
        depth: peak.met.unwrap_or(end) - peak.value,
        is_deeper: peak.met.is_none(),
        slope,
    });
    Peaks {
        peaks: peaks.collect(),
        regions: marks,
    }
}

/// A peak while it is flooded.
struct Flooded {
    index: usize,
    value: f32,
    positions: u64,
    /// The level where it met a lower one.
    met: Option<f32>,
    /// The lowest peak that it has met so far, over several steps.
    below: usize,
}

impl Flooded {
    fn new(index: usize, value: f32, number: usize) -> Self {
        Self {
            index,
            value,
            positions: 0,
            met: None,
            below: number,
        }
    }
}

/// Regions `one` and `other` meet at a level.
fn join(found: &mut [Flooded], one: u32, other: u32, level: f32) {
    if one == other {
        return;
    }
    let (one, other) = (lowest(found, one as usize), lowest(found, other as usize));
    if one != other {
        // Peaks are numbered as they are found: lowest first.
        let (lower, higher) = (one.min(other), one.max(other));
        found[higher].met = Some(level);
        found[higher].below = lower;
    }
}

/// The lowest peak of the regions that a peak's has met.
fn lowest(found: &mut [Flooded], mut peak: usize) -> usize {
    while found[peak].below != peak {
        let next = found[peak].below;
        found[peak].below = found[next].below;
        peak = next;
    }
    peak
}

/// Least-squares slopes of cones from the peaks upward.
fn slopes(matrix: &LocalizationMatrix, found: &[Flooded], regions: &[u32]) -> Vec<f32> {
    // Sums of distance·rise and of distance².
    let mut sums = vec![[0.0_f64; 2]; found.len()];
    for (index, &region) in regions.iter().enumerate() {
        let Some(peak) = found.get(region as usize) else {
            continue;
        };
        let ([x, y], [px, py]) = (matrix.corner(index), matrix.corner(peak.index));
        let distance = f64::from(x.abs_diff(px)).hypot(f64::from(y.abs_diff(py)));
        let rise = f64::from(matrix.values()[index] - peak.value);
        sums[region as usize][0] += distance * rise;
        sums[region as usize][1] += distance * distance;
    }
    let slope = |[rise, run]: [f64; 2]| if run > 0.0 { (rise / run) as f32 } else { 0.0 };
    sums.into_iter().map(slope).collect()
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::simulate::seeded;

    const ALL: Flooding = Flooding {
        threshold: f32::MAX,
        most: usize::MAX,
    };

    /// Cones with their tips at some positions, of different heights.
    fn cones(tips: &[(f32, f32, f32)]) -> LocalizationMatrix {
        let value = |x: u32, y: u32| {
            let cone = |&(tx, ty, value): &(f32, f32, f32)| {
                value + 0.1 * (x as f32 - tx).hypot(y as f32 - ty)
            };
            tips.iter().map(cone).fold(f32::MAX, f32::min)
        };
        let values = (0..30).flat_map(|y| (0..40).map(move |x| value(x, y)));
        LocalizationMatrix::new(40, values.collect())
    }

    #[test]
    fn cones_are_peaks_with_their_value_slope_and_depth() {
        let matrix = cones(&[(8.0, 10.0, 0.5), (30.0, 10.0, 0.2)]);
        let Peaks { peaks, regions } = find_peaks(&matrix, ALL);
        assert_eq!(peaks.len(), 2);
        assert_eq!((peaks[0].corner, peaks[0].value), ([30, 10], 0.2));
        assert_eq!((peaks[1].corner, peaks[1].value), ([8, 10], 0.5));
        for peak in &peaks {
            assert!((peak.slope - 0.1).abs() < 1e-3, "{peak:?}");
        }
        // They meet on the line between the tips, at 0.5 + 0.1·a = 0.2 + 0.1·(22 − a), a = 9.5: within a pixel.
        assert!((peaks[1].depth - 0.95).abs() < 0.06, "{peaks:?}");
        assert!(!peaks[1].is_deeper && peaks[0].is_deeper);
        assert_eq!(peaks[0].size_px + peaks[1].size_px, 1200);
        assert_eq!(regions[10 * 40 + 39], 0);
        assert_eq!(regions[10 * 40], 1);
    }

    #[test]
    fn a_third_peak_ends_at_the_lower_of_two_that_it_meets() {
        // The middle one meets the left one at a lower level than the right one.
        let matrix = cones(&[(4.0, 10.0, 0.0), (14.0, 10.0, 0.4), (34.0, 10.0, 0.1)]);
        let peaks = find_peaks(&matrix, ALL).peaks;
        let corners: Vec<u32> = peaks.iter().map(|peak| peak.corner[0]).collect();
        assert_eq!(corners, [4, 34, 14]);
        // 0.4 + 0.1·a = 0.1·(10 − a): a = 3. The right one then meets both: 0.1 + 0.1·a = 0.4 + 0.1·(20 − a), a = 11.5.
        assert!((peaks[2].depth - 0.3).abs() < 0.06, "{peaks:?}");
        assert!((peaks[1].depth - 1.15).abs() < 0.06, "{peaks:?}");
    }

    #[test]
    fn flooding_ends_at_the_threshold_and_at_the_last_peak() {
        let matrix = cones(&[(8.0, 10.0, 0.5), (30.0, 10.0, 0.2)]);
        let threshold = Flooding {
            threshold: 0.4,
            ..ALL
        };
        let Peaks { peaks, regions } = find_peaks(&matrix, threshold);
        assert_eq!(peaks.len(), 1);
        let below = matrix
            .values()
            .iter()
            .filter(|&&value| value <= 0.4)
            .count();
        assert_eq!(peaks[0].size_px, below as u64);
        assert_eq!(regions.iter().filter(|&&region| region == 0).count(), below);
        assert!((peaks[0].depth - 0.2).abs() < 1e-6);

        let one = find_peaks(&matrix, Flooding { most: 1, ..ALL });
        assert_eq!(one.peaks.len(), 1);
        assert!(one.peaks[0].size_px < 1200, "ends where the second begins");
        assert!((one.peaks[0].depth - 0.3).abs() < 1e-6 && one.peaks[0].is_deeper);
    }

    #[test]
    fn windows_without_contrast_are_no_part_of_the_map() {
        let mut values = vec![0.5_f32; 100];
        values[42] = 0.1;
        values[7] = f32::INFINITY;
        let matrix = LocalizationMatrix::new(10, values);
        let flooding = Flooding::of(&matrix);
        assert!((flooding.threshold - 0.5 * (98.0 * 0.5 + 0.1) / 99.0).abs() < 1e-6);
        let peaks = find_peaks(&matrix, flooding).peaks;
        assert_eq!(peaks.len(), 1);
        assert!(peaks[0].depth.is_finite() && peaks[0].slope.is_finite());
    }

    #[test]
    fn every_peak_is_a_local_minimum_and_every_local_minimum_a_peak() {
        let mut random = seeded(4, 2);
        let values: Vec<f32> = (0..900).map(|_| random.random_range(0.0..1.0)).collect();
        let matrix = LocalizationMatrix::new(30, values);
        let peaks = find_peaks(&matrix, ALL).peaks;
        let minima = (0..900).filter(|&index| {
            let value = matrix.values()[index];
            matrix
                .neighbors(index)
                .all(|other| matrix.values()[other] > value)
        });
        let mut minima: Vec<[u32; 2]> = minima.map(|index| matrix.corner(index)).collect();
        let mut corners: Vec<[u32; 2]> = peaks.iter().map(|peak| peak.corner).collect();
        minima.sort_unstable();
        corners.sort_unstable();
        assert_eq!(corners, minima);
        assert!(peaks.windows(2).all(|pair| pair[0].value <= pair[1].value));
    }
}
