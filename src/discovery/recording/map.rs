//! `--map THEIRS=OURS,…`: what a column is to be called, and the unit its header lacks.

use crate::units::{self, Unit};

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

    /// Returns whether a header is renamed.
    pub(in crate::discovery) fn knows(&self, header: &str) -> bool {
        self.entries.iter().any(|entry| entry.theirs == header.trim())
    }

    /// Returns the first of their names that no header has.
    pub(in crate::discovery) fn unused(&self, headers: &[String]) -> Option<&str> {
        let name = |header: &str| header.split('[').next().unwrap_or_default().trim().to_owned();
        self.entries
            .iter()
            .find(|e| !headers.iter().any(|h| h.trim() == e.theirs || name(h) == e.theirs))
            .map(|entry| entry.theirs.as_str())
    }
}
