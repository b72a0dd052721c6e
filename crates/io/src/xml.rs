//! The frame of VTK XML files: pieces, arrays, appended data. What the arrays mean is up to `vtu` and `vti`.

use std::borrow::Cow;
use std::ops::Range;

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use crate::cells::Indices;
use crate::error::{At, ReadError, ReadReason, expect_count};
use crate::number::NumberType;
use crate::payload;
use crate::payload::{Compressor, Framing, Source};
use crate::shares;

/// What the types of documents begin with that list files with pieces.
pub(super) const IN_FILES: char = 'P';

/// Reads a document with the pieces of a grid.
pub(super) type ReadFile<'a> = &'a mut dyn FnMut(&Document<'_>) -> Result<(), ReadError>;

/// Deepest nesting of elements; VTK's files need eight.
const MAX_DEPTH: usize = 32;

/// The attributes of an element.
#[derive(Debug, Default)]
pub(super) struct Attributes(Vec<(String, String)>);

impl Attributes {
    /// The value of attribute `name`.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.0.iter().find(|(n, _)| n == name).map(|(_, value)| value.trim())
    }

    /// The value of attribute `name` as a count.
    pub fn count(&self, name: &str) -> Result<usize, ReadReason> {
        let text = self.get(name).ok_or_else(|| ReadReason::Missing(format!("attribute {name}")))?;
        text.parse().map_err(|_| ReadReason::Syntax(format!("attribute {name}=\"{text}\" is not a count")))
    }

    /// The value of attribute `name` as numbers, if it is there.
    pub fn numbers<T: std::str::FromStr, const N: usize>(
        &self,
        name: &str,
    ) -> Result<Option<[T; N]>, ReadReason> {
        let Some(text) = self.get(name) else { return Ok(None) };
        let parsed: Result<Vec<T>, _> = text.split_ascii_whitespace().map(str::parse).collect();
        let numbers = parsed.ok().and_then(|v| <[T; N]>::try_from(v).ok());
        numbers
            .map(Some)
            .ok_or_else(|| ReadReason::Syntax(format!("attribute {name}=\"{text}\" is not {N} numbers")))
    }

    pub fn of(element: &BytesStart<'_>) -> Result<Self, ReadReason> {
        let mut list = Vec::new();
        for attribute in element.attributes().with_checks(false) {
            let attribute = attribute.map_err(|e| ReadReason::Syntax(format!("not well-formed XML: {e}")))?;
            let value = attribute
                .normalized_value(XmlVersion::Explicit1_0)
                .map_err(|e| ReadReason::Syntax(format!("not well-formed XML: {e}")))?;
            list.push((attribute.key.as_ref().to_owned(), value.into_owned()));
        }
        Ok(Self(list))
    }
}

/// A `<DataArray>` that was not decoded yet.
#[derive(Debug)]
pub(super) struct Array<'a> {
    /// Name of the enclosing element, as `PointData`.
    pub section: String,
    /// Number of the enclosing piece, from 0.
    pub piece: usize,
    attributes: Attributes,
    text: Cow<'a, str>,
    /// The unit, if there is an `<InformationKey>` for it.
    unit: String,
}

impl Array<'_> {
    /// The unit of the values; empty if there is none. VTK has a key for it, others write an attribute.
    pub fn unit(&self) -> &str {
        let unit = ["Unit", "Units", "unit", "units"].into_iter().find_map(|name| self.attributes.get(name));
        unit.unwrap_or(&self.unit).trim()
    }

    /// The array's name; empty if it has none.
    pub fn name(&self) -> &str {
        self.attributes.get("Name").unwrap_or_default()
    }

    /// How to call the array in an error.
    pub fn place(&self) -> String {
        format!("piece {}, <{}>, array \"{}\"", self.piece, self.section, self.name())
    }

    /// Values a tuple; 1 if not stated.
    pub fn components(&self) -> Result<usize, ReadReason> {
        match self.attributes.get("NumberOfComponents") {
            None | Some("") => Ok(1),
            Some(_) => self.attributes.count("NumberOfComponents"),
        }
    }

    /// Where the values are. As VTK has it, what is not stated otherwise is text, and an offset is enough to say that they come later.
    fn encoding(&self) -> Encoding {
        let format = self.attributes.get("format").unwrap_or_default().to_ascii_lowercase();
        match format.as_str() {
            "binary" => Encoding::Binary,
            "appended" => Encoding::Appended,
            "ascii" => Encoding::Ascii,
            _ if self.attributes.get("offset").is_some() => Encoding::Appended,
            _ => Encoding::Ascii,
        }
    }

    /// The number type, or `None` for strings and the like.
    pub fn number_type(&self) -> Option<NumberType> {
        self.attributes.get("type").and_then(NumberType::named)
    }
}

