//! How much memory a command may take: of the machine, of its container and of its shell's limits.

use std::fs;
use std::path::Path;

/// Returns the bytes that this process may still take, or 4 GiB if that is unknown.
pub fn available() -> u64 {
    let most = [machine(), container(), within_limits()];
    // Each limit ends the process by itself, so the least counts.
    most.into_iter().flatten().min().unwrap_or(4 << 30)
}

/// Returns the bytes that limits as of `ulimit` leave this process, if there are any.
pub fn within_limits() -> Option<u64> {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Resource, getrlimit};
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let left = |(resource, used)| {
            let limit = getrlimit(resource).current?;
            // Such limits count what the process has already reserved.
            Some(limit.saturating_sub(bytes_of(&status, used)?))
        };
        [(Resource::As, "VmSize:"), (Resource::Data, "VmData:")].into_iter().filter_map(left).min()
    }
    #[cfg(not(target_os = "linux"))]
    None
}

/// Returns an amount of memory for messages, as `1.5 GB`.
pub fn in_words(bytes: u64) -> String {
    match bytes {
        0..1_000_000 => format!("{} kB", bytes / 1000),
        1_000_000..1_000_000_000 => format!("{} MB", bytes / 1_000_000),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

/// Returns the machine's memory, where the system reports it.
#[cfg(not(any(windows, target_os = "macos")))]
fn machine() -> Option<u64> {
    bytes_of(&fs::read_to_string("/proc/meminfo").ok()?, "MemTotal:")
}

#[cfg(target_os = "macos")]
fn machine() -> Option<u64> {
    let sysctl = std::process::Command::new("/usr/sbin/sysctl").args(["-n", "hw.memsize"]).output();
    String::from_utf8(sysctl.ok()?.stdout).ok()?.trim().parse().ok()
}

#[cfg(windows)]
#[expect(unsafe_code, reason = "the system answers by a C function alone")]
fn machine() -> Option<u64> {
    use windows_sys::Win32::System::SystemInformation::{GlobalMemoryStatusEx, MEMORYSTATUSEX};
    let mut status = MEMORYSTATUSEX {
        dwLength: size_of::<MEMORYSTATUSEX>() as u32,
        ..MEMORYSTATUSEX::default()
    };
    // SAFETY: it fills a struct that states its size.
    let is_known = unsafe { GlobalMemoryStatusEx(&raw mut status) } != 0;
    is_known.then_some(status.ullTotalPhys)
}

/// Returns the memory of the container or job (cgroup) that this process belongs to, if limited.
fn container() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    groups.lines().filter_map(|line| limit_of_group(line, Path::new("/sys/fs/cgroup"))).min()
}

/// Returns the least limit of a group, a line of `/proc/self/cgroup`, and of those around it.
fn limit_of_group(line: &str, root: &Path) -> Option<u64> {
    let mut fields = line.splitn(3, ':').skip(1);
    // Version 2 has one hierarchy without a controller's name, version 1 one for each controller
    // (cgroups(7)).
    let (folder, file) = match fields.next()? {
        "" => (root.to_owned(), "memory.max"),
        "memory" => (root.join("memory"), "memory.limit_in_bytes"),
        _ => return None,
    };
    let group = folder.join(fields.next()?.trim_start_matches('/'));
    // A limit holds for all groups within, and inside a container the inner folders may not be
    // visible.
    let around = group.ancestors().take_while(|group| group.starts_with(&folder));
    // A group without a limit says `max`, which is no number.
    let limit = |group: &Path| fs::read_to_string(group.join(file)).ok()?.trim().parse().ok();
    around.filter_map(limit).min()
}

/// Returns the bytes of an entry such as `VmSize:     1234 kB`.
#[cfg(any(test, not(any(windows, target_os = "macos"))))]
fn bytes_of(text: &str, key: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(key))?;
    rest.trim().strip_suffix(" kB")?.parse::<u64>().ok().map(|kib| kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_read_in_bytes() {
        let text = "Name:\tlamp\nVmSize:\t    1234 kB\nVmData:\t   99 pages\n";
        assert_eq!(bytes_of(text, "VmSize:"), Some(1234 * 1024));
        assert_eq!([in_words(999_999_999), in_words(1 << 33)], ["999 MB", "8.6 GB"]);
        assert_eq!([bytes_of(text, "VmData:"), bytes_of(text, "VmRSS:")], [None, None]);
    }

    #[test]
    fn the_least_limit_around_a_group_counts() {
        let root = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        write("night/memory.max", "3000\n");
        write("night/job/memory.max", "max\n");
        write("memory/job/memory.limit_in_bytes", "500\n");
        let limit = |line| limit_of_group(line, root.path());
        assert_eq!(limit("0::/night/job"), Some(3000));
        assert_eq!(limit("0::/other"), None);
        assert_eq!(limit("4:memory:/job"), Some(500));
        assert_eq!(limit("5:cpu:/night"), None);
    }
}
