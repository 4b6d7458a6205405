//! Eigenmark on a microcontroller: what stands between the core and a board's parts.
//!
//! What a host can test is compiled for hosts, too: cameras, the autopilot's link, the host's link and faults know
//! buses and wires only as traits. The rest is for the target, and kept thin.

#![no_std]
#[cfg(any(test, feature = "std"))]
extern crate std;

#[cfg(target_os = "none")]
pub mod atlas_region;
pub mod autopilot;
pub mod board;
pub mod camera;
#[cfg(target_os = "none")]
pub mod crash;
pub mod desk;
#[cfg(all(target_os = "none", feature = "emulated"))]
mod exit;
pub mod faults;
pub mod flight;
#[cfg(target_os = "none")]
pub mod guard;
pub mod ring;
#[cfg(target_os = "none")]
pub mod room;
#[cfg(any(test, feature = "std"))]
pub mod simulated;
pub mod stack;
pub mod storm;
pub mod time;
pub mod wire;

/// The logger of a program, said once at its top.
#[cfg(target_os = "none")]
#[macro_export]
macro_rules! logger {
    () => {
        #[cfg(any(feature = "stm32f405", feature = "stm32h743"))]
        use defmt_rtt as _;
        #[cfg(feature = "emulated")]
        use defmt_semihosting as _;

        defmt::timestamp!("");
    };
}

#[cfg(all(target_os = "none", feature = "emulated"))]
pub use exit::{fail, panicked, succeed};
