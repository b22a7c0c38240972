//! Columns of an array, as programs in C++ name them: `q[0]` to `q[6]`, `tau_J[0]`. Their index is no unit.

use std::collections::{BTreeMap, BTreeSet};

/// A column of an array: `q[0]`, `q[0] [rad]`.
pub(super) struct Element<'h> {
    /// The array's name: `q`.
    pub(super) stem: &'h str,
    /// As written.
    pub(super) index: usize,
    /// The unit behind the index.
    pub(super) unit: Option<&'h str>,
}

impl<'h> Element<'h> {
    /// Reads a header, `None` for one that is no element's.
    pub(super) fn read(header: &'h str) -> Option<Self> {
        let (stem, rest) = header.split_once('[')?;
        let (index, rest) = rest.split_once(']')?;
        let (stem, index, rest) = (stem.trim(), index.trim(), rest.trim());
        let is_index = !stem.is_empty() && index.chars().all(|c| c.is_ascii_digit());
        let index = index.parse::<usize>().ok().filter(|_| is_index)?;
        let unit = match rest {
            "" => None,
            rest => Some(rest.strip_prefix('[')?.strip_suffix(']')?),
        };
        Some(Self { stem, index, unit })
    }

    /// Returns its name without a unit.
    pub(super) fn name(&self) -> String {
        format!("{}[{}]", self.stem, self.index)
    }
}

/// The arrays of a table, each with its indices.
pub(super) struct Arrays<'h>(BTreeMap<&'h str, BTreeSet<usize>>);

impl<'h> Arrays<'h> {
    /// Finds them among the headers.
    pub(super) fn among(headers: &'h [String]) -> Self {
        let mut found: BTreeMap<&str, BTreeSet<usize>> = BTreeMap::new();
        for element in headers.iter().filter_map(|header| Element::read(header)) {
            found.entry(element.stem).or_default().insert(element.index);
        }
        Self(found)
    }

    /// Returns the element that a header names, and its number from 1 where none of its array is missing, counted from 0 or 1.
    pub(super) fn element(&self, header: &'h str) -> Option<(Element<'h>, Option<usize>)> {
        let element = Element::read(header)?;
        let indices = self.0.get(element.stem)?;
        let (first, last) = (*indices.first()?, *indices.last()?);
        // By itself it is the unit of a plain number.
        if element.unit.is_none() && (first, last) == (1, 1) {
            return None;
        }
        let is_whole = first <= 1 && last - first == indices.len() - 1;
        let number = is_whole.then(|| element.index - first + 1);
        Some((element, number))
    }
}
