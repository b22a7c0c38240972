//! A run as one table: the arm's recording, with the current step and the fluents as measured last.

use std::collections::BTreeSet;

use super::{Error, Material};

/// Returns the rows of `arm.csv` with `step` and `action` (empty between steps) and a column for each fluent: 1 or 0
/// as measured after the latest step that is over, empty where it is unknown.
///
/// # Errors
///
/// When `arm.csv` is no table.
pub fn table(material: &Material<'_>) -> Result<String, Error> {
    let steps = &material.run.steps;
    let names: BTreeSet<&str> = steps
        .iter()
        .flat_map(|step| step.fluents.iter().map(|fluent| fluent.name.as_str()))
        .collect();
    let mut reader = csv::Reader::from_reader(material.arm.as_bytes());
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut header = reader.headers()?.clone();
    for name in ["step", "action"].into_iter().chain(names.iter().copied()) {
        header.push_field(name);
    }
    writer.write_record(&header)?;
    for (n, record) in reader.records().enumerate() {
        let mut record = record?;
        let text = record.get(0).unwrap_or_default();
        let time: f64 =
            text.parse().map_err(|_| Error::Cell { line: n + 2, text: text.to_owned() })?;
        let under_way =
            steps.iter().find(|step| (step.interval_s[0]..=step.interval_s[1]).contains(&time));
        let last = steps.iter().rfind(|step| step.interval_s[1] <= time);
        record.push_field(&under_way.map(|step| step.number.to_string()).unwrap_or_default());
        record.push_field(under_way.map_or("", |step| &step.action));
        for name in &names {
            let row = last.and_then(|step| step.fluents.iter().find(|row| row.name == *name));
            record.push_field(match row.and_then(|row| row.measured) {
                Some(true) => "1",
                Some(false) => "0",
                None => "",
            });
        }
        writer.write_record(&record)?;
    }
    let bytes = writer.into_inner().map_err(|error| Error::Format(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| Error::Format(error.to_string()))
}
