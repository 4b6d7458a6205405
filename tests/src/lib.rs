//! What the cross-crate tests share: the emulated board, the real maps, the command line, and named settings.

pub mod board;
pub mod cli;
pub mod maps;
pub mod tables;
