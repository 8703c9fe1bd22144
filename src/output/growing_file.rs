//! A file that grows and is whole whenever the program is killed.

use super::{OutputError, write_whole};
use crate::{archive::Archive, evolution::Observed};
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

    /// Saves where the file ends, or goes back to that end of the file at `path`; `None` where there was
    /// no file.
    pub(super) fn archive(
        this: &mut Option<Self>,
        path: PathBuf,
        ending: &'static str,
        archive: &mut Archive,
    ) -> Observed {
        let mut length = this.as_ref().map(|file| file.length);
        archive.value(&mut length)?;
        if archive.is_loading() {
            *this = length.map(|length| Self::reopen(path, length, ending)).transpose()?;
        }
        Ok(())
    }

    fn reopen(path: PathBuf, length: u64, ending: &'static str) -> Result<Self, OutputError> {
        let reopened = File::options().write(true).open(&path).and_then(|file| {
            let there = file.metadata()?.len();
            let mut this = Self { path: path.clone(), file, length, ending };
            if there < length {
                return Err(io::Error::other("it is shorter than when the checkpoint was written"));
            }
            this.end_at(length)?;
            Ok(this)
        });
        reopened.map_err(|e| OutputError::new(&path, e))
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
