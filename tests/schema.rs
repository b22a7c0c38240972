//! Whether a document of `--json` is as its schema in `docs/schema/` says.
//!
//! What is read of JSON Schema 2020-12 is what the schemas use, and a word that is not known here fails. Programs may meet
//! more than a schema lists, since documents grow; here what is printed must be listed, so that none is forgotten.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;

/// Words that only explain.
const WORDS: &[&str] = &["$schema", "$id", "$defs", "title", "description"];

/// The schemas, by the name of their file without its ending.
pub(crate) struct Schemas {
    all: BTreeMap<String, Value>,
}

impl Schemas {
    pub(crate) fn read() -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/schema");
        let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let files = files.filter(|path| path.extension().is_some_and(|ending| ending == "json"));
        let read = |path: std::path::PathBuf| {
            let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
            let text = fs::read_to_string(&path).unwrap();
            let schema: Value = serde_json::from_str(&text).unwrap();
            assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema", "{name}");
            assert_eq!(schema["$id"], format!("{name}.json"));
            (name, schema)
        };
        Self { all: files.map(read).collect() }
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.all.keys().map(String::as_str)
    }

    /// Fails with every place where a document is not as its schema says.
    pub(crate) fn holds(&self, name: &str, document: &Value) {
        let schema = self.all.get(name).unwrap_or_else(|| panic!("there is no schema `{name}`"));
        let wrong = self.wrong(name, schema, document, "");
        assert!(wrong.is_empty(), "{name}: {wrong:#?}");
    }

    /// Returns what is wrong with a value, each with its place.
    fn wrong(&self, file: &str, schema: &Value, value: &Value, at: &str) -> Vec<String> {
        let Some(words) = schema.as_object() else {
            return if *schema == Value::Bool(true) {
                Vec::new()
            } else {
                vec![format!("{at}: nothing may be here")]
            };
        };
        let mut wrong = Vec::new();
        for (word, said) in words {
            let found = match word.as_str() {
                word if WORDS.contains(&word) => Vec::new(),
                "$ref" => {
                    let (file, schema) = self.referred(file, said.as_str().unwrap());
                    self.wrong(file, schema, value, at)
                }
                "type" => has_type(said, value)
                    .err()
                    .map(|why| format!("{at}: {why}"))
                    .into_iter()
                    .collect(),
                "enum" if said.as_array().unwrap().contains(value) => Vec::new(),
                "enum" => vec![format!("{at}: {value} is none of {said}")],
                "const" if said == value => Vec::new(),
                "const" => vec![format!("{at}: {value} is not {said}")],
                "anyOf" => {
                    let all = said.as_array().unwrap().iter();
                    let each: Vec<_> = all.map(|one| self.wrong(file, one, value, at)).collect();
                    // The one that comes nearest says most.
                    each.into_iter().min_by_key(Vec::len).unwrap_or_default()
                }
                "required" => missing(said, value, at),
                "properties" | "additionalProperties" => Vec::new(),
                "items" => {
                    let items = value.as_array().into_iter().flatten().enumerate();
                    items
                        .flat_map(|(k, item)| self.wrong(file, said, item, &format!("{at}/{k}")))
                        .collect()
                }
                word => panic!("{file}: `{word}` is not read here"),
            };
            wrong.extend(found);
        }
        if let Some(members) = value.as_object() {
            let more = words.get("additionalProperties");
            for (name, member) in members {
                let own = words.get("properties").and_then(|own| own.get(name)).or(more);
                let place = format!("{at}/{name}");
                match own {
                    Some(schema) => wrong.extend(self.wrong(file, schema, member, &place)),
                    None if words.contains_key("properties") => {
                        wrong.push(format!("{place}: not listed"));
                    }
                    None => {}
                }
            }
        }
        wrong
    }

    /// Returns what `run.json#/$defs/step` refers to, and the file it is in.
    fn referred<'a>(&'a self, file: &'a str, to: &'a str) -> (&'a str, &'a Value) {
        let (other, path) = to.split_once('#').unwrap_or((to, ""));
        let file = if other.is_empty() { file } else { other.strip_suffix(".json").unwrap() };
        let schema = self.all.get(file).and_then(|schema| schema.pointer(path));
        (file, schema.unwrap_or_else(|| panic!("there is no `{to}`")))
    }
}

fn missing(required: &Value, value: &Value, at: &str) -> Vec<String> {
    let Some(members) = value.as_object() else { return Vec::new() };
    let names = required.as_array().unwrap().iter().map(|name| name.as_str().unwrap());
    names
        .filter(|name| !members.contains_key(*name))
        .map(|name| format!("{at}: `{name}` is missing"))
        .collect()
}

fn has_type(said: &Value, value: &Value) -> Result<(), String> {
    let is = |name: &str| match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("`{other}` is no type"),
    };
    let names: Vec<&str> = match said {
        Value::Array(all) => all.iter().map(|name| name.as_str().unwrap()).collect(),
        one => vec![one.as_str().unwrap()],
    };
    let short: String = value.to_string().chars().take(80).collect();
    if names.iter().any(|name| is(name)) {
        Ok(())
    } else {
        Err(format!("{short} is no {}", names.join(" or ")))
    }
}

#[test]
fn a_document_that_is_otherwise_is_told() {
    let schemas = Schemas::read();
    let schema = &schemas.all["error"];
    let whole =
        serde_json::json!({"error": {"code": "a", "message": "b", "where": null, "help": null}});
    assert_eq!(schemas.wrong("error", schema, &whole, ""), [""; 0]);
    let other = serde_json::json!({"error": {"code": 3, "message": "b", "help": null, "more": 1}});
    assert_eq!(
        schemas.wrong("error", schema, &other, ""),
        ["/error: `where` is missing", "/error/code: 3 is no string", "/error/more: not listed"]
    );
}
