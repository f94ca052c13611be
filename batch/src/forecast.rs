//! How long the tasks of a night take, from tasks that were done before.

use std::collections::{BTreeMap, HashMap};

use crate::engine::Local;
use crate::journal::{Event, host};
use crate::key::{Key, Kind};
use crate::store::Store;
use crate::task::Graph;

/// The time that tasks take on this machine, as far as earlier tasks show it.
#[derive(Clone, Debug, PartialEq)]
pub struct Forecast {
    /// The least and the greatest time in seconds, of tasks whose times are known. The least counts the
    /// processor time of earlier tasks, shared evenly among threads. The greatest counts their whole
    /// duration beside other tasks, with waits for disks, as if one thread did each task.
    pub seconds: [f64; 2],
    /// The number of earlier tasks that it is from.
    pub earlier: usize,
    /// Kinds of which no task was done before, each with the number of its tasks to do.
    pub unknown: Vec<(Kind, usize)>,
}

/// The newest tasks of a kind that count.
const MOST_EARLIER: usize = 200;

/// Tasks are similar if the estimate of none is more times the other's. Starting a process is much of
/// a short task, and little of a long one.
const SIMILAR: f64 = 10.0;

/// Of so many similar tasks, the shortest and the longest do not count.
const CUT: usize = 10;

impl Forecast {
    /// Computes the time of the tasks `to_do`, each after the tasks that it needs.
    ///
    /// A task that was done before takes the time of then. Other tasks take their estimate, times the
    /// least and the greatest ratio of time to estimate of similar earlier tasks: tasks of
    /// the same kind, whose estimate is up to ten times as long or as short, if there are any. The tenth
    /// with the least and the tenth with the greatest ratio do not count.
    /// `events` are in the order of their times; other machines' do not count.
    pub fn new(
        graph: &Graph,
        to_do: &[Key],
        store: &Store,
        events: &[Event],
        local: &Local,
    ) -> Self {
        let here = host();
        let done = |event: &&Event| event.is_done() && event.host == here;
        let times_of = |event: &Event| {
            let cpu_s = event.cpu_s.unwrap_or(event.seconds);
            [cpu_s, cpu_s.max(event.seconds)]
        };
        let mut known: HashMap<Key, [f64; 2]> = HashMap::new();
        let mut newest: BTreeMap<Kind, Vec<&Event>> = BTreeMap::new();
        for event in events.iter().rev().filter(done) {
            known.entry(event.key).or_insert(times_of(event));
            let of_kind = newest.entry(event.kind).or_default();
            if of_kind.len() < MOST_EARLIER {
                of_kind.push(event);
            }
        }
        // Estimates and times of earlier tasks.
        let estimated = |event: &&Event| {
            let estimate = store.task(event.key)?.cost.cpu_s;
            (estimate > 0.0).then(|| (estimate, times_of(event)))
        };
        let earlier: BTreeMap<Kind, Vec<(f64, [f64; 2])>> = newest
            .iter()
            .filter(|(kind, _)| to_do.iter().any(|key| graph.task(*key).recipe.kind == **kind))
            .map(|(kind, events)| (*kind, events.iter().filter_map(estimated).collect()))
            .collect();
        let mut unknown: BTreeMap<Kind, usize> = BTreeMap::new();
        let mut times: HashMap<Key, [f64; 2]> = HashMap::new();
        let mut used: usize = earlier.values().map(Vec::len).sum();
        for &key in to_do {
            let task = graph.task(key);
            let similar = || range(task.cost.cpu_s, earlier.get(&task.recipe.kind)?);
            let time = match known.get(&key) {
                Some(&seconds) => {
                    used += 1;
                    Some(seconds)
                }
                None => similar(),
            };
            if time.is_none() {
                *unknown.entry(task.recipe.kind).or_default() += 1;
            }
            times.insert(key, time.unwrap_or_default());
        }
        let least = local.duration(graph, to_do, |key, threads| times[&key][0] / threads as f64);
        let most = local.duration(graph, to_do, |key, _| times[&key][1]);
        // Shorter tasks in another order can take longer together.
        let seconds = [least.min(most), most.max(least)];
        Self { seconds, earlier: used, unknown: unknown.into_iter().collect() }
    }
}

