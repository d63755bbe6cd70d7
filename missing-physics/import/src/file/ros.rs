//! Messages of ROS by their definition: `.msg` text (of ROS 2 and ROS 1), values in CDR or in ROS 1's serialization.
//!
//! OMG Data Distribution Service Interoperability Wire Protocol 2.5, 10.2 (encapsulation), and CDR of CORBA 3.3, 9.3 (alignment).

use std::collections::HashMap;

/// Elements of an array beyond these are passed over: pictures and clouds are no columns.
const LONGEST_ARRAY: usize = 64;
/// Messages within messages.
const DEEPEST: usize = 16;

/// How values are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// Aligned, after four bytes that say the order of bytes.
    Cdr,
    /// Little endian without gaps.
    Ros1,
}

/// A kind of message.
#[derive(Debug, Default)]
pub(super) struct Schema {
    types: Vec<Vec<Member>>,
}

#[derive(Debug)]
struct Member {
    name: String,
    kind: Kind,
    many: Many,
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    /// Bytes, whether a sign, whether a float.
    Number {
        size: usize,
        signed: bool,
        float: bool,
    },
    Text,
    Wide,
    /// Two numbers of four bytes: seconds and nanoseconds (ROS 1).
    Time,
    Message(usize),
}

#[derive(Debug, Clone, Copy)]
enum Many {
    One,
    Fixed(usize),
    Counted,
}

/// What a message holds: numbers and texts by path (`pose.position.x`).
#[derive(Debug, Default)]
pub(super) struct Contents {
    pub(super) numbers: Vec<(String, f64)>,
    pub(super) texts: Vec<(String, String)>,
    /// Whether elements of long arrays were passed over.
    pub(super) long: bool,
}

impl Schema {
    /// Reads a definition with those that it needs, each below a line of `=`.
    ///
    /// # Errors
    /// Which type is unknown.
    pub(super) fn parse(name: &str, text: &str) -> Result<Self, String> {
        let mut blocks: Vec<(String, Vec<&str>)> = vec![(short(name), Vec::new())];
        for line in text.lines().map(str::trim) {
            if line.starts_with("====") {
                blocks.push((String::new(), Vec::new()));
            } else if let (Some(name), Some(last)) = (line.strip_prefix("MSG:"), blocks.last_mut()) {
                last.0 = short(name.trim());
            } else if let Some(last) = blocks.last_mut() {
                last.1.push(line.split('#').next().unwrap_or_default().trim());
            }
        }
        let places: HashMap<String, usize> =
            blocks.iter().enumerate().rev().map(|(at, (name, _))| (name.clone(), at)).collect();
        let find = |kind: &str, within: &str| {
            let package = within.split('/').next().unwrap_or_default();
            let names = [short(kind), format!("{package}/{kind}"), format!("std_msgs/{kind}")];
            let alone = || {
                places.iter().find(|(name, _)| name.split('/').next_back() == Some(kind)).map(|(_, at)| *at)
            };
            names.iter().find_map(|name| places.get(name).copied()).or_else(alone)
        };
        let mut types = Vec::new();
        for (name, lines) in &blocks {
            let members =
                lines.iter().filter(|line| !line.is_empty()).filter_map(|line| member(line, name, &find));
            types.push(members.collect::<Result<Vec<_>, _>>()?);
        }
        Ok(Self { types })
    }

    /// What a message holds.
    ///
    /// # Errors
    /// Where it is shorter than its definition says.
    pub(super) fn read(&self, bytes: &[u8], encoding: Encoding) -> Result<Contents, String> {
        let (bytes, little, widest) = match (encoding, bytes) {
            (Encoding::Ros1, bytes) => (bytes, true, 1),
            (Encoding::Cdr, [0, kind, _, _, rest @ ..]) => {
                (rest, kind % 2 == 1, if *kind >= 6 { 4 } else { 8 })
            }
            _ => return Err("a message without its first four bytes".into()),
        };
        let mut reader = Reader { bytes, at: 0, little, widest, encoding };
        let mut out = Contents::default();
        self.message(0, &mut reader, &mut String::new(), &mut out, true, DEEPEST)?;
        Ok(out)
    }

