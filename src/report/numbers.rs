//! An answer that is numbers, as lines for people: the keys of the JSON document with their units.

use std::fmt::Write as _;

use serde_json::Value;

/// Returns one line a value: lists of numbers on one line, lists of things numbered from 1.
pub(super) fn lines(value: &Value) -> String {
    let mut text = String::new();
    write(value, 0, &mut text);
    text
}

fn write(value: &Value, depth: usize, text: &mut String) {
    let indent = "  ".repeat(depth);
    let Value::Object(map) = value else {
        let _ = writeln!(text, "{indent}{}", inline(value));
        return;
    };
    for (key, value) in map {
        match value {
            Value::Null => {}
            Value::Array(items) if items.iter().any(Value::is_object) => {
                for (i, item) in items.iter().enumerate() {
                    let _ = writeln!(text, "{indent}{key} {}", i + 1);
                    write(item, depth + 1, text);
                }
            }
            Value::Array(rows) if rows.iter().any(Value::is_array) => {
                let _ = writeln!(text, "{indent}{key}");
                for row in rows {
                    let _ = writeln!(text, "{indent}  {}", inline(row));
                }
            }
            Value::Object(_) => {
                let _ = writeln!(text, "{indent}{key}");
                write(value, depth + 1, text);
            }
            plain => {
                let _ = writeln!(text, "{indent}{key:<20} {}", inline(plain));
            }
        }
    }
}

fn inline(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Number(number) => match number.as_f64() {
            Some(x) if number.is_f64() => format!("{x:>12.6}"),
            _ => number.to_string(),
        },
        Value::Array(items) => items.iter().map(inline).collect::<Vec<_>>().join(" "),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn matrices_stand_in_rows_and_things_are_numbered() {
        let answer = json!({"model": "rigid", "D": [[1.0, 0.0], [0.0, 1.0]], "views": [{"k": 2}]});
        assert_eq!(
            lines(&answer),
            "D\n      1.000000     0.000000\n      0.000000     1.000000\nmodel                rigid\n\
             views 1\n  k                    2\n"
        );
    }
}
