//! Sums of pixels and of their squares over windows at every pixel: a row and a column enter, a row and a column leave.

use std::ops::{AddAssign, SubAssign};

/// What contrast normalization needs to know of a view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sums {
    /// Σy.
    pub pixels: u64,
    /// Σy².
    pub squares: u64,
}

impl Sums {
    /// The sums of a view.
    #[must_use]
    pub fn of(pixels: &[u8]) -> Self {
        let mut sums = Self::default();
        for &pixel in pixels {
            sums += Self::of_one(pixel);
        }
        sums
    }

    fn of_one(pixel: u8) -> Self {
        let y = u64::from(pixel);
        Self {
            pixels: y,
            squares: y * y,
        }
    }
}

impl AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        self.pixels += other.pixels;
        self.squares += other.squares;
    }
}

impl SubAssign for Sums {
    fn sub_assign(&mut self, other: Self) {
        self.pixels -= other.pixels;
        self.squares -= other.squares;
    }
}

/// The sums over every window of `side`×`side` pixels within a picture of rows of `width` pixels, row-major.
pub(super) fn of_windows(pixels: &[u8], width: usize, side: usize) -> Vec<Sums> {
    let columns = width - side + 1;
    let mut sums = Vec::with_capacity(columns * (pixels.len() / width - side + 1));
    let mut strip = vec![Sums::default(); width];
    for row in pixels.chunks_exact(width).take(side - 1) {
        enter(&mut strip, row);
    }
    let entering = pixels.chunks_exact(width).skip(side - 1);
    for (entering, leaving) in entering.zip(pixels.chunks_exact(width)) {
        enter(&mut strip, entering);
        let mut window = Sums::default();
        strip[..side - 1]
            .iter()
            .for_each(|&column| window += column);
        for (&entering, &leaving) in strip[side - 1..].iter().zip(&strip) {
            window += entering;
            sums.push(window);
            window -= leaving;
        }
        for (column, &pixel) in strip.iter_mut().zip(leaving) {
            *column -= Sums::of_one(pixel);
        }
    }
    sums
}

fn enter(strip: &mut [Sums], row: &[u8]) {
    for (column, &pixel) in strip.iter_mut().zip(row) {
        *column += Sums::of_one(pixel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_have_the_sums_of_their_views() {
        let pixels: Vec<u8> = (0..7 * 5_u32).map(|i| (i * i * 91 % 256) as u8).collect();
        for side in [1, 2, 5] {
            let found = of_windows(&pixels, 7, side);
            let columns = 7 - side + 1;
            assert_eq!(found.len(), columns * (5 - side + 1));
            for (at, sums) in found.iter().enumerate() {
                let start = at / columns * 7 + at % columns;
                let rows = (0..side).map(|row| &pixels[start + row * 7..][..side]);
                let view: Vec<u8> = rows.flatten().copied().collect();
                assert_eq!(*sums, Sums::of(&view), "{side} at {at}");
            }
        }
    }
}
