//! Γ_C as a line: the places of its nodes, the pressure along it, and the length of contact.
//!
//! The pressure is continuous along each part of Γ_C and linear between its vertices, also with quadratic elements. A
//! vertex has the pressure F/ℓ, where ℓ is half of the length of its edges and F its reaction with its shares of the
//! reactions of the midsides. So the area under the pressure is the force. On an edge of length L with the ends a and
//! b and the reaction R of its midside, the share of a is
//!
//! R/2 + L/6 (p_a − p_b),   at least 0 and at most R,
//!
//! with the quotients p of the reactions of a and b alone by ∫φ. A pressure that is linear in the arc length keeps its
//! values. At a vertex with a prescribed displacement R is the part of the reaction that Γ_C exerts
//! ([`Supports`](super::Supports)).
//!
//! Where boundaries meet smoothly at a node, those with the least gap there share its reaction.
//!
//! At a vertex between two materials the pressure jumps. Each side then has a line node of its own. With the parts λ_a and λ_b of
//! the length there, the reaction F = (λ_a + λ_b) p becomes the pressures p_a = p − J λ_b/(λ_a + λ_b) and p_b = p_a + J. The
//! jump J is the difference of the pressures that the next two line nodes of each side extrapolate.

use crate::{
    ROUNDING,
    contact::ContactPoint,
    fem::{Body, Edge},
    mesh::{BoundaryFace, Lines, distance, joined_faces},
    problem::State,
    scene::{Expression, Gap},
};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Γ_C of the whole body, and the places of this rank's nodes on it.
#[derive(Debug, Clone, Default)]
pub struct ContactLine {
    /// Part by part with the body on the left.
    pub(super) line_nodes: Vec<LineNode>,
    /// Per node: its faces, each with the line nodes and their lengths of it, m.
    places: BTreeMap<usize, Vec<(BoundaryFace, Vec<Place>)>>,
    /// The line nodes at which closed parts begin and end in a vertex without a corner.
    seams: Vec<[usize; 2]>,
    /// The two line nodes of each vertex between materials: the end of an edge, and the start of the next one.
    interface_nodes: Vec<[usize; 2]>,
    /// Per number of a boundary: its gap g(x, y, t), m.
    gaps: BTreeMap<usize, Expression>,
}

/// A line node, and its part of the length of a face, m.
type Place = (usize, f64);

/// The share of a line node in the reaction of a contact point with the force F: which part of F it gets, which multiple of the mean
/// pressure F/∫φ, and how much wider its gap is than the least gap at the point, m.
pub(super) struct ReactionShare {
    pub(super) line_node: usize,
    pub(super) force: f64,
    pressure: f64,
    farther: f64,
}

/// A node of the line: a vertex or the middle of an edge, on one part of a boundary. A corner is two line nodes, and so is the vertex at
/// which a closed part begins and ends.
#[derive(Debug, Clone)]
pub(super) struct LineNode {
    pub(super) boundary: usize,
    /// Half of the length of the edges of a vertex, m; `None` in the middle of an edge.
    length: Option<f64>,
    /// Its row, without the state.
    row: ContactRow,
}

/// A row of `contact.csv`: a gap condition at a node of Γ_C, its remaining gap and its pressure.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ContactRow {
    /// t, s.
    pub time: f64,
    /// The boundary.
    pub boundary: String,
    /// The number of the connected part of the boundary, from 0.
    pub part: usize,
    /// The length of the part up to the node, m, with the body on the left.
    pub arc_length: f64,
    /// The node, m.
    pub x: f64,
    /// See `x`.
    pub y: f64,
    /// ν, towards the obstacle.
    pub normal_x: f64,
    /// See `normal_x`.
    pub normal_y: f64,
    /// The remaining gap g − u·ν, m.
    pub gap: f64,
    /// Pa, positive in compression.
    pub pressure: f64,
    /// 1 if the node is active, else 0.
    pub active: u8,
    /// The reaction, N per metre of thickness; not in the file.
    #[serde(skip)]
    pub force: f64,
}

/// The reaction at a line node, as the ranks exchange it: line node, ν_x, ν_y, gap, reaction (N per metre of thickness),
/// reaction over ∫φ (Pa), active.
type Reaction = [f64; 7];

