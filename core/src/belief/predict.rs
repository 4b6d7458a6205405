//! The belief moves with the vehicle.

use core::cell::Cell;

use micromath::F32Ext;

use super::Layers;
use crate::math::wrapped;

/// How the vehicle moved between two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Forward along the heading, in map pixels.
    pub forward_px: f32,
    /// To the right of the heading, in map pixels.
    pub right_px: f32,
    /// Turn, clockwise, in radians.
    pub yaw_rad: f32,
    /// Variance of the displacement along each axis, in squared map pixels.
    pub variance_px2: f32,
    /// Variance of the turn, in squared radians.
    pub variance_rad2: f32,
    /// Probability that the vehicle was carried away meanwhile, to anywhere.
    pub carried_away: f32,
}

/// Weights are spread when the variance of displacements is this share of a squared cell, or more.
const SPREAD: f32 = 0.05;

/// With at least this probability of having been carried away, the next frame has nothing in common with those before.
const ELSEWHERE: f32 = 0.1;

impl Layers {
    /// See [`Belief::predict`](super::Belief::predict).
    #[inline(never)]
    pub(super) fn predict(&mut self, weights: &mut [f32], motion: &Motion, heading_rad: f32) {
        let way = motion.forward_px * motion.forward_px + motion.right_px * motion.right_px;
        let numbers = [
            way,
            motion.yaw_rad,
            motion.variance_px2,
            motion.variance_rad2,
            motion.carried_away,
        ];
        let headings = self.cells.headings();
        if !numbers.iter().all(|number| number.is_finite()) {
            if headings == 1 {
                self.heading_rad = wrapped(heading_rad);
            }
            return self.forget(weights);
        }
        let halfway = if headings == 1 {
            self.heading_rad = wrapped(heading_rad);
            self.heading_rad
        } else {
            let halfway = self.heading_rad + motion.yaw_rad / 2.0;
            self.heading_rad += motion.yaw_rad;
            halfway
        };
        let step = core::f32::consts::TAU / f32::from(headings);
        for layer in 0..headings {
            let heading = wrapped(halfway + step * f32::from(layer));
            let (sin, cos) = (F32Ext::sin(heading), F32Ext::cos(heading));
            if let Some(offset) = self.offsets.get_mut(usize::from(layer)) {
                offset.x_px += sin * motion.forward_px + cos * motion.right_px;
                offset.y_px += sin * motion.right_px - cos * motion.forward_px;
            }
            self.carry(weights, layer);
        }
        if headings > 1 {
            self.turn(weights, step);
        }
        self.way_px += crate::math::sqrt(way);
        if motion.carried_away >= ELSEWHERE {
            self.way_px = f32::INFINITY;
        }
        self.spread(weights, motion, step);
        self.normalize(weights, motion.carried_away.clamp(0.0, 1.0));
    }

    /// Moves the weights of a heading by whole cells, so that its offset is at most half of one.
    fn carry(&mut self, weights: &mut [f32], layer: u8) {
        let side = self.cells.side_px();
        let Some(offset) = self.offsets.get_mut(usize::from(layer)) else {
            return;
        };
        let whole = |length: f32| crate::math::round_clamped(length / side, i16::MAX).0;
        let (right, down) = (whole(offset.x_px), whole(offset.y_px));
        if (right, down) == (0, 0) {
            return;
        }
        offset.x_px -= f32::from(right) * side;
        offset.y_px -= f32::from(down) * side;
        let (columns, len) = (usize::from(self.cells.columns()), self.cells.layer());
        let start = usize::from(layer) * len;
        if let Some(weights) = weights.get_mut(start..start + len) {
            shift(weights, columns, right.into(), down.into());
        }
    }

