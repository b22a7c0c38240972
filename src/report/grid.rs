//! A table of words, in the three forms it is asked for: lines, Markdown, CSV.

use std::fmt::Write as _;

/// In which form a table is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Columns for people.
    Text,
    /// A Markdown table.
    Markdown,
    /// Comma-separated values.
    Csv,
}

/// A head and rows as long as it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Grid {
    /// The names of the columns.
    pub head: Vec<String>,
    /// The cells.
    pub rows: Vec<Vec<String>>,
    /// How many columns from the left hold words; the others hold numbers and stand at the right.
    pub words: usize,
}

impl Grid {
    /// A table with these columns, the first `words` of them words.
    pub fn new(words: usize, head: &[&str]) -> Self {
        Self { head: head.iter().map(ToString::to_string).collect(), rows: Vec::new(), words }
    }

    /// Returns it in a form.
    pub fn form(&self, form: Form) -> String {
        match form {
            Form::Text => self.text(),
            Form::Markdown => self.markdown(),
            Form::Csv => self.csv(),
        }
    }

    fn text(&self) -> String {
        let lines = || std::iter::once(&self.head).chain(&self.rows);
        let width = |column: usize| {
            lines().filter_map(|line| line.get(column)).map(|cell| cell.chars().count()).max()
        };
        let widths: Vec<usize> = (0..self.head.len()).map(|i| width(i).unwrap_or(0)).collect();
        let mut text = String::new();
        for line in lines() {
            let mut row = String::new();
            for (i, (cell, width)) in line.iter().zip(&widths).enumerate() {
                let gap = if i == 0 { "" } else { "  " };
                let _ = if i < self.words {
                    write!(row, "{gap}{cell:<width$}")
                } else {
                    write!(row, "{gap}{cell:>width$}")
                };
            }
            text.push_str(row.trim_end());
            text.push('\n');
        }
        text.trim_end().to_owned()
    }

    fn markdown(&self) -> String {
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
            format!("| {} |", cells.join(" | "))
        };
        let rule: Vec<&str> =
            (0..self.head.len()).map(|i| if i < self.words { "---" } else { "---:" }).collect();
        let mut lines = vec![line(&self.head), format!("| {} |", rule.join(" | "))];
        lines.extend(self.rows.iter().map(|row| line(row)));
        lines.join("\n")
    }

    fn csv(&self) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for line in std::iter::once(&self.head).chain(&self.rows) {
            writer
                .write_record(line)
                .expect("memory can be written, and rows are as long as the head");
        }
        let bytes = writer.into_inner().expect("memory can be written");
        String::from_utf8_lossy(&bytes).trim_end().to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_forms_say_the_same() {
        let mut grid = Grid::new(1, &["way", "n"]);
        grid.rows.push(vec!["all, or \"none\" | é".into(), "20".into()]);
        grid.rows.push(vec!["b".into(), "3".into()]);
        assert_eq!(
            grid.form(Form::Text),
            "way                  n\nall, or \"none\" | é  20\nb                    3"
        );
        assert_eq!(
            grid.form(Form::Markdown),
            "| way | n |\n| --- | ---: |\n| all, or \"none\" \\| é | 20 |\n| b | 3 |"
        );
        assert_eq!(grid.form(Form::Csv), "way,n\n\"all, or \"\"none\"\" | é\",20\nb,3");
    }
}
