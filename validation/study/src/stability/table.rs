//! The table of a map: rows of named cells, each with its verdict.

use crate::StudyError;
use serde::Serialize;
use serde_json::Value;
use signorini::output;
use std::path::PathBuf;

/// What a row of a map turned out to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The answer is right to the accuracy promised.
    Correct,
    /// The program gave no answer and said why.
    Refused,
    /// The program gave a wrong answer without saying so.
    Wrong,
}

impl Verdict {
    /// Of an answer that the program gave without a reservation.
    pub(super) fn of_answer(right: bool) -> Self {
        if right { Self::Correct } else { Self::Wrong }
    }
}

/// How many rows of a map were of which kind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Right answers.
    pub correct: usize,
    /// Refusals with a reason.
    pub refused: usize,
    /// Wrong answers that the program did not report.
    pub wrong: usize,
}

/// What was tried and what came of it: cells by their columns.
#[derive(Debug, Clone, Default)]
pub(super) struct Row(Vec<(&'static str, Value)>);

impl Row {
    /// With one more cell; `None` and NaN leave it empty.
    pub(super) fn with(mut self, column: &'static str, value: impl Serialize) -> Self {
        self.0.push((column, serde_json::to_value(value).unwrap_or_default()));
        self
    }
}

/// The rows of a map so far.
#[derive(Debug, Default)]
pub struct Table {
    path: PathBuf,
    /// In the order of their first cells.
    columns: Vec<&'static str>,
    rows: Vec<Row>,
    counts: Counts,
}

impl Table {
    /// An empty table, to be written to `path`.
    pub(super) fn new(path: PathBuf) -> Self {
        Self { path, ..Self::default() }
    }

    /// Adds a row.
    pub(super) fn push(&mut self, row: Row, verdict: Verdict) {
        match verdict {
            Verdict::Correct => self.counts.correct += 1,
            Verdict::Refused => self.counts.refused += 1,
            Verdict::Wrong => self.counts.wrong += 1,
        }
        let row = row.with("verdict", verdict);
        for (column, _) in &row.0 {
            if !self.columns.contains(column) {
                self.columns.push(column);
            }
        }
        self.rows.push(row);
    }

    /// Its verdicts.
    pub(super) fn counts(&self) -> Counts {
        self.counts
    }

    /// Writes the CSV file, if there are rows. Maps that take minutes do so now and then: what is
    /// measured is kept.
    pub(super) fn write(&self) -> Result<(), StudyError> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let cell = |row: &Row, column: &&str| {
            let found = row.0.iter().find(|(name, _)| name == column);
            found.map_or(Value::Null, |(_, value)| value.clone())
        };
        let header = self.columns.iter().map(|&column| column.into()).collect();
        let rows = self.rows.iter();
        let rows = rows.map(|row| self.columns.iter().map(|column| cell(row, column)).collect());
        let lines: Vec<Vec<Value>> = std::iter::once(header).chain(rows).collect();
        Ok(output::write_table(&self.path, &lines)?)
    }
}
