//! A chunk: rows of one entity as a table of Arrow, each with its name and its time.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::{Array, ArrayRef, DurationNanosecondArray, FixedSizeBinaryArray, RecordBatch};
use arrow_ipc::writer::StreamWriter;
use arrow_schema::{ArrowError, DataType, Field, Schema, TimeUnit};

use super::footer::Indexed;
use super::messages::Tuid;
use super::{Component, Error, Items, SORBET, TIMELINE};

/// How long a row's name is, bytes.
const NAME: i32 = 16;

/// A chunk.
pub(super) struct Chunk {
    entity: String,
    columns: Vec<(Component, DataType)>,
    batch: RecordBatch,
}

impl Chunk {
    /// A chunk of that name, of rows of those names.
    pub(super) fn new(
        entity: &str,
        id: &Tuid,
        rows: &[Tuid],
        times: Option<&[i64]>,
        columns: Vec<(Component, Items)>,
    ) -> Result<Self, Error> {
        let names = rows.iter().map(Tuid::bytes);
        let mut fields = vec![marked(name_field(), true)];
        let mut arrays: Vec<ArrayRef> = vec![Arc::new(FixedSizeBinaryArray::try_from_iter(names)?)];
        if let Some(times) = times {
            fields.push(marked(time_field(), times.is_sorted()));
            arrays.push(Arc::new(DurationNanosecondArray::from(times.to_vec())));
        }
        let mut kinds = Vec::new();
        for (component, items) in columns {
            if items.len() % rows.len() != 0 {
                let entity = entity.to_owned();
                return Err(Error::Uneven { entity, items: items.len(), rows: rows.len() });
            }
            if i32::try_from(items.bytes()).is_err() {
                return Err(Error::TooLong(entity.to_owned()));
            }
            let array = items.rows(rows.len())?;
            fields.push(data_field(component, component.name(), array.data_type()));
            kinds.push((component, array.data_type().clone()));
            arrays.push(Arc::new(array));
        }
        let metadata = [
            ("rerun:entity_path", entity.to_owned()),
            ("rerun:id", format!("chunk_{:016X}{:016x}", id.time_ns(), id.inc())),
            ("sorbet:version", SORBET.to_owned()),
        ];
        let metadata = metadata.map(|(key, value)| (key.to_owned(), value));
        let schema = Schema::new_with_metadata(fields, HashMap::from(metadata));
        let batch = RecordBatch::try_new(Arc::new(schema), arrays)?;
        Ok(Self { entity: entity.to_owned(), columns: kinds, batch })
    }

    /// Returns it as a stream of Arrow.
    pub(super) fn encode(&self) -> Result<Vec<u8>, ArrowError> {
        stream(&self.batch)
    }

    /// Returns what the list of chunks says of it, except where it is.
    pub(super) fn index(
        &self,
        id: &Tuid,
        times: Option<&[i64]>,
        n_rows: u64,
        payload: u64,
    ) -> Indexed {
        let ends = times.and_then(|times| Some((*times.iter().min()?, *times.iter().max()?)));
        Indexed {
            entity: self.entity.clone(),
            id: id.bytes(),
            ends,
            n_rows,
            payload,
            columns: self.columns.clone(),
            ..Indexed::default()
        }
    }
}

/// Returns a table as a stream of Arrow.
pub(super) fn stream(batch: &RecordBatch) -> Result<Vec<u8>, ArrowError> {
    let mut bytes = Vec::new();
    let mut writer = StreamWriter::try_new(&mut bytes, &batch.schema())?;
    writer.write(batch)?;
    writer.finish()?;
    drop(writer);
    Ok(bytes)
}

/// The column of the rows' names.
pub(super) fn name_field() -> Field {
    let metadata = [
        ("rerun:kind", "control"),
        ("ARROW:extension:name", "rerun.datatypes.TUID"),
        ("ARROW:extension:metadata", r#"{"namespace":"row"}"#),
    ];
    field("rerun.controls.RowId", DataType::FixedSizeBinary(NAME), false, metadata)
}

/// The column of the times.
pub(super) fn time_field() -> Field {
    let metadata = [("rerun:kind", "index"), ("rerun:index_name", TIMELINE)];
    field(TIMELINE, time(), true, metadata)
}

/// The type of times.
pub(super) fn time() -> DataType {
    DataType::Duration(TimeUnit::Nanosecond)
}

/// A column of what an entity is.
pub(super) fn data_field(component: Component, name: String, kind: &DataType) -> Field {
    let mut metadata = HashMap::from(component.metadata());
    metadata.insert("rerun:kind".to_owned(), "data".to_owned());
    Field::new(name, kind.clone(), true).with_metadata(metadata)
}

fn field<const N: usize>(
    name: &str,
    kind: DataType,
    may_be_absent: bool,
    metadata: [(&str, &str); N],
) -> Field {
    let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned()));
    Field::new(name, kind, may_be_absent).with_metadata(HashMap::from(metadata))
}

/// The same column, known to be in order where it is.
fn marked(field: Field, is_sorted: bool) -> Field {
    let mut metadata = field.metadata().clone();
    if is_sorted {
        metadata.insert("rerun:is_sorted".to_owned(), "true".to_owned());
    }
    field.with_metadata(metadata)
}
