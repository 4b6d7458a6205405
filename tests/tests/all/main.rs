//! Everything that is tested across crates, in one program: it is linked once, and its tests share the cores.
//!
//! A file here runs only when it is a module below. `cargo test -p eigenmark-tests dense::` runs the tests of one.

mod atlas;
mod command_line;
mod dense;
mod evaluate;
mod experiment;
mod exploration;
mod firmware;
mod flights;
mod fuzz;
mod headings;
mod judgements;
mod merge;
mod panicless;
mod poses;
mod quantization;
mod rankings;
mod reliability;
mod selections;
mod session;
mod tracking;
