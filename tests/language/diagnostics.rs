//! How a mistake is shown: where it stands, drawn, spoken and as JSON. What is said of which mistake is told in `mistakes`.

use trueup::language::{Source, Style, parse, render};

/// One file, five planted errors, one pass: the prototype of the language's design, reproduced.
const BAD: &str = "\
task pick(o: Graspable) {
    needs visible(o
    either side prior 0.7 { grasp(o, side) }
    or     top  prior 0.3 { grasp(o, top }
    lift(o, by: 12 centimetres) while holding(o)
}

/// Pour.
task pour(source: Container target: Container) {
    lift(source)
}

tsak place(o: Graspable) {
    lower(o)
}
";

/// Renders everything wrong with a text by its syntax alone.
fn told(text: &str) -> Vec<String> {
    let source = Source::new("bad.task", text);
    parse(text).1.iter().map(|d| render(d, &source, Style::Plain)).collect()
}

#[test]
fn five_planted_errors_are_found_in_one_pass() {
    let codes: Vec<(&str, usize)> = {
        let source = Source::new("bad.task", BAD);
        parse(BAD).1.iter().map(|d| (d.code, source.line_column(d.span.from).0)).collect()
    };
    assert_eq!(
        codes,
        [
            ("task::unclosed", 2),
            ("task::unclosed", 4),
            ("task::unit", 5),
            ("task::comma", 9),
            ("task::keyword", 13),
        ]
    );
}

#[test]
fn an_unclosed_parenthesis_shows_both_ends() {
    assert_eq!(
        told(BAD)[1],
        "task::unclosed

  × `(` is never closed
   ╭─[bad.task:4:34]
 3 │     either side prior 0.7 { grasp(o, side) }
 4 │     or     top  prior 0.3 { grasp(o, top }
   ·                                  ┬       ┬
   ·                                  │       ╰── expected the closing bracket before this
   ·                                  ╰── opened here
 5 │     lift(o, by: 12 centimetres) while holding(o)
   ╰────
  help: add `)` before this `}`
"
    );
}

#[test]
fn a_wrong_unit_names_the_right_one() {
    assert_eq!(
        told(BAD)[2],
        "task::unit

  × `centimetres` is not a unit
   ╭─[bad.task:5:20]
 4 │     or     top  prior 0.3 { grasp(o, top }
 5 │     lift(o, by: 12 centimetres) while holding(o)
   ·                    ─────┬─────
   ·                         ╰── unknown unit
 6 │ }
   ╰────
  help: write `12 cm`  (units: mm cm m deg rad ns us ms s min mL L g kg N N*m A V Hz rad/s %)
"
    );
}

#[test]
fn a_missing_comma_is_told_where_it_is_missing() {
    assert_eq!(
        told(BAD)[3],
        "task::comma

  × missing `,` before `target`
    ╭─[bad.task:9:29]
  8 │ /// Pour.
  9 │ task pour(source: Container target: Container) {
    ·                             ───┬──
    ·                                ╰── expected `)`, `,`
 10 │     lift(source)
    ╰────
  help: separate parameters with commas
"
    );
}

#[test]
fn a_screen_reader_hears_sentences() {
    let source = Source::new("bad.task", BAD);
    let narrated = render(&parse(BAD).1[1], &source, Style::Narrated);
    assert!(narrated.contains("`(` is never closed"), "{narrated}");
    assert!(narrated.contains("label at line 4, column 34: opened here"), "{narrated}");
    assert!(narrated.contains("add `)` before this `}`"), "{narrated}");
    assert!(!narrated.contains('╭'));
}

#[test]
fn json_has_the_fields_of_the_interface() {
    let source = Source::new("bad.task", BAD);
    let json = parse(BAD).1[2].to_json(&source);
    assert_eq!(json["code"], "task::unit");
    assert_eq!(json["severity"], "error");
    assert_eq!(json["file"], "bad.task");
    assert_eq!((json["line"].as_u64(), json["column"].as_u64()), (Some(5), Some(20)));
    let (from, to) = (json["span"][0].as_u64().unwrap(), json["span"][1].as_u64().unwrap());
    assert_eq!(&BAD[from as usize..to as usize], "centimetres");
    assert_eq!(json["labels"][0]["message"], "unknown unit");
    assert!(json["help"].as_str().unwrap().starts_with("write `12 cm`"));
}

#[test]
fn columns_count_characters_also_after_a_degree_sign() {
    let text = "f(a: 5 °) then g(b: 3 furlongs)\n";
    let source = Source::new("x.task", text);
    let found = &parse(text).1[0];
    assert_eq!(source.line_column(found.span.from), (1, 23));
    assert_eq!(source.slice(found.span), "furlongs");
}
