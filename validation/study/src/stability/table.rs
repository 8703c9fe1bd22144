//! The table of a map: rows of named cells, each with its verdict.

use crate::StudyError;
use serde::Serialize;
use serde_json::{Map, Value};
use signorini::output::{self, OutputError};
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
pub(super) struct Row(Map<String, Value>);

impl Row {
    /// With one more cell; `None` and NaN leave it empty.
    pub(super) fn with(mut self, column: &'static str, value: impl Serialize) -> Self {
        self.0.insert(column.to_owned(), serde_json::to_value(value).unwrap_or_default());
        self
    }
}

/// The rows of a map so far.
#[derive(Debug, Default)]
pub struct Table {
    path: PathBuf,
    /// In the order of their first cells.
    columns: Vec<String>,
    rows: Vec<(Row, Verdict)>,
}

impl Table {
    /// An empty table, to be written to `path`.
    pub(super) fn new(path: PathBuf) -> Self {
        Self { path, ..Self::default() }
    }

    /// Adds a row.
    pub(super) fn push(&mut self, row: Row, verdict: Verdict) {
        for column in row.0.keys() {
            if !self.columns.contains(column) {
                self.columns.push(column.clone());
            }
        }
        self.rows.push((row, verdict));
    }

    /// Adds the row of a problem to which the program gave no answer, and why.
    pub(super) fn push_refused(&mut self, row: Row, why: impl ToString) {
        self.push(row.with("message", why.to_string()), Verdict::Refused);
    }

    /// Its verdicts.
    pub(super) fn counts(&self) -> Counts {
        let of = |kind: Verdict| self.rows.iter().filter(|(_, verdict)| *verdict == kind).count();
        let [correct, refused, wrong] =
            [Verdict::Correct, Verdict::Refused, Verdict::Wrong].map(of);
        Counts { correct, refused, wrong }
    }

    /// Writes the CSV file, if there are rows. Maps that take minutes do so now and then: what is
    /// measured is kept.
    pub(super) fn write(&self) -> Result<(), StudyError> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let titles = self.columns.iter().map(String::as_str).chain(["verdict"]);
        let mut lines: Vec<Vec<Value>> = vec![titles.map(Value::from).collect()];
        for (row, verdict) in &self.rows {
            let cells = self.columns.iter().map(|column| row.0.get(column).cloned());
            let cells = cells.map(Option::unwrap_or_default);
            lines.push(cells.chain(serde_json::to_value(verdict)).collect());
        }
        let failed = |error: csv::Error| OutputError::new(&self.path, error);
        let mut writer = csv::Writer::from_writer(Vec::new());
        lines.iter().try_for_each(|line| writer.serialize(line)).map_err(failed)?;
        let text = writer.into_inner().map_err(|error| failed(error.into_error().into()))?;
        Ok(output::write_whole(&self.path, &text)?)
    }
}
