//! Removes results that no batch names any more.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::io;
use std::path::Path;
use std::time::Duration;

use crate::key::Key;
use crate::named::NamedTasks;
use crate::store::{Store, StoreError, folders_in, remove};

/// Counts of removed and kept results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Removed {
    /// The number of results.
    pub results: u64,
    /// The number of results kept.
    pub kept: u64,
    /// The bytes of all files that were removed.
    pub bytes: u64,
}

/// Removes results that no batch run within `keep` names: neither as a result that it wants, nor as
/// one that it still needs to make those. So ranges go once their part is joined.
///
/// # Errors
/// Returns an error if a file cannot be read or removed.
pub fn collect(store: &Store, keep: Duration) -> Result<Removed, StoreError> {
    let failed = |error| StoreError::Io(store.root().to_owned(), error);
    let (recent, old) = NamedTasks::within(store, keep).map_err(failed)?;
    let mut wanted = HashSet::new();
    for batch in &recent {
        mark(batch, store, &mut wanted);
    }
    let mut removed = Removed::default();
    for shard in folders_in(&store.root().join("tasks")) {
        for path in files(&shard).map_err(failed)? {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let Some((key, end)) = name.split_once('.') else { continue };
            let Ok(key) = key.parse::<Key>() else { continue };
            let is_manifest = u64::from(end == "json");
            if wanted.contains(&key) {
                removed.kept += is_manifest;
            } else {
                removed.results += is_manifest;
                removed.remove(&path)?;
            }
        }
        // It stays if it is not empty.
        let _ = fs::remove_dir(&shard);
    }
    for shard in folders_in(&store.root().join("notes")) {
        for path in files(&shard).map_err(failed)? {
            // No batch lists notes, so their age decides. A time in the future counts as now.
            let age = path.metadata().and_then(|file| file.modified()).map(|at| at.elapsed());
            if age.is_ok_and(|age| age.unwrap_or_default() > keep) {
                removed.remove(&path)?;
            }
        }
    }
    old.iter().try_for_each(|path| removed.remove(path))?;
    Ok(removed)
}

/// Marks the results that a batch wants, and the results that it needs to make missing ones.
fn mark(batch: &NamedTasks, store: &Store, wanted: &mut HashSet<Key>) {
    let needs: HashMap<Key, &[Key]> =
        batch.tasks.iter().map(|task| (task.key, &task.needs[..])).collect();
    let mut open = batch.goals.clone();
    while let Some(key) = open.pop() {
        if wanted.insert(key) && store.manifest(key).is_none() {
            open.extend(needs.get(&key).copied().unwrap_or_default());
        }
    }
}

fn files(folder: &Path) -> io::Result<Vec<std::path::PathBuf>> {
    fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect()
}

impl Removed {
    fn remove(&mut self, path: &Path) -> Result<(), StoreError> {
        self.bytes += path.metadata().map_or(0, |file| file.len());
        remove(path)
    }
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::key::Kind;
    use crate::store::{Facts, Manifest};
    use crate::task::Graph;
    use crate::task::tests::task;

    #[test]
    fn what_is_wanted_or_still_needed_stays() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::create(&folder.path().join("store")).unwrap();
        let mut graph = Graph::default();
        let [a, b, c] = ["a", "b", "c"].map(|name| graph.add(task(name, Kind::Range, &[])));
        let low = graph.add(task("low", Kind::Join, &[a]));
        let high = graph.add(task("high", Kind::Join, &[b]));
        let publish = |key: Key| {
            let recipe = graph.task(key).recipe.clone();
            let result = store.begin(key).unwrap();
            io::Write::write_all(&mut result.file(), b"layers").unwrap();
            let result = Some(result.finish().unwrap());
            store.publish(&Manifest { recipe, result, facts: Facts::default() }).unwrap();
        };
        [a, b, c, low].into_iter().for_each(publish);
        NamedTasks::new("night.toml".into(), &graph, &[low, high]).keep(&store).unwrap();
        let removed = collect(&store, Duration::from_secs(3600)).unwrap();
        assert_eq!((removed.results, removed.kept), (2, 2));
        let is_there = |key: &Key| store.manifest(*key).is_some() && store.result(*key).exists();
        assert_eq!(
            [a, b, c, low, high].each_ref().map(is_there),
            [false, true, false, true, false]
        );
        assert_eq!(collect(&store, Duration::from_secs(3600)).unwrap().results, 0);
        std::thread::sleep(Duration::from_millis(20));
        assert_eq!(collect(&store, Duration::ZERO).unwrap().results, 2);
        assert_eq!(store.keys().unwrap(), []);
    }
}
