//! What leaves the program: files that are whole or absent, NumPy arrays, pictures inside pages, progress.

mod files;
mod npy;
mod picture;
mod progress;

pub use files::{OutputError, check_directory, check_target, create_dir, write_file};
pub use npy::write_npy;
pub use picture::{fitted, jpeg, jpeg_uri, png, png_uri};
pub use progress::{Bar, Progress};
