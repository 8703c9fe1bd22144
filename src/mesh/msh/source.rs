//! One stream of numbers out of a text or a binary `.msh`, so that the formats are read once.

use super::super::error::{Place, Problem};

/// A problem and the byte where it was found, before the file has a name.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) at: Option<usize>,
    pub(super) problem: Problem,
}

pub(super) type Result<T> = std::result::Result<T, Fault>;

/// Reads the bytes of a mesh file from front to back.
pub(super) struct Source<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Whether the data between the section lines are binary.
    pub(super) binary: bool,
    /// Where each section begins, to say later in which one a byte lies.
    sections: Vec<(usize, String)>,
}

impl<'a> Source<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, binary: false, sections: Vec::new() }
    }

    /// Offset of the next item, past the blanks of a text file.
    pub(super) fn at(&mut self) -> usize {
        if !self.binary {
            self.skip_blanks();
        }
        self.at
    }

    /// The place of a byte, as the reader of the message counts.
    pub(super) fn place(&self, at: usize) -> Place {
        let before = &self.bytes[..at.min(self.bytes.len())];
        if self.binary {
            let section = self.sections.iter().rev().find(|(start, _)| *start <= at);
            Place::Byte {
                section: section.map(|(_, name)| name.clone()).unwrap_or_default(),
                byte: at,
            }
        } else {
            Place::Line(1 + before.iter().filter(|&&b| b == b'\n').count())
        }
    }

    /// A fault at a byte.
    pub(super) fn fault<T>(&self, at: usize, problem: Problem) -> Result<T> {
        Err(Fault { at: Some(at), problem })
    }

    fn truncated<T>(&self) -> Result<T> {
        let section = self.section_name().to_owned();
        self.fault(self.bytes.len(), Problem::Truncated { section })
    }

    fn section_name(&self) -> &str {
        self.sections.last().map_or("MeshFormat", |(_, name)| name)
    }

    /// Opens the next section and returns its name, or `None` at the end of the file.
    pub(super) fn open(&mut self) -> Result<Option<String>> {
        self.skip_blanks();
        let start = self.at;
        if start == self.bytes.len() {
            return Ok(None);
        }
        let line = self.line()?;
        match line.strip_prefix('$') {
            Some(name) => {
                self.sections.push((start, name.to_owned()));
                Ok(Some(name.to_owned()))
            }
            None if self.sections.is_empty() => self.fault(start, Problem::NotMsh),
            None => self.expected(start, "a section line such as $Nodes", &line),
        }
    }

    /// Reads the closing line of the open section.
    pub(super) fn close(&mut self) -> Result<()> {
        self.skip_blanks();
        let start = self.at;
        if start == self.bytes.len() {
            return self.truncated();
        }
        let line = self.line()?;
        if line.strip_prefix("$End") == Some(self.section_name()) {
            return Ok(());
        }
        let complete = self.bytes.get(self.at.saturating_sub(1)) == Some(&b'\n');
        if complete {
            self.expected(start, "the end of the section ($End…)", &line)
        } else {
            self.truncated()
        }
    }

    /// Passes over the open section.
    pub(super) fn skip(&mut self) -> Result<()> {
        let end = format!("$End{}", self.section_name());
        let rest = &self.bytes[self.at..];
        match rest.windows(end.len()).position(|w| w == end.as_bytes()) {
            Some(offset) => {
                self.at += offset;
                self.close()
            }
            None => self.truncated(),
        }
    }

    fn skip_blanks(&mut self) {
        let rest = &self.bytes[self.at..];
        let blanks = rest.iter().take_while(|b| b.is_ascii_whitespace()).count();
        self.at += blanks;
    }

    /// The rest of the line, without surrounding blanks; section lines are text in any file.
    pub(super) fn line(&mut self) -> Result<String> {
        let rest = &self.bytes[self.at..];
        if rest.is_empty() {
            return self.truncated();
        }
        let length = rest.iter().position(|&b| b == b'\n');
        let line = &rest[..length.unwrap_or(rest.len())];
        self.at += length.map_or(rest.len(), |n| n + 1);
        Ok(String::from_utf8_lossy(line.trim_ascii()).into_owned())
    }

    /// A number on a line of its own, text in any file.
    pub(super) fn count_line(&mut self, what: &'static str, numbers: u64) -> Result<usize> {
        let start = self.at();
        let line = self.line()?;
        match line.parse() {
            Ok(count) => self.bounded(start, what, count, numbers),
            Err(_) => self.expected(start, "a count", &line),
        }
    }

    /// A count of items of at least `numbers` numbers each. One that the rest of the file
    /// cannot hold is an error: nothing may be allocated on its word.
    pub(super) fn count(&mut self, what: &'static str, numbers: u64) -> Result<usize> {
        let start = self.at();
        let count = self.size("a count")?;
        self.bounded(start, what, count, numbers)
    }

    /// Checks a count already read; see [`count`](Self::count).
    pub(super) fn bounded(
        &self,
        start: usize,
        what: &'static str,
        count: u64,
        numbers: u64,
    ) -> Result<usize> {
        // A digit and a blank, or the shortest binary integer. The last blank may be missing.
        let shortest = numbers * if self.binary { 4 } else { 2 };
        let rest = (self.bytes.len() - self.at) as u64 + 1;
        match usize::try_from(count) {
            Ok(fits) if count.saturating_mul(shortest) <= rest => Ok(fits),
            _ => self.fault(start, Problem::Count { what, count }),
        }
    }

    /// An `int`: four bytes in a binary file.
    pub(super) fn int(&mut self, what: &'static str) -> Result<i32> {
        if self.binary { Ok(i32::from_ne_bytes(self.take()?)) } else { self.parse(what) }
    }

    /// A `size_t`: eight bytes in a binary file.
    pub(super) fn size(&mut self, what: &'static str) -> Result<u64> {
        if self.binary { Ok(u64::from_ne_bytes(self.take()?)) } else { self.parse(what) }
    }

    /// A `double`, which may be infinite or not a number.
    pub(super) fn real(&mut self) -> Result<f64> {
        if self.binary { Ok(f64::from_ne_bytes(self.take()?)) } else { self.parse("a number") }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        match self.bytes[self.at..].first_chunk() {
            Some(chunk) => {
                self.at += N;
                Ok(*chunk)
            }
            None => self.truncated(),
        }
    }

    fn parse<T: std::str::FromStr>(&mut self, what: &'static str) -> Result<T> {
        self.skip_blanks();
        let start = self.at;
        let rest = &self.bytes[start..];
        let length = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
        if length == 0 {
            return self.truncated();
        }
        self.at += length;
        let word = &rest[..length];
        match std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()) {
            Some(value) => Ok(value),
            None => self.expected(start, what, &String::from_utf8_lossy(word)),
        }
    }

    /// The fault of finding something else, shortened to what fits a terminal.
    pub(super) fn expected<T>(&self, at: usize, what: &'static str, found: &str) -> Result<T> {
        let mut found: String = found.escape_debug().collect();
        if found.chars().count() > 40 {
            found = found.chars().take(40).chain(['…']).collect();
        }
        self.fault(at, Problem::Expected { what, found })
    }
}
