//! Results, manifests and delivered files that are not what they were.

use std::fs::{self, File};
use std::path::Path;

use lamp_batch::{Key, Kind, Store};

use super::night::Night;

/// Writes a file anew, also a read-only one.
fn change(path: &Path, edit: impl Fn(&mut Vec<u8>)) {
    let mut bytes = fs::read(path).unwrap();
    edit(&mut bytes);
    fs::remove_file(path).unwrap();
    fs::write(path, bytes).unwrap();
}

fn flip(bytes: &mut [u8]) {
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
}

/// Returns the tasks of a kind.
fn of_kind(store: &Store, kind: Kind) -> Vec<Key> {
    let is_it = |key: &Key| store.task(*key).is_some_and(|task| task.recipe.kind == kind);
    let keys: Vec<Key> = store.keys().unwrap().into_iter().filter(is_it).collect();
    assert!(!keys.is_empty(), "no {kind:?}");
    keys
}

#[test]
fn a_flipped_bit_in_what_is_used_is_noticed_and_made_again() {
    let night = Night::new();
    let wanted = night.done();
    let store = Store::open(&night.store()).unwrap();
    // A result of each kind, and the tasks that would use it.
    for (kind, users) in
        [(Kind::Plan, Kind::Whole), (Kind::Range, Kind::Join), (Kind::Join, Kind::Tile)]
    {
        for user in of_kind(&store, users) {
            for need in store.task(user).unwrap().needs {
                change(&store.result(need), |bytes| flip(bytes));
            }
            store.forget(user).unwrap();
        }
        let ended = night.run();
        assert_eq!(ended.status, Some(0), "{ended:?}");
        assert!(
            ended.stderr.contains("the bytes of its file differ from its manifest"),
            "{ended:?}"
        );
        wanted.check(&night.outcome(&ended), &format!("a damaged {kind:?}"));
    }
    // Results that only their delivery uses.
    for (name, kind) in [("parts/ball.lamp", Kind::Join), ("builds/all.lamp", Kind::Tile)] {
        // The join below a plan is not made again.
        let is_there = |key: &Key| store.result(*key).exists();
        for key in of_kind(&store, kind).into_iter().filter(is_there) {
            change(&store.result(key), |bytes| flip(bytes));
        }
        fs::remove_file(night.scratch.path("night").join(name)).unwrap();
        let ended = night.run();
        assert!(ended.status == Some(0) && ended.stderr.contains("is made again"), "{ended:?}");
        wanted.check(&night.outcome(&ended), &format!("a damaged {kind:?}, to be delivered"));
        night.scratch.run("lamp batch verify night.toml -q");
        wanted.check(&night.done(), "after all damaged results");
    }
    night.scratch.run("lamp batch verify night.toml").succeeds_quietly();
    night.check_tidy();
}

#[test]
fn a_manifest_that_is_cut_short_is_none() {
    let night = Night::new();
    let wanted = night.done();
    let store = Store::open(&night.store()).unwrap();
    let keys = store.keys().unwrap();
    let manifest = |key: Key| store.result(key).with_extension("json");
    for (place, &key) in keys.iter().enumerate() {
        // Nothing, a part, and all but a byte.
        change(&manifest(key), |bytes| bytes.truncate((bytes.len() - 1) * (place % 3) / 2));
    }
    let ended = night.run();
    let done = ended.stderr.lines().filter(|line| line.ends_with(" is done"));
    assert_eq!((ended.status, done.count()), (Some(0), keys.len()), "{ended:?}");
    wanted.check(&night.outcome(&ended), "all manifests cut");
    night.check_tidy();
}

#[test]
fn a_delivered_file_that_was_changed_is_delivered_again() {
    let night = Night::new();
    let wanted = night.done();
    let [edited, cut, gone] = ["parts/ball.lamp", "parts/plain.lamp", "builds/all.lamp"]
        .map(|name| night.scratch.path("night").join(name));
    change(&edited, |bytes| bytes.extend(b"mine"));
    change(&cut, |bytes| bytes.truncate(bytes.len() / 2));
    fs::remove_file(&gone).unwrap();
    wanted.check(&night.done(), "changed files");
    // Under the same size and time, bytes are compared by verify alone.
    night.scratch.run("lamp batch verify night.toml").succeeds_quietly();
    let before = edited.metadata().unwrap().modified().unwrap();
    change(&edited, |bytes| flip(bytes));
    File::options().write(true).open(&edited).unwrap().set_modified(before).unwrap();
    fs::remove_file(&gone).unwrap();
    let verified = night.scratch.run("lamp batch verify night.toml");
    assert_eq!(verified.statuses, [Some(1)], "{verified:?}");
    for words in [
        "ball.lamp: its bytes differ from the delivered ones: the next run delivers it again",
        "all.lamp: it is gone: the next run delivers it again",
        "batch: 2 of 5 delivered files have changed or are gone",
    ] {
        assert!(verified.stderr.contains(words), "{verified:?}");
    }
    assert_eq!(verified.stderr.lines().count(), 3, "{verified:?}");
    wanted.check(&night.done(), "a file of the same size and time");
    night.check_nothing_done_twice();
    night.check_tidy();
}
