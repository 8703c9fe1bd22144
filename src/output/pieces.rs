//! A frame in pieces: each rank writes the triangles that it owns, the first one the list.

use super::array::head;
use crate::fem::Body;
use std::fmt::Write;

/// The nodes and triangles of this rank's piece.
pub(super) struct Piece {
    /// The rank's numbers of the nodes.
    pub(super) nodes: Vec<usize>,
    /// The corners of the triangles, as places in `nodes`.
    pub(super) corners: Vec<[usize; 3]>,
}

impl Piece {
    /// The triangles that this rank owns, with their nodes.
    pub(super) fn of(body: &Body) -> Self {
        let triangles = &body.mesh.triangles[..body.own_triangles];
        let mut used = vec![body.partition.comm().is_serial(); body.mesh.nodes.len()];
        triangles.iter().flatten().for_each(|&node| used[node] = true);
        let nodes: Vec<usize> = (0..used.len()).filter(|&node| used[node]).collect();
        let mut place = vec![0; used.len()];
        nodes.iter().enumerate().for_each(|(at, &node)| place[node] = at);
        Self { nodes, corners: triangles.iter().map(|t| t.map(|node| place[node])).collect() }
    }

    /// The piece's values of a nodal field.
    pub(super) fn values<'a, T: Copy>(&'a self, field: &'a [T]) -> impl Iterator<Item = T> + 'a {
        self.nodes.iter().map(|&node| field[node])
    }
}

/// The name of a rank's piece of the frame `stem`.
pub(super) fn piece_name(stem: &str, rank: usize) -> String {
    format!("{stem}_{rank}.vtu")
}

/// The list of `pieces` pieces: arrays (name, VTK type, components) at points and in cells.
pub(super) fn list(
    stem: &str,
    pieces: usize,
    points: &[(&str, &str, usize)],
    cells: &[(&str, &str, usize)],
) -> String {
    let arrays = |arrays: &[(&str, &str, usize)]| {
        arrays.iter().fold(String::new(), |mut text, (name, kind, components)| {
            let _ = writeln!(
                text,
                "<PDataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"/>"
            );
            text
        })
    };
    let sources: String = (0..pieces)
        .map(|rank| format!("<Piece Source=\"{}\"/>\n", piece_name(stem, rank)))
        .collect();
    format!(
        "{}<PUnstructuredGrid GhostLevel=\"0\">\n<PPointData>\n{}</PPointData>\n\
         <PCellData>\n{}</PCellData>\n<PPoints>\n{}</PPoints>\n{sources}\
         </PUnstructuredGrid>\n</VTKFile>\n",
        head("PUnstructuredGrid"),
        arrays(points),
        arrays(cells),
        arrays(&[("Points", "Float64", 3)]),
    )
}