/// A part of the data set.
#[derive(Debug)]
pub(super) struct Piece<'a> {
    /// Attributes of `<Piece>`.
    pub attributes: Attributes,
    /// All arrays of the piece, in the order of the file.
    pub arrays: Vec<Array<'a>>,
}

impl<'a> Piece<'a> {
    /// Whether it has neither points nor cells, as pieces of parallel programs may.
    fn is_empty(&self) -> bool {
        let is_zero = |name: &str| self.attributes.get(name).is_none_or(|count| count == "0");
        match self.attributes.numbers::<i64, 6>("Extent") {
            Ok(Some([x0, x1, y0, y1, z0, z1])) => x0 > x1 || y0 > y1 || z0 > z1,
            _ => {
                let counted = self.attributes.get("NumberOfPoints").is_some();
                counted && is_zero("NumberOfPoints") && is_zero("NumberOfCells")
            }
        }
    }

    /// The arrays of one section.
    pub fn section(&self, name: &str) -> impl Iterator<Item = &Array<'a>> {
        self.arrays.iter().filter(move |a| a.section == name)
    }
}

/// A VTK XML file, taken apart.
pub(super) struct Document<'a> {
    /// The data set's type, as `UnstructuredGrid`.
    pub kind: String,
    version: [u32; 2],
    /// The name of the file where several are listed; else empty.
    pub name: String,
    /// Attributes of the element named like the type.
    pub dataset: Attributes,
    /// The parts.
    pub pieces: Vec<Piece<'a>>,
    /// The arrays of the whole data set.
    field_data: Vec<Array<'a>>,
    pub framing: Framing,
    appended: Option<Appended<'a>>,
}

struct Appended<'a> {
    base64: bool,
    bytes: &'a [u8],
}

