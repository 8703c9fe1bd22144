//! Frames in VTU files, read back by vtkio.

use std::path::Path;
use vtkio::model::{Attribute, CellType, DataSet, Piece, Vtk};

/// Names, values and components of point and cell data; the points; the types and nodes of the cells.
pub struct Frame {
    pub points: Vec<f64>,
    pub types: Vec<CellType>,
    pub nodes: Vec<Vec<usize>>,
    pub point_data: Vec<(String, Vec<f64>)>,
    pub cell_data: Vec<(String, Vec<f64>)>,
}

fn arrays(attributes: Vec<Attribute>) -> Vec<(String, Vec<f64>)> {
    let array = |attribute| match attribute {
        Attribute::DataArray(array) => {
            (array.name, array.data.cast_into::<f64>().expect("real numbers"))
        }
        Attribute::Field { name, .. } => panic!("{name} is a field"),
    };
    attributes.into_iter().map(array).collect()
}

pub fn frame(path: &Path) -> Frame {
    let vtk = Vtk::import(path).unwrap_or_else(|e| panic!("{}: {e:?}", path.display()));
    let DataSet::UnstructuredGrid { mut pieces, .. } = vtk.data else { panic!("another data set") };
    let Some(Piece::Inline(piece)) = pieces.pop() else { panic!("no piece") };
    let (connectivity, offsets) = piece.cells.cell_verts.into_xml();
    let firsts = std::iter::once(0).chain(offsets.iter().copied());
    let cell = |(first, end): (u64, &u64)| {
        connectivity[first as usize..*end as usize].iter().map(|&node| node as usize).collect()
    };
    Frame {
        nodes: firsts.zip(&offsets).map(cell).collect(),
        types: piece.cells.types,
        points: piece.points.cast_into().expect("real numbers"),
        point_data: arrays(piece.data.point),
        cell_data: arrays(piece.data.cell),
    }
}
