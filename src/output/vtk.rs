//! VTK's XML files (VTK User's Guide, "VTK File Formats"), with arrays as base64. They are not compressed:
//! compression would save a third of the bytes and take longer than the writing.

use super::growing_file::GrowingFile;
use base64::{Engine, engine::general_purpose::STANDARD};
use num_traits::ToBytes;
use std::{iter, path::PathBuf};

/// VTK's names of the number types.
pub(super) const REAL: &str = "Float64";
pub(super) const SINGLE: &str = "Float32";
pub(super) const INTEGER: &str = "Int32";
const BYTE: &str = "UInt8";
/// The ending of a list of frames.
const LIST_END: &str = "</Collection>\n</VTKFile>\n";

/// A named array with a tuple of numbers for each point or cell.
pub(super) struct DataArray {
    /// Type, name and components, as XML attributes.
    attributes: String,
    /// VTK's header (the number of the following bytes, 64 bits), then the numbers; little-endian.
    bytes: Vec<u8>,
}

impl DataArray {
    /// The array `name` of tuples of `components` numbers. `number_type` is VTK's name of their type.
    pub(super) fn new<T: ToBytes>(
        name: &str,
        number_type: &str,
        components: usize,
        values: impl Iterator<Item = T>,
    ) -> Self {
        let mut bytes = vec![0; size_of::<u64>()];
        values.for_each(|value| bytes.extend_from_slice(value.to_le_bytes().as_ref()));
        let length = (bytes.len() - size_of::<u64>()) as u64;
        bytes[..size_of::<u64>()].copy_from_slice(&length.to_le_bytes());
        let mut attributes = format!("type=\"{number_type}\" Name=\"{name}\"");
        // Readers take a scalar without this attribute as a plain list.
        if components > 1 {
            attributes += &format!(" NumberOfComponents=\"{components}\"");
        }
        Self { attributes, bytes }
    }

    /// The array with names of its components for ParaView.
    pub(super) fn with_names(mut self, names: &[&str]) -> Self {
        for (component, name) in names.iter().enumerate() {
            self.attributes += &format!(" ComponentName{component}=\"{name}\"");
        }
        self
    }

    /// The element `<PDataArray>`, which declares the array in the list of a file's pieces.
    pub(super) fn declaration(&self) -> String {
        format!("<PDataArray {}/>\n", self.attributes)
    }

    /// Adds the element `<DataArray>` with the values.
    pub(super) fn write(&self, text: &mut String) {
        *text += &format!("<DataArray {} format=\"binary\">", self.attributes);
        text.reserve(self.bytes.len() / 3 * 4 + 64);
        STANDARD.encode_string(&self.bytes, text);
        *text += "</DataArray>\n";
    }
}

/// A VTK file with an element `kind`, its `attributes` and its `content`.
pub(super) fn vtk_file(kind: &str, attributes: &str, content: impl FnOnce(&mut String)) -> String {
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n\
         <{kind}{attributes}>\n"
    );
    content(&mut text);
    text + &format!("</{kind}>\n</VTKFile>\n")
}

/// The file of an unstructured grid with one piece, which begins as [`cells_text`] does, and the fields of its points and cells.
pub(super) fn piece(mesh: &str, points: &[DataArray], cells: &[DataArray]) -> String {
    vtk_file("UnstructuredGrid", "", |text| {
        *text += mesh;
        for (kind, arrays) in [("PointData", points), ("CellData", cells)] {
            if !arrays.is_empty() {
                *text += &format!("<{kind}>\n");
                arrays.iter().for_each(|array| array.write(text));
                *text += &format!("</{kind}>\n");
            }
        }
        *text += "</Piece>\n";
    })
}

/// A list of frames over time for ParaView. The first frame creates the file.
pub(super) fn list_of_frames(path: PathBuf) -> GrowingFile {
    let empty = vtk_file("Collection", "", |_| ());
    GrowingFile::new(path, empty.trim_end_matches(LIST_END).to_owned(), LIST_END)
}

/// The entry of a list for the frame in `file` at a time, s.
pub(super) fn entry(time: f64, file: &str) -> String {
    format!("<DataSet timestep=\"{time}\" file=\"{file}\"/>\n")
}

/// The beginning of `<Piece>`, with `<Points>` and `<Cells>` of one `kind`, which have this number of `nodes` each.
pub(super) fn cells_text(
    points: &[[f64; 2]],
    nodes: &[usize],
    (kind, of_cell): (u8, usize),
) -> String {
    let coordinates = points.iter().flat_map(|&[x, y]| [x, y, 0.0]);
    let cells = nodes.len() / of_cell;
    let offsets = (1..=cells).map(|cell| (of_cell * cell) as i32);
    let types = iter::repeat_n(kind, cells);
    let nodes = nodes.iter().map(|&node| node as i32);
    let head = format!("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{cells}\">\n", points.len());
    let mut text = head + "<Points>\n";
    DataArray::new("Points", REAL, 3, coordinates).write(&mut text);
    text += "</Points>\n<Cells>\n";
    DataArray::new("connectivity", INTEGER, 1, nodes).write(&mut text);
    DataArray::new("offsets", INTEGER, 1, offsets).write(&mut text);
    DataArray::new("types", BYTE, 1, types).write(&mut text);
    text + "</Cells>\n"
}
