//! The laptop's half of Eigenmark: an aerial map goes in, an atlas for the vehicle comes out, and a judgement of it.
//!
//! The folders are the workflow, and each has its inference twin in `eigenmark-core`:
//!
//! | folder | does | twin in the core |
//! | --- | --- | --- |
//! | [`map`] | loads aerial maps, draws the built-in one, segments by color, lays out candidates | `frame`, `landmark::lattice` |
//! | [`learn`] | vectors of candidates, preprocessing, PCA at once, in parts, one by one | `preprocess`, `eigenspace`, `explore` |
//! | [`dense`] | the projection of the window at every pixel of a map | `eigenspace` |
//! | [`select`] | which candidates become landmarks, and how far selections agree | `landmark`, `explore` |
//! | [`atlas`] | folds, quantizes, calibrates, reads and writes atlases | `atlas` |
//! | [`topology`] | which landmarks make places, and between which a vehicle can fly | `route` |
//! | [`train`] | the whole way, from map to atlas, also in parts | — |
//! | [`simulate`] | a vehicle over the map: camera, sensor, instruments, wind, light; whole flights | — |
//! | [`evaluate`] | how far landmarks can be trusted, where the map could be mistaken; selections side by side | `localizer` |
//! | [`experiment`] | the report's experiments: a grid of settings, every selection, what each tolerates; claims | — |
//! | [`report`] | self-contained HTML pages | — |
//! | [`flash`] | boards and their slots; atlases as bin, Intel HEX, UF2 and ELF; `probe-rs` | `slots` |
//! | [`monitor`] | shows, serves and logs what a live board says | — |
//! | [`link`] | requests to a board over its serial line or TCP; uploads | `link`, `slots` |
//! | [`output`] | files that are whole or absent, NumPy arrays, progress | — |
//!
//! The command line (`command`, in the binary) only parses, calls this library, and prints.

pub mod atlas;
pub mod dense;
pub mod evaluate;
pub mod experiment;
pub mod flash;
pub mod learn;
pub mod link;
pub mod map;
pub mod monitor;
pub mod output;
pub mod report;
pub mod select;
pub mod simulate;
pub mod topology;
pub mod train;
