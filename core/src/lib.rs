//! Where am I, from one downward camera: the part of Eigenmark that flies.
//!
//! A camera [`Frame`](frame::Frame) is reduced to a small [`View`](preprocess::View), projected into the
//! [`Eigenspace`](eigenspace::Eigenspace) of an aerial map, and compared with the stored landmarks. The answer is a
//! [`Fix`](localizer::Fix): the nearest landmark, where it is on the map, and how far that can be trusted.
//! Everything that was learned about the map comes from one flash bundle, the [`Atlas`](atlas::Atlas).
//!
//! # Layers
//! Each layer uses only those above it in this table.
//!
//! | layer | does | deliberately does not know |
//! | --- | --- | --- |
//! | [`math`] | rounding, roots and angles with the same bits everywhere | what the numbers mean |
//! | [`kernel`] | integer loops, each twice: plain, and for Armv7E-M | what the numbers mean |
//! | [`frame`] | camera pixels, borrowed and checked | who took them |
//! | [`preprocess`] | frame → view: exact area averaging, or levelling from a known pose; sums for normalization | eigenspaces |
//! | [`eigenspace`] | view → coefficients, distance from feature space | landmarks |
//! | [`landmark`] | coefficients → nearest landmarks; where candidates lie on the map | frames |
//! | [`route`] | places and legs → the shortest way to a goal | landmarks, frames |
//! | [`explore`] | views → an eigenspace learned on the way, and landmarks chosen online | frames, maps, atlases |
//! | [`track`] | frames → displacements, integrated to a place | maps, landmarks |
//! | [`atlas`] | the flash bundle: one parser, one writer | where in memory it lies |
//! | [`localizer`] | frame → fix | links, boards, time |
//! | [`belief`] | displacements and distances → where the vehicle may be | frames, routes |
//! | [`mission`] | belief and route → commanded heading and speed | frames, links, time |
//! | [`navigator`] | frames and instruments → commands, by all of the above | links, boards |
//! | [`chart`] | a pattern flown without an atlas, the map that comes of it, and ways over that | atlases |
//! | [`slots`] | two atlases in flash: which is flown by, how the other is written | which chip's flash |
//! | [`link`] | framed messages between a board and a host | the wire |
//!
//! # Promises
//! No heap, no recursion, no panic on any input, and bit-identical answers on every machine: the arithmetic is
//! integers, and IEEE-754 single precision operations in a fixed order where integers end.

#![no_std]
#[cfg(any(test, feature = "std"))]
extern crate std;

#[cfg(target_endian = "big")]
compile_error!(
    "an atlas is used in place from little-endian memory; big-endian machines are not supported"
);

pub mod atlas;
pub mod belief;
pub mod chart;
pub mod eigenspace;
pub mod explore;
pub mod frame;
pub mod kernel;
pub mod landmark;
pub mod link;
pub mod localizer;
pub mod math;
pub mod mission;
pub mod navigator;
pub mod preprocess;
pub mod route;
pub mod slots;
pub mod track;
