//! The sections of a `.msh` file and the numbers in them, whether text or binary.

use super::super::error::Problem;
use std::{borrow::Cow, str::FromStr};

/// What is wrong and at which byte (`None`: in the file as a whole), before the file has a name.
#[derive(Debug)]
pub struct Fault {
    pub at: Option<usize>,
    pub problem: Problem,
}

pub type Result<T> = std::result::Result<T, Fault>;

/// The error of `problem` at a byte of the file, or without one in the file as a whole.
pub fn fault<T>(at: impl Into<Option<usize>>, problem: Problem) -> Result<T> {
    Err(Fault { at: at.into(), problem })
}

/// The error of finding something else, shortened to what fits a terminal.
pub fn expected<T>(at: usize, what: &str, found: &str) -> Result<T> {
    let mut found: String = found.escape_debug().collect();
    if found.chars().count() > 40 {
        found = found.chars().take(40).chain(['…']).collect();
    }
    fault(at, Problem::Expected { what: what.to_owned(), found })
}

/// How a file writes its numbers.
#[derive(Clone, Copy, PartialEq)]
pub enum Numbers {
    /// As words between blanks.
    Text,
    /// Binary; tags and counts are `int`s of four bytes (MSH 2.2).
    Binary2,
    /// Binary; tags and counts are `size_t`s of eight bytes (MSH 4.1).
    Binary4,
}

/// What stands between the lines `$Name` and `$EndName`.
pub struct Section<'a> {
    pub name: &'a str,
    /// Where the section begins, at its first line.
    pub at: usize,
    /// The file up to the section's last line.
    bytes: &'a [u8],
    /// The first byte after the section's first line.
    start: usize,
}

impl<'a> Section<'a> {
    /// Divides a file into `sections`. Their first and last lines are text in any file.
    pub fn split(bytes: &'a [u8], sections: &mut Vec<Self>) -> Result<()> {
        let mut at = 0;
        loop {
            at += bytes[at..].iter().take_while(|b| b.is_ascii_whitespace()).count();
            let line = first_line(&bytes[at..]);
            if line.is_empty() {
                return Ok(());
            }
            let Some(Ok(name)) = line.trim_ascii_end().strip_prefix(b"$").map(str::from_utf8)
            else {
                let found = String::from_utf8_lossy(line);
                return match sections.is_empty() {
                    true => fault(at, Problem::NotMsh),
                    false => expected(at, "a section line such as $Nodes", found.trim_end()),
                };
            };
            match name {
                "MeshFormat" | "Comments" => {}
                // MSH 1 had no header.
                "NOD" | "ELM" => return fault(at, Problem::Version("1".to_owned())),
                _ if sections.is_empty() => return fault(at, Problem::NotMsh),
                _ => {}
            }
            let start = at + line.len();
            let last = format!("$End{name}");
            let mut dollars = (start..bytes.len()).filter(|&i| bytes[i] == b'$');
            let end = dollars.find(|&i| bytes[i..].starts_with(last.as_bytes()));
            sections.push(Self { name, at, bytes: &bytes[..end.unwrap_or(bytes.len())], start });
            let Some(end) = end else {
                return fault(bytes.len(), Problem::Truncated { section: name.to_owned() });
            };
            at = end + last.len();
        }
    }
}

fn first_line(bytes: &[u8]) -> &[u8] {
    bytes.split_inclusive(|&b| b == b'\n').next().unwrap_or_default()
}

/// Reads a section from front to back. No read goes beyond its end: counts need no check.
pub struct ByteReader<'a> {
    section: &'a Section<'a>,
    position: usize,
    pub numbers: Numbers,
}

impl<'a> ByteReader<'a> {
    /// At the start of `section`.
    pub fn new(section: &'a Section, numbers: Numbers) -> Self {
        Self { section, position: section.start, numbers }
    }

    /// Whether numbers are binary.
    pub fn is_binary(&self) -> bool {
        self.numbers != Numbers::Text
    }

    /// The byte of the next item, past the blanks of a text file.
    pub fn position(&mut self) -> usize {
        if !self.is_binary() {
            self.skip_blanks();
        }
        self.position
    }

    fn skip_blanks(&mut self) {
        self.position += self.rest().iter().take_while(|b| b.is_ascii_whitespace()).count();
    }

    fn rest(&self) -> &'a [u8] {
        &self.section.bytes[self.position..]
    }

    /// Makes sure that the section holds nothing more.
    pub fn finish(mut self) -> Result<()> {
        self.skip_blanks();
        match self.rest() {
            [] => Ok(()),
            rest => {
                let found = String::from_utf8_lossy(first_line(rest).trim_ascii());
                expected(self.position, "the end of the section ($End…)", &found)
            }
        }
    }

    /// The rest of the line, without surrounding blanks.
    pub fn line(&mut self, what: &str) -> Result<Cow<'a, str>> {
        let line = first_line(self.rest());
        if line.is_empty() {
            return self.section_ends(what);
        }
        self.position += line.len();
        Ok(String::from_utf8_lossy(line.trim_ascii()))
    }

    /// A count on a line of its own, which is text in any file.
    pub fn count_line(&mut self) -> Result<u64> {
        let at = self.position();
        let line = self.line("a count")?;
        line.parse().or_else(|_| expected(at, "a count", &line))
    }

    /// An `int`.
    pub fn int(&mut self, what: &str) -> Result<i32> {
        if self.is_binary() { Ok(i32::from_ne_bytes(self.take(what)?)) } else { self.word(what) }
    }

    /// A tag or a count: a whole number that is not negative.
    pub fn size(&mut self, what: &str) -> Result<u64> {
        match self.numbers {
            Numbers::Text => self.word(what),
            Numbers::Binary4 => Ok(u64::from_ne_bytes(self.take(what)?)),
            Numbers::Binary2 => {
                let (at, value) = (self.position, self.int(what)?);
                u64::try_from(value).or_else(|_| expected(at, what, &value.to_string()))
            }
        }
    }

    /// A `double`, which may be infinite or not a number.
    pub fn real(&mut self) -> Result<f64> {
        let what = "a number";
        if self.is_binary() { Ok(f64::from_ne_bytes(self.take(what)?)) } else { self.word(what) }
    }

    /// The next bytes of a binary file.
    fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        let Some(bytes) = self.rest().first_chunk() else { return self.section_ends(what) };
        self.position += N;
        Ok(*bytes)
    }

    /// The next word of a text file as a number.
    fn word<T: FromStr>(&mut self, what: &str) -> Result<T> {
        self.skip_blanks();
        let (at, rest) = (self.position, self.rest());
        let length = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
        if length == 0 {
            return self.section_ends(what);
        }
        self.position += length;
        match str::from_utf8(&rest[..length]).ok().and_then(|word| word.parse().ok()) {
            Some(value) => Ok(value),
            None => expected(at, what, &String::from_utf8_lossy(&rest[..length])),
        }
    }

    fn section_ends<T>(&self, what: &str) -> Result<T> {
        let (what, section) = (what.to_owned(), self.section.name.to_owned());
        fault(self.position, Problem::SectionEnds { what, section })
    }
}
