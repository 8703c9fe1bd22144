//! Frames in VTU files, read back from the format's description: XML with arrays in base64, each behind its size in bytes
//! (VTK file formats, "XML file formats", format="binary" with header_type UInt64).

use base64::{Engine, engine::general_purpose::STANDARD};
use roxmltree::{Document, Node};
use std::path::Path;

/// VTK's numbers of cell types.
pub const LINE: u8 = 3;
pub const TRIANGLE: u8 = 5;
pub const QUADRATIC_TRIANGLE: u8 = 22;

/// Names, values and components of point and cell data; the points; the types and nodes of the cells.
pub struct Frame {
    pub points: Vec<f64>,
    pub types: Vec<u8>,
    pub nodes: Vec<Vec<usize>>,
    pub point_data: Vec<(String, Vec<f64>)>,
    pub cell_data: Vec<(String, Vec<f64>)>,
}

/// The numbers of an array. Its size in bytes comes first.
fn values(array: Node) -> Vec<f64> {
    assert_eq!(array.attribute("format"), Some("binary"), "{array:?}");
    let bytes = STANDARD.decode(array.text().expect("data").trim()).expect("base64");
    let (size, data) = bytes.split_at(8);
    assert_eq!(
        u64::from_le_bytes(size.try_into().expect("eight bytes")),
        data.len() as u64,
        "{array:?}"
    );
    macro_rules! numbers {
        ($kind:ty) => {{
            let (numbers, rest) = data.as_chunks();
            assert!(rest.is_empty(), "{array:?}");
            numbers.iter().map(|bytes| <$kind>::from_le_bytes(*bytes) as f64).collect()
        }};
    }
    match array.attribute("type").expect("a type") {
        "Float64" => numbers!(f64),
        "Float32" => numbers!(f32),
        "Int64" => numbers!(i64),
        "Int32" => numbers!(i32),
        "UInt8" => numbers!(u8),
        other => panic!("an array of {other}"),
    }
}

/// Names and values of the arrays in the section of this name; none without the section.
fn arrays(piece: Node, section: &str) -> Vec<(String, Vec<f64>)> {
    let section = piece.children().find(|node| node.has_tag_name(section));
    let arrays = section.into_iter().flat_map(|node| node.children()).filter(Node::is_element);
    arrays
        .map(|array| (array.attribute("Name").expect("a name").to_owned(), values(array)))
        .collect()
}

pub fn frame(path: &Path) -> Frame {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let document = Document::parse(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let piece = document.descendants().find(|node| node.has_tag_name("Piece")).expect("a piece");
    let cells = arrays(piece, "Cells");
    let of = |name: &str| &cells.iter().find(|(of, _)| of == name).expect("part of the cells").1;
    let (connectivity, offsets) = (of("connectivity"), of("offsets"));
    let firsts = std::iter::once(0).chain(offsets.iter().map(|&end| end as usize));
    let cell = |(first, &end): (usize, &f64)| {
        connectivity[first..end as usize].iter().map(|&node| node as usize).collect()
    };
    Frame {
        nodes: firsts.zip(offsets).map(cell).collect(),
        types: of("types").iter().map(|&kind| kind as u8).collect(),
        points: arrays(piece, "Points").pop().expect("points").1,
        point_data: arrays(piece, "PointData"),
        cell_data: arrays(piece, "CellData"),
    }
}
