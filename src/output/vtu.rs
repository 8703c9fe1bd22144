//! Fields for ParaView: VTK XML unstructured grids and their collection over time.

use super::{OutputError, write_whole};
use crate::{evolution::State, fem::Body};
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
    /// A writer for `body` into `folder`.
    pub fn new(folder: &Path, body: &Body) -> Self {
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
    pub fn add(&mut self, state: &State) -> Result<(), OutputError> {
        let name = format!("fields_{:04}.vtu", self.frames.len());
        let path = self.folder.join(&name);
        let mut content = Vec::new();
        self.grid(state)
            .try_into_xml_format(Compressor::ZLib, COMPRESSION)
            .and_then(|file| file.write(&mut content))
            .map_err(|e| OutputError::new(&path, format!("{e:?}")))?;
        write_whole(&path, &content)?;
        self.frames.push((state.time, name));
        write_whole(&self.folder.join("fields.pvd"), self.collection().as_bytes())
    }

    fn grid(&self, state: &State) -> Vtk {
        let triangles = self.connectivity.len() / 3;
        let displacement: Vec<f64> = state.u.chunks(2).flat_map(|u| [u[0], u[1], 0.0]).collect();
        // σ as ParaView's symmetric tensor order: xx, yy, xy.
        let stress: Vec<f64> = state.stress.iter().flat_map(|s| [s[0], s[1], s[2]]).collect();
        let scalar = |name: &str, values: &[f64]| {
            Attribute::scalars(name, 1).with_data(values.to_vec())
        };
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
                        scalar("normal_pressure", &state.pressure),
                        scalar("gap", &state.gap),
                    ],
                    cell: vec![
                        scalar("von_mises", &state.von_mises),
                        Attribute::generic("stress", 3).with_data(stress),
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
