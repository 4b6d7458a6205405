//! Boards. The one so far is the Netduino Plus 2, which QEMU emulates: an STM32F405.

mod netduinoplus2;

pub use netduinoplus2::{Board, CORE_HZ, Link};
