//! The list of chunks at the end of a file: which entity, from when to when, and at which byte.
//!
//! A reader that wants a stretch of time reads the last 32 bytes ([`last`]), the list, and then those chunks only.
//!
//! Source: Rerun, `re_log_encoding`, `RrdManifest` and `StreamFooter`.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use arrow_array::{
    ArrayRef, BooleanArray, DurationNanosecondArray, FixedSizeBinaryArray, RecordBatch,
    StringArray, UInt64Array,
};
use arrow_ipc::writer::StreamWriter;
use arrow_schema::{ArrowError, DataType, Field, Schema};
use sha2::{Digest, Sha256};

use super::chunk::{data_field, name_field, stream, time, time_field};
use super::hash::xxh32;
use super::messages::{self, DataframePart, RrdFooter, RrdManifest, StoreId};
use super::{Component, MAGIC, TIMELINE};

/// What the end of a file is known by.
const FOOT: [u8; 4] = *b"FOOT";
/// Where the hash of a footer starts from: `StreamFooter::CRC_SEED`.
const SEED: u32 = 7_850_921;
/// The entity of what is known of the recording itself; the columns of its list are called otherwise.
const PROPERTIES: &str = "/__properties";

/// A chunk in the list.
#[derive(Debug, Clone, Default)]
pub(super) struct Indexed {
    pub(super) entity: String,
    pub(super) id: [u8; 16],
    /// The first and the last time, ns; nothing for what is at all times.
    pub(super) ends: Option<(i64, i64)>,
    pub(super) n_rows: u64,
    /// At which byte its message's body begins, and how long that is.
    pub(super) offset: u64,
    pub(super) size: u64,
    /// How long the stream of Arrow in it is, bytes.
    pub(super) payload: u64,
    pub(super) columns: Vec<(Component, DataType)>,
}

impl Indexed {
    fn has(&self, component: Component) -> bool {
        self.columns.iter().any(|(own, _)| *own == component)
    }
}

/// Returns the message that ends a recording.
pub(super) fn message(store: &StoreId, chunks: &[Indexed]) -> Result<RrdFooter, ArrowError> {
    let fields = fields(chunks);
    let manifest = RrdManifest {
        store_id: Some(store.clone()),
        sorbet_schema_sha256: Some(digest(&fields)?),
        sorbet_schema: Some(messages::Schema { arrow_schema: Some(opened(&fields)?) }),
        data: Some(DataframePart::plain(stream(&list(chunks)?)?)),
    };
    Ok(RrdFooter { manifests: vec![manifest] })
}

/// Returns the last bytes of a file: where the body of [`message`] begins, how long it is, and its hash.
pub(super) fn last(offset: u64, body: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend(offset.to_le_bytes());
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(xxh32(body, SEED).to_le_bytes());
    bytes.extend(MAGIC);
    bytes.extend(FOOT);
    // One list.
    bytes.extend(1_u32.to_le_bytes());
    bytes
}

/// Returns every column that the recording has.
fn fields(chunks: &[Indexed]) -> Vec<Field> {
    let mut columns: BTreeMap<String, Field> = BTreeMap::new();
    for chunk in chunks {
        let prefix = if chunk.entity == PROPERTIES { "property" } else { &chunk.entity };
        for (component, kind) in &chunk.columns {
            let name = format!("{prefix}:{}", component.name());
            let field = data_field(*component, name.clone(), kind);
            let mut metadata = field.metadata().clone();
            metadata.insert("rerun:entity_path".to_owned(), chunk.entity.clone());
            if chunk.ends.is_none() {
                metadata.insert("rerun:is_static".to_owned(), "true".to_owned());
            }
            columns.insert(name, field.with_metadata(metadata));
        }
    }
    let is_timed = chunks.iter().any(|chunk| chunk.ends.is_some());
    let times = is_timed.then(time_field);
    std::iter::once(name_field()).chain(times).chain(columns.into_values()).collect()
}

/// A stream of Arrow of which only the beginning is there: its columns.
fn opened(fields: &[Field]) -> Result<Vec<u8>, ArrowError> {
    let mut bytes = Vec::new();
    let writer = StreamWriter::try_new(&mut bytes, &Schema::new(fields.to_vec()))?;
    drop(writer);
    Ok(bytes)
}

