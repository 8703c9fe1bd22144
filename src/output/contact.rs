//! Results on Γ_C: `contact.csv` with a row per contact node and frame, and lines for ParaView.

use super::{
    OutputError, Table,
    growing_file::GrowingFile,
    vtk::{DataArray, REAL, cells_text, entry, list_of_frames, piece},
    write_whole,
};
use crate::observe::ContactRow;
use std::path::{Path, PathBuf};

/// VTK_LINE, with its number of nodes.
const LINE: (u8, usize) = (3, 2);

/// Writes Γ_C in every frame, `contact_NNNN.vtu`, and all frames into `contact.csv`.
pub(super) struct ContactWriter {
    folder: PathBuf,
    pub(super) list: GrowingFile,
    pub(super) table: Table,
}

impl ContactWriter {
    /// A writer into `folder`.
    pub(super) fn new(folder: &Path) -> Result<Self, OutputError> {
        let list = list_of_frames(folder.join("contact.pvd"));
        let table = Table::new(folder.join("contact.csv"), &ContactRow::default(), &[])?;
        Ok(Self { folder: folder.to_owned(), list, table })
    }

    /// Writes Γ_C at `time`, s, if the body has one; the lines go to `file`.
    ///
    /// # Errors
    /// A file cannot be written.
    pub(super) fn add(
        &mut self,
        file: &str,
        time: f64,
        rows: &[ContactRow],
    ) -> Result<(), OutputError> {
        if rows.is_empty() {
            return Ok(());
        }
        self.table.add(rows)?;
        write_whole(&self.folder.join(file), lines(rows).as_bytes())?;
        self.list.add(entry(time, file).as_bytes())
    }
}

/// The contact nodes as points, with lines between neighbours on Γ_C.
fn lines(rows: &[ContactRow]) -> String {
    let is_joined = |&[i, j]: &[usize; 2]| {
        (&rows[i].boundary, rows[i].part) == (&rows[j].boundary, rows[j].part)
    };
    let joined: Vec<usize> =
        (1..rows.len()).map(|i| [i - 1, i]).filter(is_joined).flatten().collect();
    let points: Vec<_> = rows.iter().map(|row| [row.x, row.y]).collect();
    let scalar =
        |name, of: fn(&ContactRow) -> f64| DataArray::new(name, REAL, 1, rows.iter().map(of));
    // The pressure acts on the body, against ν.
    let pressure =
        rows.iter().flat_map(|row| [row.normal_x, row.normal_y, 0.0].map(|n| -row.pressure * n));
    let fields = [
        DataArray::new("pressure_on_body", REAL, 3, pressure),
        scalar("normal_pressure", |row| row.pressure),
        scalar("gap", |row| row.gap),
        scalar("arc_length", |row| row.arc_length),
        scalar("active", |row| f64::from(row.active)),
    ];
    piece(&cells_text(&points, &joined, LINE), &fields, &[])
}
