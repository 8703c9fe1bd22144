//! Turns what a file lists into the mesh of a plane body, or says why it is none.

use super::{
    super::{Curve, Mesh, error::Problem, extent, twice_area},
    byte_reader::{Result, fault},
    contents::{Contents, Element, Node},
};
use std::collections::{BTreeMap, HashMap, HashSet};

/// Twice the area over the square of the longest side: below this a triangle is a line.
const FLAT: f64 = 1e-10;
/// |z| over the extent of the body: below this a node lies in the plane.
const PLANAR: f64 = 1e-10;

/// The mesh of the body. Nodes of no triangle, such as the centres of arcs, are left out.
pub fn mesh(contents: &Contents) -> Result<Mesh> {
    let elements = triangles(contents);
    if elements.is_empty() {
        return fault(None, Problem::NoTriangles);
    }
    let (index, nodes) = number_nodes(contents, &elements)?;
    let points: Vec<[f64; 2]> = nodes.iter().map(|node| [node.point[0], node.point[1]]).collect();
    let limit = PLANAR * extent(&points);
    if let Some(node) = nodes.iter().find(|node| node.point[2].abs() > limit) {
        return fault(node.at, Problem::NotPlanar { node: node.tag, z: node.point[2] });
    }
    let counter_clockwise = |element: &&Element<3>| counter_clockwise(element, &index, &points);
    let triangles = elements.iter().map(counter_clockwise).collect::<Result<Vec<_>>>()?;
    let half_edges = half_edges(&elements, &triangles, &nodes)?;
    let curves = curves(contents, &index, &half_edges)?;
    Ok(Mesh { nodes: points, triangles, curves })
}

/// The triangles of the body: those of its physical surfaces, if there are any.
fn triangles(contents: &Contents) -> Vec<&Element<3>> {
    let grouped = contents.triangles.iter().any(|t| t.group != 0);
    // MSH 2.2 lists a triangle once for each of its groups; the first listing counts. (What is
    // listed twice in one group, or on two entities, stays and is found to overlap.)
    let mut first_group = HashMap::new();
    let listed = contents.triangles.iter().filter(|t| !grouped || t.group != 0);
    let first = listed.filter(|t| {
        let mut nodes = t.nodes;
        nodes.sort_unstable();
        *first_group.entry((t.entity, nodes)).or_insert(t.group) == t.group
    });
    first.collect()
}

/// The numbers of the body's nodes by their tags.
type Index = HashMap<u64, usize>;
/// In place of the number of a node that `$Nodes` does not list.
const UNLISTED: usize = usize::MAX;

/// Numbers the nodes of the triangles `elements` in the order of the file, and finds them there.
fn number_nodes<'a>(
    contents: &'a Contents,
    elements: &[&Element<3>],
) -> Result<(Index, Vec<&'a Node>)> {
    let mut index = Index::with_capacity(contents.nodes.len());
    index.extend(elements.iter().flat_map(|element| element.nodes).map(|tag| (tag, UNLISTED)));
    let mut nodes = Vec::with_capacity(index.len());
    for node in &contents.nodes {
        match index.get_mut(&node.tag) {
            Some(number) if *number == UNLISTED => {
                *number = nodes.len();
                nodes.push(node);
            }
            Some(_) => return fault(node.at, Problem::DuplicateNode(node.tag)),
            None => {}
        }
    }
    Ok((index, nodes))
}

/// The nodes of a triangle in counter-clockwise order.
fn counter_clockwise(
    element: &Element<3>,
    index: &Index,
    points: &[[f64; 2]],
) -> Result<[usize; 3]> {
    let mut triangle = element.nodes.map(|tag| index[&tag]);
    if let Some(missing) = triangle.iter().position(|&node| node == UNLISTED) {
        let (element_tag, node) = (element.tag, element.nodes[missing]);
        return fault(element.at, Problem::MissingNode { element: element_tag, node });
    }
    let [a, b, c] = triangle.map(|node| points[node]);
    let twice = twice_area(a, b, c);
    let length = |p: [f64; 2], q: [f64; 2]| (q[0] - p[0]).hypot(q[1] - p[1]);
    let longest = length(a, b).max(length(b, c)).max(length(c, a));
    // Huge coordinates overflow the area.
    if twice.abs() <= FLAT * longest * longest || !twice.is_finite() {
        return fault(element.at, Problem::ZeroArea(element.tag));
    }
    if twice < 0.0 {
        triangle.swap(1, 2);
    }
    Ok(triangle)
}

/// A side of a triangle, which lies on its left, and the triangle.
type HalfEdge = ([usize; 2], usize);

/// The sides of all triangles, sorted: an inner edge is there twice, once in each direction, a
/// boundary edge once.
///
/// Of a side that is there twice in one direction both triangles are on the left: they overlap.
fn half_edges(
    elements: &[&Element<3>],
    triangles: &[[usize; 3]],
    nodes: &[&Node],
) -> Result<Vec<HalfEdge>> {
    let sides = |(t, &[a, b, c]): (usize, &[usize; 3])| [([a, b], t), ([b, c], t), ([c, a], t)];
    let mut half_edges: Vec<HalfEdge> = triangles.iter().enumerate().flat_map(sides).collect();
    half_edges.sort_unstable();
    match half_edges.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some(pair) => {
            let [first, second] = [0, 1].map(|i| elements[pair[i].1]);
            let nodes = pair[0].0.map(|node| nodes[node].tag);
            fault(second.at, Problem::Overlap { triangles: [first.tag, second.tag], nodes })
        }
        None => Ok(half_edges),
    }
}

/// The physical curves, each edge once.
fn curves(
    contents: &Contents,
    index: &Index,
    half_edges: &[HalfEdge],
) -> Result<BTreeMap<String, Curve>> {
    let is_side = |edge: [usize; 2]| half_edges.binary_search_by_key(&edge, |side| side.0).is_ok();
    let mut curves = BTreeMap::<String, Curve>::new();
    let mut seen = HashSet::new();
    for line in &contents.lines {
        let [a, b] = line.nodes.map(|tag| index.get(&tag).copied().unwrap_or(UNLISTED));
        let name = contents.curve_names.get(&line.group);
        let name = name.cloned().unwrap_or_else(|| line.group.to_string());
        let sides = (is_side([a, b]), is_side([b, a]));
        if sides == (false, false) {
            let stray = Problem::StrayLine { line: line.tag, curve: name, nodes: line.nodes };
            return fault(line.at, stray);
        }
        let first = seen.insert((name.clone(), [a.min(b), a.max(b)]));
        let curve = curves.entry(name).or_default();
        match sides {
            _ if !first => {}
            (true, true) => curve.interior_edges += 1,
            (true, false) => curve.edges.push([a, b]),
            _ => curve.edges.push([b, a]),
        }
    }
    Ok(curves)
}