impl<'a> Document<'a> {
    /// Takes `bytes` apart; arrays are decoded later.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, ReadError> {
        let (text, data) = split_appended(bytes).at(|| "<AppendedData>".into())?;
        let text = std::str::from_utf8(text)
            .map_err(|_| ReadReason::Syntax("the XML text is not UTF-8".into()))
            .at(String::new)?;
        let mut parser = Parser::default();
        let mut reader = Reader::from_str(text);
        loop {
            let event = reader.read_event();
            let place = || format!("byte {}", reader.buffer_position());
            let event =
                event.map_err(|e| ReadReason::Syntax(format!("not well-formed XML: {e}"))).at(place)?;
            match event {
                Event::Start(e) => parser.open(&e, true).at(place)?,
                Event::Empty(e) => parser.open(&e, false).at(place)?,
                Event::End(_) => _ = parser.stack.pop(),
                Event::Text(t) => parser.text(t.into_inner()),
                Event::CData(t) => parser.text(t.into_inner()),
                Event::Eof => break,
                _ => {}
            }
        }
        parser.finish(data)
    }

    /// The parts that are not empty, with their numbers.
    pub fn full_pieces(&self) -> impl Iterator<Item = (usize, &Piece<'a>)> {
        self.pieces.iter().enumerate().filter(|(_, piece)| !piece.is_empty())
    }

    /// What the part of this number is called in messages about its cells.
    pub fn part_name(&self, number: usize) -> Option<String> {
        match (self.name.as_str(), self.pieces.len() > 1) {
            ("", false) => None,
            ("", true) => Some(format!("piece {number}")),
            (name, false) => Some(name.to_owned()),
            (name, true) => Some(format!("{name}, piece {number}")),
        }
    }

    /// Whether the file is of an older version of the format than this one.
    pub fn is_before(&self, version: [u32; 2]) -> bool {
        self.version < version
    }

    /// The array with the time of the data set, as VTK writes it.
    pub fn time_array(&self) -> Option<&Array<'a>> {
        self.field_data.iter().find(|array| array.name() == "TimeValue")
    }

    /// The time of the data set; none if that is not a finite number.
    pub fn time(&self) -> Option<f64> {
        let array = self.time_array()?;
        let time = self.floats(array, 1, 1).ok()?.first().copied();
        time.filter(|time| time.is_finite())
    }

    /// The values of a numeric array of `tuples` tuples of `components`.
    pub fn floats(
        &self,
        array: &Array<'a>,
        tuples: usize,
        components: usize,
    ) -> Result<Vec<f64>, ReadReason> {
        self.values(array, tuples, components, NumberType::parse_float, |t, b, big| Ok(t.floats(b, big)))
    }

    /// The values of an array of `count` indices.
    pub fn integers(&self, array: &Array<'a>, count: usize) -> Result<Vec<i64>, ReadReason> {
        self.values(array, count, 1, NumberType::parse_integer, NumberType::integers)
    }

    /// How many numbers an array has, where nothing else says it.
    pub fn count_of(&self, array: &Array<'a>) -> Result<usize, ReadReason> {
        if array.encoding() == Encoding::Ascii {
            return Ok(array.text.split_ascii_whitespace().count());
        }
        let size = array.number_type().map_or(1, NumberType::size) as u64;
        let bytes = payload::stated_bytes(self.source(array)?, self.framing)?;
        usize::try_from(bytes / size).map_err(|_| endless(array))
    }

    /// The values of an array of `count` indices, decoded later if they are numbers already.
    pub fn indices<'b>(&'b self, array: &'b Array<'a>, count: usize) -> Result<Indices<'b>, ReadReason> {
        let number = array.number_type().filter(|number| number.is_integer());
        let (Some(number), true) = (number, count > 0 && array.encoding() != Encoding::Ascii) else {
            return self.integers(array, count).map(Indices::Listed);
        };
        let bytes = count.checked_mul(number.size()).ok_or_else(|| endless(array))?;
        let bytes = payload::read_block(self.source(array)?, self.framing, bytes)?;
        Ok(Indices::Stored { bytes, number, big: self.framing.big })
    }

    fn values<T: Copy + Send>(
        &self,
        array: &Array<'a>,
        tuples: usize,
        components: usize,
        parse: impl Fn(NumberType, &str) -> Result<T, ReadReason> + Sync + Send,
        decode: impl Fn(NumberType, &[u8], bool) -> Result<Vec<T>, ReadReason>,
    ) -> Result<Vec<T>, ReadReason> {
        let number = array.number_type().ok_or_else(|| {
            let kind = array.attributes.get("type").unwrap_or_default();
            ReadReason::unsupported(format!("data of type \"{kind}\""), "use a numeric type")
        })?;
        let needed = tuples.checked_mul(components);
        let bytes = needed.and_then(|n| n.checked_mul(number.size()));
        let (Some(needed), Some(bytes)) = (needed, bytes) else { return Err(endless(array)) };
        if array.encoding() == Encoding::Ascii {
            return parse_text(&array.text, needed, |token| parse(number, token));
        }
        if needed == 0 {
            return Ok(Vec::new());
        }
        let block = payload::read_block(self.source(array)?, self.framing, bytes)?;
        decode(number, &block, self.framing.big)
    }

    /// Where the values of an array are, for those who read some of them.
    pub fn place_of<'b>(&'b self, array: &'b Array<'a>) -> Result<Place<'b>, ReadReason> {
        Ok(match array.encoding() {
            Encoding::Ascii => Place::Numbers,
            Encoding::Binary => Place::Inline(&array.text),
            Encoding::Appended => {
                let appended =
                    self.appended.as_ref().ok_or_else(|| ReadReason::Missing("<AppendedData>".into()))?;
                Place::Appended { offset: array.attributes.count("offset")? as u64, base64: appended.base64 }
            }
        })
    }

    fn source<'b>(&'b self, array: &'b Array<'a>) -> Result<Source<'b>, ReadReason> {
        match array.encoding() {
            Encoding::Ascii | Encoding::Binary => Ok(Source::base64(array.text.as_bytes())),
            Encoding::Appended => {
                let offset = array.attributes.count("offset")?;
                let appended =
                    self.appended.as_ref().ok_or_else(|| ReadReason::Missing("<AppendedData>".into()))?;
                let bytes = appended.bytes.get(offset..).ok_or(ReadReason::Truncated {
                    needed: offset as u64,
                    found: appended.bytes.len() as u64,
                })?;
                Ok(if appended.base64 { Source::base64(bytes) } else { Source::Raw(bytes) })
            }
        }
    }
}

