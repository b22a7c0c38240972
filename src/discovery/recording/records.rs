//! The messages and the metadata of an MCAP file, one after the other, without trusting what it says of itself.
//!
//! A chunk of kilobytes may unpack to terabytes, and a record may claim any length: what the chunks say they hold
//! is added up before anything is unpacked, and no record may be longer than a limit. Only schemas, channels,
//! messages and metadata are looked into.
//!
//! Source: the MCAP specification 0, "Records" and "Chunk".

use std::sync::Arc;

use mcap::parse_record;
use mcap::read::ChannelAccumulator;
use mcap::records::{Metadata, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{Channel, MAGIC, McapError};

use super::BrokenBag;

/// Bytes of one record that are read; a large picture fits.
const LONGEST: usize = 128 << 20;
/// Bytes that all chunks together may unpack to.
const MOST_UNPACKED: u64 = 2 << 30;
/// Records of a file: an hour of a hundred topics at 50 Hz.
const MOST_RECORDS: usize = 20_000_000;
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

/// What a file holds that is looked into.
pub(super) enum Item<'a> {
    Message(Message<'a>),
    /// What is told of the file, under a name.
    Metadata(Metadata),
}

/// Calls `each` for every item in the order of the file; its own errors end the reading.
///
/// # Errors
///
/// What is wrong with the file, or what `each` returned.
pub(super) fn items<E>(
    bytes: &[u8],
    broken: impl Fn(BrokenBag) -> E,
    mut each: impl FnMut(Item<'_>) -> Result<(), E>,
) -> Result<(), E> {
    sizes(bytes).map_err(&broken)?;
    let wrong = |error: McapError| broken(BrokenBag::Unread(error.to_string()));
    let options = LinearReaderOptions::default().with_record_length_limit(LONGEST);
    let mut reader = LinearReader::new_with_options(options);
    let mut known = ChannelAccumulator::default();
    let mut rest = bytes;
    let mut n_records = 0;
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
        n_records += 1;
        if n_records > MOST_RECORDS {
            return Err(broken(BrokenBag::TooManyRecords(MOST_RECORDS)));
        }
        if opcode == op::METADATA {
            // Anybody may tell anything of a file; what is broken tells nothing.
            if let Ok(Record::Metadata(metadata)) = parse_record(opcode, data) {
                each(Item::Metadata(metadata))?;
            }
            continue;
        }
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
                each(Item::Message(Message { channel, sequence, log_time, data: &data }))?;
            }
            _ => {}
        }
    }
    Ok(())
}

/// Adds up what the chunks say they hold, and looks that the records of plain chunks end where their chunk does.
fn sizes(bytes: &[u8]) -> Result<(), BrokenBag> {
    let mut total = 0_u64;
    for (opcode, body) in Records(bytes.get(MAGIC.len()..).unwrap_or_default()) {
        let Some(body) = body.filter(|_| opcode == op::CHUNK) else { continue };
        let Some((unpacked, compression, records)) = chunk(body) else {
            return Err(BrokenBag::ShortChunk);
        };
        total = total.saturating_add(unpacked);
        if total > MOST_UNPACKED {
            return Err(BrokenBag::Unpacks { total, most: MOST_UNPACKED });
        }
        let is_plain = compression.is_empty();
        if is_plain && Records(records).any(|(_, body)| body.is_none()) {
            return Err(BrokenBag::BeyondChunk);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
        [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
    }

    fn chunk_of(unpacked: u64, compression: &str, packed: &[u8]) -> Vec<u8> {
        let mut body = vec![0; 16];
        body.extend(unpacked.to_le_bytes());
        body.extend([0; 4]);
        body.extend((compression.len() as u32).to_le_bytes());
        body.extend(compression.as_bytes());
        body.extend((packed.len() as u64).to_le_bytes());
        body.extend(packed);
        record(op::CHUNK, &body)
    }

    fn read(records: &[Vec<u8>]) -> Result<(), BrokenBag> {
        let mut file = MAGIC.to_vec();
        file.extend(record(op::HEADER, &[0; 8]));
        file.extend(records.concat());
        file.extend(record(op::DATA_END, &[0; 4]));
        file.extend(record(op::FOOTER, &[0; 20]));
        file.extend(MAGIC);
        items(&file, |flaw| flaw, |_| Ok(()))
    }

    /// A frame of zeros, 128 KiB from every four bytes, after `head`.
    fn zeros(head: &[u8], blocks: usize) -> Vec<u8> {
        let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0, 0x58];
        let block = |size: usize, kind: usize, last: bool| {
            ((size << 3) | (kind << 1) | usize::from(last)).to_le_bytes()[..3].to_vec()
        };
        frame.extend(block(head.len(), 0, false));
        frame.extend(head);
        for i in 0..blocks {
            frame.extend(block(1 << 17, 1, i + 1 == blocks));
            frame.push(0);
        }
        frame
    }

    #[test]
    fn a_chunk_that_says_it_holds_gigabytes_is_refused_before_it_is_unpacked() {
        let unpacks = |total: u64| BrokenBag::Unpacks { total, most: 2 << 30 };
        assert_eq!(read(&[chunk_of(64 << 30, "zstd", b"no frame")]), Err(unpacks(64 << 30)));
        let half = chunk_of(3 << 29, "zstd", b"");
        assert_eq!(read(&[half.clone(), half]), Err(unpacks(3 << 30)));
    }

    #[test]
    fn a_chunk_that_says_less_than_it_holds_is_not_followed() {
        // One record of a terabyte, of which the frame holds the first gigabyte.
        let head = [&[0x80][..], &(1_u64 << 40).to_le_bytes()].concat();
        for said in [1000, 1 << 30] {
            let error = read(&[chunk_of(said, "zstd", &zeros(&head, 8192))]).unwrap_err();
            assert!(!error.to_string().is_empty());
        }
    }

    #[test]
    fn records_that_end_nowhere_are_told() {
        let long = [&[5][..], &1000_u64.to_le_bytes(), b"short"].concat();
        assert_eq!(read(&[chunk_of(14, "", &long)]), Err(BrokenBag::BeyondChunk));
        assert_eq!(read(&[record(op::CHUNK, b"short")]), Err(BrokenBag::ShortChunk));
        let endless = [MAGIC, &[5], &(1_u64 << 60).to_le_bytes()].concat();
        assert!(items(&endless, |flaw| flaw, |_| Ok(())).is_err());
        // What is no message is not looked into, however broken.
        let others = [op::ATTACHMENT, op::STATISTICS, op::METADATA];
        assert_eq!(read(&others.map(|other| record(other, b""))), Ok(()));
        assert_eq!(read(&[]), Ok(()));
    }
}
