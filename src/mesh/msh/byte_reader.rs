//! The sections of a `.msh` file and the numbers in them, text or binary.

use std::{borrow::Cow, fmt::Display, str::FromStr};

/// The error is what is wrong, and at which byte (`None`: in the file as a whole), before the file
/// has a name.
pub type Result<T> = std::result::Result<T, (Option<usize>, String)>;

/// The error of `problem` at a byte of the file, or without one in the file as a whole.
pub fn error_at<T>(at: impl Into<Option<usize>>, problem: impl Into<String>) -> Result<T> {
    Err((at.into(), problem.into()))
}

/// An error: the file has `found` instead of `what`. Long texts are cut.
pub fn expected<T>(at: usize, what: &str, found: impl Display) -> Result<T> {
    let found: String = found.to_string().trim().escape_debug().collect();
    error_at(at, format!("expected {what}, found `{found:.40}`"))
}

/// The error of a file that is not a mesh file.
pub fn not_a_mesh<T>(at: impl Into<Option<usize>>) -> Result<T> {
    error_at(at, "not a gmsh mesh: it does not begin with $MeshFormat")
}

/// The part of a file between the lines `$Name` and `$EndName`.
pub struct Section<'a> {
    pub name: &'a str,
    /// The byte at which the section begins, with its first line.
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
            at += blanks(&bytes[at..]);
            let line = first_line(&bytes[at..]);
            if line.is_empty() {
                return Ok(());
            }
            let name = line.trim_ascii_end().strip_prefix(b"$");
            let name = match name.and_then(|name| str::from_utf8(name).ok()) {
                Some(name @ ("MeshFormat" | "Comments" | "NOD")) => name,
                _ if sections.is_empty() => return not_a_mesh(at),
                Some(name) => name,
                None => {
                    let found = String::from_utf8_lossy(line);
                    return expected(at, "a section line such as $Nodes", found);
                }
            };
            let start = at + line.len();
            // The sections of version 1 have capitals.
            let last = if matches!(name, "NOD" | "ELM") { "$END" } else { "$End" };
            let last = format!("{last}{name}");
            let mut dollars = (start..bytes.len()).filter(|&i| bytes[i] == b'$');
            let end = dollars.find(|&i| bytes[i..].starts_with(last.as_bytes()));
            sections.push(Self { name, at, bytes: &bytes[..end.unwrap_or(bytes.len())], start });
            let Some(end) = end else {
                let cut = format!("the file ends inside ${name}: it was cut off; {AGAIN}");
                return error_at(bytes.len(), cut);
            };
            at = end + last.len();
        }
    }
}

/// The advice for an incomplete file.
const AGAIN: &str = "mesh or copy it again";

fn first_line(bytes: &[u8]) -> &[u8] {
    bytes.split_inclusive(|&b| b == b'\n').next().unwrap_or_default()
}

/// The number of blanks at the start of `bytes`.
fn blanks(bytes: &[u8]) -> usize {
    bytes.iter().take_while(|b| b.is_ascii_whitespace()).count()
}

/// Reads a section from start to end. No read goes beyond the end of the section, so counts need no check.
pub struct ByteReader<'a> {
    section: &'a Section<'a>,
    position: usize,
    pub encoding: Encoding,
}

/// How a file writes its numbers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Encoding {
    /// Are they binary, counts with eight bytes (`size_t`)? Otherwise they are words between blanks.
    pub is_binary: bool,
    /// Do binary numbers have the byte order of other machines?
    pub is_swapped: bool,
    /// Do binary tags of nodes and elements have four bytes (`int`), as before version 4.1, or eight?
    pub has_short_tags: bool,
}

impl<'a> ByteReader<'a> {
    /// A reader at the start of `section`.
    pub fn new(section: &'a Section, encoding: Encoding) -> Self {
        Self { section, position: section.start, encoding }
    }

    /// The name of the section.
    pub fn section_name(&self) -> &'a str {
        self.section.name
    }

    /// The byte of the next item, after the blanks of a text file.
    pub fn position(&mut self) -> usize {
        if !self.encoding.is_binary {
            self.position += blanks(self.rest());
        }
        self.position
    }

    fn rest(&self) -> &'a [u8] {
        &self.section.bytes[self.position..]
    }

    /// Checks that the section is read to its end.
    pub fn finish(self) -> Result<()> {
        let rest = self.rest().trim_ascii_start();
        if rest.is_empty() {
            return Ok(());
        }
        let at = self.section.bytes.len() - rest.len();
        expected(at, "the end of the section ($End…)", String::from_utf8_lossy(first_line(rest)))
    }

    /// The rest of the line, without surrounding blanks.
    pub fn line(&mut self, what: &str) -> Result<Cow<'a, str>> {
        let line = self.take(what, first_line(self.rest()).len().max(1))?;
        Ok(String::from_utf8_lossy(line.trim_ascii()))
    }

    /// A count on its own line, which is text also in binary files.
    pub fn count_line(&mut self) -> Result<u64> {
        let at = self.position();
        let line = self.line("a count")?;
        line.parse().or_else(|_| expected(at, "a count", line))
    }

    /// An `int`.
    pub fn int(&mut self, what: &str) -> Result<i32> {
        self.number(what, i32::from_ne_bytes)
    }

    /// The tag of a node or an element: a whole number that is not negative.
    pub fn tag(&mut self, what: &str) -> Result<u64> {
        let Encoding { is_binary: true, has_short_tags: true, .. } = self.encoding else {
            return self.size(what);
        };
        let (at, tag) = (self.position(), self.int(what)?);
        u64::try_from(tag).or_else(|_| expected(at, what, tag))
    }

    /// A count: a whole number that is not negative.
    pub fn size(&mut self, what: &str) -> Result<u64> {
        self.number(what, u64::from_ne_bytes)
    }

    /// A `double`, which may be infinite or not a number.
    pub fn real(&mut self, what: &str) -> Result<f64> {
        self.number(what, f64::from_ne_bytes)
    }

    /// The next `N` bytes of a binary file or the next word of a text file as a number.
    fn number<T: FromStr, const N: usize>(
        &mut self,
        what: &str,
        from_bytes: fn([u8; N]) -> T,
    ) -> Result<T> {
        let at = self.position();
        if self.encoding.is_binary {
            let bytes = self.take(what, N)?;
            let is_swapped = self.encoding.is_swapped;
            return Ok(from_bytes(std::array::from_fn(|i| {
                bytes[if is_swapped { N - 1 - i } else { i }]
            })));
        }
        let length = self.rest().iter().take_while(|b| !b.is_ascii_whitespace()).count();
        let word = String::from_utf8_lossy(self.take(what, length.max(1))?);
        word.parse().or_else(|_| expected(at, what, word))
    }

    /// The next `count` bytes.
    fn take(&mut self, what: &str, count: usize) -> Result<&'a [u8]> {
        let Some(bytes) = self.rest().get(..count) else {
            let section = self.section.name;
            let problem = format!(
                "expected {what}, but ${section} ends here: it lists less than it announces; {AGAIN}"
            );
            return error_at(self.position, problem);
        };
        self.position += count;
        Ok(bytes)
    }
}
