//! Γ_C: `contact.csv` with a row per contact node and frame, and lines for ParaView.

use super::{
    OutputError, Table,
    data_array::DataArray,
    vtu::{BYTE, FrameList, INTEGER, REAL, vtk_file},
    write_whole,
};
use crate::{
    archive::Archive,
    evolution::{ContactRow, Observed},
};
use std::{
    io, iter,
    path::{Path, PathBuf},
};

const TABLE: &str = "contact.csv";
/// VTK_LINE.
const LINE: u8 = 3;

/// Writes Γ_C in every frame, `contact_NNNN.vtu`, and all frames into `contact.csv`.
pub(super) struct ContactWriter {
    folder: PathBuf,
    list: FrameList,
    /// On the first rank, once there was a contact node.
    table: Option<Table>,
}

impl ContactWriter {
    /// A writer into `folder`.
    pub(super) fn new(folder: &Path) -> Self {
        let list = FrameList::new(folder.join("contact.pvd"));
        Self { folder: folder.to_owned(), list, table: None }
    }

    /// Saves how long list and table are, or goes back to that.
    pub(super) fn archive(&mut self, archive: &mut Archive) -> Observed {
        self.list.archive(archive)?;
        Table::archive(&mut self.table, self.folder.join(TABLE), archive)
    }

    /// Writes Γ_C at `time`, s, if there is one, its lines as `file`.
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
        let table = match self.table.take() {
            Some(table) => table,
            None => Table::create(self.folder.join(TABLE), &rows[0], &[])?,
        };
        self.table.insert(table).add(rows)?;
        let path = self.folder.join(file);
        let text = lines(rows).map_err(|e| OutputError::new(&path, e))?;
        write_whole(&path, text.as_bytes())?;
        self.list.add(time, file)
    }
}

/// The contact nodes as points, each joined with the next one of its part of Γ_C.
fn lines(rows: &[ContactRow]) -> io::Result<String> {
    let is_joined = |pair: &[ContactRow]| {
        (&pair[0].boundary, pair[0].part) == (&pair[1].boundary, pair[1].part)
    };
    let joined: Vec<_> = (0..rows.len() - 1).filter(|&i| is_joined(&rows[i..i + 2])).collect();
    let points = rows.iter().flat_map(|row| [row.x, row.y, 0.0]);
    let ends = joined.iter().flat_map(|&i| [i as i32, i as i32 + 1]);
    let scalar = |name, of: fn(&ContactRow) -> f64| {
        DataArray::new(name, REAL, 1, rows.iter().map(of)).element()
    };
    // On the body, against ν.
    let pressure =
        rows.iter().flat_map(|row| [row.normal_x, row.normal_y, 0.0].map(|n| -row.pressure * n));
    let piece = format!(
        "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n<Points>\n{}</Points>\n<Cells>\n{}{}{}\
         </Cells>\n<PointData>\n{}{}{}{}{}</PointData>\n</Piece>\n",
        rows.len(),
        joined.len(),
        DataArray::new("Points", REAL, 3, points).element()?,
        DataArray::new("connectivity", INTEGER, 1, ends).element()?,
        DataArray::new("offsets", INTEGER, 1, (1..=joined.len()).map(|i| 2 * i as i32))
            .element()?,
        DataArray::new("types", BYTE, 1, iter::repeat_n(LINE, joined.len())).element()?,
        DataArray::new("pressure_on_body", REAL, 3, pressure).element()?,
        scalar("normal_pressure", |row| row.pressure)?,
        scalar("gap", |row| row.gap)?,
        scalar("arc_length", |row| row.arc_length)?,
        scalar("active", |row| f64::from(row.active))?,
    );
    Ok(vtk_file("UnstructuredGrid", "", &piece))
}
