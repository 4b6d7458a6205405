//! See `frame` in `tests/src/fuzz`.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| eigenmark_fuzz::frame(input));
