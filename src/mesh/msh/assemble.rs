//! Turns what a file says into a mesh of a plane body, or says why it is none.

use super::{
    super::{Mesh, error::Problem, twice_area},
    edges::Edges,
    fault,
    raw::{Element, Raw, name},
    source::{Fault, Result},
};

/// Twice the area over the square of the longest edge: below this a triangle is a line.
const FLAT: f64 = 1e-10;
/// |z| over the extent of the body: below this a node lies in the plane.
const PLANAR: f64 = 1e-10;

pub(super) fn assemble(raw: Raw) -> Result<Mesh> {
    reject_unusable(&raw)?;
    let index = Index::new(&raw)?;
    let mut triangles = body(&raw, &index)?;
    let points = planar_points(&raw, &triangles)?;
    for (element, triangle) in &mut triangles {
        let [a, b, c] = triangle.map(|node| points[node]);
        let area = twice_area(a, b, c);
        let longest = [[a, b], [b, c], [c, a]]
            .map(|[p, q]| (q[0] - p[0]).hypot(q[1] - p[1]))
            .into_iter()
            .fold(0.0, f64::max);
        // Huge coordinates overflow the area.
        if area.abs() <= FLAT * longest * longest || !area.is_finite() {
            return at(element.at, Problem::ZeroArea(element.tag));
        }
        if area < 0.0 {
            triangle.swap(1, 2);
        }
    }
    let edges = Edges::new(&raw, &triangles)?;
    let mut mesh = Mesh {
        nodes: points,
        triangles: triangles.into_iter().map(|(_, nodes)| nodes).collect(),
        curves: edges.curves(&raw, &index)?,
    };
    drop_unused(&mut mesh);
    Ok(mesh)
}

/// A fault at a byte of the file.
pub(super) fn at<T>(at: usize, problem: Problem) -> Result<T> {
    Err(Fault { at: Some(at), problem })
}

fn reject_unusable(raw: &Raw) -> Result<()> {
    if let Some((_, &(_, first))) = raw.unusable.iter().next() {
        let list = raw.unusable.iter();
        let list: Vec<_> =
            list.map(|(&number, (count, _))| format!("{} ({count})", name(number))).collect();
        return at(first, Problem::Unusable(list.join(", ")));
    }
    if raw.triangles.is_empty() {
        return fault(Problem::NoTriangles);
    }
    Ok(())
}

/// Positions of the nodes by tag.
pub(super) struct Index(Vec<(u64, usize)>);

impl Index {
    fn new(raw: &Raw) -> Result<Self> {
        let mut index: Vec<_> = raw.nodes.iter().map(|node| node.tag).zip(0..).collect();
        index.sort_unstable();
        match index.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            Some(&[_, (tag, second)]) => at(raw.nodes[second].at, Problem::DuplicateNode(tag)),
            _ => Ok(Self(index)),
        }
    }

    fn get(&self, tag: u64) -> Option<usize> {
        let Self(index) = self;
        // gmsh numbers without gaps as a rule: look there before searching.
        let guess = usize::try_from(tag.checked_sub(index.first()?.0)?).ok()?;
        match index.get(guess) {
            Some(&(found, node)) if found == tag => Some(node),
            _ => {
                let place = index.binary_search_by_key(&tag, |&(tag, _)| tag).ok()?;
                Some(index[place].1)
            }
        }
    }

    /// Looks up the nodes of an element.
    pub(super) fn resolve<const N: usize>(&self, element: &Element<N>) -> Result<[usize; N]> {
        let mut nodes = [0; N];
        for (place, tag) in nodes.iter_mut().zip(element.nodes) {
            let Some(node) = self.get(tag) else {
                let missing = Problem::MissingNode { element: element.tag, node: tag };
                return at(element.at, missing);
            };
            *place = node;
        }
        Ok(nodes)
    }
}

/// A triangle as listed, and the positions of its nodes.
pub(super) type Triangle<'a> = (&'a Element<3>, [usize; 3]);

/// The triangles of the body, each once.
fn body<'a>(raw: &'a Raw, index: &Index) -> Result<Vec<Triangle<'a>>> {
    let grouped = raw.triangles.iter().any(|t| t.group != 0);
    let mut triangles: Vec<Triangle> = Vec::with_capacity(raw.triangles.len());
    for element in raw.triangles.iter().filter(|t| !grouped || t.group != 0) {
        triangles.push((element, index.resolve(element)?));
    }

    // MSH 2 lists a triangle once for each of its groups; the same triangle again in the
    // same group or on another surface is an error.
    let mut order: Vec<_> = triangles.iter().map(|(_, nodes)| *nodes).zip(0..).collect();
    for (nodes, _) in &mut order {
        nodes.sort_unstable();
    }
    order.sort_unstable();
    let mut keep = vec![true; triangles.len()];
    for same in order.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
        let elements: Vec<_> = same.iter().map(|&(_, i)| triangles[i].0).collect();
        for (i, second) in elements.iter().enumerate().skip(1) {
            let twice =
                |first: &&&Element<3>| first.entity != second.entity || first.group == second.group;
            if let Some(first) = elements[..i].iter().find(twice) {
                let (first, second_tag) = (first.tag, second.tag);
                return at(second.at, Problem::DuplicateTriangle { first, second: second_tag });
            }
            keep[same[i].1] = false;
        }
    }
    let mut keep = keep.into_iter();
    triangles.retain(|_| keep.next() == Some(true));
    Ok(triangles)
}

/// The nodes' x and y, after making sure that those of the body lie in the plane.
fn planar_points(raw: &Raw, triangles: &[Triangle]) -> Result<Vec<[f64; 2]>> {
    let used = || triangles.iter().flat_map(|(_, t)| t).map(|&node| &raw.nodes[node]);
    let extent = (0..2)
        .map(|i| {
            let (low, high) = used().fold((f64::MAX, f64::MIN), |(low, high), node| {
                (low.min(node.point[i]), high.max(node.point[i]))
            });
            high - low
        })
        .fold(0.0, f64::max);
    match used().find(|node| node.point[2].abs() > PLANAR * extent) {
        Some(node) => at(node.at, Problem::NotPlanar { node: node.tag, z: node.point[2] }),
        None => Ok(raw.nodes.iter().map(|node| [node.point[0], node.point[1]]).collect()),
    }
}

/// Drops the nodes of no triangle, such as the centres of arcs.
fn drop_unused(mesh: &mut Mesh) {
    let mut used = vec![false; mesh.nodes.len()];
    for &node in mesh.triangles.iter().flatten() {
        used[node] = true;
    }
    let mut place = Vec::with_capacity(used.len());
    let mut kept = 0;
    for &used in &used {
        place.push(kept);
        kept += usize::from(used);
    }
    let mut keep = used.iter();
    mesh.nodes.retain(|_| keep.next() == Some(&true));
    for node in mesh.triangles.iter_mut().flatten() {
        *node = place[*node];
    }
    for node in mesh.curves.values_mut().flat_map(|curve| curve.edges.iter_mut().flatten()) {
        *node = place[*node];
    }
}
