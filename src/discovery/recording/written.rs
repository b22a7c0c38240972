//! How the text of a table is written: what parts its cells, and what stands for a decimal point.

use std::borrow::Cow;

use super::sheet::MOST_COLUMNS;

/// A table's text and how it is written.
pub(super) struct Written<'t> {
    /// As it came; of cells parted by spaces with a tab for all that are between two of them.
    pub(super) text: Cow<'t, str>,
    /// What stands between two cells.
    pub(super) delimiter: u8,
    /// Whether a comma stands where others write a point.
    pub(super) has_decimal_commas: bool,
}

/// A line of a table whose cells are parted by spaces that has more or fewer than the header.
pub(super) struct Uneven {
    /// From 1.
    pub(super) line: usize,
    /// Its cells.
    pub(super) cells: usize,
    /// The header's.
    pub(super) columns: usize,
}

impl<'t> Written<'t> {
    /// Commas stand between cells where the header has some, else semicolons, else tabs, else whatever space there is between
    /// words: then of every line as much. Beside other signs than commas these stand for points where no cell has a point: a
    /// table with both is read as it stands.
    pub(super) fn of(text: &'t str) -> Result<Self, Uneven> {
        let mut lines = text.lines().enumerate().filter(|(_, line)| is_row(line));
        let (_, header) = lines.next().unwrap_or_default();
        let is_tabbed = |line: &str| line.contains('\t');
        let first = lines.clone().next().map_or(header, |(_, line)| line);
        let are_named = |cells: &str| cells.split('\t').all(|cell| !cell.trim().is_empty());
        let delimiter = if header.contains(',') {
            b','
        } else if header.contains(';') {
            b';'
        } else if are_named(header) && is_tabbed(header) && is_tabbed(first) {
            b'\t'
        } else {
            let columns = names(header).len();
            let is_number = |word: &str| word.replace(',', ".").parse::<f64>().is_ok();
            let are_numbers =
                |line: &str| line.split_whitespace().filter(|word| is_number(word)).count() > 1;
            // A line of units may come first.
            if columns < 2 || !lines.clone().take(2).any(|(_, line)| are_numbers(line)) {
                b','
            } else {
                let cells = |(at, line): (usize, &str)| (at + 1, line.split_whitespace().count());
                return match lines.clone().map(cells).find(|(_, cells)| *cells != columns) {
                    Some((line, cells)) => Err(Uneven { line, cells, columns }),
                    None => Ok(Self {
                        text: Cow::Owned(with_tabs(text)),
                        delimiter: b'\t',
                        has_decimal_commas: !lines.any(|(_, line)| line.contains('.')),
                    }),
                };
            }
        };
        let has_decimal_commas = delimiter != b',' && !lines.any(|(_, line)| line.contains('.'));
        Ok(Self { text: Cow::Borrowed(text), delimiter, has_decimal_commas })
    }
}

/// Returns whether a line is neither blank nor a remark.
fn is_row(line: &str) -> bool {
    let line = line.trim_start();
    !line.is_empty() && !line.starts_with('#')
}

/// Returns the names of a header whose cells are parted by spaces; a unit may stand apart: `t [s]`.
fn names(header: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    // One more tells that they are too many.
    for word in header.split_whitespace().take(MOST_COLUMNS + 1) {
        match names.last_mut().filter(|_| word.starts_with('[')) {
            Some(name) => name.push_str(word),
            None => names.push(word.to_owned()),
        }
    }
    names
}

/// Writes a tab between two cells that are parted by spaces, line by line.
fn with_tabs(text: &str) -> String {
    let mut tabbed = String::with_capacity(text.len());
    let mut is_header = true;
    for line in text.lines() {
        if is_row(line) && std::mem::take(&mut is_header) {
            tabbed.push_str(&names(line).join("\t"));
        } else {
            for (at, word) in line.split_whitespace().enumerate() {
                if at > 0 {
                    tabbed.push('\t');
                }
                tabbed.push_str(word);
            }
        }
        tabbed.push('\n');
    }
    tabbed
}
