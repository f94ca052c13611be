//! Limits of memory, from too little to start with to enough.

use super::jobs::{JOBS, Workplace};
use super::limits::{PATIENCE, limited};
use super::trials;

#[test]
fn too_little_memory_is_one_sentence_and_no_file() {
    let workplace = Workplace::new();
    let mut refused = 0;
    for job in JOBS.iter().filter(|job| !job.line.contains('|')) {
        let wanted = workplace.wanted(job);
        // Mebibytes, in steps that are small where it matters. With less than the first of them
        // the system cannot load a program of the development profile.
        let limits = trials(8).min(100);
        for step in 0..limits {
            let mebibytes = 64 + 336 * step * step / (limits * limits);
            let line = format!("{} --threads 4", job.line);
            let what = format!("`{line}` with {mebibytes} MiB");
            let ended =
                limited(&workplace.scratch.command(&line), &format!("-v {}", mebibytes << 10));
            let succeeds = ended.status == Some(0);
            refused += u32::from(!succeeds);
            assert!(ended.time < PATIENCE, "{what} hangs");
            assert!(succeeds || ended.is_refusal(&["memory"]), "{what}: {ended:?}");
            workplace.check_whole(job, &wanted, &what);
            workplace.clear(job);
        }
        workplace.check_rerun(job, &wanted, job.line);
        workplace.clear(job);
    }
    assert!(refused > 0, "no limit was too low");
}
