//! What the cross-crate tests share: the emulated board, the real maps, the command line, and what is fuzzed.

pub mod board;
pub mod cli;
pub mod fuzz;
pub mod maps;
pub mod tables;