    /// Turns the layers so that the first is within half a step of its heading.
    fn turn(&mut self, weights: &mut [f32], step: f32) {
        self.heading_rad = wrapped(self.heading_rad);
        let (steps, _) = crate::math::round_clamped(self.heading_rad / step, i16::MAX);
        if steps == 0 {
            return;
        }
        self.heading_rad -= f32::from(steps) * step;
        let headings = self.cells.headings();
        let turns = i32::from(steps).checked_rem_euclid(headings.into());
        let (turns, cells) = (turns.unwrap_or(0) as usize, self.cells.layer());
        rotate(weights, turns * cells);
        let offsets = self.offsets.get_mut(..headings.into());
        rotate(offsets.unwrap_or_default(), turns);
    }

    /// Spreads the weights by what the displacements left uncertain.
    fn spread(&mut self, weights: &mut [f32], motion: &Motion, step: f32) {
        self.spread_px2 += motion.variance_px2.max(0.0);
        self.spread_rad2 += motion.variance_rad2.max(0.0);
        let side = self.cells.side_px();
        let share = self.spread_px2 / (side * side);
        let (columns, len) = (usize::from(self.cells.columns()), self.cells.layer());
        if share >= SPREAD {
            self.spread_px2 = 0.0;
            // The kernel (a, 1 − 2a, a) has the variance 2a; as wide as it can be, it has two thirds.
            let mut rest = share;
            for _ in 0..8 {
                let a = (rest / 2.0).min(1.0 / 3.0);
                for layer in weights.chunks_exact_mut(len.max(1)) {
                    blur_layer(layer, columns, a);
                }
                rest -= 2.0 * a;
                if rest < SPREAD {
                    break;
                }
            }
        }
        let share = self.spread_rad2 / (step * step);
        if self.cells.headings() > 1 && share >= SPREAD {
            self.spread_rad2 = 0.0;
            let a = (share / 2.0).min(1.0 / 3.0);
            for cell in 0..len {
                let turned = weights.get_mut(cell..).unwrap_or_default();
                blur_circle(turned, len, a);
            }
        }
    }
}

/// Moves items on by `by`, those at the end to the beginning: by turning round all, then what was and what is ahead.
/// That is slower than to rotate, and less code.
fn rotate<T>(items: &mut [T], by: usize) {
    if by <= items.len() {
        items.reverse();
        let (ahead, behind) = items.split_at_mut(by);
        ahead.reverse();
        behind.reverse();
    }
}

/// Moves a grid's weights to the right and down by whole cells; what leaves it is lost, what comes in is zero.
#[inline(never)]
fn shift(weights: &mut [f32], columns: usize, right: i32, down: i32) {
    let rows = weights.len() / columns.max(1);
    let (right_by, down_by) = (right.unsigned_abs() as usize, down.unsigned_abs() as usize);
    if right_by >= columns || down_by >= rows {
        return weights.fill(0.0);
    }
    let by = down * columns as i32 + right;
    let cells = Cell::from_mut(&mut *weights).as_slice_of_cells();
    let start = (by.unsigned_abs() as usize).min(cells.len());
    let (Some(before), Some(after)) = (cells.get(..cells.len() - start), cells.get(start..)) else {
        return;
    };
    // In the order in which nothing is overwritten before it is moved.
    if by >= 0 {
        for (from, to) in before.iter().rev().zip(after.iter().rev()) {
            to.set(from.get());
        }
    } else {
        for (to, from) in before.iter().zip(after) {
            to.set(from.get());
        }
    }
    for (row, weights) in weights.chunks_exact_mut(columns).enumerate() {
        let is_new = if down >= 0 {
            row < down_by
        } else {
            row >= rows - down_by
        };
        let came_in = if is_new {
            weights.get_mut(..)
        } else if right >= 0 {
            weights.get_mut(..right_by)
        } else {
            weights.get_mut(columns - right_by..)
        };
        came_in.unwrap_or_default().fill(0.0);
    }
}

/// Columns that are convolved together: what the registers of a Cortex-M4F leave room for.
const LANES: usize = 8;

