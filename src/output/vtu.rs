//! Fields for ParaView: VTK XML unstructured grids and their collection over time.

use super::{
    OutputError,
    contact::ContactWriter,
    digits,
    growing_file::{GrowingFile, Written},
    vtk::{DataArray, INTEGER, REAL, SINGLE, cells_text, entry, list_of_frames, piece, vtk_file},
    write_whole,
};
use crate::{
    fem::Elements,
    model::von_mises,
    observe::{NodalStress, ObservedProblem, principal, principal_direction},
    petsc::PetscError,
    problem::State,
};
use serde::{Deserialize, Serialize};
use std::{
    iter,
    panic::resume_unwind,
    path::{Path, PathBuf},
    sync::Arc,
    thread::{self, JoinHandle},
};

/// VTK_TRIANGLE and VTK_QUADRATIC_TRIANGLE (the midpoints of the sides 01, 12, 20 follow the vertices), with the number of
/// nodes.
const TRIANGLE: (u8, usize) = (5, 3);
const QUADRATIC_TRIANGLE: (u8, usize) = (22, 6);

/// Writes frames `fields_NNNN.vtu` and their list over time, `fields.pvd`. Each of several ranks writes its
/// piece of a frame, `fields_NNNN_R.vtu`. The first rank writes the lists: `fields_NNNN.pvtu` names the
/// pieces, `fields.pvd` the frames.
///
/// A piece has the triangles of its rank and all their nodes; a node where materials meet is a point for each of
/// them. A rank without triangles writes no piece.
pub struct FieldWriter {
    folder: PathBuf,
    /// The beginning of `<Piece>` with `<Points>` and `<Cells>`, the same in every frame.
    mesh: Arc<str>,
    /// The points of a frame and their stresses.
    stress: Arc<NodalStress>,
    /// The ranks that write pieces.
    pieces: Vec<usize>,
    /// `fields.pvd`; only the first rank writes it.
    list: GrowingFile,
    /// On a single rank: the thread that writes the last frame, and the entry of this frame in the list.
    pending: Option<(JoinHandle<Result<(), OutputError>>, String)>,
    /// The files of Γ_C; only the first rank writes them.
    contact: ContactWriter,
    frames: usize,
    last_time: Option<f64>,
    digits: usize,
}

/// The state of the files of frames in a checkpoint.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FieldsWritten {
    frames: usize,
    last_time: Option<f64>,
    /// Lengths and checksums of `fields.pvd`, `contact.pvd` and `contact.csv`.
    files: [Option<Written>; 3],
}

impl FieldWriter {
    /// A writer for the body of `problem` into `folder`. Collective.
    ///
    /// # Errors
    /// The names of the columns of `contact.csv` cannot be written.
    pub fn new(folder: &Path, problem: &ObservedProblem) -> Result<Self, OutputError> {
        let comm = problem.body.comm();
        let triangles = comm.gather(&[problem.body.own_triangles as f64]);
        let stress = Arc::clone(problem.nodal_stress());
        let kind = match problem.body.elements() {
            Elements::Linear(_) => TRIANGLE,
            Elements::Quadratic(_) => QUADRATIC_TRIANGLE,
        };
        Ok(Self {
            folder: folder.to_owned(),
            mesh: cells_text(&stress.places(), &stress.cells, kind).into(),
            stress,
            pieces: (0..comm.size()).filter(|&rank| triangles[rank] > 0.0).collect(),
            list: list_of_frames(folder.join("fields.pvd")),
            pending: None,
            contact: ContactWriter::new(folder)?,
            frames: 0,
            last_time: None,
            digits: digits(problem.scene()),
        })
    }

    /// The state of the files for a checkpoint. Call [`Self::complete`] first.
    pub fn written(&self) -> FieldsWritten {
        let files = [&self.list, &self.contact.list, &self.contact.table.0];
        let files = files.map(|file| file.written);
        FieldsWritten { frames: self.frames, last_time: self.last_time, files }
    }

    /// Continues after the frames of a checkpoint.
    ///
    /// # Errors
    /// A file was changed since.
    pub fn resume(&mut self, written: &FieldsWritten) -> Result<(), OutputError> {
        (self.frames, self.last_time) = (written.frames, written.last_time);
        let files = [&mut self.list, &mut self.contact.list, &mut self.contact.table.0];
        files.into_iter().zip(written.files).try_for_each(|(file, written)| file.resume(written))
    }

