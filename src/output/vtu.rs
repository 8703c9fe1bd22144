//! Fields for ParaView: VTK XML unstructured grids and their collection over time.

use super::{OutputError, write_whole};
use crate::evolution::{Setting, State};
use std::path::{Path, PathBuf};
use vtkio::{
    model::{
        Attribute, Attributes, ByteOrder, CellType, Cells, DataSet, IOBuffer,
        UnstructuredGridPiece, Version, VertexNumbers, Vtk,
    },
    xml::Compressor,
};

/// Writes `fields_NNNN.vtu` frames and keeps `fields.pvd` their list.
pub struct FieldWriter {
    folder: PathBuf,
    points: Vec<f64>,
    connectivity: Vec<u64>,
    frames: Vec<(f64, String)>,
}

/// zlib's fastest level: half the size for a tenth of the time of its best.
const COMPRESSION: u32 = 1;

impl FieldWriter {
    /// A writer for the body of `setting` into `folder`.
    pub fn new(folder: &Path, setting: &Setting) -> Self {
        let body = &setting.body;
        Self {
            folder: folder.to_owned(),
            points: body.mesh.nodes.iter().flat_map(|&[x, y]| [x, y, 0.0]).collect(),
            connectivity: body.mesh.triangles.iter().flatten().map(|&n| n as u64).collect(),
            frames: Vec::new(),
        }
    }

    /// Time of the last frame written.
    pub fn last_time(&self) -> Option<f64> {
        self.frames.last().map(|(time, _)| *time)
    }

    /// Writes a frame and the collection that names it.
    pub fn add(&mut self, setting: &Setting, state: &State) -> Result<(), OutputError> {
        let name = format!("fields_{:04}.vtu", self.frames.len());
        let path = self.folder.join(&name);
        let mut content = Vec::new();
        self.grid(setting, state)
            .try_into_xml_format(Compressor::ZLib, COMPRESSION)
            .and_then(|file| file.write(&mut content))
            .map_err(|e| OutputError::new(&path, format!("{e:?}")))?;
        write_whole(&path, &content)?;
        self.frames.push((state.time, name));
        write_whole(&self.folder.join("fields.pvd"), self.collection().as_bytes())
    }

    fn grid(&self, setting: &Setting, state: &State) -> Vtk {
        let triangles = self.connectivity.len() / 3;
        let displacement: Vec<f64> = state.u.chunks(2).flat_map(|u| [u[0], u[1], 0.0]).collect();
        let elasticity = &setting.elasticity;
        let stress: Vec<_> = (state.zeta_mean.iter().enumerate())
            .map(|(t, zeta)| elasticity.stress(&setting.body, t, *zeta, &state.u))
            .collect();
        let von_mises: Vec<f64> = stress.iter().map(|s| elasticity.material.von_mises(s)).collect();
        let components: Vec<f64> = stress.iter().flat_map(|s| [s[0], s[1], s[2]]).collect();
        let (pressure, gap) = contact_fields(state);
        let scalar =
            |name: &str, values: &[f64]| Attribute::scalars(name, 1).with_data(values.to_vec());
        Vtk {
            version: Version::new_xml(1, 0),
            title: String::new(),
            byte_order: ByteOrder::LittleEndian,
            file_path: None,
            data: DataSet::inline(UnstructuredGridPiece {
                points: IOBuffer::F64(self.points.clone()),
                cells: Cells {
                    cell_verts: VertexNumbers::XML {
                        connectivity: self.connectivity.clone(),
                        offsets: (1..=triangles as u64).map(|t| 3 * t).collect(),
                    },
                    types: vec![CellType::Triangle; triangles],
                },
                data: Attributes {
                    point: vec![
                        Attribute::vectors("displacement").with_data(displacement),
                        scalar("zeta", &state.zeta),
                        scalar("normal_pressure", &pressure),
                        scalar("gap", &gap),
                    ],
                    cell: vec![
                        scalar("von_mises", &von_mises),
                        Attribute::generic("stress", 3).with_data(components),
                    ],
                },
            }),
        }
    }

    fn collection(&self) -> String {
        let frames: String = (self.frames.iter())
            .map(|(time, file)| format!("    <DataSet timestep=\"{time}\" file=\"{file}\"/>\n"))
            .collect();
        format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" \
             byte_order=\"LittleEndian\">\n  <Collection>\n{frames}  </Collection>\n</VTKFile>\n"
        )
    }
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
