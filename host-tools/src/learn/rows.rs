//! Where the vectors come from that an eigenspace is learned from: read a block at a time, so that memory does not grow
//! with their number.

/// Vectors of one length, numbered from 0, single precision, that can be read again and again.
///
/// What learns from them takes `&dyn Rows`: compiled once, here, not in every crate that calls it.
pub trait Rows: Sync {
    /// How many there are, n.
    fn count(&self) -> usize;

    /// Numbers per vector, m.
    fn pixels(&self) -> usize;

    /// Writes the vectors from number `first` on into `out`, one after the other; as many as `out` has room for.
    fn read(&self, first: usize, out: &mut [f32]);

    /// `count` vectors from number `first` on, read into `buffer` unless they are in memory already.
    fn block<'a>(&'a self, first: usize, count: usize, buffer: &'a mut Vec<f32>) -> &'a [f32] {
        buffer.resize(count * self.pixels(), 0.0);
        self.read(first, buffer);
        buffer
    }
}

/// Vectors that are in memory: n rows of m.
#[derive(Clone, Copy, Debug)]
pub struct Matrix<'a> {
    values: &'a [f32],
    pixels: usize,
}

impl<'a> Matrix<'a> {
    /// Rows of `pixels` numbers each; what is left over at the end is not used.
    ///
    /// # Panics
    /// When `pixels` is zero.
    #[must_use]
    pub fn new(values: &'a [f32], pixels: usize) -> Self {
        assert!(pixels > 0, "a row has at least one number");
        let whole = values.len() / pixels * pixels;
        Self {
            values: &values[..whole],
            pixels,
        }
    }
}

impl Rows for Matrix<'_> {
    fn count(&self) -> usize {
        self.values.len() / self.pixels
    }

    fn pixels(&self) -> usize {
        self.pixels
    }

    fn read(&self, first: usize, out: &mut [f32]) {
        out.copy_from_slice(&self.values[first * self.pixels..][..out.len()]);
    }

    fn block<'a>(&'a self, first: usize, count: usize, _: &'a mut Vec<f32>) -> &'a [f32] {
        &self.values[first * self.pixels..][..count * self.pixels]
    }
}
