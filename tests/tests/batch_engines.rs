//! Nights by the schedulers of clusters, with the real `lamp`: the same files as by processes of this
//! machine alone. Where a scheduler is not installed, its test says so.
#![cfg(target_os = "linux")]

#[path = "../../batch/tests/engines/hyperqueue.rs"]
mod hyperqueue;
#[path = "../../batch/tests/engines/running.rs"]
#[allow(dead_code, reason = "nobody kills a scheduler here")]
mod running;
#[path = "../../batch/tests/engines/slurm.rs"]
mod slurm;

use std::env;
use std::fs;
use std::path::Path;
use std::process::Command;

use lamp_fixtures::Sample;
use lamp_tests::{Scratch, note};

use running::Running;

/// The folder of the scheduler that is to run, in the process of a test that has its environment.
const FOLDER: &str = "LAMP_TEST_SCHEDULER";
/// The file that such a process leaves in the folder.
const RAN: &str = "ran";

#[test]
fn slurm_makes_the_files_of_a_local_night() {
    let test = "batch_engines::slurm_makes_the_files_of_a_local_night";
    in_environment(test, |folder| match slurm::Slurm::start(folder) {
        Ok(slurm) => check("slurm", &slurm),
        Err(why) => note(&format!("{test}: skipped, since {why}")),
    });
}

#[test]
fn hyperqueue_makes_the_files_of_a_local_night() {
    let test = "batch_engines::hyperqueue_makes_the_files_of_a_local_night";
    in_environment(test, |folder| match hyperqueue::HyperQueue::start(folder) {
        Ok(hyperqueue) => check("hyperqueue", &hyperqueue),
        Err(why) => note(&format!("{test}: skipped, since {why}")),
    });
}

/// Runs a test again in a process of its own, so that all that it starts finds the scheduler, whose
/// folder it gets.
fn in_environment(test: &str, run: impl FnOnce(&Path)) {
    if let Some(folder) = env::var_os(FOLDER) {
        fs::write(Path::new(&folder).join(RAN), test).unwrap();
        return run(Path::new(&folder));
    }
    let folder = tempfile::tempdir().unwrap();
    let before = env::var_os("PATH").unwrap();
    let programs = [folder.path().join("bin")].into_iter().chain(env::split_paths(&before));
    let again = Command::new(env::current_exe().unwrap())
        .args(["--exact", test, "--nocapture"])
        .env(FOLDER, folder.path())
        .env("PATH", env::join_paths(programs).unwrap())
        .env("SLURM_CONF", folder.path().join("slurm.conf"))
        .env("HQ_SERVER_DIR", folder.path().join("hq"))
        .status();
    assert!(again.unwrap().success(), "{test}");
    // A name that no test has would run none, which is no failure either.
    assert!(folder.path().join(RAN).exists(), "{test} is the name of this test");
}

/// Does a night of four parts and a build by a scheduler, and by processes alone.
fn check(engine: &str, scheduler: &impl Running) {
    let scratch = Scratch::new();
    for (name, sample, facets) in [
        ("ball", Sample::Sphere, 600),
        ("cube", Sample::Cube, 64),
        ("ring", Sample::Torus, 2000),
        ("tower", Sample::Tower, 5000),
    ] {
        scratch.part(&format!("{name}.stl"), sample, facets);
    }
    for of in [engine, "local"] {
        let text = format!(
            "defaults.stages = [\"slice --dpi 60 --thickness 150um\", \"fix\"]\n\
             defaults.ranges = 2\nstore.folder = \"{of}-store\"\n\
             [[part]]\nfile = \"*.stl\"\n\
             [[build]]\nname = \"all\"\nparts = [\"ball:2\", \"cube\", \"ring\", \"tower\"]\n\
             tile = \"--settle --mesh none --area 200x200mm\"\n"
        );
        scratch.write(&format!("{of}.toml"), text.as_bytes());
        let ran = scratch.run(&format!("lamp batch {of}.toml --engine {of}"));
        assert_eq!(ran.statuses, [Some(0)], "{ran:?}: {}", scheduler.state());
    }
    for name in ["parts/ball", "parts/cube", "parts/ring", "parts/tower", "builds/all"] {
        let [found, wanted] =
            [engine, "local"].map(|of| scratch.bytes(&format!("{of}/{name}.lamp")));
        assert!(found == wanted, "{engine}: {name} has other bytes");
    }
    let journal = fs::read_dir(scratch.path(&format!("{engine}-store/journal"))).unwrap();
    let journal: String =
        journal.map(|file| fs::read_to_string(file.unwrap().path()).unwrap()).collect();
    let by_engine = format!("\"engine\":\"{engine}\"");
    assert!(journal.lines().count() > 8 && journal.lines().all(|line| line.contains(&by_engine)));
}
