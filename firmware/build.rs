//! Gives the linker the workspace's `memory.x`, for the chosen board, and the scripts of cortex-m-rt and defmt.

use std::{env, fs, path::PathBuf};

fn main() {
    let variable = |name| PathBuf::from(env::var_os(name).expect("cargo sets it"));
    let (out, here) = (variable("OUT_DIR"), variable("CARGO_MANIFEST_DIR"));
    let is_h743 = env::var_os("CARGO_FEATURE_STM32H743").is_some();
    let mut scripts = vec![("memory.x", here.join("../memory.x"))];
    let mut arguments = vec!["--nmagic", "-Tlink.x", "-Tdefmt.x"];
    if is_h743 {
        scripts.push(("dma.x", here.join("src/board/stm32h743/dma.x")));
        arguments.extend(["--defsym=__stm32h743=1", "-Tdma.x"]);
    }
    for (name, script) in scripts {
        fs::copy(&script, out.join(name)).expect("the linker's scripts are there");
        println!("cargo:rerun-if-changed={}", script.display());
    }
    println!("cargo:rustc-link-search={}", out.display());
    for argument in arguments {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