    /// Time of the last frame, s.
    pub fn last_time(&self) -> Option<f64> {
        self.last_time
    }

    /// Writes a frame and adds it to the lists; with `output.every` = 0 that of Γ_C alone. On a single rank a
    /// thread writes the frame while the run goes on, which saves about a tenth of the time of a run of 100 steps.
    /// Collective.
    ///
    /// # Errors
    /// A file of this frame or of the previous one cannot be written.
    pub fn add(&mut self, problem: &ObservedProblem, state: &State) -> Result<(), OutputError> {
        self.complete()?;
        let number = format!("{:0width$}", self.frames, width = self.digits);
        let (stem, contact_file) = (format!("fields_{number}"), format!("contact_{number}.vtu"));
        (self.frames, self.last_time) = (self.frames + 1, Some(state.time));
        // This is collective: all ranks collect Γ_C, even if one has failed to collect its fields.
        let (contact, pressures) = problem.supports.contact.rows(&problem.body, state);
        if problem.scene().output.every == Some(0) {
            let is_root = problem.body.comm().is_root();
            let rows = if is_root { &contact[..] } else { &[] };
            return self.contact.add(&contact_file, state.time, rows);
        }
        let (cells, comm) = (cell_data(problem, state), problem.body.comm());
        let failed = |error| OutputError::new(Path::new("a frame"), error);
        let mut points = point_data(problem, &self.stress, state, &pressures).map_err(failed)?;
        let strained = NodalStress::strained(problem, state);
        if comm.is_serial() {
            let (file, mesh) = (format!("{stem}.vtu"), Arc::clone(&self.mesh));
            let (path, entry) = (self.folder.join(&file), entry(state.time, &file));
            let nodal = Arc::clone(&self.stress);
            let write = move || {
                let stresses = nodal.stresses(&strained, None);
                points.extend(stress_data(&stresses.map_err(|e| OutputError::new(&path, e))?));
                write_whole(&path, piece(&mesh, &points, &cells).as_bytes())
            };
            let thread = thread::Builder::new().spawn(write);
            self.pending = Some((
                thread.map_err(|error| OutputError::new(Path::new("a frame"), error))?,
                entry,
            ));
            return self.contact.add(&contact_file, state.time, &contact);
        }
        let vertices = &problem.body.vertices.partition;
        let stresses = self.stress.stresses(&strained, Some(vertices)).map_err(failed)?;
        points.extend(stress_data(&stresses));
        let piece_file = |rank| format!("{stem}_{rank}.vtu");
        if self.pieces.contains(&comm.rank()) {
            let text = piece(&self.mesh, &points, &cells);
            write_whole(&self.folder.join(piece_file(comm.rank())), text.as_bytes())?;
        }
        if !comm.is_root() {
            return Ok(());
        }
        self.contact.add(&contact_file, state.time, &contact)?;
        let whole = format!("{stem}.pvtu");
        let files = self.pieces.iter().copied().map(piece_file);
        let text = list_of_pieces(files, &points, &cells);
        write_whole(&self.folder.join(&whole), text.as_bytes())?;
        self.list.add(entry(state.time, &whole).as_bytes())
    }

    /// Waits until the last frame is written.
    ///
    /// # Errors
    /// The frame cannot be written.
    pub fn complete(&mut self) -> Result<(), OutputError> {
        let Some((thread, entry)) = self.pending.take() else { return Ok(()) };
        thread.join().unwrap_or_else(|panic| resume_unwind(panic))?;
        self.list.add(entry.as_bytes())
    }
}

/// A run that is given up leaves no thread that writes into the folder of the next one.
impl Drop for FieldWriter {
    fn drop(&mut self) {
        self.pending.take().map(|(thread, _)| thread.join());
    }
}

