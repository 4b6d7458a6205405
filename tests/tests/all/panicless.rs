//! Nothing that flies can panic: `firmware/src/bin/panicless.rs` links only then.
//!
//! The compiler has to see that no check can fail, so here it makes everything fast. What flies is the same source,
//! made small: checks stay in it that cannot fail.

use std::fs;

use eigenmark_tests::board;

/// What flies is larger than this; a program from which it was optimized away would prove nothing.
const LEAST_BYTES: u64 = 20_000;

const FAST: [&str; 6] = [
    "--features",
    "panicless",
    "--config",
    "profile.firmware.opt-level=3",
    "--config",
    "profile.firmware.package.eigenmark-core.opt-level=3",
];

#[test]
fn nothing_that_flies_can_panic() {
    let path = board::firmware_with("panicless", &FAST).expect("links, because nothing can panic");
    let bytes = board::flash_bytes(&fs::read(path).expect("readable")).expect("an ELF file");
    println!("panicless: {bytes} bytes of flash");
    assert!(bytes > LEAST_BYTES, "{bytes} bytes: what flies is missing");
}

#[test]
fn a_panic_path_does_not_link() {
    let arguments = [&FAST[..], &["--features", "panic-path"]].concat();
    let error = board::firmware_with("panicless", &arguments).expect_err("must not link");
    assert!(
        error.to_string().contains("a_panic_path_is_linked"),
        "{error}"
    );
}