/// Where the values of an array are.
pub(super) enum Place<'a> {
    /// In the text, as numbers.
    Numbers,
    /// In this text, in base64.
    Inline(&'a str),
    /// In the appended data, from this byte on.
    Appended { offset: u64, base64: bool },
}

/// The error of an array that has more bytes than can be counted.
fn endless(array: &Array<'_>) -> ReadReason {
    ReadReason::Truncated { needed: u64::MAX, found: array.text.len() as u64 }
}

/// Where the values of an array are.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Encoding {
    /// Inline, as text.
    Ascii,
    /// Inline, in base64.
    Binary,
    /// Behind the XML.
    Appended,
}

/// Bytes of text that a thread parses at a time.
const SHARE: usize = 1 << 17;

/// Exactly `needed` numbers of white-space separated text.
fn parse_text<T: Copy + Send>(
    text: &str,
    needed: usize,
    parse: impl Fn(&str) -> Result<T, ReadReason> + Sync + Send,
) -> Result<Vec<T>, ReadReason> {
    // No more than there can be: each has a character, and white space behind it.
    let mut values = Vec::with_capacity(needed.min(text.len() / 2 + 1));
    shares::append(&mut values, text.len(), SHARE, |share| {
        words_from(text, share).split_ascii_whitespace().map(&parse).collect()
    })?;
    expect_count("numbers", needed, values.len())?;
    Ok(values)
}

/// The words that begin in a part of the text, and the white space around them.
fn words_from(text: &str, part: Range<usize>) -> &str {
    let bytes = text.as_bytes();
    let space = |range: Range<usize>| {
        bytes[range.clone()].iter().position(u8::is_ascii_whitespace).map(|at| range.start + at)
    };
    // The word that the part begins with is that of an earlier one, if it goes on from there.
    let start = if part.start == 0 { Some(0) } else { space(part.start - 1..part.end) };
    let end = |_| space(part.end - 1..bytes.len()).unwrap_or(bytes.len());
    // White space is a character by itself: both are between characters.
    start.map_or("", |start| text.get(start..end(start)).unwrap_or_default())
}

/// Splits a file with appended data, which is not XML, into the text up to and including the start tag of
/// `<AppendedData>` and the bytes after the underscore that marks the data's beginning.
fn split_appended(bytes: &[u8]) -> Result<(&[u8], &[u8]), ReadReason> {
    const TAG: &[u8] = b"<AppendedData";
    let mut start = 0;
    while !bytes[start..].starts_with(TAG) {
        let Some(next) = bytes.get(start + 1..).and_then(|rest| payload::find(rest, |byte| byte == b'<'))
        else {
            return Ok((bytes, &[]));
        };
        start += 1 + next;
    }
    let end = bytes[start..].iter().position(|c| *c == b'>').map(|i| start + i + 1);
    let end = end.ok_or_else(|| ReadReason::Syntax("the tag does not end".into()))?;
    let (text, rest) = bytes.split_at(end);
    let data = rest.trim_ascii_start().strip_prefix(b"_");
    let data = data.ok_or_else(|| ReadReason::Missing("the underscore before the data".into()))?;
    Ok((text, data))
}

/// Collects what the reader sees.
#[derive(Default)]
struct Parser<'a> {
    stack: Vec<String>,
    file: Option<Attributes>,
    dataset: Option<Attributes>,
    pieces: Vec<Piece<'a>>,
    field_data: Vec<Array<'a>>,
    appended: Option<Attributes>,
    /// Whether the last `<InformationKey>` is that of a unit.
    in_unit: bool,
}

