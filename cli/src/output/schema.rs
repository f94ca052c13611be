//! The JSON Schemas of answers, in `docs/schemas`, made from the types of the answers.

use std::fs;
use std::path::Path;

use schemars::generate::{SchemaGenerator, SchemaSettings};
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value, json};

/// Makes the schema of a type.
type MakeSchema = fn(&mut SchemaGenerator) -> Schema;

const BLESS: &str = "LAMP_BLESS=1 cargo test -p lamp-cli --lib schemas";

/// Checks the file of a schema: the keys of `Head`, and then lists with items of these types. With
/// `LAMP_BLESS=1`, writes the file.
pub(crate) fn check<Head: JsonSchema>(name: &str, lists: &[(&str, MakeSchema)]) {
    let text = serde_json::to_string_pretty(&schema_of::<Head>(name, lists)).unwrap() + "\n";
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/schemas");
    let path = folder.join(format!("{name}.json"));
    if std::env::var("LAMP_BLESS").is_ok_and(|value| value == "1") {
        fs::create_dir_all(folder).unwrap();
        fs::write(path, text).unwrap();
        return;
    }
    let found = fs::read_to_string(&path).unwrap_or_default();
    assert!(found == text, "docs/schemas/{name}.json is not as its type: {BLESS}");
}

fn schema_of<Head: JsonSchema>(name: &str, lists: &[(&str, MakeSchema)]) -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    // Names of types in the program mean nothing to a reader of its answers.
    let settings = settings.with(|settings| settings.inline_subschemas = true);
    let mut generator = settings.into_generator();
    let mut head = Head::json_schema(&mut generator).to_value();
    let mut properties = Map::new();
    let mut required = Vec::new();
    if head["properties"]["schema"].is_null() {
        properties.insert("schema".to_owned(), json!({ "const": name }));
        required.push(json!("schema"));
    } else {
        head["properties"]["schema"] = json!({ "const": name });
    }
    if let Value::Object(of_head) = head["properties"].take() {
        properties.extend(of_head);
    }
    if let Value::Array(of_head) = head["required"].take() {
        required.extend(of_head);
    }
    for (list, item) in lists {
        let items = item(&mut generator).to_value();
        properties.insert((*list).to_owned(), json!({ "type": "array", "items": items }));
        required.push(json!(list));
    }
    let description = head["description"].take();
    assert!(description.is_string(), "{name}: its type has no doc comment");
    let mut schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": format!("urn:lamp:{name}"),
        "title": name,
        "description": description,
        "type": "object",
        "properties": properties,
        "required": required,
    });
    for key in ["allOf", "anyOf", "oneOf"] {
        if !head[key].is_null() {
            schema[key] = head[key].take();
        }
    }
    close(&mut schema, false);
    schema
}

/// Refuses keys that a schema does not name, and makes each description one line. The `branch` of
/// a choice leaves keys to the schema around it.
fn close(schema: &mut Value, branch: bool) {
    let Some(object) = schema.as_object_mut() else { return };
    if let Some(Value::String(text)) = object.get_mut("description") {
        *text = text.replace('\n', " ");
        let is_of_code = ["[`", "`None`", "`Some", "::"].iter().any(|code| text.contains(code));
        assert!(!is_of_code, "a description is for readers of JSON: {text}");
    }
    // A value that the program itself reads for an absent key says nothing of answers.
    object.remove("default");
    let has_keys = object.contains_key("properties");
    for key in ["allOf", "anyOf", "oneOf"] {
        let branches = object.get_mut(key).and_then(Value::as_array_mut);
        branches.into_iter().flatten().for_each(|each| close(each, branch || has_keys));
    }
    let inner = object.get_mut("properties").and_then(Value::as_object_mut);
    inner.into_iter().flat_map(|keys| keys.values_mut()).for_each(|each| close(each, false));
    for key in ["items", "additionalProperties"] {
        object.get_mut(key).into_iter().for_each(|each| close(each, false));
    }
    if has_keys && !branch && !object.contains_key("additionalProperties") {
        object.insert("unevaluatedProperties".to_owned(), json!(false));
    }
}
