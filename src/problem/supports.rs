//! The boundaries that support the body: the forces they exert, and Γ_C as a line.

use super::{State, boundary_conditions::BoundaryConditions};
use crate::{
    contact::ContactPoint,
    fem::{Body, Edge, Subdomain},
    scene::{Boundary, Scene},
};
use serde::Serialize;
use std::{
    cmp::Ordering,
    collections::{BTreeMap, BTreeSet},
};

/// The boundaries with prescribed displacements or a gap, and the nodes of this rank on them.
#[derive(Debug, Clone, Default)]
pub struct Supports {
    /// Their names, in the order of the scene.
    pub names: Vec<String>,
    /// Per node with a prescribed displacement: its prescribed directions.
    prescribed: BTreeMap<usize, Vec<Prescribed>>,
    /// Per node of Γ_C: its place on each of its edges on Γ_C.
    contact: BTreeMap<usize, Vec<ContactPlace>>,
    /// Per name of a boundary and connected part of it on Γ_C: its length, m.
    lengths: BTreeMap<(String, usize), f64>,
}

/// A force on the body, or a direction in which its displacement is prescribed, with the number of the boundary.
type Prescribed = (usize, [f64; 2]);

/// Where a node of Γ_C lies.
#[derive(Debug, Clone, Copy)]
struct ContactPlace {
    boundary: usize,
    /// The number of the connected part of the boundary, from 0.
    part: usize,
    /// The length of the part up to the node, m, with the body on the left.
    arc_length: f64,
    /// The body's outward normal.
    normal: [f64; 2],
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
}

impl Supports {
    /// The supports of `scene` on the undivided `body`, with its `conditions`.
    pub(super) fn new(scene: &Scene, body: &Body, conditions: &BoundaryConditions) -> Self {
        let mut supports = Self { names: conditions.supports.clone(), ..Self::default() };
        for (row, boundary) in conditions.rows.iter().zip(&conditions.prescribed_by) {
            supports.prescribed.entry(row.node).or_default().push((*boundary, row.direction));
        }
        for Boundary { name, .. } in scene.boundaries.iter().filter(|of| of.gap().is_some()) {
            let number = supports.names.iter().position(|other| other == name);
            if let (Some(number), Some(curve)) = (number, body.mesh.curves.get(name)) {
                supports.add_contact((number, name), body, &body.edges(&curve.edges));
            }
        }
        supports
    }

    fn add_contact(&mut self, (boundary, name): (usize, &str), body: &Body, edges: &[Edge]) {
        let points = &body.nodes.points;
        let distance =
            |a: usize, b: usize| (points[a][0] - points[b][0]).hypot(points[a][1] - points[b][1]);
        for (part, edges) in connected(edges).iter().enumerate() {
            let mut start = 0.0;
            for edge in edges {
                let [a, b] = edge.ends;
                let half = edge.middle.map_or(0.0, |middle| distance(a, middle));
                let end =
                    start + edge.middle.map_or_else(|| distance(a, b), |m| half + distance(m, b));
                for (node, face) in edge.faces(points) {
                    let arc_length = match node {
                        _ if node == a => start,
                        _ if node == b => end,
                        _ => start + half,
                    };
                    let place = ContactPlace { boundary, part, arc_length, normal: face.normal };
                    self.contact.entry(node).or_default().push(place);
                }
                start = end;
            }
            self.lengths.insert((name.to_owned(), part), start);
        }
    }

    pub(super) fn restrict(&self, subdomain: &Subdomain) -> Self {
        let own = |node: &usize| subdomain.owned(*node);
        let (prescribed, contact) = (self.prescribed.iter(), self.contact.iter());
        Self {
            names: self.names.clone(),
            lengths: self.lengths.clone(),
            prescribed: prescribed.filter_map(|(n, of)| Some((own(n)?, of.clone()))).collect(),
            contact: contact.filter_map(|(n, of)| Some((own(n)?, of.clone()))).collect(),
        }
    }

    /// The place of a contact point. On several boundaries, the one with the nearest normal exerts the force.
    fn place(&self, point: &ContactPoint) -> Option<ContactPlace> {
        let along = |place: &&ContactPlace| {
            point.normal[0] * place.normal[0] + point.normal[1] * place.normal[1]
        };
        let places = self.contact.get(&point.node)?.iter();
        places.rev().max_by(|a, b| along(a).total_cmp(&along(b))).copied()
    }

