//! How the columns of a view lie on the pixels of a row when their ratio is not whole.

/// The largest number of columns.
pub const MAX_COLUMNS: u8 = 50;

/// What a column takes of the pixel it begins in, how many pixels it takes whole, and what it takes of the pixel it
/// ends in, which the next column begins in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct Cut {
    pub first: u16,
    pub whole: u16,
    pub last: u16,
}

/// The cuts of all columns. A pixel is as many units long as there are columns, a column as many as there are pixels.
#[derive(Clone, Debug)]
pub struct Cuts {
    cuts: [Cut; MAX_COLUMNS as usize],
    columns: u8,
    pixels: u16,
}

impl Cuts {
    /// Cuts of `pixels` into `columns`, at most [`MAX_COLUMNS`].
    pub fn new(pixels: u16, columns: u8) -> Self {
        let columns = columns.clamp(1, MAX_COLUMNS);
        let unit = u16::from(columns);
        let mut cuts = [Cut::default(); MAX_COLUMNS as usize];
        let mut left = 0; // units of the pixel that the column begins in
        for cut in cuts.iter_mut().take(columns.into()) {
            let first = left.min(pixels);
            let rest = pixels - first;
            let (whole, last) = (rest / unit, rest % unit);
            *cut = Cut { first, whole, last };
            left = if last > 0 { unit - last } else { left - first };
        }
        Self {
            cuts,
            columns,
            pixels,
        }
    }

    /// The cuts, from left to right.
    pub fn as_slice(&self) -> &[Cut] {
        self.cuts.get(..self.columns.into()).unwrap_or(&self.cuts)
    }

    /// Units of a pixel.
    pub fn unit(&self) -> u32 {
        self.columns.into()
    }

    /// Pixels that all columns take together: Σ(whole + 1 where there is a last), by construction.
    pub fn pixels(&self) -> usize {
        self.pixels.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_take_all_pixels_and_the_same_of_each() {
        for pixels in (1..200).chain([4095, 4096]) {
            for columns in 1..=MAX_COLUMNS {
                let cuts = Cuts::new(pixels, columns);
                let mut read = 0;
                for cut in cuts.as_slice() {
                    let units = u32::from(cut.first)
                        + u32::from(cut.whole) * cuts.unit()
                        + u32::from(cut.last);
                    assert_eq!(units, u32::from(pixels));
                    read += usize::from(cut.whole) + usize::from(cut.last > 0);
                }
                assert_eq!(
                    (read, cuts.pixels()),
                    (usize::from(pixels), usize::from(pixels))
                );
            }
        }
    }
}
