//! Makes the mesh of a plane body from the contents of a file.

use super::{
    super::{Curve, Mesh, Side, boundary_edges, extent, place, sides, twice_area},
    byte_reader::{Result, error_at},
    contents::{Contents, Element, Node},
    flat, one_body, quadrilaterals, slit,
};
use rustc_hash::{FxHashMap as HashMap, FxHashSet as HashSet};
use std::collections::BTreeMap;

/// The largest difference of z over the extent of the body: ten times the tolerance of OpenCASCADE.
const PLANAR: f64 = 1e-6;

/// The mesh of the body. It has no nodes without triangles, such as the centres of arcs.
pub fn mesh(mut contents: Contents) -> Result<Mesh> {
    quadrilaterals::divide(&mut contents)?;
    let contents = &contents;
    let (elements, mut surfaces) = triangles(contents);
    if elements.is_empty() {
        let none = "there are no triangles: with physical groups gmsh writes these alone, so name the body in the \
                    .geo, as in `Physical Surface(\"body\") = {1};` (and mesh with `gmsh -2`)";
        return error_at(None, none);
    }
    let (index, listed) = number_nodes(contents, &elements)?;
    let nodes: Vec<[f64; 2]> = listed.iter().map(|node| [node.point[0], node.point[1]]).collect();
    let plane = [listed[0].point[2], PLANAR * extent(&nodes)];
    listed.iter().try_for_each(|node| check_planar(node, plane))?;
    let counter_clockwise = |element: &&Element<3>| counter_clockwise(element, &index, &nodes);
    let mut triangles = elements.iter().map(counter_clockwise).collect::<Result<Vec<_>>>()?;
    let removed = flat::mend(&nodes, &mut triangles, &mut surfaces).or_else(|flat| {
        let problem = format!(
            "triangle {} has no area at {}: its nodes lie on a line, or squares of its coordinates are \
             beyond double precision; mend the mesh there, or try Mesh.Algorithm = 1 in the .geo",
            elements[flat].tag,
            place(extent(&nodes), nodes[triangles[flat][0]])
        );
        error_at(elements[flat].at, problem)
    })?;
    let sides = sides(&triangles);
    let same_side =
        |pair: &&[Side]| (pair[0].ends, pair[0].on_left) == (pair[1].ends, pair[1].on_left);
    if let Some(pair) = sides.windows(2).find(same_side) {
        let [first, second] = [0, 1].map(|i| elements[pair[i].triangle()]);
        let [a, b] = pair[0].edge().map(|node| listed[node].tag);
        let problem = format!(
            "triangles {} and {} lie on the same side of their common edge, nodes {a} and {b} at {}: two \
             surfaces overlap, of which one should go (gmsh: Coherence), or the mesh folds over \
             itself",
            first.tag,
            second.tag,
            place(extent(&nodes), nodes[pair[0].edge()[0]])
        );
        return error_at(second.at, problem);
    }
    one_body::check(&nodes, &triangles, &sides)?;
    let curves = curves(contents, &index, &sides);
    let points = (0..listed.len()).filter(|&node| listed[node].is_point).collect();
    let cut = (contents.divided > 0).then(|| {
        format!("its {} quadrilaterals are cut into two triangles each", contents.divided)
    });
    let notes =
        [cut, ungrouped(contents, extent(&nodes)), slit::note(&nodes, &boundary_edges(&sides))];
    let notes = notes.into_iter().flatten().collect();
    let mut mesh = Mesh { nodes, triangles, curves, surfaces, points, notes, ..Mesh::default() };
    if !contents.midpoints.is_empty() {
        set_midpoints(&mut mesh, contents, &elements, &index, plane)?;
        mesh.curved.retain(|edge, _| !removed.contains(edge));
    }
    Ok(mesh)
}

/// Checks that a node lies in the plane of the body, up to a tolerance.
fn check_planar(
    &Node { tag, point: [.., z], at, .. }: &Node,
    [plane, tolerance]: [f64; 2],
) -> Result<()> {
    match (z - plane).abs() > tolerance {
        true => {
            let problem = format!(
                "node {tag} has z = {z} instead of {plane}: the body must lie in a plane of constant z"
            );
            error_at(at, problem)
        }
        false => Ok(()),
    }
}

/// A note on the triangles in no physical surface, if there are physical surfaces, in a body of this extent, m.
fn ungrouped(contents: &Contents, extent: f64) -> Option<String> {
    let left_out: Vec<_> = contents.triangles.iter().filter(|t| t.group == 0).collect();
    let first = left_out.first().filter(|_| left_out.len() < contents.triangles.len())?;
    let node = contents.nodes.iter().find(|node| node.tag == first.nodes[0])?;
    Some(format!(
        "{} triangles are in no physical surface and left out, as at {}: name all parts of the body in the .geo, as in \
         Physical Surface(\"body\") = {{1, 2}};",
        left_out.len(),
        place(extent, [node.point[0], node.point[1]])
    ))
}