/// What arrays a piece may have: of its geometry, of values, and of what has no volume.
const SECTIONS: [&str; 10] = [
    "Points",
    "Cells",
    "Coordinates",
    "PointData",
    "CellData",
    "FieldData",
    "Verts",
    "Lines",
    "Strips",
    "Polys",
];

fn check_section(name: &str) -> Result<(), ReadReason> {
    if SECTIONS.contains(&name) {
        return Ok(());
    }
    let name: String = name.chars().take(48).collect();
    let remedy = "leave it out, if the piece is complete without it".into();
    Err(ReadReason::Unsupported { what: format!("a section <{name}> of a piece"), remedy })
}

/// The last major version of the format that VTK 9 knows, and refuses later ones as we do.
const LAST_VERSION: u32 = 2;

/// VTK's key for the unit of an array.
const UNIT_KEY: &str = "UNITS_LABEL";

impl<'a> Parser<'a> {
    fn open(&mut self, element: &BytesStart<'_>, stays_open: bool) -> Result<(), ReadReason> {
        let name = element.name().as_ref().to_owned();
        let parents: Vec<&str> = self.stack.iter().map(String::as_str).collect();
        match (parents.as_slice(), name.as_str()) {
            ([], "VTKFile") => self.file = Some(Attributes::of(element)?),
            ([], other) => return Err(ReadReason::Syntax(format!("the root is <{other}>, not <VTKFile>"))),
            (["VTKFile"], "AppendedData") => self.appended = Some(Attributes::of(element)?),
            (["VTKFile"], kind) if Some(kind) == self.kind() => self.dataset = Some(Attributes::of(element)?),
            (["VTKFile", _], "Piece") => {
                self.pieces.push(Piece { attributes: Attributes::of(element)?, arrays: Vec::new() });
            }
            (["VTKFile", _, "Piece"], "Points" | "Cells" | "Coordinates") if self.has(&name) => {
                return Err(ReadReason::Syntax(format!("a piece has two sections <{name}>")));
            }
            (["VTKFile", _, "Piece", section], "DataArray") => {
                check_section(section)?;
                let array = self.new_array((*section).to_owned(), element)?;
                if let Some(piece) = self.pieces.last_mut() {
                    piece.arrays.push(array);
                }
            }
            (["VTKFile", _, "FieldData"], "DataArray") => {
                let array = self.new_array("FieldData".to_owned(), element)?;
                self.field_data.push(array);
            }
            (["VTKFile", _, "Piece", _, "DataArray"], "InformationKey") => {
                self.in_unit = Attributes::of(element)?.get("name") == Some(UNIT_KEY);
            }
            _ => {}
        }
        if self.stack.len() > MAX_DEPTH {
            return Err(ReadReason::TooLarge { what: "nested elements".into(), limit: MAX_DEPTH as u64 });
        }
        if stays_open {
            self.stack.push(name);
        }
        Ok(())
    }

    fn kind(&self) -> Option<&str> {
        self.file.as_ref()?.get("type")
    }

    /// Whether the last piece has arrays in this section.
    fn has(&self, section: &str) -> bool {
        self.pieces.last().is_some_and(|piece| piece.section(section).next().is_some())
    }