/// The nodal fields of u, ζ and contact, with the `pressures` at nodes of Γ_C. Outside Γ_C the contact pressure is 0
/// and the remaining gap NaN. At a corner with two gap conditions they are the larger pressure and the smaller gap.
/// Collective.
fn point_data(
    problem: &ObservedProblem,
    points: &NodalStress,
    state: &State,
    pressures: &[(usize, f64)],
) -> Result<Vec<DataArray>, PetscError> {
    let partition = &problem.body.nodes.partition;
    let mut pressure = vec![0.0_f64; partition.local()];
    let mut gap = vec![f64::NAN; partition.local()];
    pressures.iter().for_each(|(node, value)| pressure[*node] = *value);
    for point in state.of_contact() {
        gap[point.node] = gap[point.node].min(point.gap);
    }
    partition.update(&mut pressure, 1)?;
    partition.update(&mut gap, 1)?;
    let zeta = problem.body.at_nodes(&state.zeta);
    let displacement = points.nodes().flat_map(|i| [state.u[2 * i], state.u[2 * i + 1], 0.0]);
    let scalar = |name, values: &[f64]| {
        DataArray::new(name, REAL, 1, points.nodes().map(|node| values[node]))
    };
    let mut arrays = vec![
        DataArray::new("displacement", REAL, 3, displacement),
        scalar("zeta", &zeta),
        scalar("normal_pressure", &pressure),
        scalar("gap", &gap),
    ];
    if !partition.comm().is_serial() || points.nodes().count() > partition.local() {
        // The number of the node in the whole body, with which readers can join pieces and materials.
        let numbers = points.nodes().map(|node| partition.global(node, 1, 0));
        arrays.push(DataArray::new("global_node", INTEGER, 1, numbers));
    }
    Ok(arrays)
}

/// The nodal stresses (σ_xx, σ_yy, σ_xy, σ_zz), σ₁ ≥ σ₂ in the plane, the direction of σ₁, and von Mises.
fn stress_data(stresses: &[[f64; 4]]) -> [DataArray; 4] {
    let single = |value: f64| value as f32;
    let components = stresses.iter().flat_map(|stress| stress.map(single));
    let principals = stresses.iter().flat_map(|stress| principal(*stress).map(single));
    let directions = stresses.iter().flat_map(|stress| {
        let [x, y] = principal_direction(*stress);
        [x, y, 0.0].map(single)
    });
    let von_mises = stresses.iter().map(|stress| single(von_mises(*stress)));
    [
        DataArray::new("stress", SINGLE, 4, components).with_names(&["xx", "yy", "xy", "zz"]),
        DataArray::new("principal_stress", SINGLE, 2, principals).with_names(&["1", "2"]),
        DataArray::new("principal_direction", SINGLE, 3, directions),
        DataArray::new("von_mises", SINGLE, 1, von_mises),
    ]
}

/// The mean stress of each triangle, xx, yy, xy, as the finite elements have it. If there are several materials,
/// each triangle has a number: 0, or 1, 2, … for the surfaces of the scene by name.
fn cell_data(problem: &ObservedProblem, state: &State) -> Vec<DataArray> {
    let (elasticity, body) = (&problem.elasticity, &problem.body);
    let zeta = problem.zeta_at_points(&state.zeta);
    let stress = elasticity.stresses(body, &zeta, &state.u);
    let components = stress[..body.own_triangles].iter().flat_map(|s| [s[0], s[1], s[2]]);
    let mut arrays =
        vec![DataArray::new("stress_raw", REAL, 3, components).with_names(&["xx", "yy", "xy"])];
    if !problem.scene().surfaces.is_empty() {
        let materials = body.materials[..body.own_triangles].iter().map(|&number| number as i32);
        arrays.push(DataArray::new("material", INTEGER, 1, materials));
    }
    arrays
}

/// The list of the pieces of a frame, each with the arrays `points` and `cells`.
fn list_of_pieces(
    files: impl Iterator<Item = String>,
    points: &[DataArray],
    cells: &[DataArray],
) -> String {
    let [points, cells] =
        [points, cells].map(|arrays| arrays.iter().map(DataArray::declaration).collect::<String>());
    let coordinates = DataArray::new::<f64>("Points", REAL, 3, iter::empty()).declaration();
    let files: String = files.map(|file| format!("<Piece Source=\"{file}\"/>\n")).collect();
    let pieces = format!(
        "<PPointData>\n{points}</PPointData>\n<PCellData>\n{cells}</PCellData>\n\
         <PPoints>\n{coordinates}</PPoints>\n{files}"
    );
    vtk_file("PUnstructuredGrid", " GhostLevel=\"0\"", |text| *text += &pieces)
}
