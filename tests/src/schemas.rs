//! Checks the JSON of programs against the schemas in `docs/schemas`.

use std::collections::BTreeMap;
use std::fs;
use std::sync::{Arc, LazyLock, Mutex};

use jsonschema::Validator;
use serde_json::{Deserializer, Value};

use crate::binaries::workspace_root;

/// Files that commands read again and refuse if a key is unknown, so that no other program has them.
const WITHOUT: &[&str] = &["lamp-recipe-1"];

/// Checks each JSON object of an output or a file whose `schema` is one of ours. Anything else passes.
///
/// # Panics
/// Panics if an object is not as its schema says, or if its schema has no file.
#[track_caller]
pub(crate) fn check_answers(place: &str, bytes: &[u8]) {
    if !bytes.starts_with(b"{") {
        return;
    }
    for answer in Deserializer::from_slice(bytes).into_iter::<Value>() {
        // The end of an output may be missing, as of a program that was stopped.
        let Ok(answer) = answer else { return };
        let Some(name) = answer["schema"].as_str().filter(|name| name.starts_with("lamp-")) else {
            return;
        };
        if WITHOUT.contains(&name) {
            return;
        }
        let validator = validator(name);
        let errors = validator.iter_errors(&answer).take(5);
        let errors: Vec<_> =
            errors.map(|error| format!("{}: {error:.300}", error.instance_path())).collect();
        assert!(errors.is_empty(), "{place}: not {name}:\n{}", errors.join("\n"));
    }
}

/// Returns what checks answers of a schema.
fn validator(name: &str) -> Arc<Validator> {
    static KNOWN: LazyLock<Mutex<BTreeMap<String, Arc<Validator>>>> = LazyLock::new(Mutex::default);
    let mut known = KNOWN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let new = || {
        let path = workspace_root().join("docs/schemas").join(format!("{name}.json"));
        let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let schema = serde_json::from_str(&text).expect("a schema is JSON");
        Arc::new(jsonschema::validator_for(&schema).expect("a schema is one of JSON Schema"))
    };
    known.entry(name.to_owned()).or_insert_with(new).clone()
}
