//! What the cross-crate tests share: the emulated board, the real maps, the command line, what is fuzzed, and
//! what is on record.

pub mod board;
pub mod cli;
pub mod fuzz;
pub mod maps;
pub mod record;
pub mod tables;