impl ContactLine {
    /// The parts of these boundaries (number, name, gap, edges) of a body, whose nodes are `points`. Materials meet at the
    /// nodes `between` them.
    pub(super) fn new<'a>(
        boundaries: impl IntoIterator<Item = (usize, &'a str, &'a Gap, Vec<Edge>)>,
        points: &[[f64; 2]],
        lines: &Lines,
        between: &BTreeSet<usize>,
    ) -> Self {
        let (mut line, mut places) = (Self::default(), Vec::new());
        for (boundary, name, gap, edges) in boundaries {
            line.gaps.insert(boundary, gap.distance.clone());
            for (part, edges) in connected(&edges).iter().enumerate() {
                let row = ContactRow { boundary: name.to_owned(), part, ..ContactRow::default() };
                let lines = (points, lines, between);
                line.add((boundary, row), gap.normal, lines, edges, &mut places);
            }
        }
        line.places = joined_faces(places);
        let interface_nodes = between.iter().flat_map(|node| line.places.get(node)).flatten();
        let pair = |(_, places): &(BoundaryFace, Vec<Place>)| match places[..] {
            [(a, _), (b, _)] if line.beside(a, -1, 1).is_some() => Some([a, b]),
            [(a, _), (b, _)] => Some([b, a]),
            _ => None,
        };
        line.interface_nodes = interface_nodes.filter_map(pair).collect();
        line
    }

    /// Adds the `edges` of a connected part, whose rows are like `row`, and the `places` of its nodes.
    fn add(
        &mut self,
        (boundary, row): (usize, ContactRow),
        normal: Option<[f64; 2]>,
        (points, lines, between): (&[[f64; 2]], &Lines, &BTreeSet<usize>),
        edges: &[Edge],
        places: &mut Vec<(usize, BoundaryFace, Place)>,
    ) {
        let distance = |a: usize, b: usize| distance(points[a], points[b]);
        let face = |face: BoundaryFace| {
            normal.map_or(face, |normal| BoundaryFace::plane(normal, face.length))
        };
        let line_node = |node: usize, arc_length: f64, length: Option<f64>| {
            let [x, y] = points[node];
            LineNode { boundary, length, row: ContactRow { arc_length, x, y, ..row.clone() } }
        };
        let begin = self.line_nodes.len();
        let (mut start, mut first, mut last) = (0.0, None::<BoundaryFace>, None::<BoundaryFace>);
        for edge in edges {
            let faces: Vec<_> = edge.faces(points, lines).map(|(n, f)| (n, face(f))).collect();
            let [a, b] = edge.ends;
            let middle = edge.middle.unwrap_or(b);
            let half = distance(a, middle);
            let length = half + distance(middle, b);
            let goes_on = !between.contains(&a);
            match self.line_nodes.last_mut() {
                Some(before) if goes_on && last.is_some_and(|l| l.continues(&faces[0].1)) => {
                    before.length = before.length.map(|before| before + 0.5 * length);
                }
                _ => self.line_nodes.push(line_node(a, start, Some(0.5 * length))),
            }
            let number = self.line_nodes.len() - 1;
            self.line_nodes.extend(edge.middle.map(|m| line_node(m, start + half, None)));
            self.line_nodes.push(line_node(b, start + length, Some(0.5 * length)));
            let numbers = [number, self.line_nodes.len() - 1, number + 1];
            let of_edge = faces.iter().zip(numbers);
            places.extend(of_edge.map(|(&(node, face), n)| (node, face, (n, face.length))));
            (start, first, last) = (start + length, first.or(Some(faces[0].1)), Some(faces[1].1));
        }
        let [from, to] = [edges[0].ends[0], edges[edges.len() - 1].ends[1]];
        if from == to
            && !between.contains(&from)
            && first.zip(last).is_some_and(|(first, last)| last.continues(&first))
        {
            self.seams.push([begin, self.line_nodes.len() - 1]);
        }
    }

    /// Is the node of this rank on Γ_C?
    pub(super) fn has(&self, node: usize) -> bool {
        self.places.contains_key(&node)
    }

    /// The line with the places of a rank's nodes, to which `own` gives new numbers.
    pub(super) fn restrict(&self, own: impl Fn(&usize) -> Option<usize>) -> Self {
        let places = self.places.iter().filter_map(|(n, of)| Some((own(n)?, of.clone())));
        Self { places: places.collect(), ..self.clone() }
    }

    /// The shares of a contact point at time t: in the face with its normal. Those of the boundaries with the least gap there
    /// bear the force, by their lengths.
    pub(super) fn shares(&self, point: &ContactPoint, t: f64) -> Vec<ReactionShare> {
        let Some(faces) = self.places.get(&point.node) else { return Vec::new() };
        let own = BoundaryFace::plane(point.normal, 0.0);
        let off = |(face, _): &(BoundaryFace, Vec<Place>)| face.angle(&own);
        let nearest = faces.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        let mut lengths = BTreeMap::new();
        for &(line_node, length) in nearest.iter().flat_map(|(_, places)| places) {
            *lengths.entry(line_node).or_insert(0.0) += length;
        }
        let gap = |line_node: usize| {
            let LineNode { boundary, row: ContactRow { x, y, .. }, .. } =
                &self.line_nodes[line_node];
            self.gaps.get(boundary).map_or(0.0, |gap| gap.eval(*x, *y, t))
        };
        let least = lengths.keys().map(|line_node| gap(*line_node)).fold(f64::INFINITY, f64::min);
        let total: f64 = lengths.values().sum();
        let bears = |line_node: usize| gap(line_node) - least <= ROUNDING * total;
        let bearing = lengths.iter().filter(|(line_node, _)| bears(**line_node));
        let bearing: f64 = bearing.map(|(_, length)| length).sum();
        let share = |(&line_node, length): (&usize, &f64)| {
            let part = if bears(line_node) { 1.0 / bearing } else { 0.0 };
            let [force, pressure] = [length * part, total * part];
            ReactionShare { line_node, force, pressure, farther: gap(line_node) - least }
        };
        lengths.iter().map(share).collect()
    }

    /// The arc length between a line node and the one that follows `steps` later or earlier on its part, m, and its number.
    fn beside(&self, line_node: usize, direction: isize, steps: isize) -> Option<(f64, usize)> {
        let number = line_node.checked_add_signed(direction * steps)?;
        let [own, other] = [&self.line_nodes[line_node].row, &self.line_nodes.get(number)?.row];
        let length = direction as f64 * (other.arc_length - own.arc_length);
        let is_beside = (&own.boundary, own.part) == (&other.boundary, other.part) && length > 0.0;
        is_beside.then_some((length, number))
    }

    /// The reactions at all line nodes in order, on every rank, with those of interface nodes in proportion to lengths. Collective.
    fn reactions(&self, body: &Body, state: &State) -> Vec<Reaction> {
        let reactions = |point: &ContactPoint| {
            let ContactPoint { normal, force, pressure, gap, active, .. } = *point;
            // No -0.
            let [nx, ny] = normal.map(|n| n + 0.0);
            let force = if active { force } else { 0.0 };
            let of = move |share: ReactionShare| {
                let (line_node, gap) = (share.line_node as f64, gap + share.farther);
                let active = f64::from(u8::from(active && share.force > 0.0));
                [line_node, nx, ny, gap, share.force * force, share.pressure * pressure, active]
            };
            self.shares(point, state.time).into_iter().map(of)
        };
        let own: Vec<Reaction> = state.of_contact().flat_map(reactions).collect();
        let all = body.comm().gather(own.as_flattened());
        let mut all: Vec<Reaction> = all.as_chunks().0.to_vec();
        all.sort_by(|a, b| a[0].total_cmp(&b[0]));
        all
    }

    /// The force to move from the first to the second line node of each pair of interface nodes, N per metre of thickness, and the places of both
    /// in `all` reactions.
    fn moved<'a>(&'a self, all: &'a [Reaction]) -> impl Iterator<Item = ([usize; 2], f64)> + 'a {
        let place = |k: usize| all.binary_search_by(|of| of[0].total_cmp(&(k as f64))).ok();
        // Interface nodes give no pressure to extrapolate from: their forces are not divided yet.
        let is_interface =
            |line_node: &usize| self.interface_nodes.as_flattened().contains(line_node);
        let extrapolated = move |line_node: usize, direction: isize| {
            let beside = |steps: isize| {
                let (length, number) = self.beside(line_node, direction, steps)?;
                Some((length, all[place(number)?][5])).filter(|_| !is_interface(&number))
            };
            let (length, p) = beside(1)?;
            let slope = beside(2).map(|(farther, q)| (p - q) / (farther - length));
            Some(p + slope.unwrap_or(0.0) * length)
        };
        self.interface_nodes.iter().filter_map(move |&[a, b]| {
            let jump = extrapolated(b, 1)? - extrapolated(a, -1)?;
            let places = [place(a)?, place(b)?];
            let [(f, p), (g, _)] = places.map(|i| (all[i][4], all[i][5]));
            let force = f * g / (f + g) * jump / p;
            force.is_finite().then(|| (places, force.clamp(-g, f)))
        })
    }

    /// The forces to move between boundaries at interface nodes, on the first rank alone: the numbers of both boundaries, the place, m,
    /// and the force on the body, N per metre of thickness. Collective.
    pub(super) fn moved_forces(
        &self,
        body: &Body,
        state: &State,
    ) -> Vec<([usize; 2], [f64; 2], [f64; 2])> {
        let boundaries = |of: &[usize; 2]| of.map(|line_node| self.line_nodes[line_node].boundary);
        if !self.interface_nodes.iter().map(boundaries).any(|[a, b]| a != b) {
            return Vec::new();
        }
        let all = self.reactions(body, state);
        let of = |(places, force): ([usize; 2], f64)| {
            let [nx, ny] = [1, 2].map(|k| -force * all[places[0]][k]);
            let line_nodes = places.map(|i| &self.line_nodes[all[i][0] as usize]);
            let ContactRow { x, y, .. } = line_nodes[0].row;
            (line_nodes.map(|of| of.boundary), [x, y], [nx, ny])
        };
        let is_first = body.comm().rank() == 0;
        self.moved(&all).map(of).filter(|_| is_first).collect()
    }

    /// The rows in a state, boundary by boundary and along each, on every rank; and the pressures at this rank's nodes of
    /// Γ_C, Pa. Collective.
    pub fn rows(&self, body: &Body, state: &State) -> (Vec<ContactRow>, Vec<(usize, f64)>) {
        let mut all = self.reactions(body, state);
        for (places, force) in Vec::from_iter(self.moved(&all)) {
            for (i, change) in places.into_iter().zip([-force, force]) {
                all[i][5] *= 1.0 + change / all[i][4];
                all[i][4] += change;
            }
        }
        let pressures = self.pressures(&all);
        let row = |&[number, normal_x, normal_y, gap, force, _, active]: &Reaction| {
            let (line_node, time) = (number as usize, state.time);
            let (pressure, active) = (pressures[line_node], active as u8);
            let row = self.line_nodes[line_node].row.clone();
            ContactRow { time, normal_x, normal_y, gap, pressure, active, force, ..row }
        };
        let nodal = |(node, faces): (&usize, &Vec<(BoundaryFace, Vec<Place>)>)| {
            let places = faces.iter().flat_map(|(_, places)| places);
            (*node, places.map(|(line_node, _)| pressures[*line_node]).fold(0.0, f64::max))
        };
        (all.iter().map(row).collect(), self.places.iter().map(nodal).collect())
    }

    /// The pressure at each line node, Pa.
    fn pressures(&self, reactions: &[Reaction]) -> Vec<f64> {
        let line_nodes = &self.line_nodes;
        let [mut forces, mut nodal] = [vec![0.0; line_nodes.len()], vec![0.0; line_nodes.len()]];
        for &[number, .., force, pressure, _] in reactions {
            forces[number as usize] += force;
            nodal[number as usize] = pressure;
        }
        let middles = || (0..line_nodes.len()).filter(|&i| line_nodes[i].length.is_none());
        let arc = |i: usize| line_nodes[i].row.arc_length;
        for i in middles() {
            let (a, b, length) = (i - 1, i + 1, arc(i + 1) - arc(i - 1));
            let share = 0.5 * forces[i] + length / 6.0 * (nodal[a] - nodal[b]);
            let share = share.clamp(0.0, forces[i]);
            forces[a] += share;
            forces[b] += forces[i] - share;
        }
        for (of, force) in line_nodes.iter().zip(&mut forces) {
            *force /= of.length.unwrap_or(1.0);
        }
        for seam in &self.seams {
            let [p, q] = seam.map(|line_node| {
                (line_nodes[line_node].length.unwrap_or_default(), forces[line_node])
            });
            let mean = (p.0 * p.1 + q.0 * q.1) / (p.0 + q.0);
            seam.iter().for_each(|line_node| forces[*line_node] = mean);
        }
        for i in middles() {
            let (a, b) = (i - 1, i + 1);
            let part = (arc(i) - arc(a)) / (arc(b) - arc(a));
            forces[i] = (1.0 - part) * forces[a] + part * forces[b];
        }
        forces
    }

    /// The length of contact by the `rows` of Γ_C, m, and the nodes on both sides of each of its ends, which lies
    /// between them. At the end of Γ_C a light pressure may hide a short open part.
    pub fn length(&self, rows: &[ContactRow]) -> (f64, Vec<[[f64; 2]; 2]>) {
        /// Smaller pressures than this fraction of the largest are light.
        const LIGHT: f64 = 0.05;
        let (mut length, mut ends) = (0.0, Vec::new());
        for part in parts_from_open_nodes(rows) {
            let largest = part.iter().fold(0.0, |most, row| f64::max(most, row.pressure));
            for (i, pair) in part.windows(2).enumerate() {
                let [a, b] = [&pair[0], &pair[1]];
                length += 0.5 * f64::from(a.active + b.active) * (b.arc_length - a.arc_length);
                let is_light = |row: &ContactRow| row.pressure < LIGHT * largest;
                let at_end = (i == 0 && is_light(a)) || (i + 2 == part.len() && is_light(b));
                if a.active != b.active || (a.active == 1 && at_end) {
                    ends.push([[a.x, a.y], [b.x, b.y]]);
                }
            }
        }
        (length, ends)
    }

    /// Is a length of contact by the `rows` of Γ_C more than the edges of single nodes? `None` without contact.
    pub fn resolves_length(&self, rows: &[ContactRow]) -> Option<bool> {
        let both = |pair: &[ContactRow]| pair[0].active + pair[1].active == 2;
        let is_active = rows.iter().any(|row| row.active == 1);
        let parts = parts_from_open_nodes(rows);
        is_active.then(|| parts.iter().any(|part| part.windows(2).any(both)))
    }
}