/// Convolves the rows of a grid with (a, 1 − 2a, a), then its columns. What would leave at an end stays there.
#[inline(never)]
fn blur_layer(layer: &mut [f32], columns: usize, a: f32) {
    let columns = columns.max(1);
    let cells = Cell::from_mut(layer).as_slice_of_cells();
    for row in cells.chunks_exact(columns) {
        blur::<1>(row.iter().map(core::slice::from_ref), a);
    }
    let rows = || cells.chunks_exact(columns);
    let whole = columns / LANES * LANES;
    for first in (0..whole).step_by(LANES) {
        blur::<LANES>(rows().filter_map(|row| row.get(first..)), a);
    }
    for first in whole..columns {
        blur::<1>(rows().filter_map(|row| row.get(first..)), a);
    }
}

/// Convolves the first numbers of some runs, all the first ones, all the second ones, …, with (a, 1 − 2a, a).
#[inline(always)]
fn blur<'c, const LANES: usize>(runs: impl Iterator<Item = &'c [Cell<f32>]>, a: f32) {
    let mut runs = runs.filter_map(|run| run.first_chunk::<LANES>());
    let Some(mut at) = runs.next() else {
        return;
    };
    let mut here = at.each_ref().map(Cell::get);
    let mut before = here;
    for next in runs {
        let after = next.each_ref().map(Cell::get);
        mix(at, before, here, after, a);
        (before, here, at) = (here, after, next);
    }
    mix(at, before, here, here, a);
}

#[inline(always)]
fn mix<const LANES: usize>(
    at: &[Cell<f32>; LANES],
    before: [f32; LANES],
    here: [f32; LANES],
    after: [f32; LANES],
    a: f32,
) {
    for (((at, before), here), after) in at.iter().zip(before).zip(here).zip(after) {
        at.set(mixed(before, here, after, a));
    }
}

#[inline(always)]
fn mixed(before: f32, here: f32, after: f32, a: f32) -> f32 {
    here + a * (before - here + (after - here))
}

/// Convolves every `stride`th number from the first, which are around a circle, with (a, 1 − 2a, a).
#[inline(never)]
fn blur_circle(numbers: &mut [f32], stride: usize, a: f32) {
    let stride = stride.max(1);
    let last = numbers.get((numbers.len().max(1) - 1) / stride * stride);
    let (Some(&first), Some(&last)) = (numbers.first(), last) else {
        return;
    };
    let (mut before, mut here, mut at) = (last, first, 0);
    while let Some(&after) = numbers.get(at + stride) {
        if let Some(number) = numbers.get_mut(at) {
            *number = mixed(before, here, after, a);
        }
        (before, here) = (here, after);
        at += stride;
    }
    if let Some(number) = numbers.get_mut(at) {
        *number = mixed(before, here, first, a);
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;

    /// Every line by the definition, apart from the numbers that it is of.
    fn blur_reference(layer: &mut [f32], columns: usize, a: f32) {
        for (len, stride, starts) in [
            (
                columns,
                1,
                (0..layer.len()).step_by(columns).collect::<Vec<_>>(),
            ),
            (layer.len() / columns, columns, (0..columns).collect()),
        ] {
            for start in starts {
                let line: Vec<f32> = (0..len).map(|at| layer[start + at * stride]).collect();
                for at in 0..len {
                    let (before, here) = (line[at.saturating_sub(1)], line[at]);
                    let after = line[(at + 1).min(len - 1)];
                    layer[start + at * stride] = mixed(before, here, after, a);
                }
            }
        }
    }

    proptest! {
        #[test]
        fn blur_layer_matches_reference(
            columns in 1_usize..30, rows in 1_usize..9, a in 0.0_f32..0.33,
            numbers in prop::collection::vec(0.0_f32..1.0, 30 * 9),
        ) {
            let mut expected = numbers[..columns * rows].to_vec();
            let mut found = expected.clone();
            blur_reference(&mut expected, columns, a);
            blur_layer(&mut found, columns, a);
            prop_assert_eq!(found, expected);
        }
    }
}
