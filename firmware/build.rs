//! Tells the linker where memory.x lies, and compiles the C sources where they are asked for.

fn main() {
    let here = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    println!("cargo:rustc-link-search={here}");
    println!("cargo:rerun-if-changed=memory.x");
    #[cfg(feature = "c")]
    {
        println!("cargo:rerun-if-changed=c");
        cc::Build::new()
            .files(["c/gpi_compensator.c", "c/by_hand.c"])
            .flags(["-std=c99", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", "-O2"])
            .compile("compensators");
    }
}