    fn new_array(&self, section: String, element: &BytesStart<'_>) -> Result<Array<'a>, ReadReason> {
        let piece = self.pieces.len().saturating_sub(1);
        let attributes = Attributes::of(element)?;
        Ok(Array { section, piece, attributes, text: Cow::Borrowed(""), unit: String::new() })
    }

    fn text(&mut self, text: Cow<'a, str>) {
        let parents: Vec<&str> = self.stack.iter().map(String::as_str).collect();
        let of_piece = self.pieces.last_mut().and_then(|p| p.arrays.last_mut());
        // Elements inside an array hold text of their own.
        let array = match parents.as_slice() {
            ["VTKFile", _, "Piece", _, "DataArray"] => of_piece,
            ["VTKFile", _, "FieldData", "DataArray"] => self.field_data.last_mut(),
            ["VTKFile", _, "Piece", _, "DataArray", "InformationKey"] if self.in_unit => {
                of_piece.into_iter().for_each(|array| array.unit.push_str(&text));
                return;
            }
            _ => return,
        };
        let Some(array) = array else { return };
        // White space before the first number is left out; behind it, between comments, it separates numbers. Each piece of text is
        // looked at once: there may be very many.
        if !array.text.is_empty() {
            array.text.to_mut().push_str(&text);
        } else if !text.trim_ascii_start().is_empty() {
            array.text = text;
        }
    }

    fn finish(self, data: &'a [u8]) -> Result<Document<'a>, ReadError> {
        // With appended data, <VTKFile> and <AppendedData> end after the part that was read.
        let open = if self.appended.is_some() { 2 } else { 0 };
        if self.stack.len() > open {
            let what = format!("<{}> does not end", self.stack[open]);
            return Err(ReadReason::Syntax(what)).at(String::new);
        }
        let file = self.file.ok_or_else(|| ReadReason::Missing("<VTKFile>".into())).at(String::new)?;
        let kind = file.get("type").unwrap_or_default().to_owned();
        let framing = framing(&file).at(|| "<VTKFile>".into())?;
        let dataset = self.dataset.ok_or_else(|| ReadReason::Missing(format!("<{kind}>"))).at(String::new)?;
        let appended =
            self.appended.map(|a| appended(&a, data)).transpose().at(|| "<AppendedData>".into())?;
        let (pieces, field_data, version) = (self.pieces, self.field_data, version(&file));
        if version[0] > LAST_VERSION {
            let what = format!("version {}.{} of the format", version[0], version[1]);
            let remedy = "have it written by VTK 9";
            return Err(ReadReason::unsupported(what, remedy)).at(|| "<VTKFile>".into());
        }
        Ok(Document { kind, version, name: String::new(), dataset, pieces, field_data, framing, appended })
    }
}

/// The version of the format, the oldest if it is not stated.
fn version(file: &Attributes) -> [u32; 2] {
    let mut numbers = file.get("version").unwrap_or_default().split('.').map(|number| number.parse().ok());
    let mut next = || numbers.next().flatten().unwrap_or(0);
    [next(), next()]
}

fn appended<'a>(attributes: &Attributes, bytes: &'a [u8]) -> Result<Appended<'a>, ReadReason> {
    match attributes.get("encoding") {
        Some("raw") => Ok(Appended { base64: false, bytes }),
        Some("base64") => Ok(Appended { base64: true, bytes }),
        other => Err(ReadReason::Syntax(format!("encoding=\"{}\" is not known", other.unwrap_or_default()))),
    }
}

fn framing(file: &Attributes) -> Result<Framing, ReadReason> {
    let unknown =
        |name: &str, value: &str| Err(ReadReason::Syntax(format!("{name}=\"{value}\" is not known")));
    let big = match file.get("byte_order") {
        None | Some("LittleEndian") => false,
        Some("BigEndian") => true,
        Some(other) => return unknown("byte_order", other),
    };
    let wide = match file.get("header_type") {
        None | Some("UInt32") => false,
        Some("UInt64") => true,
        Some(other) => return unknown("header_type", other),
    };
    let compressor = match file.get("compressor") {
        None | Some("") => None,
        Some("vtkZLibDataCompressor") => Some(Compressor::Zlib),
        Some("vtkLZ4DataCompressor") => Some(Compressor::Lz4),
        Some("vtkLZMADataCompressor") => Some(Compressor::Lzma),
        Some(other) => return unknown("compressor", other),
    };
    Ok(Framing { big, wide, compressor })
}

#[cfg(test)]
mod tests {
    use super::words_from;

    #[test]
    fn each_word_is_in_one_part_whatever_the_parts_are() {
        for text in ["", " ", "12 3.5\n777\t8é 9", "  a long-word-of-its-own  b c ", "one"] {
            let all: Vec<&str> = text.split_ascii_whitespace().collect();
            for share in 1..=text.len() {
                let starts = (0..text.len()).step_by(share);
                let parts = starts.map(|start| words_from(text, start..text.len().min(start + share)));
                assert_eq!(
                    parts.flat_map(str::split_ascii_whitespace).collect::<Vec<_>>(),
                    all,
                    "{text:?}, {share}"
                );
            }
        }
    }
}
