//! `trueup paper`: the tables of the paper from laboratories.

use std::fs;

use crate::program::Scratch;

#[test]
fn table_1_of_two_laboratories_has_every_form_and_the_papers_numbers() {
    let scratch = Scratch::new("paper-table1");
    let said =
        scratch.trueup(&["paper", "table1", "--n", "2", "--seed", "3", "--out", "out", "--json"]);
    assert_eq!(said.code, 0, "{said:?}");
    let told = said.document("paper-table1");
    let kept: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(scratch.path("out/table1.json")).unwrap())
            .unwrap();
    assert_eq!(told, kept);
    let rows = told["rows"].as_array().unwrap();
    let names: Vec<&str> = rows.iter().filter_map(|row| row["way"].as_str()).collect();
    assert_eq!(names, ["none", "scale", "affine", "projective", "camera"]);
    let error = |k: usize| rows[k]["error_px"]["mean"].as_f64().unwrap();
    // More freedom comes closer, the paper's order; a fitted camera closest of all.
    assert!(error(1) > error(2) && error(2) > error(3) && error(3) > error(4), "{told:#}");
    assert!(error(4) < 2.0, "{told:#}");
    for (row, mse) in [(1, 8.2), (2, 5.1), (3, 2.7)] {
        assert!((rows[row]["paper"]["mse"].as_f64().unwrap() - mse).abs() < 1e-12);
    }
    for laboratory in told["laboratories"].as_array().unwrap() {
        assert_eq!(laboratory["corners"], 6);
    }
    let page = fs::read_to_string(scratch.path("out/table1.md")).unwrap();
    assert!(page.contains("$ trueup paper table1 --n 2 --seed 3"), "{page}");
    assert!(page.contains("| projective | 8 |"), "{page}");
    // The same command gives the same numbers.
    let again =
        scratch.trueup(&["paper", "table1", "--n", "2", "--seed", "3", "--out", "out", "--json"]);
    assert_eq!(again.json()["laboratories"], told["laboratories"]);
}

#[test]
fn what_a_folder_cannot_be_is_told() {
    let scratch = Scratch::new("paper-folder");
    scratch.file("out", "a file");
    let said = scratch.trueup(&["paper", "table1", "--n", "1", "--out", "out/deep", "--json"]);
    assert_eq!(said.code, 2, "{said:?}");
    let none = scratch.trueup(&["paper", "table1", "--n", "0"]);
    assert_eq!(none.code, 2, "{none:?}");
}
