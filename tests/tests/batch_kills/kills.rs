//! Kills at random moments.

use std::time::{Duration, Instant};

use lamp_fixtures::SplitMix;
use lamp_tests::note;

use super::night::{Ended, Night, Outcome};
use super::number;
use super::processes::{send, tasks, wait_for_no_task};

/// How often each kind of process was hit.
#[derive(Debug, Default)]
struct Hits {
    tasks: usize,
    nights: usize,
    both: usize,
}

impl Hits {
    fn all(&self) -> usize {
        self.tasks + self.nights + self.both
    }
}

#[test]
fn a_hundred_kills_change_no_byte_and_no_fact() {
    let (seed, wanted_hits) = (number("LAMP_SEED", 23), number("LAMP_KILLS", 100) as usize);
    let night = Night::new();
    let start = Instant::now();
    let wanted = night.done();
    let time = start.elapsed();
    night.check_nothing_done_twice();
    let mut trial = Trial {
        night: &night,
        wanted: &wanted,
        numbers: SplitMix(seed),
        longest: time.as_millis() as usize / 2,
        hits: Hits::default(),
        wanted_hits,
    };
    let mut whole = 0;
    while trial.hits.all() < wanted_hits {
        night.clear();
        trial.until_done();
        whole += 1;
    }
    note(&format!("seed {seed}: {whole} nights of {time:.1?} had {:?}", trial.hits));
}

struct Trial<'a> {
    night: &'a Night,
    wanted: &'a Outcome,
    numbers: SplitMix,
    /// The longest time between two kills, in milliseconds.
    longest: usize,
    hits: Hits,
    wanted_hits: usize,
}

impl Trial<'_> {
    /// Kills and restarts a night until it is done, and looks at what came of it.
    fn until_done(&mut self) {
        let ended = loop {
            let ended = self.one_life();
            if ended.status == Some(0) {
                break ended;
            }
            // A task that was killed three times is set aside, until the next time.
            assert!(ended.signal == Some(9) || ended.killed_tasks() > 0, "{ended:?}");
        };
        let what = format!("after {:?}", self.hits);
        self.wanted.check(&self.night.outcome(&ended), &what);
        wait_for_no_task(&self.night.store());
        self.night.check_nothing_done_twice();
        self.night.check_tidy();
    }

    /// Starts a night, and kills at random until that has ended it, or it ends by itself.
    fn one_life(&mut self) -> Ended {
        let mut running = self.night.start();
        let id = running.child.id();
        let store = self.night.store();
        let mut is_group = false;
        while self.hits.all() < self.wanted_hits {
            let pause = Duration::from_millis(self.numbers.below(self.longest) as u64);
            if !running.runs_for(pause) {
                break;
            }
            let kind = self.numbers.below(4);
            if kind < 2 {
                is_group = kind == 1;
                send("KILL", &format!("{}{id}", if is_group { "-" } else { "" }));
                break;
            }
            let tasks = tasks(&store, None);
            if !tasks.is_empty() {
                send("KILL", &tasks[self.numbers.below(tasks.len())].to_string());
            }
        }
        let ended = running.wait();
        // Tasks that were hit alive report it.
        self.hits.tasks += ended.killed_tasks();
        if ended.signal == Some(9) {
            *(if is_group { &mut self.hits.both } else { &mut self.hits.nights }) += 1;
        }
        ended
    }
}
