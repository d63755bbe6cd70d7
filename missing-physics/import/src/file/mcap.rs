//! MCAP, and ROS 2's bags in it: a table for each topic whose messages hold numbers.

use std::collections::{BTreeMap, HashMap};
use std::io::Read;
use std::path::Path;

use mcap::records::{ChunkHeader, MessageHeader, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::opened;
use super::ros::{Contents, Encoding, Schema};
use crate::error::{ImportError, one_line};
use crate::table::{Column, Table, Values};

/// A single record, or what a chunk is unpacked to, is no larger.
const LARGEST_RECORD: usize = 512 << 20;
/// Numbers of a whole bag.
const MOST_CELLS: usize = 40_000_000;
/// Stamps further from the time of logging than this (ns) are of another clock.
const SAME_CLOCK: i128 = 3_600_000_000_000;

/// Reads a bag of any size, piece by piece.
pub(super) fn read(path: &Path, mut file: impl Read) -> Result<Vec<Table>, ImportError> {
    let broken = |why: String| ImportError::broken(path, why);
    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default().with_record_length_limit(LARGEST_RECORD).with_emit_chunks(true),
    );
    let mut bag = Bag::default();
    let mut cut = None;
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let read =
                    file.read(reader.insert(wanted.min(LARGEST_RECORD))).map_err(|e| opened(path, &e))?;
                reader.notify_read(read);
            }
            Ok(LinearReadEvent::Record { data, opcode }) => {
                let record = mcap::parse_record(opcode, data).map_err(|e| broken(e.to_string()))?;
                match record {
                    Record::Chunk { header, data } => match unpacked(&header, &data) {
                        Ok(records) => bag.take_all(&records).map_err(broken)?,
                        Err(why) if bag.cells > 0 => {
                            cut = Some(why);
                            break;
                        }
                        Err(why) => return Err(broken(why)),
                    },
                    record => bag.take(record).map_err(broken)?,
                }
            }
            // A recorder that was ended leaves a bag without its end: what came before is whole.
            Err(error) if bag.cells > 0 => {
                cut = Some(one_line(&error.to_string()));
                break;
            }
            Err(error) => return Err(broken(format!("no MCAP, or broken: {error}"))),
        }
    }
    let mut tables = bag.tables(path);
    if let (Some(why), Some(first)) = (cut, tables.first_mut()) {
        first.remarks.push(format!("the bag is broken ({why}): what came before that is read"));
    }
    if tables.is_empty() {
        return Err(broken(
            bag.left.into_values().next().unwrap_or_else(|| "no message with a number".into()),
        ));
    }
    Ok(tables)
}

/// The records of a chunk.
fn unpacked(header: &ChunkHeader, data: &[u8]) -> Result<Vec<u8>, String> {
    let size = header.uncompressed_size;
    if size > LARGEST_RECORD as u64 {
        return Err(format!("a chunk of {size} bytes, expected at most {LARGEST_RECORD}"));
    }
    let mut records = Vec::new();
    // One byte more than it says is enough to see that it says too little.
    let done = match header.compression.as_str() {
        "" => data.take(size + 1).read_to_end(&mut records),
        "zstd" => zstd::Decoder::new(data).and_then(|d| d.take(size + 1).read_to_end(&mut records)),
        "lz4" => lz4_flex::frame::FrameDecoder::new(data).take(size + 1).read_to_end(&mut records),
        other => return Err(format!("chunks are packed by {}, expected zstd or lz4", one_line(other))),
    };
    done.map_err(|e| format!("a chunk that cannot be unpacked: {}", one_line(&e.to_string())))?;
    if records.len() as u64 != size {
        return Err(format!("a chunk of {} bytes or more, {size} as it says", records.len()));
    }
    let sum = header.uncompressed_crc;
    if sum != 0 && crc32fast::hash(&records) != sum {
        return Err("a chunk whose checksum is another".into());
    }
    Ok(records)
}

/// What was read so far.
#[derive(Default)]
struct Bag {
    schemas: HashMap<u16, (String, String, Vec<u8>)>,
    topics: BTreeMap<u16, Topic>,
    /// Why a topic is not read, by name.
    left: BTreeMap<String, String>,
    cells: usize,
}

struct Topic {
    name: String,
    schema: String,
    how: How,
    /// Time of logging and stamp of each message, ns.
    times: Vec<(i128, Option<i128>)>,
    columns: BTreeMap<String, Vec<f64>>,
    long: bool,
}

enum How {
    Ros(Schema, Encoding),
    Json,
    Not,
}

impl Bag {
    /// Takes the records of a chunk.
    fn take_all(&mut self, records: &[u8]) -> Result<(), String> {
        mcap::read::LinearReader::sans_magic(records)
            .try_for_each(|record| self.take(record.map_err(|e| e.to_string())?))
    }

