//! A file that grows and is whole whenever the program is killed.

use super::{OutputError, write_whole};
use crate::{archive::Archive, evolution::Observed};
use std::{
    fs::File,
    io,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

/// A file that grows by whole pieces between a beginning and an ending, and has both at any time; it is
/// created with its first piece.
///
/// A piece and the ending behind it are one write over the ending before.
#[derive(Debug)]
pub(super) struct GrowingFile {
    path: PathBuf,
    beginning: String,
    ending: &'static str,
    /// Once it is there, with the bytes in front of the ending.
    file: Option<(File, u64)>,
}

impl GrowingFile {
    pub(super) fn new(path: PathBuf, beginning: String, ending: &'static str) -> Self {
        Self { path, beginning, ending, file: None }
    }

    /// Saves where the file ends, or goes back to that end of the file that is there.
    pub(super) fn archive(&mut self, archive: &mut Archive) -> Observed {
        let mut length = self.file.as_ref().map(|(_, length)| *length);
        archive.value(&mut length)?;
        if archive.is_loading() {
            let reopened = length.map(|length| self.reopen(length)).transpose();
            self.file = reopened.map_err(|e| OutputError::new(&self.path, e))?;
        }
        Ok(())
    }

    fn reopen(&self, length: u64) -> io::Result<(File, u64)> {
        let file = File::options().write(true).open(&self.path)?;
        if file.metadata()?.len() < length {
            return Err(io::Error::other("it is shorter than when the checkpoint was written"));
        }
        end_at(&file, length, self.ending)?;
        Ok((file, length))
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a piece.
    pub(super) fn add(&mut self, piece: &[u8]) -> Result<(), OutputError> {
        let failed = |e: io::Error| OutputError::new(&self.path, e);
        if self.file.is_none() {
            write_whole(&self.path, [&self.beginning, self.ending].concat().as_bytes())?;
            self.file = Some(self.reopen(self.beginning.len() as u64).map_err(failed)?);
        }
        let Some((file, length)) = &mut self.file else { return Ok(()) };
        let text = [piece, self.ending.as_bytes()].concat();
        if let Err(error) = file.write_all_at(&text, *length) {
            // A full disk takes a part of it: the file ends as before.
            let _ = end_at(file, *length, self.ending);
            return Err(failed(error));
        }
        *length += piece.len() as u64;
        Ok(())
    }
}

/// Puts the ending behind the first `length` bytes.
fn end_at(file: &File, length: u64, ending: &str) -> io::Result<()> {
    file.write_all_at(ending.as_bytes(), length)?;
    file.set_len(length + ending.len() as u64)
}
