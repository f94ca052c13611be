//! Commands that write files and folders, and what they should have written.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use lamp_fixtures::{Defect, inject};
use lamp_stack::FOLDER_LIST;
use lamp_tests::{Ran, Scratch, tilted_ball};

/// A command line and all that it writes.
pub(crate) struct Job {
    pub(crate) line: &'static str,
    pub(crate) outputs: &'static [&'static str],
}

/// Commands that write each kind of output. All take a good part of a second where nothing is
/// optimized.
pub(crate) const JOBS: [Job; 9] = [
    Job { line: "slice ball.stl --dpi 500 -q -o out.tif", outputs: &["out.tif"] },
    Job { line: "slice ball.stl --dpi 500 -q --force -o out/", outputs: &["out"] },
    Job {
        line: "fix stray.tif -q --force --evidence pictures --report fix.json -o out.tif",
        outputs: &["out.tif", "pictures", "fix.json"],
    },
    Job { line: "tile stray.tif -q --area 60x60mm -o out.tif", outputs: &["out.tif"] },
    Job {
        line: "tile stray.tif -q --force --area 60x60mm --strips out --mirrors 200",
        outputs: &["out"],
    },
    Job {
        line: "tile stray.tif -q --force --area 60x60mm --fields 200x160 --overlap 4 -o out/",
        outputs: &["out"],
    },
    Job { line: "lamp convert stray.tif -q --force --png -o out/", outputs: &["out"] },
    Job { line: "lamp split stray.tif -q --force --every 20 -o out/", outputs: &["out"] },
    Job {
        line: "slice ball.stl --dpi 300 -q | fix -q | dither -q | tile -q --area 60x60mm -o out.tif",
        outputs: &["out.tif"],
    },
];

/// The content of a name: its bytes, or the bytes of each file in the folder.
type Content = BTreeMap<String, Vec<u8>>;

/// A folder for jobs.
pub(crate) struct Workplace {
    pub(crate) scratch: Scratch,
    /// Its content without outputs.
    names: Vec<String>,
}

/// The expected output of a job, and its duration.
pub(crate) struct Wanted {
    contents: Vec<Content>,
    pub(crate) time: Duration,
}

impl Workplace {
    /// Makes a folder with the inputs of all jobs.
    pub(crate) fn new() -> Self {
        let scratch = Scratch::new();
        let mut ball = tilted_ball();
        inject(&mut ball, Defect::Drop, 3, 1);
        scratch.mesh("ball.stl", &ball);
        scratch.run("slice ball.stl --dpi 300 -q -o stray.tif").succeeds();
        let names = scratch.names();
        Self { scratch, names }
    }

    /// Runs a job that nobody disturbs.
    pub(crate) fn wanted(&self, job: &Job) -> Wanted {
        let start = Instant::now();
        self.scratch.run(job.line).succeeds();
        let time = start.elapsed();
        let content = |name: &&str| self.content(name).expect("the job writes it");
        let contents = job.outputs.iter().map(content).collect();
        self.clear(job);
        Wanted { contents, time }
    }

    fn content(&self, name: &str) -> Option<Content> {
        let path = self.scratch.path(name);
        if path.is_dir() {
            Some(folder(&path))
        } else {
            Some([(String::new(), fs::read(path).ok()?)].into())
        }
    }

    /// Removes what a job wrote.
    pub(crate) fn clear(&self, job: &Job) {
        for name in job.outputs {
            let path = self.scratch.path(name);
            let _ = fs::remove_file(&path).or_else(|_| fs::remove_dir_all(&path));
        }
    }

    /// Puts something older where a job will write.
    pub(crate) fn put_old(&self, job: &Job) {
        for name in job.outputs {
            let path = self.scratch.path(name);
            if name.contains('.') {
                fs::write(path, OLD).unwrap();
            } else {
                fs::create_dir(&path).unwrap();
                fs::write(path.join(OLD_PAGE), OLD).unwrap();
                fs::write(path.join(FOLDER_LIST), format!("\n{OLD_PAGE}\n")).unwrap();
            }
        }
    }

    /// Checks that every output is whole: absent, as old as before, or as wanted.
    pub(crate) fn check_whole(&self, job: &Job, wanted: &Wanted, what: &str) {
        for (name, wanted) in job.outputs.iter().zip(&wanted.contents) {
            let Some(found) = self.content(name) else { continue };
            let is_old = found.values().any(|bytes| bytes == OLD);
            assert!(is_old || found == *wanted, "{what}: {name} is neither old nor whole");
        }
    }

    /// Checks that a job that nobody disturbs writes all that it should.
    pub(crate) fn check_rerun(&self, job: &Job, wanted: &Wanted, what: &str) {
        let _: Ran = self.scratch.run(job.line).succeeds();
        for (name, wanted) in job.outputs.iter().zip(&wanted.contents) {
            assert!(self.content(name).as_ref() == Some(wanted), "{what}: the rerun's {name}");
        }
        self.check_tidy(job, what);
    }

    /// Checks that there is nothing but inputs and outputs.
    pub(crate) fn check_tidy(&self, job: &Job, what: &str) {
        let names = self.scratch.names();
        let known =
            |name: &&String| self.names.contains(name) || job.outputs.contains(&name.as_str());
        let litter: Vec<_> = names.iter().filter(|name| !known(name)).collect();
        assert!(litter.is_empty(), "{what}: left {litter:?}");
    }
}

const OLD: &[u8] = b"old";
/// The page of a folder to be replaced.
const OLD_PAGE: &str = "layer_99999.tif";

fn folder(path: &Path) -> Content {
    let entries = fs::read_dir(path).expect("a folder");
    let file = |entry: std::io::Result<fs::DirEntry>| {
        let entry = entry.expect("it can be listed");
        let bytes = fs::read(entry.path()).expect("a file");
        (entry.file_name().to_string_lossy().into_owned(), bytes)
    };
    entries.map(file).collect()
}
