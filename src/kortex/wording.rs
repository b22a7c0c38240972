//! What an arm in fault says, where its tables have no words for it.

/// A fault, by its bit, that is not in the tables.
pub(super) fn unknown_fault(bit: u32) -> String {
    format!("fault {bit:#010x}, which this program does not know")
}
