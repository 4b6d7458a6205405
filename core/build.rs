//! Says whether the target has the Armv7E-M instructions that the fast kernels use, and floating-point registers:
//! Cortex-M4F and M7F do.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(armv7em)");
    if std::env::var("TARGET")
        .is_ok_and(|target| target.starts_with("thumbv7em") && target.ends_with("eabihf"))
    {
        println!("cargo::rustc-cfg=armv7em");
    }
}
