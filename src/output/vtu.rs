//! Fields for ParaView: VTK XML unstructured grids and their collection over time.
//!
//! The arrays are encoded here and not by the VTK crate, which reads these files back in the tests:
//! it compresses value by value and took 0.9 s for a frame of 66,049 nodes.

use super::{
    OutputError,
    array::{data_array, head},
    pieces::{Piece, list, piece_name},
    write_whole,
};
use crate::{
    evolution::{DiscreteProblem, State},
    petsc::{Communicator, PetscError},
};
use std::path::{Path, PathBuf};

/// Writes `fields_NNNN.vtu` frames and keeps `fields.pvd` their list. Of several ranks each writes
/// its piece `fields_NNNN_R.vtu`, and the first the lists: `fields_NNNN.pvtu` and `fields.pvd`.
pub struct FieldWriter {
    folder: PathBuf,
    comm: Communicator,
    piece: Piece,
    /// Points and cells, the same in every frame.
    mesh: String,
    frames: Vec<(f64, String)>,
}

/// VTK_TRIANGLE.
const TRIANGLE: u8 = 5;
/// The arrays of every frame: name, VTK's type, components.
const AT_POINTS: [(&str, &str, usize); 4] = [
    ("displacement", "Float64", 3),
    ("zeta", "Float64", 1),
    ("normal_pressure", "Float64", 1),
    ("gap", "Float64", 1),
];
const IN_CELLS: [(&str, &str, usize); 2] = [("von_mises", "Float64", 1), ("stress", "Float64", 3)];
/// The number of a node in the whole body, by which pieces can be joined.
const NUMBER: (&str, &str, usize) = ("global_node", "Int32", 1);

impl FieldWriter {
    /// A writer for the body of `problem` into `folder`.
    ///
    /// # Errors
    /// The mesh cannot be encoded.
    pub fn new(folder: &Path, problem: &DiscreteProblem) -> Result<Self, OutputError> {
        let body = &problem.body;
        let piece = Piece::of(body);
        let mesh = mesh(&piece, &body.mesh.nodes).map_err(|e| OutputError::new(folder, e))?;
        let comm = body.partition.comm();
        Ok(Self { folder: folder.to_owned(), comm, piece, mesh, frames: Vec::new() })
    }

    /// Time of the last frame written.
    pub fn last_time(&self) -> Option<f64> {
        self.frames.last().map(|(time, _)| *time)
    }

    /// Writes a frame and the collection that names it. Collective.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn add(&mut self, problem: &DiscreteProblem, state: &State) -> Result<(), OutputError> {
        let stem = format!("fields_{:04}", self.frames.len());
        let (piece, frame) = match self.comm.is_serial() {
            true => (format!("{stem}.vtu"), format!("{stem}.vtu")),
            false => (piece_name(&stem, self.comm.rank()), format!("{stem}.pvtu")),
        };
        self.frames.push((state.time, frame.clone()));
        let path = self.folder.join(&piece);
        let contact = contact_fields(problem, state).map_err(|e| OutputError::new(&path, e))?;
        let data = self.fields(problem, state, contact).map_err(|e| OutputError::new(&path, e))?;
        let content = format!(
            "{}<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n{}{data}\
             </Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
            head("UnstructuredGrid"),
            self.piece.nodes.len(),
            self.piece.corners.len(),
            self.mesh
        );
        write_whole(&path, content.as_bytes())?;
        if !self.comm.is_root() {
            return Ok(());
        }
        if !self.comm.is_serial() {
            let points = [&AT_POINTS[..], &[NUMBER]].concat();
            let text = list(&stem, self.comm.size(), &points, &IN_CELLS);
            write_whole(&self.folder.join(frame), text.as_bytes())?;
        }
        write_whole(&self.folder.join("fields.pvd"), self.collection().as_bytes())
    }

    fn collection(&self) -> String {
        let frames: String = (self.frames.iter())
            .map(|(time, file)| format!("<DataSet timestep=\"{time}\" file=\"{file}\"/>\n"))
            .collect();
        format!("{}<Collection>\n{frames}</Collection>\n</VTKFile>\n", head("Collection"))
    }

    /// `<PointData>` and `<CellData>`.
    fn fields(
        &self,
        problem: &DiscreteProblem,
        state: &State,
        (pressure, gap): (Vec<f64>, Vec<f64>),
    ) -> std::io::Result<String> {
        let (elasticity, piece) = (&problem.elasticity, &self.piece);
        let stress: Vec<_> = (state.zeta_mean.iter().enumerate().take(piece.corners.len()))
            .map(|(t, zeta)| elasticity.stress(&problem.body, t, *zeta, &state.u))
            .collect();
        let u = &state.u;
        let displacement = piece.nodes.iter().flat_map(|&i| [u[2 * i], u[2 * i + 1], 0.0]);
        let von_mises = stress.iter().map(|s| elasticity.material.von_mises(s));
        let components = stress.iter().flat_map(|s| [s[0], s[1], s[2]]);
        let number = |&node: &usize| problem.body.partition.global(node, 1, 0);
        let [(u, _, width), (zeta, ..), (p, ..), (g, ..)] = AT_POINTS;
        let [(mises, ..), (sigma, _, parts)] = IN_CELLS;
        Ok([
            "<PointData>\n".to_owned(),
            data_array(u, width, displacement)?,
            data_array(zeta, 1, piece.values(&state.zeta))?,
            data_array(p, 1, piece.values(&pressure))?,
            data_array(g, 1, piece.values(&gap))?,
            match self.comm.is_serial() {
                true => String::new(),
                false => data_array(NUMBER.0, 1, piece.nodes.iter().map(number))?,
            },
            "</PointData>\n<CellData>\n".to_owned(),
            data_array(mises, 1, von_mises)?,
            data_array(sigma, parts, components)?,
            "</CellData>\n".to_owned(),
        ]
        .concat())
    }
}

/// `<Points>` and `<Cells>`.
fn mesh(piece: &Piece, nodes: &[[f64; 2]]) -> std::io::Result<String> {
    let cells = piece.corners.len();
    let points = data_array("Points", 3, piece.values(nodes).flat_map(|[x, y]| [x, y, 0.0]))?;
    let corners = piece.corners.iter().flatten().map(|&node| node as i32);
    let connectivity = data_array("connectivity", 1, corners)?;
    let offsets = data_array("offsets", 1, (1..=cells).map(|t| 3 * t as i32))?;
    let types = data_array("types", 1, (0..cells).map(|_| TRIANGLE))?;
    Ok(format!("<Points>\n{points}</Points>\n<Cells>\n{connectivity}{offsets}{types}</Cells>\n"))
}

/// Contact pressure (0 off Γ_C) and remaining gap (NaN off Γ_C) at the nodes; where two
/// conditions meet at a corner, the larger pressure and the smaller gap.
fn contact_fields(
    problem: &DiscreteProblem,
    state: &State,
) -> Result<(Vec<f64>, Vec<f64>), PetscError> {
    let mut pressure = vec![0.0_f64; state.zeta.len()];
    let mut gap = vec![f64::NAN; state.zeta.len()];
    for point in &state.contact {
        pressure[point.node] = pressure[point.node].max(point.pressure);
        gap[point.node] = gap[point.node].min(point.gap);
    }
    let partition = &problem.body.partition;
    partition.update(&mut pressure, 1)?;
    partition.update(&mut gap, 1)?;
    Ok((pressure, gap))
}
