//! Area averaging as the definition says it, pixel by pixel: the twin that [`reduce`](super::reduce) is tested
//! against.

use super::View;
use crate::frame::Frame;

/// Reduces the frame's centered square to a view of `side`×`side` pixels; the same bits as
/// [`reduce`](super::reduce()), slowly.
///
/// With q pixels per side of the square and v per side of the view, a source pixel is v units long and a view pixel
/// q units. Each view pixel is the mean of the source pixels it overlaps, weighted by overlap, rounded half up.
pub fn reduce(frame: &Frame<'_>, view: &mut View) {
    let (q, v) = (u32::from(frame.square_side()), u32::from(view.side()));
    view.fill(|pixels| {
        for (pixel, index) in pixels.iter_mut().zip(0..) {
            let (row, column) = (index / v, index % v);
            let mut sum = 0;
            for y in 0..q {
                for x in 0..q {
                    let weight = overlap(row, y, q, v) * overlap(column, x, q, v);
                    sum += weight * u32::from(frame.square_row(y as u16)[x as usize]);
                }
            }
            *pixel = ((sum + q * q / 2) / (q * q)) as u8;
        }
    });
}

/// Length shared by view pixel `i` (q units long) and source pixel `j` (v units long).
fn overlap(i: u32, j: u32, q: u32, v: u32) -> u32 {
    ((i + 1) * q)
        .min((j + 1) * v)
        .saturating_sub((i * q).max(j * v))
}
