//! How a program ends: with an exit code for whoever runs the emulated board.

use core::panic::PanicInfo;

use cortex_m_semihosting::debug::{EXIT_FAILURE, EXIT_SUCCESS, exit};

/// Ends the program: everything it set out to do is done.
pub fn succeed() -> ! {
    loop {
        exit(EXIT_SUCCESS);
    }
}

/// Ends the program: something that was stated is not so.
pub fn fail() -> ! {
    loop {
        exit(EXIT_FAILURE);
    }
}

/// Ends the program by what a panic says: for the panic handler of programs that are not flown.
pub fn panicked(info: &PanicInfo<'_>) -> ! {
    defmt::error!("panic: {}", defmt::Display2Format(info));
    fail()
}
