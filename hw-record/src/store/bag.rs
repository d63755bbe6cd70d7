use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use serde_json::{Map, Value, json};

use super::keep::{Store, failed, png_of};
use crate::error::RecordError;
use crate::source::{Contents, Kind, Reading, Source};

/// An MCAP file: a topic for each source, messages in JSON, the time of logging that of the arrival.
///
/// Sound and pictures have the schemas that Foxglove gives them (`foxglove.RawAudio`, `foxglove.CompressedImage`), bytes in base64.
pub(crate) struct Bag {
    path: PathBuf,
    writer: Writer<BufWriter<File>>,
    topics: Vec<Topic>,
    /// This computer's date at the clock's zero, ns since 1970.
    zero_ns: u64,
}

struct Topic {
    channel: u16,
    sequence: u32,
    kind: Kind,
}

fn io(error: McapError) -> std::io::Error {
    match error {
        McapError::Io(error) => error,
        other => std::io::Error::other(other),
    }
}

/// Name and JSON schema of a source's messages.
fn schema(source: &Source) -> (String, Value) {
    let number = || json!({"type": "number"});
    let text = || json!({"type": "string"});
    let mut properties = Map::from_iter([("t_s".to_owned(), number())]);
    let date =
        || json!({"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}});
    let bytes = || json!({"type": "string", "contentEncoding": "base64"});
    let mut add = |of: Vec<(&str, Value)>| properties.extend(of.into_iter().map(|(k, v)| (k.to_owned(), v)));
    let name = match &source.kind {
        Kind::Numbers(columns) => {
            add(columns.iter().map(|c| (c.as_str(), number())).collect());
            format!("hw-record.{}", source.name)
        }
        Kind::Sound { .. } => {
            add(vec![("timestamp", date()), ("data", bytes()), ("format", text())]);
            add(vec![("sample_rate", number()), ("number_of_channels", number())]);
            "foxglove.RawAudio".into()
        }
        Kind::Depth { .. } => {
            add(vec![("timestamp", date()), ("frame_id", text()), ("data", bytes()), ("format", text())]);
            add(vec![("depth_unit_m", number())]);
            "foxglove.CompressedImage".into()
        }
    };
    (name, json!({"type": "object", "properties": properties}))
}

impl Bag {
    pub(crate) fn new(path: &Path, sources: &[Source]) -> Result<Self, RecordError> {
        let file = BufWriter::new(File::create(path).map_err(failed(path))?);
        let broken = |error| failed(path)(io(error));
        let mut writer = WriteOptions::new()
            .compression(None)
            .library(concat!("hw-record ", env!("CARGO_PKG_VERSION")))
            .create(file)
            .map_err(broken)?;
        let mut topics = Vec::new();
        for source in sources {
            let (name, schema) = schema(source);
            let id = writer.add_schema(&name, "jsonschema", schema.to_string().as_bytes()).map_err(broken)?;
            let channel = writer.add_channel(id, &source.name, "json", &BTreeMap::new()).map_err(broken)?;
            topics.push(Topic { channel, sequence: 0, kind: source.kind.clone() });
        }
        let zero = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let zero_ns = u64::try_from(zero.as_nanos()).unwrap_or(0);
        Ok(Self { path: path.to_owned(), writer, topics, zero_ns })
    }
}

/// The numbers of a reading by their columns, whose names need no escape; a number that is none has no word in JSON but null.
fn row(columns: &[String], t_s: f64, numbers: &[f64]) -> String {
    let mut row = String::with_capacity(32 * (numbers.len() + 1));
    let named = columns.iter().map(String::as_str).zip(numbers);
    for (name, number) in std::iter::once(("t_s", &t_s)).chain(named) {
        row.push_str(if row.is_empty() { "{\"" } else { ",\"" });
        row.push_str(name);
        row.push_str("\":");
        row.push_str(&if number.is_finite() { number.to_string() } else { "null".into() });
    }
    row.push('}');
    row
}

fn message(kind: &Kind, log_ns: u64, reading: &Reading) -> std::io::Result<String> {
    let mut message = Map::from_iter([("t_s".to_owned(), json!(reading.t_s))]);
    let date = json!({"sec": log_ns / 1_000_000_000, "nsec": log_ns % 1_000_000_000});
    let more = match (&reading.contents, kind) {
        (Contents::Numbers(numbers), Kind::Numbers(columns)) => {
            return Ok(row(columns, reading.t_s, numbers));
        }
        (Contents::Sound(samples), Kind::Sound { channels, rate_hz }) => {
            // The schema knows whole numbers of 16 bits alone.
            let pcm = |s: &f32| ((f64::from(*s) * 32_767.0).round() as i16).to_le_bytes();
            let bytes: Vec<u8> = samples.iter().flat_map(pcm).collect();
            json!({"timestamp": date, "data": STANDARD.encode(bytes), "format": "pcm-s16",
                "sample_rate": rate_hz, "number_of_channels": channels})
        }
        (Contents::Depth(picture), Kind::Depth { unit_m, .. }) => {
            let png = png_of(picture, *unit_m).map_err(std::io::Error::other)?;
            json!({"timestamp": date, "frame_id": "camera", "data": STANDARD.encode(png), "format": "png",
                "depth_unit_m": unit_m})
        }
        _ => return Err(std::io::Error::other("a reading of another kind than its source's")),
    };
    if let Value::Object(more) = more {
        message.extend(more);
    }
    Ok(Value::Object(message).to_string())
}

impl Store for Bag {
    fn put(&mut self, number: usize, arrival_s: f64, reading: &Reading) -> Result<(), RecordError> {
        let Some(topic) = self.topics.get_mut(number) else { return Ok(()) };
        let log_time = self.zero_ns + (arrival_s * 1e9) as u64;
        let data = message(&topic.kind, log_time, reading).map_err(failed(&self.path))?;
        topic.sequence += 1;
        let header = MessageHeader {
            channel_id: topic.channel,
            sequence: topic.sequence,
            log_time,
            publish_time: log_time,
        };
        let written = self.writer.write_to_known_channel(&header, data.as_bytes());
        written.map_err(|e| failed(&self.path)(io(e)))
    }

    /// Ends the chunk: what is in it can be read without the file's end.
    fn flush(&mut self) -> Result<(), RecordError> {
        self.writer.flush().map_err(|e| failed(&self.path)(io(e)))
    }

    fn finish(&mut self) -> Result<(), RecordError> {
        self.writer.finish().map(drop).map_err(|e| failed(&self.path)(io(e)))
    }
}
