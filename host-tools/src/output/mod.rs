//! What leaves the program: files that are whole or absent, NumPy arrays, progress.

mod files;
mod npy;
mod progress;

pub use files::{OutputError, check_directory, check_target, create_dir, write_file};
pub use npy::write_npy;
pub use progress::{Bar, Progress};