/// SHA-256 of the columns in order.
fn digest(fields: &[Field]) -> Result<Vec<u8>, ArrowError> {
    let mut fields = fields.to_vec();
    fields.sort();
    Ok(Sha256::digest(opened(&fields)?).to_vec())
}

/// Returns the list as a table: a row for each chunk.
fn list(chunks: &[Indexed]) -> Result<RecordBatch, ArrowError> {
    let mut columns: Vec<(Field, ArrayRef)> = Vec::new();
    let mut put = |field: Field, array: ArrayRef| columns.push((field, array));
    let bare = |name: &str, kind| Field::new(name, kind, false);
    let entities = StringArray::from_iter_values(chunks.iter().map(|chunk| &chunk.entity));
    put(bare("chunk_entity_path", DataType::Utf8), Arc::new(entities));
    let ids = FixedSizeBinaryArray::try_from_iter(chunks.iter().map(|chunk| chunk.id))?;
    put(bare("chunk_id", DataType::FixedSizeBinary(16)), Arc::new(ids));
    let flags = |of: &dyn Fn(&Indexed) -> bool| -> ArrayRef {
        Arc::new(BooleanArray::from(chunks.iter().map(of).collect::<Vec<bool>>()))
    };
    let counts = |of: &dyn Fn(&Indexed) -> u64| -> ArrayRef {
        Arc::new(UInt64Array::from(chunks.iter().map(of).collect::<Vec<u64>>()))
    };
    let times = |of: &dyn Fn(&Indexed) -> Option<i64>| -> ArrayRef {
        Arc::new(DurationNanosecondArray::from(chunks.iter().map(of).collect::<Vec<_>>()))
    };
    put(bare("chunk_is_static", DataType::Boolean), flags(&|chunk| chunk.ends.is_none()));
    put(bare("chunk_num_rows", DataType::UInt64), counts(&|chunk| chunk.n_rows));
    put(bare("chunk_byte_offset", DataType::UInt64), counts(&|chunk| chunk.offset));
    put(bare("chunk_byte_size", DataType::UInt64), counts(&|chunk| chunk.size));
    let field = bare("chunk_byte_size_uncompressed", DataType::UInt64);
    put(field, counts(&|chunk| chunk.payload));
    for component in components(chunks, |_| true) {
        let field = index(Some(component), "rerun:static", "has_static_data");
        let field = field.with_data_type(DataType::Boolean).with_nullable(false);
        put(field, flags(&|chunk| chunk.ends.is_none() && chunk.has(component)));
    }
    if chunks.iter().any(|chunk| chunk.ends.is_some()) {
        put(index(None, TIMELINE, "start"), times(&|chunk| Some(chunk.ends?.0)));
        put(index(None, TIMELINE, "end"), times(&|chunk| Some(chunk.ends?.1)));
    }
    for component in components(chunks, |chunk| chunk.ends.is_some()) {
        let ends = |chunk: &Indexed| chunk.ends.filter(|_| chunk.has(component));
        let named = |what| index(Some(component), TIMELINE, what);
        put(named("start"), times(&|chunk| Some(ends(chunk)?.0)));
        put(named("end"), times(&|chunk| Some(ends(chunk)?.1)));
        let field = named("num_rows").with_data_type(DataType::UInt64);
        put(field, counts(&|chunk| ends(chunk).map_or(0, |_| chunk.n_rows)));
    }
    let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) = columns.into_iter().unzip();
    RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays)
}

/// Returns the components of some of the chunks.
fn components(chunks: &[Indexed], which: impl Fn(&Indexed) -> bool) -> BTreeSet<Component> {
    let chunks = chunks.iter().filter(|chunk| which(chunk));
    chunks.flat_map(|chunk| chunk.columns.iter().map(|(component, _)| *component)).collect()
}

/// A column of the list that is about a component, or about all, on an index: of times, unless it is said otherwise.
fn index(component: Option<Component>, index: &str, what: &str) -> Field {
    let timeline = (index == TIMELINE).then(|| TIMELINE.to_owned());
    let name = timeline
        .into_iter()
        .chain(component.map(|component| component.name()))
        .chain([what.to_owned()]);
    let name = name.collect::<Vec<String>>().join(":");
    let mut metadata = HashMap::from([("rerun:index".to_owned(), index.to_owned())]);
    if let Some(component) = component {
        metadata.extend(component.metadata());
    }
    Field::new(name, time(), true).with_metadata(metadata)
}
