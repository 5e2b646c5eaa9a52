//! Files of Apache Parquet: flat tables of optional numbers and texts, in plain encoding without compression.
//!
//! Format: <https://parquet.apache.org/docs/file-format/>. The footer is a Thrift structure in the compact protocol.

use std::io::{self, Write};

const MAGIC: &[u8] = b"PAR1";
/// Rows of a row group.
const GROUP: usize = 1 << 16;

/// Values of a column; a missing one is null.
#[derive(Debug, Clone, PartialEq)]
enum Values {
    Numbers(Vec<Option<f64>>),
    Texts(Vec<Option<String>>),
}

/// Kind of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// `DOUBLE`.
    Number,
    /// `BYTE_ARRAY` in UTF-8.
    Text,
}

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A number; NaN is null.
    Number(f64),
    /// A text.
    Text(String),
    /// Null.
    Null,
}

/// Writer of a table, a row group at a time.
pub struct ParquetWriter<'a> {
    out: &'a mut dyn Write,
    position: u64,
    names: Vec<(String, ColumnKind)>,
    group: Vec<Values>,
    in_group: usize,
    rows: u64,
    /// Of each row group: its rows and the place, size and values of its columns.
    groups: Vec<(u64, Vec<[u64; 2]>)>,
}

impl<'a> ParquetWriter<'a> {
    /// Begins a table.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn begin(out: &'a mut dyn Write, names: Vec<(String, ColumnKind)>) -> io::Result<Self> {
        out.write_all(MAGIC)?;
        Ok(Self {
            out,
            position: MAGIC.len() as u64,
            group: empty(&names),
            names,
            in_group: 0,
            rows: 0,
            groups: Vec::new(),
        })
    }

    /// Adds a row, with a cell of its kind for each column.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) -> io::Result<()> {
        let mut cells = cells.into_iter();
        for values in &mut self.group {
            let cell = cells.next().unwrap_or(Cell::Null);
            match (values, cell) {
                (Values::Numbers(list), Cell::Number(x)) => {
                    list.push(Some(x).filter(|x| !x.is_nan()));
                }
                (Values::Texts(list), Cell::Text(text)) => list.push(Some(text)),
                (Values::Numbers(list), _) => list.push(None),
                (Values::Texts(list), _) => list.push(None),
            }
        }
        self.in_group += 1;
        match self.in_group == GROUP {
            true => self.end_group(),
            false => Ok(()),
        }
    }

    fn end_group(&mut self) -> io::Result<()> {
        if self.in_group == 0 {
            return Ok(());
        }
        let group = std::mem::replace(&mut self.group, empty(&self.names));
        let mut chunks = Vec::new();
        for values in group {
            let page = page(&values);
            chunks.push([self.position, page.len() as u64]);
            self.out.write_all(&page)?;
            self.position += page.len() as u64;
        }
        self.groups.push((self.in_group as u64, chunks));
        self.rows += self.in_group as u64;
        self.in_group = 0;
        Ok(())
    }

    /// Ends the table.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn end(mut self) -> io::Result<()> {
        self.end_group()?;
        let footer = self.footer();
        let length = u32::try_from(footer.len()).map_err(io::Error::other)?;
        self.out.write_all(&footer)?;
        self.out.write_all(&length.to_le_bytes())?;
        self.out.write_all(MAGIC)
    }

    /// The structure `FileMetaData`.
    fn footer(&self) -> Vec<u8> {
        let mut out = Thrift::default();
        out.number(1, I32, 2);
        out.list(2, STRUCT, self.names.len() + 1);
        out.begin();
        out.text(4, "schema");
        out.number(5, I32, self.names.len() as i64);
        out.end();
        for (name, kind) in &self.names {
            out.begin();
            out.number(1, I32, kind.code());
            // Optional.
            out.number(3, I32, 1);
            out.text(4, name);
            if *kind == ColumnKind::Text {
                // UTF8.
                out.number(6, I32, 0);
            }
            out.end();
        }
        out.number(3, I64, self.rows as i64);
        out.list(4, STRUCT, self.groups.len());
        for (rows, chunks) in &self.groups {
            out.begin();
            out.list(1, STRUCT, chunks.len());
            for ([place, size], (name, kind)) in chunks.iter().zip(&self.names) {
                let (place, size) = (*place as i64, *size as i64);
                out.begin();
                out.number(2, I64, place);
                out.field(3, STRUCT);
                out.begin();
                out.number(1, I32, kind.code());
                out.list(2, I32, 2);
                // Plain values, run-length levels.
                out.element(0);
                out.element(3);
                out.list(3, BINARY, 1);
                out.bytes(name.as_bytes());
                // Uncompressed.
                out.number(4, I32, 0);
                out.number(5, I64, *rows as i64);
                out.number(6, I64, size);
                out.number(7, I64, size);
                out.number(9, I64, place);
                out.end();
                out.end();
            }
            let size: u64 = chunks.iter().map(|[_, size]| size).sum();
            out.number(2, I64, size as i64);
            out.number(3, I64, *rows as i64);
            out.end();
        }
        out.text(6, concat!("kmcfit ", env!("CARGO_PKG_VERSION")));
        out.finish()
    }
}

