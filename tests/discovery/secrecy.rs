//! What finds effects never sees what was hidden: the truth is for scoring alone.

use std::fs;
use std::path::{Path, PathBuf};

fn files(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn no_source_file_knows_where_the_truth_lies() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    files(&root.join("src"), &mut found);
    assert!(found.iter().any(|path| path.ends_with("discovery/robot/simulate/mod.rs")));
    for path in found {
        let text = fs::read_to_string(&path).unwrap();
        for word in ["truth/", "\"truth\"", "hidden_effects", "made_as", "visibility"] {
            assert!(!text.contains(word), "{} holds `{word}`", path.display());
        }
    }
}

/// Discovery may read recordings and nothing of the laboratory.
#[test]
fn discovery_does_not_name_the_laboratory() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    files(&root.join("src/discovery"), &mut found);
    for path in found {
        let text = fs::read_to_string(&path).unwrap();
        assert!(!text.contains("crate::lab"), "{}", path.display());
    }
}
