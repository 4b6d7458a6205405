//! The sums over windows, plainly.

use super::{Errors, FRACTION, SAMPLES, SIDE, Samples, Sums, WORDS};
use crate::track::level::Level;

/// The samples of a template whose first sample is `first`, with their differences and sums.
pub fn prepare(level: &Level<'_>, first: [i32; 2]) -> Option<Samples> {
    const WIDE: usize = SIDE + 2;
    let one = 1 << FRACTION;
    let wide: [[i16; WIDE]; WIDE] = sample(level, first.map(|at| at - one))?;
    let mut sums = Sums::default();
    let (mut levels, mut across, mut down) = ([0; SAMPLES], [0; SAMPLES], [0; SAMPLES]);
    for index in 0..SAMPLES {
        let (x, y) = (index % SIDE + 1, index / SIDE + 1);
        let t = wide[y][x];
        let dx = wide[y][x + 1] - wide[y][x - 1];
        let dy = wide[y + 1][x] - wide[y - 1][x];
        (levels[index], across[index], down[index]) = (t, dx, dy);
        let [t, dx, dy] = [t, dx, dy].map(i32::from);
        sums.t += t;
        sums.x += dx;
        sums.y += dy;
        sums.tt += t * t;
        sums.xt += dx * t;
        sums.yt += dy * t;
        sums.xx += dx * dx;
        sums.xy += dx * dy;
        sums.yy += dy * dy;
    }
    Some(Samples {
        levels: pack(&levels),
        across: pack(&across),
        down: pack(&down),
        sums,
    })
}

/// The sums of the errors of the window whose first sample is `first`.
pub fn compare(samples: &Samples, level: &Level<'_>, first: [i32; 2]) -> Option<Errors> {
    let window: [[i16; SIDE]; SIDE] = sample(level, first)?;
    let mut errors = Errors::default();
    let [levels, across, down] = [&samples.levels, &samples.across, &samples.down].map(unpack);
    for (index, &level) in window.as_flattened().iter().enumerate() {
        let [t, dx, dy, level] = [levels[index], across[index], down[index], level].map(i32::from);
        let e = level - t;
        errors.e += e;
        errors.ee += e * e;
        errors.et += e * t;
        errors.ex += e * dx;
        errors.ey += e * dy;
    }
    Some(errors)
}

/// N×N bilinear samples one pixel apart, in units of 1/8 gray level; `None` when one lies outside the level.
fn sample<const N: usize>(level: &Level<'_>, first: [i32; 2]) -> Option<[[i16; N]; N]> {
    let one = 1 << FRACTION;
    let last = i32::from(level.side) - 2 - N as i32 + 1;
    let [left, top] = first.map(|at| at >> FRACTION);
    if left < 0 || top < 0 || left > last || top > last {
        return None;
    }
    let [u, v] = first.map(|at| at & (one - 1));
    let mut samples = [[0; N]; N];
    for (y, samples) in samples.iter_mut().enumerate() {
        let (above, below) = (level.row(top as usize + y), level.row(top as usize + y + 1));
        let columns = above.iter().zip(below).skip(left as usize);
        let mut before = None;
        let mut samples = samples.iter_mut();
        for (&above, &below) in columns.take(N + 1) {
            let mixed = (i32::from(above) * (one - v) + i32::from(below) * v) >> 2;
            if let Some(before) = before
                && let Some(sample) = samples.next()
            {
                *sample = ((before * (one - u) + mixed * u) >> 5) as i16;
            }
            before = Some(mixed);
        }
    }
    Some(samples)
}

/// Samples 0 and 2, then 1 and 3 of every four in the halves of two words.
fn pack(samples: &[i16; SAMPLES]) -> [u32; WORDS] {
    core::array::from_fn(|word| {
        let first = word / 2 * 4 + word % 2;
        let [low, high] =
            [samples[first], samples[first + 2]].map(|sample| u32::from(sample as u16));
        low | high << 16
    })
}

fn unpack(words: &[u32; WORDS]) -> [i16; SAMPLES] {
    core::array::from_fn(|index| {
        let word = words[index / 4 * 2 + index % 2];
        (word >> (16 * (index % 4 / 2))) as i16
    })
}
