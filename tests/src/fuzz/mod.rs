//! What arbitrary bytes may do to the readers: one function per reader, which panics when a promise is broken.
//!
//! libFuzzer runs them from `tests/fuzz`, of which this folder is the library, too; `tests/all/fuzz.rs` runs them
//! everywhere, over the committed seeds and random changes of them. Where blind bytes would stop at a checksum or a
//! length, an input is taken as the description of something that passes it.

mod atlas;
mod frame;
mod input;
mod link;

pub use atlas::{atlas, holds_atlas};
pub use frame::frame;
pub use link::link;

/// A reader to be fuzzed.
pub type Target = fn(&[u8]);

/// All of them, by the names of their binaries and of their seeds' directories.
pub const TARGETS: [(&str, Target); 3] = [("atlas", atlas), ("frame", frame), ("link", link)];