    fn message(
        &self,
        kind: usize,
        reader: &mut Reader<'_>,
        path: &mut String,
        out: &mut Contents,
        kept: bool,
        depth: usize,
    ) -> Result<(), String> {
        let depth = depth.checked_sub(1).ok_or("messages within messages without end")?;
        for member in &self.types[kind] {
            let before = path.len();
            if !path.is_empty() {
                path.push('.');
            }
            path.push_str(&member.name);
            let count = match member.many {
                Many::One => 1,
                Many::Fixed(n) => n,
                Many::Counted => reader.count()?,
            };
            let kept = kept && count <= LONGEST_ARRAY;
            out.long |= count > LONGEST_ARRAY;
            if let (Kind::Number { size, .. }, false) = (member.kind, kept) {
                reader.skip(count, size)?;
                path.truncate(before);
                continue;
            }
            for element in 0..count {
                let whole = path.len();
                if !matches!(member.many, Many::One) {
                    path.push_str(&format!("[{element}]"));
                }
                match member.kind {
                    Kind::Number { size, signed, float } => {
                        let value = reader.number(size, signed, float)?;
                        if kept {
                            out.numbers.push((path.clone(), value));
                        }
                    }
                    Kind::Time => {
                        let (seconds, rest) =
                            (reader.number(4, true, false)?, reader.number(4, true, false)?);
                        if kept {
                            out.numbers.push((format!("{path}.sec"), seconds));
                            out.numbers.push((format!("{path}.nanosec"), rest));
                        }
                    }
                    Kind::Text => {
                        let text = reader.text()?;
                        if kept {
                            out.texts.push((path.clone(), text));
                        }
                    }
                    Kind::Wide => {
                        let count = reader.count()?;
                        reader.skip(count, 2)?;
                    }
                    Kind::Message(at) => self.message(at, reader, path, out, kept, depth)?,
                }
                path.truncate(whole);
            }
            path.truncate(before);
        }
        Ok(())
    }
}

/// `geometry_msgs/msg/Wrench` as `geometry_msgs/Wrench`.
fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

/// A line such as `float64[9] covariance`; nothing for a constant.
fn member(
    line: &str,
    within: &str,
    find: &impl Fn(&str, &str) -> Option<usize>,
) -> Option<Result<Member, String>> {
    let (kind, rest) = line.split_once(char::is_whitespace)?;
    let name = rest.trim().split(char::is_whitespace).next().unwrap_or_default();
    // `uint8 NAME=1`, `uint8 NAME = 1`; a default has no equals sign.
    if rest.contains('=') && !kind.contains("<=") || name.is_empty() {
        return None;
    }
    let (kind, many) = match kind.split_once('[') {
        None => (kind, Many::One),
        Some((kind, bounds)) => match bounds.trim_end_matches(']') {
            "" => (kind, Many::Counted),
            bound if bound.starts_with("<=") => (kind, Many::Counted),
            size => match size.parse() {
                Ok(size) => (kind, Many::Fixed(size)),
                Err(_) => return Some(Err(format!("an array of {size} elements"))),
            },
        },
    };
    let number = |size, signed, float| Kind::Number { size, signed, float };
    let kind = match kind.split("<=").next().unwrap_or_default() {
        "bool" | "uint8" | "byte" => number(1, false, false),
        "int8" | "char" => number(1, true, false),
        "uint16" => number(2, false, false),
        "int16" => number(2, true, false),
        "uint32" => number(4, false, false),
        "int32" => number(4, true, false),
        "uint64" => number(8, false, false),
        "int64" => number(8, true, false),
        "float32" => number(4, true, true),
        "float64" => number(8, true, true),
        "string" => Kind::Text,
        "wstring" => Kind::Wide,
        "time" | "duration" => Kind::Time,
        other => match find(other, within) {
            Some(at) => Kind::Message(at),
            None => return Some(Err(format!("the type {other} is not defined"))),
        },
    };
    Some(Ok(Member { name: name.to_owned(), kind, many }))
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    little: bool,
    widest: usize,
    encoding: Encoding,
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize, size: usize) -> Result<&'a [u8], String> {
        let align = size.clamp(1, self.widest);
        let from = self.at.next_multiple_of(align);
        let to = count.checked_mul(size).and_then(|n| n.checked_add(from));
        let taken = to.and_then(|to| Some((to, self.bytes.get(from..to)?)));
        let (to, taken) = taken.ok_or("a message that ends before its definition does")?;
        self.at = to;
        Ok(taken)
    }

    fn skip(&mut self, count: usize, size: usize) -> Result<(), String> {
        if count > 0 { self.take(count, size).map(drop) } else { Ok(()) }
    }

    fn number(&mut self, size: usize, signed: bool, float: bool) -> Result<f64, String> {
        let bytes = self.take(1, size)?;
        let bits = if self.little {
            bytes.iter().rev().fold(0_u64, |bits, b| bits << 8 | u64::from(*b))
        } else {
            bytes.iter().fold(0_u64, |bits, b| bits << 8 | u64::from(*b))
        };
        let unused = 64 - 8 * size as u32;
        Ok(match (float, signed, size) {
            (true, _, 4) => f64::from(f32::from_bits(bits as u32)),
            (true, _, _) => f64::from_bits(bits),
            (false, true, _) => ((bits << unused) as i64 >> unused) as f64,
            (false, false, _) => bits as f64,
        })
    }

    /// The number of elements that follow: no more than there are bytes.
    fn count(&mut self) -> Result<usize, String> {
        let count = self.number(4, false, false)? as usize;
        if count > self.bytes.len() {
            return Err("an array that is longer than its message".into());
        }
        Ok(count)
    }

    fn text(&mut self) -> Result<String, String> {
        let count = self.count()?;
        let bytes = self.take(count, 1)?;
        let text = String::from_utf8_lossy(bytes);
        // CDR counts a zero at the end.
        Ok(if self.encoding == Encoding::Cdr {
            text.trim_end_matches('\0').to_owned()
        } else {
            text.into_owned()
        })
    }
}
