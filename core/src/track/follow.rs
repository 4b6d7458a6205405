//! From a corner in one frame to the same corner in another: coarse to fine, and back again.
//!
//! Pyramidal Lucas-Kanade tracking (Bouguet 2001): on every level, coarse first, a window is moved until it looks like
//! the template's; the next finer level starts where that ended. A level in which a window does not fit, for the corner
//! is near the border, is left out: finer ones start from the guess then. What was found is tracked back to where it
//! came from (forward-backward check, Kalal, Mikolajczyk and Matas 2010), and compared there.

use super::{
    level::{Level, Pyramid},
    patch::{SIDE, Template},
};

/// Iterations per level, at most. Most need two to four.
const MAX_ITERATIONS: usize = 8;

/// A level is done when a step is shorter than this, in its pixels: from the finest, and on coarser ones.
const CONVERGED_PX: f32 = 0.03;
const NEARLY_PX: f32 = 0.12;

/// How far a level may move a window, in its pixels: half a window.
const MAX_MOVE_PX: f32 = SIDE as f32 / 2.0;

/// How far from where it started a window may return, in pixels of the frame.
const MAX_RETURN_PX: f32 = 0.7;

/// The smallest correlation of the windows of a corner in two frames. Noise of 4 gray levels in windows with a standard
/// deviation of 10 gives 0.86, two windows of different places give 0 on average.
const MIN_CORRELATION: f32 = 0.75;

/// Where the corner at `start_px` in one frame is in another, given a guess; all in pixels of the finest levels.
///
/// `None` when it left the frame, is hidden, has too little texture, or does not come back.
pub fn follow(
    from: &Pyramid<'_>,
    to: &Pyramid<'_>,
    start_px: [f32; 2],
    guess_px: [f32; 2],
) -> Option<[f32; 2]> {
    let found = search(from, to, start_px, guess_px)?;
    // Back from the same distance as forth, so that it does not start where it should end.
    let guess = [0, 1].map(|axis| found[axis] + start_px[axis] - guess_px[axis]);
    let back = search(to, from, found, guess)?;
    (distance_squared(back, start_px) < MAX_RETURN_PX * MAX_RETURN_PX).then_some(found)
}

fn search(
    from: &Pyramid<'_>,
    to: &Pyramid<'_>,
    start_px: [f32; 2],
    guess_px: [f32; 2],
) -> Option<[f32; 2]> {
    let mut at_px = guess_px;
    for (level, scale) in [(2, 4.0), (1, 2.0)] {
        let (Some(from), Some(to)) = (from.get(level), to.get(level)) else {
            continue;
        };
        let start = start_px.map(|at| at / scale);
        let at = at_px.map(|at| at / scale);
        if !from.is_none()
            && let Some((found, _)) = settle(from, start, to, at, NEARLY_PX)
        {
            at_px = found.map(|at| at * scale);
        }
    }
    let (found, correlation) = settle(&from[0], start_px, &to[0], at_px, CONVERGED_PX)?;
    (correlation >= MIN_CORRELATION).then_some(found)
}

/// Moves a window of one level, from a guess, until it looks like that of another at `start`; where that is, and the last
/// correlation.
#[inline(never)] // one template on the stack, not one per level
fn settle(
    from: &Level<'_>,
    start: [f32; 2],
    to: &Level<'_>,
    guess: [f32; 2],
    enough: f32,
) -> Option<([f32; 2], f32)> {
    let template = Template::new(from, start)?;
    let mut at = guess;
    for _ in 0..MAX_ITERATIONS {
        let found = template.compare(to, at)?;
        at = found.at_px;
        // Not `>`: also what is not a number ends here.
        let is_near = distance_squared(at, guess) <= MAX_MOVE_PX * MAX_MOVE_PX;
        if !is_near {
            return None;
        }
        if found.step_squared < enough * enough {
            return Some((at, found.correlation));
        }
    }
    None
}

fn distance_squared(a: [f32; 2], b: [f32; 2]) -> f32 {
    let [dx, dy] = [a[0] - b[0], a[1] - b[1]];
    dx * dx + dy * dy
}
