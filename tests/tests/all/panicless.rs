//! Nothing that flies can panic: `firmware/src/bin/panicless.rs` links only then.

use std::fs;

use eigenmark_tests::board;

/// What flies is larger than this; a program from which it was optimized away would prove nothing.
const LEAST_BYTES: u64 = 20_000;

#[test]
fn no_panic_path_is_linked_into_what_flies() {
    let path = board::firmware("panicless").expect("links, because nothing can panic");
    let bytes = board::flash_bytes(&fs::read(path).expect("readable")).expect("an ELF file");
    println!("panicless: {bytes} bytes of flash");
    assert!(bytes > LEAST_BYTES, "{bytes} bytes: what flies is missing");
}

#[test]
fn a_panic_path_does_not_link() {
    let feature = ["--features", "panic-path"];
    let error = board::firmware_with("panicless", &feature).expect_err("must not link");
    assert!(
        error.to_string().contains("a_panic_path_is_linked"),
        "{error}"
    );
}