    fn take(&mut self, record: Record<'_>) -> Result<(), String> {
        match record {
            Record::Schema { header, data } => {
                self.schemas.insert(header.id, (header.name, header.encoding, data.into_owned()));
            }
            Record::Channel(channel) if !self.topics.contains_key(&channel.id) => {
                let unknown = (String::new(), String::new(), Vec::new());
                let (schema, kind, text) = self.schemas.get(&channel.schema_id).unwrap_or(&unknown);
                let how = match (channel.message_encoding.as_str(), kind.as_str()) {
                    ("cdr", "ros2msg") => ros(schema, text, Encoding::Cdr),
                    ("ros1", "ros1msg") => ros(schema, text, Encoding::Ros1),
                    ("json", _) => Ok(How::Json),
                    (encoding, kind) => Err(format!("messages in {encoding} defined by {kind} are not read")),
                };
                let how = how.unwrap_or_else(|why| {
                    self.left.insert(channel.topic.clone(), format!("{}: {}", channel.topic, one_line(&why)));
                    How::Not
                });
                let schema = schema.clone();
                let (times, columns) = (Vec::new(), BTreeMap::new());
                self.topics.insert(
                    channel.id,
                    Topic { name: channel.topic, schema, how, times, columns, long: false },
                );
            }
            Record::Message { header, data } => {
                if let Some(topic) = self.topics.get_mut(&header.channel_id) {
                    match topic.take(&header, &data) {
                        Ok(cells) => self.cells += cells,
                        Err(why) => {
                            self.left.insert(topic.name.clone(), format!("{}: {why}", topic.name));
                            topic.how = How::Not;
                        }
                    }
                }
                if self.cells > MOST_CELLS {
                    return Err(format!(
                        "more than {MOST_CELLS} numbers: take the topics that you need by \"mcap filter\""
                    ));
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn tables(&self, path: &Path) -> Vec<Table> {
        let start = self.topics.values().flat_map(|t| t.times.iter().map(|(log, _)| *log)).min().unwrap_or(0);
        let mut tables: Vec<Table> =
            self.topics.values().filter(|t| !t.columns.is_empty()).map(|t| t.table(path, start)).collect();
        if let Some(first) = tables.first_mut() {
            first.remarks.extend(self.left.values().cloned());
        }
        tables
    }
}

fn ros(name: &str, text: &[u8], encoding: Encoding) -> Result<How, String> {
    Ok(How::Ros(Schema::parse(name, &String::from_utf8_lossy(text))?, encoding))
}

impl Topic {
    /// Takes a message, and says how many numbers it held.
    fn take(&mut self, header: &MessageHeader, data: &[u8]) -> Result<usize, String> {
        let contents = match &self.how {
            How::Ros(schema, encoding) => schema.read(data, *encoding)?,
            How::Json => {
                let value =
                    serde_json::from_slice(data).map_err(|e| format!("a message that is no JSON: {e}"))?;
                let mut contents = Contents::default();
                flatten(&value, &mut String::new(), &mut contents);
                contents
            }
            How::Not => return Ok(0),
        };
        self.long |= contents.long;
        let number = |path: &str| contents.numbers.iter().find(|(p, _)| p == path).map(|(_, v)| *v as i128);
        let stamp = ["header.stamp.", "timestamp."].iter().find_map(|at| {
            let seconds = number(&format!("{at}sec"))?;
            let rest = number(&format!("{at}nanosec")).or_else(|| number(&format!("{at}nsec")))?;
            Some(seconds * 1_000_000_000 + rest)
        });
        let row = self.times.len();
        self.times.push((i128::from(header.log_time), stamp));
        let cells = contents.numbers.len();
        for (path, value) in contents.numbers.iter().filter(|(path, _)| !is_bookkeeping(path)) {
            let column = self.columns.entry(named(path, &contents.texts)).or_default();
            column.resize(row, f64::NAN);
            column.push(*value);
        }
        Ok(cells)
    }

    fn table(&self, path: &Path, start: i128) -> Table {
        let stamped =
            self.times.iter().all(|(log, stamp)| stamp.is_some_and(|s| (s - log).abs() < SAME_CLOCK));
        let time = |(log, stamp): &(i128, Option<i128>)| {
            let ns = if stamped { stamp.unwrap_or(*log) } else { *log };
            (ns - start) as f64 * 1e-9
        };
        let rows = self.times.len();
        let mut columns = vec![Column::with_unit(
            format!("{} time", self.name),
            "s",
            Values::Numbers(self.times.iter().map(time).collect()),
        )];
        for (field, values) in &self.columns {
            let mut values = values.clone();
            values.resize(rows, f64::NAN);
            let title = format!("{} {field}", self.name);
            columns.push(match unit(&self.schema, field) {
                Some(unit) => Column::with_unit(title, unit, Values::Numbers(values)),
                None => Column::new(title, Values::Numbers(values)),
            });
        }
        let mut table = Table::new(path, columns);
        table.part = Some(format!("topic {} ({})", self.name, self.schema));
        table.time = Some(0);
        if !stamped && self.times.iter().any(|(_, stamp)| stamp.is_some()) {
            table
                .remarks
                .push(format!("{}: stamps are of another clock, the time of logging is taken", self.name));
        }
        if self.long {
            table.remarks.push(format!("{}: pictures, clouds and long arrays are not read", self.name));
        }
        table
    }
}

/// Stamps and sizes say nothing that is measured.
fn is_bookkeeping(path: &str) -> bool {
    let last = path.rsplit('.').next().unwrap_or_default();
    ["sec", "nanosec", "nsec", "seq"].contains(&last) || path.contains("covariance")
}

/// A path in which a joint or frame stands in place of its number: `position[3]` is `position[elbow]`.
fn named(path: &str, texts: &[(String, String)]) -> String {
    let Some((before, rest)) = path.split_once('[') else { return path.to_owned() };
    let Some((number, after)) = rest.split_once(']') else { return path.to_owned() };
    let parent = before.rfind('.').map_or("", |at| &before[..=at]);
    let ways = [
        format!("{parent}name[{number}]"),
        format!("{parent}joint_names[{number}]"),
        format!("{before}[{number}].child_frame_id"),
    ];
    let found = ways.iter().find_map(|way| texts.iter().find(|(path, _)| path == way));
    match found.filter(|(_, text)| !text.is_empty()) {
        Some((_, text)) => format!("{before}[{}]{after}", one_line(text)),
        None => path.to_owned(),
    }
}

/// Numbers and texts of a JSON value by path.
fn flatten(value: &serde_json::Value, path: &mut String, out: &mut Contents) {
    use serde_json::Value;
    let before = path.len();
    match value {
        Value::Number(number) => out.numbers.push((path.clone(), number.as_f64().unwrap_or(f64::NAN))),
        Value::Bool(flag) => out.numbers.push((path.clone(), f64::from(u8::from(*flag)))),
        Value::String(text) => out.texts.push((path.clone(), text.clone())),
        Value::Array(list) if list.len() <= 64 => {
            for (k, inner) in list.iter().enumerate() {
                path.push_str(&format!("[{k}]"));
                flatten(inner, path, out);
                path.truncate(before);
            }
        }
        Value::Array(_) => out.long = true,
        Value::Object(map) => {
            for (name, inner) in map {
                if !path.is_empty() {
                    path.push('.');
                }
                path.push_str(name);
                flatten(inner, path, out);
                path.truncate(before);
            }
        }
        Value::Null => {}
    }
}

/// The unit of a field, by the definitions of `common_interfaces` (REP 103: SI units and radians).
fn unit(schema: &str, field: &str) -> Option<&'static str> {
    let kind = schema.rsplit('/').next().unwrap_or_default();
    let joint = kind.starts_with("JointState") || kind.starts_with("JointTrajectory");
    let has = |part: &str| field.starts_with(part) || field.contains(&format!(".{part}"));
    let accelerated = kind.starts_with("Accel");
    let rules: [(bool, &'static str); 17] = [
        (joint && has("position"), "rad"),
        (joint && has("velocity"), "rad/s"),
        (joint && has("effort"), "N m"),
        (has("force."), "N"),
        (has("torque."), "N m"),
        (has("linear_acceleration."), "m/s^2"),
        (has("angular_velocity."), "rad/s"),
        (accelerated && has("linear."), "m/s^2"),
        (has("linear."), "m/s"),
        (accelerated && has("angular."), "rad/s^2"),
        (has("angular."), "rad/s"),
        (has("position.") || has("translation."), "m"),
        (kind.starts_with("Point") && (has("point.") || !field.contains('.')), "m"),
        (has("fluid_pressure"), "Pa"),
        (kind == "Temperature" && field == "temperature", "°C"),
        (kind == "Range" && field.contains("range"), "m"),
        (kind == "BatteryState" && field == "voltage", "V"),
    ];
    rules.into_iter().find(|(holds, _)| *holds).map(|(_, unit)| unit)
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    fn header(compression: &str, size: usize, crc: u32) -> ChunkHeader {
        let (message_start_time, message_end_time, compressed_size) = (0, 0, 0);
        let (uncompressed_size, uncompressed_crc) = (size as u64, crc);
        let compression = compression.to_owned();
        ChunkHeader {
            message_start_time,
            message_end_time,
            uncompressed_size,
            uncompressed_crc,
            compression,
            compressed_size,
        }
    }

    #[test]
    fn chunks_are_unpacked_or_refused() {
        let records = b"what a robot said, what a robot said".to_vec();
        let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
        encoder.write_all(&records).unwrap();
        let packed = encoder.finish().unwrap();
        let sum = crc32fast::hash(&records);
        assert_eq!(unpacked(&header("lz4", records.len(), sum), &packed).unwrap(), records);
        assert_eq!(unpacked(&header("", records.len(), 0), &records).unwrap(), records);
        let refused = [
            (header("lz4", records.len(), sum + 1), "checksum"),
            (header("lz4", records.len() - 1, sum), "as it says"),
            (header("lz4", records.len() + 1, sum), "as it says"),
            (header("lz4", usize::MAX / 2, sum), "at most"),
            (header("zstd", records.len(), sum), "cannot be unpacked"),
            (header("br", records.len(), sum), "zstd or lz4"),
        ];
        for (header, why) in refused {
            let said = unpacked(&header, &packed).unwrap_err();
            assert!(said.contains(why), "{said}");
        }
    }
}
