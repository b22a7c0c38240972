//! The messages of an MCAP file, one after the other, without trusting what it says of itself.
//!
//! A chunk of kilobytes may unpack to terabytes, and a record may claim any length: what the chunks say they hold
//! is added up before anything is unpacked, and no record may be longer than a limit. Only schemas, channels and
//! messages are looked into.
//!
//! Source: the MCAP specification 0, "Records" and "Chunk".

use std::sync::Arc;

use mcap::parse_record;
use mcap::read::ChannelAccumulator;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{Channel, MAGIC, McapError};

/// Bytes of one record that are read; a large picture fits.
const LONGEST: usize = 128 << 20;
/// Bytes that all chunks together may unpack to.
const MOST_UNPACKED: u64 = 2 << 30;
/// What a record begins with: its kind and its length.
const PREFIX: usize = 9;

/// One message with what is known of its topic.
pub(super) struct Message<'a> {
    pub(super) channel: Arc<Channel<'static>>,
    pub(super) sequence: u32,
    /// When it was logged, ns.
    pub(super) log_time: u64,
    pub(super) data: &'a [u8],
}

/// Calls `each` for every message in the order of the file; its own errors end the reading.
///
/// # Errors
///
/// What is wrong with the file, in words, or what `each` returned.
pub(super) fn messages<E>(
    bytes: &[u8],
    broken: impl Fn(String) -> E,
    mut each: impl FnMut(Message<'_>) -> Result<(), E>,
) -> Result<(), E> {
    sizes(bytes).map_err(&broken)?;
    let wrong = |error: McapError| broken(error.to_string());
    let options = LinearReaderOptions::default().with_record_length_limit(LONGEST);
    let mut reader = LinearReader::new_with_options(options);
    let mut known = ChannelAccumulator::default();
    let mut rest = bytes;
    while let Some(event) = reader.next_event() {
        let (opcode, data) = match event.map_err(wrong)? {
            LinearReadEvent::ReadRequest(need) => {
                let (now, later) = rest.split_at(need.min(rest.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                rest = later;
                continue;
            }
            LinearReadEvent::Record { opcode, data } => (opcode, data),
        };
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            continue;
        }
        match parse_record(opcode, data).map_err(wrong)? {
            Record::Schema { header, data } => {
                known.add_schema(header, data.into_owned().into()).map_err(wrong)?;
            }
            Record::Channel(channel) => known.add_channel(channel).map_err(wrong)?,
            Record::Message { header, data } => {
                let channel = known.get(header.channel_id).ok_or_else(|| {
                    wrong(McapError::UnknownChannel(header.sequence, header.channel_id))
                })?;
                let (sequence, log_time) = (header.sequence, header.log_time);
                each(Message { channel, sequence, log_time, data: &data })?;
            }
            _ => {}
        }
    }
    Ok(())
}

/// Adds up what the chunks say they hold, and looks that the records of plain chunks end where their chunk does.
fn sizes(bytes: &[u8]) -> Result<(), String> {
    let mut total = 0_u64;
    for (opcode, body) in Records(bytes.get(MAGIC.len()..).unwrap_or_default()) {
        let Some(body) = body.filter(|_| opcode == op::CHUNK) else { continue };
        let Some((unpacked, compression, records)) = chunk(body) else {
            return Err("a chunk is shorter than its header".into());
        };
        total = total.saturating_add(unpacked);
        if total > MOST_UNPACKED {
            let most = MOST_UNPACKED >> 30;
            return Err(format!(
                "its chunks unpack to {total} bytes or more, and at most {most} GiB are read"
            ));
        }
        let is_plain = compression.is_empty();
        if is_plain && Records(records).any(|(_, body)| body.is_none()) {
            return Err("a record goes on beyond the end of its chunk".into());
        }
    }
    Ok(())
}

/// Returns the size unpacked, the compression and the records of a chunk.
fn chunk(body: &[u8]) -> Option<(u64, &[u8], &[u8])> {
    // Two times, the size unpacked, its check sum.
    let unpacked = u64::from_le_bytes(body.get(16..24)?.try_into().ok()?);
    let name = u32::from_le_bytes(body.get(28..32)?.try_into().ok()?) as usize;
    let after = body.get(32..)?;
    let (compression, after) = (after.get(..name)?, after.get(name..)?);
    let packed = u64::from_le_bytes(after.get(..8)?.try_into().ok()?);
    let records = after.get(8..)?;
    Some((unpacked, compression, records.get(..usize::try_from(packed).ok()?)?))
}

/// The records of a stretch of bytes: kind and body, `None` for one that is cut off, which is the last.
struct Records<'a>(&'a [u8]);

impl<'a> Iterator for Records<'a> {
    type Item = (u8, Option<&'a [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        let opcode = *self.0.first()?;
        let body = || {
            let len = u64::from_le_bytes(self.0.get(1..PREFIX)?.try_into().ok()?);
            let end = PREFIX.checked_add(usize::try_from(len).ok()?)?;
            Some((self.0.get(PREFIX..end)?, &self.0[end..]))
        };
        let found = body();
        self.0 = found.map_or(&[], |(_, rest)| rest);
        Some((opcode, found.map(|(body, _)| body)))
    }
}