/// The triangles of the body, and by name those of each physical surface. If there are physical surfaces,
/// only their triangles make the body.
fn triangles(contents: &Contents) -> (Vec<&Element<3>>, BTreeMap<String, Vec<usize>>) {
    let grouped = contents.triangles.iter().any(|t| t.group != 0);
    // A triangle is listed once for each of its groups; the first listing counts.
    let mut first_listing = HashMap::default();
    let (mut elements, mut groups) = (Vec::new(), BTreeMap::<i32, Vec<usize>>::new());
    for triangle in contents.triangles.iter().filter(|t| !grouped || t.group != 0) {
        let mut nodes = triangle.nodes;
        nodes.sort_unstable();
        let index = *first_listing.entry(nodes).or_insert(elements.len());
        if index == elements.len() {
            elements.push(triangle);
        }
        groups.entry(triangle.group).or_default().push(index);
    }
    let mut surfaces = BTreeMap::<String, Vec<usize>>::new();
    for (group, triangles) in groups.into_iter().filter(|_| grouped) {
        surfaces.entry(contents.name(2, group)).or_default().extend(triangles);
    }
    for triangles in surfaces.values_mut() {
        triangles.sort_unstable();
        triangles.dedup();
    }
    (elements, surfaces)
}

/// The indices of the body's nodes by their tags.
type Index = HashMap<u64, usize>;

/// Numbers the nodes of the triangles `elements` in the order of the file.
fn number_nodes<'a>(
    contents: &'a Contents,
    elements: &[&Element<3>],
) -> Result<(Index, Vec<&'a Node>)> {
    let used: HashSet<u64> = elements.iter().flat_map(|element| element.nodes).collect();
    let nodes = contents.nodes.iter().filter(|node| used.contains(&node.tag));
    let nodes: Vec<&Node> = nodes.collect();
    let mut index = Index::with_capacity_and_hasher(nodes.len(), Default::default());
    for (number, node) in nodes.iter().enumerate() {
        if index.insert(node.tag, number).is_some() {
            return listed_twice(node);
        }
    }
    Ok((index, nodes))
}

/// The nodes of a triangle in counter-clockwise order.
fn counter_clockwise(
    &Element { tag, nodes: tags, at, .. }: &Element<3>,
    index: &Index,
    nodes: &[[f64; 2]],
) -> Result<[usize; 3]> {
    if let Some(missing) = tags.into_iter().find(|node| !index.contains_key(node)) {
        return missing_node(tag, missing, at);
    }
    let mut triangle = tags.map(|tag| index[&tag]);
    let [a, b, c] = triangle.map(|node| nodes[node]);
    if twice_area(a, b, c) < 0.0 {
        triangle.swap(1, 2);
    }
    Ok(triangle)
}

fn listed_twice<T>(node: &Node) -> Result<T> {
    error_at(node.at, format!("node {} is listed twice", node.tag))
}

pub fn missing_node<T>(element: u64, node: u64, at: usize) -> Result<T> {
    error_at(at, format!("element {element} refers to node {node}, which $Nodes does not list"))
}

/// Sets the midpoints of the edges of `elements`, the second-order triangles of `mesh`, and checks that no
/// triangle is folded.
fn set_midpoints(
    mesh: &mut Mesh,
    contents: &Contents,
    elements: &[&Element<3>],
    index: &Index,
    plane: [f64; 2],
) -> Result<()> {
    let mut listed = HashMap::with_capacity_and_hasher(contents.nodes.len(), Default::default());
    for node in &contents.nodes {
        if listed.insert(node.tag, node).is_some() {
            return listed_twice(node);
        }
    }
    for &&Element { tag, nodes: [a, b, c], at, .. } in elements {
        for [a, b] in [[a, b], [b, c], [c, a]] {
            let Some(midpoint) = contents.midpoint([a, b]) else {
                return error_at(
                    at,
                    format!("triangle {tag} is of order 1, others are of order 2"),
                );
            };
            let Some(node) = listed.get(&midpoint) else { return missing_node(tag, midpoint, at) };
            check_planar(node, plane)?;
            mesh.set_midpoint([index[&a], index[&b]], [node.point[0], node.point[1]]);
        }
    }
    for (element, &triangle) in elements.iter().zip(&mesh.triangles) {
        let bound = flat::bound(triangle.map(|node| mesh.nodes[node]));
        if mesh.is_curved(triangle) && !mesh.jacobian_exceeds(bound, triangle) {
            let tag = element.tag;
            let problem = format!(
                "curved triangle {tag} is folded: a midpoint of its edges lies too far off; mesh \
                 finer there, or mend it"
            );
            return error_at(element.at, problem);
        }
    }
    Ok(())
}

/// The physical curves, each edge once.
fn curves(contents: &Contents, index: &Index, sides: &[Side]) -> BTreeMap<String, Curve> {
    let mut curves = BTreeMap::<String, Curve>::new();
    let mut seen = HashSet::default();
    for line in &contents.lines {
        let name = contents.name(1, line.group);
        let mut nodes = line.nodes;
        nodes.sort_unstable();
        if !seen.insert((name.clone(), nodes)) {
            continue;
        }
        let mut edge = nodes.map(|tag| index.get(&tag).copied().unwrap_or(usize::MAX));
        edge.sort_unstable();
        let first = sides.partition_point(|side| side.edge() < edge);
        let around = sides[first..].iter().take_while(|side| side.edge() == edge);
        let curve = curves.entry(name).or_default();
        match around.collect::<Vec<_>>()[..] {
            [side] if side.on_left => curve.edges.push(edge),
            [_] => curve.edges.push([edge[1], edge[0]]),
            _ => curve.other_edges += 1,
        }
    }
    curves
}
