//! Fields for ParaView: VTK XML unstructured grids and their collection over time.
//!
//! The arrays are encoded here and not by the VTK crate, which reads these files back in the tests:
//! it compresses value by value and took 0.9 s for a frame of 66,049 nodes.

use super::{
    OutputError,
    array::{data_array, head},
    write_whole,
};
use crate::evolution::{Setting, State};
use std::path::{Path, PathBuf};

/// Writes `fields_NNNN.vtu` frames and keeps `fields.pvd` their list.
pub struct FieldWriter {
    folder: PathBuf,
    /// Points and cells, the same in every frame.
    mesh: String,
    frames: Vec<(f64, String)>,
}

/// VTK_TRIANGLE.
const TRIANGLE: u8 = 5;

impl FieldWriter {
    /// A writer for the body of `setting` into `folder`.
    ///
    /// # Errors
    /// The mesh cannot be encoded.
    pub fn new(folder: &Path, setting: &Setting) -> Result<Self, OutputError> {
        let mesh = mesh(setting).map_err(|e| OutputError::new(folder, e))?;
        Ok(Self { folder: folder.to_owned(), mesh, frames: Vec::new() })
    }

    /// Time of the last frame written.
    pub fn last_time(&self) -> Option<f64> {
        self.frames.last().map(|(time, _)| *time)
    }

    /// Writes a frame and the collection that names it.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn add(&mut self, setting: &Setting, state: &State) -> Result<(), OutputError> {
        let name = format!("fields_{:04}.vtu", self.frames.len());
        let path = self.folder.join(&name);
        let data = fields(setting, state).map_err(|e| OutputError::new(&path, e))?;
        let body = &setting.body.mesh;
        let content = format!(
            "{}<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n{}{data}\
             </Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
            head("UnstructuredGrid"),
            body.nodes.len(),
            body.triangles.len(),
            self.mesh
        );
        write_whole(&path, content.as_bytes())?;
        self.frames.push((state.time, name));
        write_whole(&self.folder.join("fields.pvd"), self.collection().as_bytes())
    }

    fn collection(&self) -> String {
        let frames: String = (self.frames.iter())
            .map(|(time, file)| format!("<DataSet timestep=\"{time}\" file=\"{file}\"/>\n"))
            .collect();
        format!("{}<Collection>\n{frames}</Collection>\n</VTKFile>\n", head("Collection"))
    }
}

/// `<Points>` and `<Cells>`.
fn mesh(setting: &Setting) -> std::io::Result<String> {
    let mesh = &setting.body.mesh;
    let cells = mesh.triangles.len();
    let points = data_array("Points", 3, mesh.nodes.iter().flat_map(|&[x, y]| [x, y, 0.0]))?;
    let corners = mesh.triangles.iter().flatten().map(|&node| node as i32);
    let connectivity = data_array("connectivity", 1, corners)?;
    let offsets = data_array("offsets", 1, (1..=cells).map(|t| 3 * t as i32))?;
    let types = data_array("types", 1, (0..cells).map(|_| TRIANGLE))?;
    Ok(format!("<Points>\n{points}</Points>\n<Cells>\n{connectivity}{offsets}{types}</Cells>\n"))
}

/// `<PointData>` and `<CellData>`.
fn fields(setting: &Setting, state: &State) -> std::io::Result<String> {
    let elasticity = &setting.elasticity;
    let stress: Vec<_> = (state.zeta_mean.iter().enumerate())
        .map(|(t, zeta)| elasticity.stress(&setting.body, t, *zeta, &state.u))
        .collect();
    let (pressure, gap) = contact_fields(state);
    let displacement = state.u.chunks(2).flat_map(|u| [u[0], u[1], 0.0]);
    let von_mises = stress.iter().map(|s| elasticity.material.von_mises(s));
    let components = stress.iter().flat_map(|s| [s[0], s[1], s[2]]);
    Ok([
        "<PointData>\n".to_owned(),
        data_array("displacement", 3, displacement)?,
        data_array("zeta", 1, state.zeta.iter().copied())?,
        data_array("normal_pressure", 1, pressure.into_iter())?,
        data_array("gap", 1, gap.into_iter())?,
        "</PointData>\n<CellData>\n".to_owned(),
        data_array("von_mises", 1, von_mises)?,
        data_array("stress", 3, components)?,
        "</CellData>\n".to_owned(),
    ]
    .concat())
}

/// Contact pressure (0 off Γ_C) and remaining gap (NaN off Γ_C) at the nodes; where two
/// conditions meet at a corner, the larger pressure and the smaller gap.
fn contact_fields(state: &State) -> (Vec<f64>, Vec<f64>) {
    let mut pressure = vec![0.0_f64; state.zeta.len()];
    let mut gap = vec![f64::NAN; state.zeta.len()];
    for point in &state.contact {
        pressure[point.node] = pressure[point.node].max(point.pressure);
        gap[point.node] = gap[point.node].min(point.gap);
    }
    (pressure, gap)
}
