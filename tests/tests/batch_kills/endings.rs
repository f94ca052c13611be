//! Nights that are asked to end, and tasks that end every time.

use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use lamp_batch::Event;

use super::night::{Night, Running};
use super::processes::{PATIENCE, send, tasks, wait_for_no_task};

#[test]
fn a_signal_ends_the_night_and_its_tasks_and_the_next_one_goes_on() {
    let night = Night::new();
    let wanted = night.done();
    for (signal, status) in [("INT", 130), ("TERM", 143)] {
        night.clear();
        // A shell that runs tests in the background lets its children ignore SIGINT.
        let lamp = night.command();
        let mut heard = Command::new("env");
        heard.arg("--default-signal").arg(lamp.get_program()).args(lamp.get_args());
        heard.current_dir(night.scratch.as_ref());
        let mut running = Running::start(heard);
        // Until a task is at work, and another has been done.
        let start = Instant::now();
        let store = night.store();
        while tasks(&store, None).is_empty() || night.count_done() == 0 {
            assert!(running.runs_for(Duration::ZERO), "no task is done");
            assert!(start.elapsed() < PATIENCE, "no task is at work");
        }
        assert!(send(signal, &running.child.id().to_string()));
        let ended = running.wait();
        assert_eq!(ended.status, Some(status), "{ended:?}");
        assert!(tasks(&store, None).is_empty(), "{signal}: tasks go on");
        night.check_tidy();
        let before = night.events().len();
        wanted.check(&night.done(), signal);
        let after = night.events().len();
        assert!(before > 0 && after > before, "{signal}: {before} tasks, and then {after}");
        night.check_nothing_done_twice();
    }
}

#[test]
fn a_task_that_crashes_every_time_costs_its_part_alone() {
    let night = Night::new();
    // Tasks that take long enough to be caught at work, also where much else is.
    let text = String::from_utf8(night.scratch.bytes("night.toml")).unwrap();
    night.scratch.write("night.toml", text.replace("--dpi 100", "--dpi 300").as_bytes());
    let wanted = night.done();
    night.clear();
    let plan = night.scratch.run("lamp batch plan night.toml --verbose").succeeds();
    let plan = String::from_utf8(plan.stdout).unwrap();
    let line = plan.lines().find(|line| line.contains("ball (layers 0..")).expect("a range");
    let key = line.split(' ').next().unwrap();
    let mut running = night.start();
    let mut killed = 0;
    while running.runs_for(Duration::ZERO) {
        for task in tasks(&night.store(), Some(key)) {
            killed += usize::from(send("KILL", &task.to_string()));
        }
        thread::sleep(Duration::from_millis(1));
    }
    let ended = running.wait();
    assert!(killed >= 3, "{killed}");
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert_eq!(ended.killed_tasks(), 3, "one attempt, and two more: {ended:?}");
    assert_eq!(ended.stderr.matches("it is tried again").count(), 2, "{ended:?}");
    assert!(
        ended.stderr.contains("signal 9, as the system does when memory runs out: it is set aside"),
        "{ended:?}"
    );
    assert!(
        ended.stderr.contains("1 of 4 parts and 1 build failed (ball), 1 skipped for them"),
        "{ended:?}"
    );
    let crashed = night.events().into_iter().filter(|event| !event.is_done());
    assert!(
        crashed.clone().count() == 3 && crashed.clone().all(|event: Event| event.subject == "ball")
    );
    let others = ["parts/cube.lamp", "parts/plain.lamp", "parts/planned.lamp"];
    for name in others {
        assert!(
            night.scratch.bytes(&format!("night/{name}"))
                == wanted.files[std::path::Path::new(name)]
        );
    }
    // The same command tries it again.
    wanted.check(&night.done(), "without crashes");
    wait_for_no_task(&night.store());
    night.check_nothing_done_twice();
    night.check_tidy();
}
