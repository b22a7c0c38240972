//! `--map THEIRS=OURS,…`: what a column is to be called, or all columns of an array, and the unit their headers lack.

use crate::units::{self, Unit};

use super::arrays::Element;
use super::{Error, Flaw, MapFlaw};

/// One renamed column.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    theirs: String,
    ours: String,
    unit: Option<Unit>,
}

/// Renamings of columns.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Map {
    entries: Vec<Entry>,
}

impl Map {
    /// Reads `t_s=t[s],u_pump_V=u[V]`: their name, ours, and the unit if the header lacks it.
    ///
    /// # Errors
    ///
    /// An [`Error`] for a part without `=`, a unit that does not exist, or a name given twice.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let mut entries: Vec<Entry> = Vec::new();
        for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            let wrong = |flaw: MapFlaw| Flaw::Map(flaw).at("--map");
            let (theirs, ours) =
                part.split_once('=').ok_or_else(|| wrong(MapFlaw::Unnamed(part.to_owned())))?;
            let column =
                units::parse_column(ours).map_err(|error| wrong(MapFlaw::Header(error)))?;
            let entry =
                Entry { theirs: theirs.trim().into(), ours: column.name, unit: column.unit };
            if entries.iter().any(|e| e.theirs == entry.theirs || e.ours == entry.ours) {
                return Err(wrong(MapFlaw::Twice(part.to_owned())));
            }
            entries.push(entry);
        }
        Ok(Self { entries })
    }

    /// Returns the name and unit that a header stands for. `theirs` may be the whole header or its name
    /// without the unit; a unit in the map wins over one in the header.
    pub(in crate::discovery) fn apply(
        &self,
        header: &str,
        column: units::Column,
    ) -> (units::Column, bool) {
        let header = header.trim();
        match self.entries.iter().find(|e| e.theirs == header || e.theirs == column.name) {
            Some(entry) => {
                let unit = entry.unit.or(column.unit);
                (units::Column { name: entry.ours.clone(), unit }, true)
            }
            None => (column, false),
        }
    }

    /// The same for an element of an array, `unit` that of its header: `q[0]=q_1` renames it by itself, `tau_J=tau` with all others.
    /// Its number from 1 stands behind its name, else the index as written.
    pub(super) fn of_element(
        &self,
        header: &str,
        (element, number): (&Element<'_>, Option<usize>),
        unit: Option<Unit>,
    ) -> units::Column {
        let of = |stem: &str| match number {
            Some(number) => format!("{stem}_{number}"),
            None => format!("{stem}[{}]", element.index),
        };
        let (header, name) = (header.trim(), element.name());
        let own = self.entries.iter().find(|e| e.theirs == header || e.theirs == name);
        if let Some(entry) = own {
            return units::Column { name: entry.ours.clone(), unit: entry.unit.or(unit) };
        }
        match self.entries.iter().find(|e| e.theirs == element.stem) {
            Some(entry) => units::Column { name: of(&entry.ours), unit: entry.unit.or(unit) },
            None => units::Column { name: of(element.stem), unit },
        }
    }

    /// Returns whether a header is renamed.
    pub(in crate::discovery) fn knows(&self, header: &str) -> bool {
        self.entries.iter().any(|entry| entry.theirs == header.trim())
    }

    /// Returns the first of their names that no header has.
    pub(in crate::discovery) fn unused(&self, headers: &[String]) -> Option<&str> {
        let name = |header: &str| header.split('[').next().unwrap_or_default().trim().to_owned();
        let is_of = |h: &String, theirs: &str| {
            let element = || Element::read(h).is_some_and(|element| element.name() == theirs);
            h.trim() == theirs || name(h) == theirs || element()
        };
        self.entries
            .iter()
            .find(|e| !headers.iter().any(|h| is_of(h, &e.theirs)))
            .map(|entry| entry.theirs.as_str())
    }
}
