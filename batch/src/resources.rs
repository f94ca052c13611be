//! Processor time and memory that this process has taken.

use std::fs;

/// Processor time is counted in these parts of a second (`USER_HZ`, which Linux shows to all
/// programs as 100).
const TICKS_PER_S: f64 = 100.0;

/// Returns the seconds of processors that this process has taken, where the system reports them.
pub(crate) fn cpu_s() -> Option<f64> {
    let text = fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program, in brackets, may hold blanks.
    let after_name = text.rsplit_once(')')?.1;
    let mut fields = after_name.split_whitespace().skip(11).map(str::parse::<f64>);
    Some((fields.next()?.ok()? + fields.next()?.ok()?) / TICKS_PER_S)
}

/// Returns the most bytes of memory that this process has held, where the system reports them.
pub(crate) fn peak_memory() -> Option<u64> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn this_process_takes_something() {
        let start = std::time::Instant::now();
        while start.elapsed().as_millis() < 30 {}
        assert!((0.01..1000.0).contains(&cpu_s().unwrap()));
        assert!((100_000..1 << 40).contains(&peak_memory().unwrap()));
    }
}