fn empty(names: &[(String, ColumnKind)]) -> Vec<Values> {
    let kind = |(_, kind): &(String, ColumnKind)| match kind {
        ColumnKind::Number => Values::Numbers(Vec::new()),
        ColumnKind::Text => Values::Texts(Vec::new()),
    };
    names.iter().map(kind).collect()
}

impl ColumnKind {
    /// Physical type.
    fn code(self) -> i64 {
        match self {
            Self::Number => 5,
            Self::Text => 6,
        }
    }
}

/// A data page with its header.
fn page(values: &Values) -> Vec<u8> {
    let present: Vec<bool> = match values {
        Values::Numbers(list) => list.iter().map(Option::is_some).collect(),
        Values::Texts(list) => list.iter().map(Option::is_some).collect(),
    };
    let levels = levels(&present);
    let mut body = (levels.len() as u32).to_le_bytes().to_vec();
    body.extend(levels);
    match values {
        Values::Numbers(list) => {
            body.extend(list.iter().flatten().flat_map(|x| x.to_le_bytes()));
        }
        Values::Texts(list) => {
            for text in list.iter().flatten() {
                body.extend((text.len() as u32).to_le_bytes());
                body.extend(text.as_bytes());
            }
        }
    }
    let mut header = Thrift::default();
    // A data page.
    header.number(1, I32, 0);
    header.number(2, I32, body.len() as i64);
    header.number(3, I32, body.len() as i64);
    header.field(5, STRUCT);
    header.begin();
    header.number(1, I32, present.len() as i64);
    header.number(2, I32, 0);
    header.number(3, I32, 3);
    header.number(4, I32, 3);
    header.end();
    let mut page = header.finish();
    page.extend(body);
    page
}

/// Definition levels, 1 for a value and 0 for null: one run of packed bits.
fn levels(present: &[bool]) -> Vec<u8> {
    let bytes = present.chunks(8).map(|eight| {
        let bits = eight.iter().enumerate();
        bits.fold(0u8, |byte, (i, is)| byte | u8::from(*is) << i)
    });
    let bytes: Vec<u8> = bytes.collect();
    let mut out = Vec::new();
    varint(&mut out, (bytes.len() as u64) << 1 | 1);
    out.extend(bytes);
    out
}

const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// Writer of Thrift structures in the compact protocol.
#[derive(Default)]
struct Thrift {
    out: Vec<u8>,
    /// Number of the last field of the current structure, and of those around it.
    last: i16,
    around: Vec<i16>,
}

impl Thrift {
    fn begin(&mut self) {
        self.around.push(std::mem::take(&mut self.last));
    }

    fn end(&mut self) {
        self.out.push(0);
        self.last = self.around.pop().unwrap_or_default();
    }

    fn finish(mut self) -> Vec<u8> {
        self.out.push(0);
        self.out
    }

    /// The head of a field; the numbers of fields ascend by less than 16.
    fn field(&mut self, number: i16, kind: u8) {
        let step = (number - self.last) as u8;
        self.out.push(step << 4 | kind);
        self.last = number;
    }

    fn number(&mut self, field: i16, kind: u8, value: i64) {
        self.field(field, kind);
        self.element(value);
    }

    /// A number in a list.
    fn element(&mut self, value: i64) {
        varint(&mut self.out, (value << 1 ^ value >> 63) as u64);
    }

    fn text(&mut self, field: i16, text: &str) {
        self.field(field, BINARY);
        self.bytes(text.as_bytes());
    }

    fn bytes(&mut self, bytes: &[u8]) {
        varint(&mut self.out, bytes.len() as u64);
        self.out.extend(bytes);
    }

    fn list(&mut self, field: i16, kind: u8, count: usize) {
        self.field(field, LIST);
        match u8::try_from(count).ok().filter(|count| *count < 15) {
            Some(count) => self.out.push(count << 4 | kind),
            None => {
                self.out.push(0xf0 | kind);
                varint(&mut self.out, count as u64);
            }
        }
    }
}

fn varint(out: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}
