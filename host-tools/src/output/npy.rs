//! NumPy files, format 1.0: a header in words, and the numbers as they are in memory, row by row.

use std::{fs, io, path::Path};

use bytemuck::Pod;

use super::{OutputError, write_file};

/// What every file of the format begins with; the header's length follows in two bytes.
const MAGIC: &[u8; 8] = b"\x93NUMPY\x01\x00";

/// Magic, length and header end at a multiple of this.
const ALIGNMENT: usize = 64;

/// What arrays consist of.
pub trait Number: Pod {
    /// NumPy's name of the type, in this machine's byte order.
    const NAME: &str;
}

impl Number for f32 {
    const NAME: &str = if cfg!(target_endian = "little") {
        "<f4"
    } else {
        ">f4"
    };
}

impl Number for f64 {
    const NAME: &str = if cfg!(target_endian = "little") {
        "<f8"
    } else {
        ">f8"
    };
}

/// Writes `values` as an array of `shape`, streamed.
///
/// # Errors
/// When the file cannot be written, or there are not as many values as the shape says.
pub fn write_npy<T: Number>(
    path: &Path,
    shape: &[u64],
    values: impl IntoIterator<Item = T>,
) -> Result<(), OutputError> {
    write_file(path, |file| {
        let header = header::<T>(shape);
        file.write_all(MAGIC)?;
        file.write_all(&(header.len() as u16).to_le_bytes())?;
        file.write_all(header.as_bytes())?;
        let mut count = 0_u64;
        for value in values {
            file.write_all(bytemuck::bytes_of(&value))?;
            count += 1;
        }
        if count != shape.iter().product::<u64>() {
            let message = format!("{count} values do not make an array of {shape:?}");
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        Ok(())
    })
}

/// Reads an array that [`write_npy`] wrote, or NumPy in the same way; gives its shape and its values.
///
/// # Errors
/// When the file cannot be read, or is another: of another format, type, byte order or order of values.
pub fn read_npy<T: Number>(path: &Path) -> io::Result<(Vec<u64>, Vec<T>)> {
    let bytes = fs::read(path)?;
    parse(&bytes).ok_or_else(|| {
        let message = format!("{}: expected an array of {}", path.display(), T::NAME);
        io::Error::new(io::ErrorKind::InvalidData, message)
    })
}

fn header<T: Number>(shape: &[u64]) -> String {
    // A comma after each, or one number in parentheses would be no tuple.
    let shape: String = shape.iter().map(|side| format!("{side},")).collect();
    let mut header = format!("{}{shape}), }}", before_shape::<T>());
    let len = MAGIC.len() + 2 + header.len() + 1;
    let padding = len.next_multiple_of(ALIGNMENT) - len;
    header.extend(std::iter::repeat_n(' ', padding));
    header.push('\n');
    header
}

fn before_shape<T: Number>() -> String {
    let name = T::NAME;
    format!("{{'descr': '{name}', 'fortran_order': False, 'shape': (")
}

fn parse<T: Number>(bytes: &[u8]) -> Option<(Vec<u64>, Vec<T>)> {
    let (len, rest) = bytes.strip_prefix(MAGIC)?.split_first_chunk()?;
    let (header, values) = rest.split_at_checked(u16::from_le_bytes(*len).into())?;
    let header = str::from_utf8(header).ok()?;
    let (shape, _) = header.strip_prefix(&before_shape::<T>())?.split_once(')')?;
    let sides = shape.split(',').map(str::trim);
    let shape: Vec<u64> = sides
        .filter(|side| !side.is_empty())
        .map(|side| side.parse().ok())
        .collect::<Option<_>>()?;
    let count = shape
        .iter()
        .try_fold(1, |count: u64, &side| count.checked_mul(side))?;
    let chunks = values.chunks_exact(size_of::<T>());
    if chunks.len() as u64 != count || !chunks.remainder().is_empty() {
        return None;
    }
    let values = chunks.map(bytemuck::pod_read_unaligned).collect();
    Some((shape, values))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written<T: Number>(shape: &[u64], values: &[T]) -> Vec<u8> {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("array.npy");
        write_npy(&path, shape, values.iter().copied()).expect("written");
        fs::read(path).expect("there")
    }

    #[test]
    #[cfg(target_endian = "little")]
    fn files_are_as_numpy_writes_them() {
        let bytes = written(&[2, 1], &[1.0_f32, -2.0]);
        let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2,1,), }";
        assert_eq!(&bytes[..10], b"\x93NUMPY\x01\x00\x76\x00");
        assert_eq!(&bytes[10..10 + header.len()], header.as_bytes());
        assert_eq!(bytes[10 + header.len()..127], [b' '; 58]);
        assert_eq!(&bytes[127..], b"\n\0\0\x80\x3f\0\0\0\xc0");
    }

    #[test]
    fn what_was_written_is_read() {
        let values = [0.5, f64::MAX, -0.0];
        for shape in [&[3][..], &[3, 1], &[1, 3, 1]] {
            let bytes = written(shape, &values);
            assert_eq!(parse(&bytes), Some((shape.to_vec(), values.to_vec())));
        }
        assert_eq!(
            parse(&written::<f32>(&[0, 7], &[])),
            Some((vec![0, 7], Vec::<f32>::new()))
        );
    }

    #[test]
    fn what_is_no_such_array_is_refused() {
        let bytes = written(&[3], &[1.0, 2.0, 3.0]);
        assert_eq!(parse::<f32>(&bytes), None);
        for len in 0..bytes.len() {
            assert_eq!(parse::<f64>(&bytes[..len]), None, "cut at {len}");
        }
        assert_eq!(parse::<f64>(&[&bytes[..], &[0]].concat()), None);
    }

    #[test]
    fn a_shape_of_another_count_is_refused() {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("array.npy");
        let error = write_npy(&path, &[2, 2], [1.0; 3]).expect_err("refused");
        assert!(
            error
                .to_string()
                .ends_with("3 values do not make an array of [2, 2]")
        );
        assert!(!path.exists());
    }
}
