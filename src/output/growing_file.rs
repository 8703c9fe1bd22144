//! A file that grows and is whole whenever the program is killed.

use super::{OutputError, write_whole};
use std::{
    fs::File,
    io,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

/// A file that grows by whole pieces in front of an ending that is always there.
///
/// A piece and the ending behind it are one write over the ending before.
#[derive(Debug)]
pub(super) struct GrowingFile {
    path: PathBuf,
    file: File,
    /// Bytes in front of the ending.
    length: u64,
    ending: &'static str,
}

impl GrowingFile {
    /// A new file with a first piece in front of its ending.
    pub(super) fn create(
        path: PathBuf,
        piece: &str,
        ending: &'static str,
    ) -> Result<Self, OutputError> {
        write_whole(&path, [piece, ending].concat().as_bytes())?;
        let file = File::options().write(true).open(&path);
        let file = file.map_err(|e| OutputError::new(&path, e))?;
        Ok(Self { path, file, length: piece.len() as u64, ending })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a piece.
    pub(super) fn add(&mut self, piece: &[u8]) -> Result<(), OutputError> {
        let text = [piece, self.ending.as_bytes()].concat();
        if let Err(error) = self.file.write_all_at(&text, self.length) {
            // A full disk takes a part of it: the file ends as before.
            let _ = self.end_at(self.length);
            return Err(OutputError::new(&self.path, error));
        }
        self.length += piece.len() as u64;
        Ok(())
    }

    /// Puts the ending behind the first `length` bytes.
    fn end_at(&mut self, length: u64) -> io::Result<()> {
        self.file.write_all_at(self.ending.as_bytes(), length)?;
        self.file.set_len(length + self.ending.len() as u64)?;
        self.length = length;
        Ok(())
    }
}
