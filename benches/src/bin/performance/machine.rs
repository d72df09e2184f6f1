//! The machine, as far as a reader needs to know it.

use std::fs;

/// Processor model and number of cores.
#[derive(Debug, Clone)]
pub struct Machine {
    pub processor: String,
    pub cores: usize,
}

pub fn describe() -> Machine {
    let information = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = information.lines().find_map(|line| {
        let (name, value) = line.split_once(':')?;
        (name.trim() == "model name").then(|| value.trim().to_owned())
    });
    Machine {
        processor: model.unwrap_or_else(|| format!("unknown ({})", std::env::consts::ARCH)),
        cores: std::thread::available_parallelism().map_or(1, usize::from),
    }
}

/// Memory of this process, where the system tells it (Linux).
pub struct PeakMemory {
    before_kib: u64,
}

impl PeakMemory {
    /// Starts over: the peak of what came before is forgotten.
    pub fn start() -> Option<Self> {
        fs::write("/proc/self/clear_refs", "5").ok()?;
        Some(Self {
            before_kib: status_kib("VmRSS:")?,
        })
    }

    /// The peak since the start, above what was in use at the start, in MB.
    pub fn megabytes(&self) -> Option<f64> {
        let above = status_kib("VmHWM:")?.saturating_sub(self.before_kib);
        Some(above as f64 * 1024.0 / 1e6)
    }
}

fn status_kib(field: &str) -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(field))?;
    line.split_whitespace().next()?.parse().ok()
}