    /// Per boundary: (F_x, F_y, M), this rank's part, with F = Σ R_i, N per metre of thickness, and M = Σ x_i × R_i
    /// about the origin, positive anticlockwise, N.
    ///
    /// R_i = (Ku − f)_i is the force on the body at node i; `unbalanced` is f − Ku. At a prescribed node with a
    /// closed gap, the obstacle exerts the normal reaction and the other boundaries exert the rest.
    pub(super) fn resultants(
        &self,
        body: &Body,
        unbalanced: &[f64],
        contact: &[ContactPoint],
    ) -> Vec<f64> {
        let mut sums = vec![0.0; 3 * self.names.len()];
        let mut add = |boundary: usize, node: usize, [fx, fy]: [f64; 2]| {
            let [x, y] = body.nodes.points[node];
            for (sum, part) in sums[3 * boundary..].iter_mut().zip([fx, fy, x * fy - y * fx]) {
                *sum += part;
            }
        };
        let mut rest: BTreeMap<usize, [f64; 2]> = (self.prescribed.keys())
            .map(|&node| (node, [-unbalanced[2 * node], -unbalanced[2 * node + 1]]))
            .collect();
        for point in contact {
            let force = point.normal.map(|n| -point.force * n);
            self.place(point).into_iter().for_each(|place| add(place.boundary, point.node, force));
            if let Some([x, y]) = rest.get_mut(&point.node) {
                (*x, *y) = (*x - force[0], *y - force[1]);
            }
        }
        for (node, force) in rest {
            let parts = parts(&self.prescribed[&node], force);
            parts.into_iter().for_each(|(boundary, part)| add(boundary, node, part));
        }
        sums
    }

    /// The rows of Γ_C in a state, boundary by boundary and along each; every rank gets all rows. Collective.
    pub fn contact_rows(&self, body: &Body, state: &State) -> Vec<ContactRow> {
        let row = |point: &ContactPoint| {
            let (place, [x, y], [nx, ny]) =
                (self.place(point)?, body.nodes.points[point.node], point.normal);
            let active = f64::from(u8::from(point.active));
            // No -0.
            let [nx, ny] = [nx + 0.0, ny + 0.0];
            let at = [place.boundary as f64, place.part as f64, place.arc_length];
            Some([at[0], at[1], at[2], x, y, nx, ny, point.gap, point.pressure, active])
        };
        let own: Vec<[f64; 10]> = state.contact.iter().filter_map(row).collect();
        let all = body.nodes.partition.comm().gather(own.as_flattened());
        let mut rows: Vec<[f64; 10]> = all.as_chunks().0.to_vec();
        rows.sort_by(|a, b| a[..3].partial_cmp(&b[..3]).unwrap_or(Ordering::Equal));
        rows.into_iter()
            .map(|[boundary, part, arc_length, x, y, normal_x, normal_y, gap, pressure, active]| {
                ContactRow {
                    time: state.time,
                    boundary: self.names[boundary as usize].clone(),
                    part: part as usize,
                    arc_length,
                    x,
                    y,
                    normal_x,
                    normal_y,
                    gap,
                    pressure,
                    active: active as u8,
                }
            })
            .collect()
    }

    /// The length of contact by the `rows` of Γ_C, m, and the nodes on both sides of each of its ends, which lies
    /// between them. Next to a node without a row, which has a prescribed displacement, contact goes on up to it. At the
    /// end of Γ_C a light pressure may hide a short open part.
    pub(crate) fn contact_length(&self, rows: &[ContactRow]) -> (f64, Vec<[[f64; 2]; 2]>) {
        /// Smaller pressures than this fraction of the largest are light.
        const LIGHT: f64 = 0.05;
        let (mut length, mut ends) = (0.0, Vec::new());
        for part in rows.chunk_by(|a, b| (&a.boundary, a.part) == (&b.boundary, b.part)) {
            let [first, .., last] = part else { continue };
            let whole = self.lengths.get(&(first.boundary.clone(), first.part));
            length += f64::from(first.active) * first.arc_length;
            length += f64::from(last.active) * whole.map_or(0.0, |all| all - last.arc_length);
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
}

/// Divides the force F at a node, N/m, between the boundaries that prescribe its displacement. If two directions d and
/// e are prescribed, their boundaries exert αd and βe with F = αd + βe; a boundary that prescribes both exerts F.
/// Otherwise one exerts F.
fn parts(prescribed: &[Prescribed], force: [f64; 2]) -> Vec<Prescribed> {
    /// Directions are parallel if the sine of the angle between them is at most this.
    const SINE: f64 = 1e-6;
    let cross = |[a, b]: [f64; 2], [c, d]: [f64; 2]| a * d - b * c;
    let pairs = prescribed.iter().flat_map(|a| prescribed.iter().map(move |b| (*a, *b)));
    let mut pairs = pairs.filter(|((_, d), (_, e))| cross(*d, *e).abs() > SINE);
    match pairs.clone().find(|(a, b)| a.0 == b.0).or_else(|| pairs.next()) {
        None => vec![(prescribed[0].0, force)],
        Some(((first, d), (other, e))) => {
            let (along_d, along_e) = (cross(force, e) / cross(d, e), cross(d, force) / cross(d, e));
            vec![(first, d.map(|d| along_d * d)), (other, e.map(|e| along_e * e))]
        }
    }
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
