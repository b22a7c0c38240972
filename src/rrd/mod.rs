//! Rows of values with times → an RRD file, which Rerun opens. It knows no run.
//!
//! An RRD file is a header, messages and a footer. The first message names the recording; every other one is a chunk:
//! rows of one entity as a table of Arrow, with the columns that Rerun's archetypes ask for ([`column`]) and one column
//! of times. The last message lists the chunks and what is where in time (`footer`), so that a reader need not read
//! all. Nothing is compressed: pictures are already, and the rest is small. Only one timeline is written, and no
//! layout of views.
//!
//! Source: Rerun 0.41 (what its SDK writes, and `re_log_encoding` and `re_sorbet` of 0.37).

mod chunk;
mod column;
mod footer;
mod hash;
pub mod messages;

use arrow_schema::ArrowError;
use prost::Message;

pub use column::{Component, Items, STEP_AFTER, Z_UP};

use chunk::Chunk;
use footer::Indexed;
use messages::{ArrowMsg, SetStoreInfo, StoreId, StoreInfo, StoreSource, StoreVersion, Tuid};

/// What a file begins with.
pub const MAGIC: [u8; 4] = *b"RRF2";
/// The version of Rerun whose format this is: major, minor, patch, and nothing for a release.
pub const VERSION: [u8; 4] = [0, 41, 0, 0];
/// No compression, messages as protobuf, and two bytes that are not used.
const OPTIONS: [u8; 4] = [0, 2, 0, 0];
/// The version of the columns' metadata that Rerun 0.41 writes.
const SORBET: &str = "0.1.4";
/// The name of the only timeline: the arm's own clock.
pub const TIMELINE: &str = "arm_time";

/// What a message is: the end, of which the body is the footer.
pub const END: u64 = 0;
/// As [`END`]: the recording's name.
pub const STORE: u64 = 1;
/// As [`END`]: a chunk.
pub const CHUNK: u64 = 2;

/// Why a file cannot be put together.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A column has not the same number of items for every row.
    #[error("{entity}: {items} items in {rows} rows")]
    Uneven {
        /// The entity.
        entity: String,
        /// How many items the column has.
        items: usize,
        /// How many rows there are.
        rows: usize,
    },
    /// A chunk has more than a column can count.
    #[error("{0}: more than 2 GiB in one chunk")]
    TooLong(String),
    /// Arrow refuses it.
    #[error(transparent)]
    Arrow(#[from] ArrowError),
}

/// A file being made.
#[derive(Debug)]
pub struct Recording {
    store: StoreId,
    /// The next part of a row's or chunk's name.
    next: u64,
    bytes: Vec<u8>,
    chunks: Vec<Indexed>,
}

impl Recording {
    /// A recording of that `id`, which is no other recording's, by an application; `source` says what wrote it.
    ///
    /// The names of rows and chunks follow from `seed`, of which recordings that are looked at together have different ones.
    pub fn new(application: &str, id: &str, source: &str, seed: u64) -> Self {
        let store = StoreId::recording(application, id);
        // Room for every row to have its own number above it.
        let mut file = Self { store, next: seed >> 1, bytes: Vec::new(), chunks: Vec::new() };
        for part in [MAGIC, VERSION, OPTIONS] {
            file.bytes.extend(part);
        }
        let info = StoreInfo {
            store_id: Some(file.store.clone()),
            store_source: Some(StoreSource::other(source)),
            store_version: Some(StoreVersion::of(VERSION)),
        };
        let body = SetStoreInfo { row_id: Some(file.name()), info: Some(info) }.encode_to_vec();
        file.message(STORE, &body);
        file
    }

    /// A name that nothing else in the file has.
    fn name(&mut self) -> Tuid {
        self.next += 1;
        Tuid::numbered(self.next)
    }

    fn message(&mut self, kind: u64, body: &[u8]) {
        self.bytes.extend(kind.to_le_bytes());
        self.bytes.extend((body.len() as u64).to_le_bytes());
        self.bytes.extend(body);
    }

    /// Adds rows of an entity, of which `times` are the times in ns; the columns have equally many items for each.
    ///
    /// Nothing is written for no rows.
    ///
    /// # Errors
    ///
    /// [`Error::Uneven`] and [`Error::TooLong`].
    pub fn add(
        &mut self,
        entity: &str,
        times: &[i64],
        columns: Vec<(Component, Items)>,
    ) -> Result<(), Error> {
        if times.is_empty() { Ok(()) } else { self.put(entity, Some(times), columns) }
    }

    /// Adds what an entity is at all times: one row.
    ///
    /// # Errors
    ///
    /// As [`Self::add`].
    pub fn always(&mut self, entity: &str, columns: Vec<(Component, Items)>) -> Result<(), Error> {
        self.put(entity, None, columns)
    }

    fn put(
        &mut self,
        entity: &str,
        times: Option<&[i64]>,
        columns: Vec<(Component, Items)>,
    ) -> Result<(), Error> {
        let id = self.name();
        let n_rows = times.map_or(1, <[i64]>::len);
        let rows: Vec<Tuid> = (0..n_rows).map(|_| self.name()).collect();
        let chunk = Chunk::new(entity, &id, &rows, times, columns)?;
        let payload = chunk.encode()?;
        let mut index = chunk.index(&id, times, n_rows as u64, payload.len() as u64);
        let body = ArrowMsg {
            store_id: Some(self.store.clone()),
            compression: messages::NO_COMPRESSION,
            uncompressed_size: payload.len() as u64,
            encoding: messages::ARROW_IPC,
            payload,
            chunk_id: Some(id),
            is_static: Some(times.is_none()),
        }
        .encode_to_vec();
        self.message(CHUNK, &body);
        index.size = body.len() as u64;
        index.offset = self.bytes.len() as u64 - index.size;
        self.chunks.push(index);
        Ok(())
    }

    /// Returns the file.
    ///
    /// # Errors
    ///
    /// [`Error::Arrow`], when the list of chunks cannot be put together.
    pub fn finish(mut self) -> Result<Vec<u8>, Error> {
        let body = footer::message(&self.store, &self.chunks)?.encode_to_vec();
        self.message(END, &body);
        let offset = self.bytes.len() as u64 - body.len() as u64;
        self.bytes.extend(footer::last(offset, &body));
        Ok(self.bytes)
    }
}

/// Returns the path of an entity, as Rerun spells it: what is no letter, digit, `_`, `-` or `.` behind a backslash.
///
/// ```
/// assert_eq!(trueup::rrd::path(&["scene", "my cup"]), r"/scene/my\ cup");
/// ```
pub fn path(parts: &[&str]) -> String {
    let mut path = String::new();
    for part in parts {
        path.push('/');
        for letter in part.chars() {
            if letter.is_ascii_punctuation() && !"_-.".contains(letter) || letter == ' ' {
                path.push('\\');
            }
            // What cannot be seen has no place in a name.
            path.push(if letter.is_control() { '_' } else { letter });
        }
    }
    path
}
