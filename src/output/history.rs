//! `history.csv`: a row per step.

use super::OutputError;
use crate::evolution::StepRecord;
use std::{
    fs::File,
    path::{Path, PathBuf},
};

/// Writes one row per accepted step, at once, so that a run can be followed.
pub struct History {
    path: PathBuf,
    writer: csv::Writer<File>,
}

impl History {
    /// Starts `history.csv` in `folder`.
    pub fn create(folder: &Path) -> Result<Self, OutputError> {
        let path = folder.join("history.csv");
        let writer = csv::Writer::from_path(&path).map_err(|e| OutputError::new(&path, e))?;
        Ok(Self { path, writer })
    }

    /// Appends a step.
    pub fn add(&mut self, record: &StepRecord) -> Result<(), OutputError> {
        self.writer.serialize(record).map_err(|e| OutputError::new(&self.path, e))?;
        self.writer.flush().map_err(|e| OutputError::new(&self.path, e))
    }
}