/// The rows of each part. A closed part begins and ends at one node: the first one of the longest stretch without contact,
/// or, if all nodes are active, that with the least pressure.
pub(super) fn parts_from_open_nodes(rows: &[ContactRow]) -> Vec<Vec<ContactRow>> {
    let from_open_node = |part: &[ContactRow]| {
        let [first, .., last] = part else { return part.to_vec() };
        let is_closed = (first.x, first.y) == (last.x, last.y) && first.arc_length == 0.0;
        let (count, whole) = (part.len(), last.arc_length);
        let active: Vec<usize> = (0..count).filter(|&i| part[i].active == 1).collect();
        if !is_closed || active.is_empty() {
            return part.to_vec();
        }
        let next = active.iter().cycle().skip(1);
        let stretches = active.iter().zip(next).filter(|(a, b)| (*a + 1) % count != **b);
        let arc = |(a, b): (&usize, &usize)| {
            (part[*b].arc_length - part[*a].arc_length).rem_euclid(whole)
        };
        let longest = stretches.max_by(|a, b| arc(*a).total_cmp(&arc(*b)));
        let lightest = (0..count).min_by(|&a, &b| part[a].pressure.total_cmp(&part[b].pressure));
        let start = longest.map_or(lightest.unwrap_or(0), |(a, _)| (a + 1) % count);
        let row = |i: usize| {
            let row = &part[i % count];
            let arc_length = row.arc_length - part[start].arc_length + whole * (i / count) as f64;
            ContactRow { arc_length, ..row.clone() }
        };
        (start..=start + count).map(row).collect()
    };
    let parts = rows.chunk_by(|a, b| (&a.boundary, a.part) == (&b.boundary, b.part));
    parts.map(from_open_node).collect()
}

/// The connected parts of a curve, each with its edges in order. The body is on the left of all edges.
fn connected(edges: &[Edge]) -> Vec<Vec<Edge>> {
    let mut after: BTreeMap<usize, Edge> = edges.iter().map(|edge| (edge.ends[0], *edge)).collect();
    let ends: BTreeSet<usize> = edges.iter().map(|edge| edge.ends[1]).collect();
    let open = edges.iter().filter(|edge| !ends.contains(&edge.ends[0]));
    // Closed parts begin at their first edge.
    let mut parts = Vec::new();
    for first in open.chain(edges) {
        let mut part = Vec::new();
        let mut node = first.ends[0];
        while let Some(edge) = after.remove(&node) {
            node = edge.ends[1];
            part.push(edge);
        }
        if !part.is_empty() {
            parts.push(part);
        }
    }
    parts
}