/// Returns the least and the greatest time of a task with an estimate, given the estimates and times of
/// earlier ones of its kind.
fn range(estimate: f64, earlier: &[(f64, [f64; 2])]) -> Option<[f64; 2]> {
    let is_similar = |other: f64| (estimate / SIMILAR..=estimate * SIMILAR).contains(&other);
    let any_similar = earlier.iter().any(|(other, _)| is_similar(*other));
    let counted = earlier.iter().filter(|(other, _)| !any_similar || is_similar(*other));
    let times = counted.map(|(other, times)| times.map(|seconds| estimate * seconds / other));
    let (mut least, mut most): (Vec<f64>, Vec<f64>) = times.map(<(f64, f64)>::from).unzip();
    least.sort_by(f64::total_cmp);
    most.sort_by(f64::total_cmp);
    // One task on a busy machine must not widen the range for all later ones.
    let cut = least.len() / CUT;
    Some([*least.get(cut)?, *most.iter().rev().nth(cut)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::tests::task;

    fn event(key: Key, kind: Kind, at: f64, cpu_s: f64) -> Event {
        Event {
            at,
            host: host(),
            engine: "local".to_owned(),
            key,
            kind,
            subject: String::new(),
            label: String::new(),
            seconds: 1.5 * cpu_s,
            cpu_s: Some(cpu_s),
            memory: None,
            status: Some(0),
            why: None,
        }
    }

    #[test]
    fn times_are_those_of_earlier_tasks() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::create(&folder.path().join("store")).unwrap();
        // Estimates are 1 s each.
        let mut graph = Graph::default();
        let [a, b] = ["a", "b"].map(|name| graph.add(task(name, Kind::Range, &[])));
        let join = graph.add(task("join", Kind::Join, &[a, b]));
        let mut before = ["c", "d", "e"].map(|name| task(name, Kind::Range, &[]));
        before[2].cost.cpu_s = 0.01;
        before.iter().for_each(|task| store.write_task(task).unwrap());
        let [c, d, e] = before.map(|task| task.recipe.key());
        let local = Local { jobs: 1, memory: 100 };
        let of = |events: &[Event]| Forecast::new(&graph, graph.keys(), &store, events, &local);

        let none = of(&[]);
        assert_eq!((none.seconds, none.earlier), ([0.0; 2], 0));
        assert_eq!(none.unknown, [(Kind::Range, 2), (Kind::Join, 1)]);
        // The least and the greatest ratio; a task of another size, a failed one and another machine's
        // do not count.
        let only_other = of(&[event(e, Kind::Range, 1.0, 0.09)]);
        assert_eq!(only_other.seconds, [18.0, 27.0], "without similar ones, all count");
        let failed = Event { status: Some(1), ..event(d, Kind::Range, 3.0, 900.0) };
        let elsewhere = Event { host: "x y".to_owned(), ..event(d, Kind::Range, 3.0, 900.0) };
        let mut events = vec![
            event(c, Kind::Range, 1.0, 2.0),
            event(d, Kind::Range, 2.0, 3.0),
            event(e, Kind::Range, 2.0, 0.09),
            failed,
            elsewhere,
        ];
        let found = of(&events);
        assert_eq!((found.seconds, found.earlier), ([4.0, 9.0], 3));
        assert_eq!(found.unknown, [(Kind::Join, 1)]);
        // Of ten and more, the least and the greatest do not count.
        let many: Vec<Event> = [1.0, 2.0, 3.0]
            .iter()
            .flat_map(|ratio| {
                vec![event(c, Kind::Range, 1.0, *ratio); if *ratio == 2.0 { 8 } else { 1 }]
            })
            .collect();
        assert_eq!(of(&many).seconds, [4.0, 6.0]);
        // The same task takes the time of the last time.
        events.extend([event(a, Kind::Range, 4.0, 7.0), event(a, Kind::Range, 5.0, 2.5)]);
        assert_eq!(of(&events).seconds, [4.5, 8.25]);
        events.push(event(join, Kind::Join, 6.0, 1.0));
        let found = of(&events);
        assert_eq!((found.seconds, found.unknown), ([5.5, 9.75], vec![]));
        let two = Local { jobs: 2, ..local };
        let found = Forecast::new(&graph, graph.keys(), &store, &events, &two);
        // Both ranges beside each other, then the join with one thread or two.
        assert_eq!(found.seconds, [2.5 + 0.5, 4.5 + 1.5]);
    }
}
