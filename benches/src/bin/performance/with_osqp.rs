//! OSQP is a cargo feature, off by default because it needs cmake to build. The comparison wants
//! it, so the plain command builds this program once more where that is possible.

use std::process::{Command, Stdio};

/// Runs this program again, built with OSQP, and returns its exit status; `None` if it has OSQP
/// already or cannot be built with it.
pub fn run_again() -> Option<i32> {
    if cfg!(feature = "osqp") {
        return None;
    }
    // Set by `cargo run`; a program started by hand is left as it is.
    let cargo = std::env::var_os("CARGO")?;
    let has_cmake = Command::new("cmake")
        .arg("--version")
        .stdout(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if !has_cmake {
        eprintln!("cmake is missing, so OSQP is left out of the comparison");
        return None;
    }
    eprintln!("building with OSQP for the comparison (--without-osqp leaves it out)");
    let with_osqp = |command: &str| {
        let mut cargo = Command::new(&cargo);
        cargo.args([
            command,
            "--release",
            "-p",
            "benches",
            "--bin",
            "performance",
        ]);
        cargo.args(["--features", "osqp"]);
        cargo
    };
    if !with_osqp("build")
        .status()
        .is_ok_and(|status| status.success())
    {
        eprintln!("OSQP does not build here and is left out of the comparison");
        return None;
    }
    let status = with_osqp("run")
        .arg("--")
        .args(std::env::args_os().skip(1))
        .status();
    // Without a code it was ended by a signal.
    Some(status.ok()?.code().unwrap_or(130))
}
