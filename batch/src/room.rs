//! The disk space that a night takes, and the free space.

use std::path::Path;

use lamp_pipeline::memory::in_words;

use crate::deliver::Deliverer;
use crate::ledger::Ledger;
use crate::plan::NightPlan;

/// The room of a task besides its result: its work, its manifest, and three blocks that are not
/// full.
const TASK_BYTES: u64 = 3 * 4096;

/// The room that a night takes, estimated, and the room that there is, in bytes.
pub struct DiskRoom {
    store: u64,
    delivered: u64,
    free: Option<u64>,
}

impl DiskRoom {
    /// Adds up what is to be done, and to be delivered to the disk of the store.
    pub fn of(plan: &NightPlan, ledger: &Ledger<'_>, deliverer: &Deliverer<'_>) -> Self {
        let tasks = ledger.keys();
        let results: u64 = tasks.iter().map(|&key| plan.graph.task(key).cost.disk).sum();
        let store = results + TASK_BYTES * tasks.len() as u64;
        let root = deliverer.store.root();
        let to_deliver = |subject: &&_| deliverer.delivered(subject).is_none();
        let delivered = match is_one_disk(root, &deliverer.output.folder) {
            true => {
                let subjects = plan.subjects.iter().filter(to_deliver);
                subjects.flat_map(|subject| &subject.wanted).map(|wanted| wanted.bytes).sum()
            }
            false => 0,
        };
        Self { store, delivered, free: fs4::available_space(root).ok() }
    }

    /// Returns a sentence if there is less than the night takes.
    pub fn shortage(&self) -> Option<String> {
        let free = self.free.filter(|&free| free < self.store + self.delivered)?;
        let [all, store, delivered, free] =
            [self.store + self.delivered, self.store, self.delivered, free].map(in_words);
        Some(format!(
            "about {all} of disk are needed ({store} for the store, {delivered} for \
             deliveries), and {free} are free: make room, or name another [store] folder"
        ))
    }
}

/// Returns whether a folder, or where it will be made, is on the disk of another one.
#[cfg(unix)]
fn is_one_disk(one: &Path, other: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let disk = |folder: &Path| {
        let known = folder.ancestors().find_map(|folder| folder.metadata().ok());
        known.map(|metadata| metadata.dev())
    };
    disk(one) == disk(other)
}

#[cfg(not(unix))]
fn is_one_disk(_: &Path, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shortage_is_told_in_one_sentence() {
        let room = |free| DiskRoom { store: 3_000_000, delivered: 2_000_000, free };
        assert_eq!(room(None).shortage(), None);
        assert_eq!(room(Some(5_000_000)).shortage(), None);
        let told = room(Some(4_999_999)).shortage().unwrap();
        assert!(
            told.starts_with("about 5 MB of disk are needed (3 MB for the store, 2 MB"),
            "{told}"
        );
        assert!(told.contains("and 4 MB are free"), "{told}");
    }
}
