//! The contact pressure of the proof: p ≥ 0 on Γ_C, with the reactions at the nodes where that is possible.
//!
//! On an edge p = p_a (1 − s)² + 2c s (1 − s) + p_b s², with c = (p_a + p_b)/2 for elements of first order. All coefficients are at
//! least 0. Among these pressures, p is the nearest in L² to the pressure that has the reactions as its nodal forces. p acts
//! along −ν of the nodes.

use super::Side;
use crate::{
    fem::RigidMotion,
    observe::{ContactRow, ObservedProblem, rows_of},
    problem::State,
    scene::Boundary,
};
use nalgebra::{DMatrix, DVector, Vector2};
use rustc_hash::FxHashMap as HashMap;

/// ∫ b_i b_j of the functions b = (1 − s)², 2s(1 − s), s².
const PRODUCTS: [[f64; 3]; 3] = [
    [1.0 / 5.0, 1.0 / 10.0, 1.0 / 30.0],
    [1.0 / 10.0, 2.0 / 15.0, 1.0 / 10.0],
    [1.0 / 30.0, 1.0 / 10.0, 1.0 / 5.0],
];
/// ∫ b_j times 1 − s, s, and 4s(1 − s).
const MOMENTS: [[f64; 3]; 3] = [
    [1.0 / 4.0, 1.0 / 6.0, 1.0 / 12.0],
    [1.0 / 12.0, 1.0 / 6.0, 1.0 / 4.0],
    [1.0 / 5.0, 4.0 / 15.0, 1.0 / 5.0],
];

/// The pressure on an edge of Γ_C. Its three coefficients belong to its first end, its middle and its last end.
pub(super) struct ContactEdge {
    /// The nodes; none in the middle for elements of first order.
    nodes: [Option<usize>; 3],
    /// Their places, m, and ν there.
    places: [[f64; 2]; 3],
    normals: [Vector2<f64>; 3],
    /// The coefficients of p, Pa, and of the remaining gap, m.
    pressures: [f64; 3],
    gaps: [f64; 3],
    length: f64,
    /// Differs ν at an end from the normal of the edge, as where Γ_C is curved?
    pub(super) is_turned: bool,
    /// Is it this rank that counts the edge? The rank of the end with the smaller global number does.
    is_own: bool,
}

/// The pressures on a boundary, and its reactions: forces, N per metre of thickness, and their places, m.
pub(super) struct Foundation {
    pub(super) edges: Vec<ContactEdge>,
    reactions: Vec<([f64; 2], Vector2<f64>)>,
}

/// The rows at the ends of an edge and in its middle, and its length, m.
struct Piece {
    ends: [usize; 2],
    middle: Option<usize>,
    length: f64,
}

impl Foundation {
    /// The boundaries with a gap. `sides` are the edges of the boundary. Collective.
    pub(super) fn all(
        problem: &ObservedProblem,
        state: &State,
        sides: &HashMap<[usize; 2], Side>,
    ) -> Vec<Self> {
        let (body, scene) = (&problem.body, problem.scene());
        let (rows, _) = problem.supports.contact.rows(body, state);
        let boundaries = scene.boundaries.iter().filter(|boundary| boundary.gap().is_some());
        let of_boundary = |boundary: &Boundary| {
            let normal = boundary.gap().and_then(|gap| gap.normal);
            Self::new(problem, rows_of(&rows, &boundary.name), (&boundary.name, normal), sides)
        };
        boundaries.map(of_boundary).collect()
    }

    /// The boundary `name` with its `rows`, which every rank has, and with the normal of its gap if that is fixed.
    fn new(
        problem: &ObservedProblem,
        rows: &[ContactRow],
        (name, normal): (&str, Option<[f64; 2]>),
        sides: &HashMap<[usize; 2], Side>,
    ) -> Self {
        let (body, mesh) = (&problem.body, problem.mesh());
        let mut places = HashMap::<[u64; 2], Vec<usize>>::default();
        for (k, row) in rows.iter().enumerate() {
            places.entry([row.x, row.y].map(f64::to_bits)).or_default().push(k);
        }
        let at = |place: [f64; 2]| places.get(&place.map(f64::to_bits)).map_or(&[][..], |of| of);
        // A place between two edges with different pressures has two rows, and so has the start of a closed part.
        let piece = |[a, b]: [[f64; 2]; 2]| {
            let pairs = at(a).iter().flat_map(|i| at(b).iter().map(move |j| [*i, *j]));
            let ends = pairs.filter(|[i, j]| i < j).min_by_key(|[i, j]| j - i)?;
            let middle = [0, 1].map(|k| 0.5 * (a[k] + b[k]));
            let length = (a[0] - b[0]).hypot(a[1] - b[1]);
            Some(Piece { ends, middle: at(middle).first().copied(), length })
        };
        let ends = |edge: &[usize; 2]| edge.map(|vertex| mesh.nodes[vertex]);
        let undivided = mesh.edges_of(name).iter().filter_map(|edge| piece(ends(edge)));
        let pressures = nearest(rows, &Vec::from_iter(undivided));
        let (own, vertices) = (&body.mesh, body.node_of_vertex());
        let edges = own.edges_of(name).iter().filter_map(|edge| {
            let nodes = edge.map(|vertex| vertices[vertex]);
            let side = sides.get(&[nodes[0].min(nodes[1]), nodes[0].max(nodes[1])])?;
            let piece = piece(edge.map(|vertex| own.nodes[vertex]))?;
            let outward = normal.map_or(side.1, Vector2::from);
            Some(ContactEdge::new(problem, (rows, &pressures), &piece, nodes, (side.0[2], outward)))
        });
        let edges = Vec::from_iter(edges);
        // The first rank counts the rows.
        let is_first = body.comm().is_root();
        let force = |row: &ContactRow| {
            ([row.x, row.y], -row.force * Vector2::new(row.normal_x, row.normal_y))
        };
        let reactions = rows.iter().filter(|_| is_first).map(force).collect();
        Self { edges, reactions }
    }
}

/// The coefficients p ≥ 0 of the rows: those of ½ ∫ p² − Σ p R that is least, with the forces R of the functions of the coefficients.
/// The method of Gauss and Seidel, in which a negative p becomes 0.
fn nearest(rows: &[ContactRow], pieces: &[Piece]) -> Vec<f64> {
    const SWEEPS: usize = 60;
    let mut forces: Vec<f64> = rows.iter().map(|row| row.force).collect();
    let (mut diagonal, mut couplings) = (vec![0.0; rows.len()], vec![Vec::new(); rows.len()]);
    for Piece { ends, middle, length } in pieces {
        let linear = [[1.0 / 3.0, 0.0, 1.0 / 6.0], [0.0; 3], [1.0 / 6.0, 0.0, 1.0 / 3.0]];
        let products = if middle.is_some() { PRODUCTS } else { linear };
        if let Some(middle) = *middle {
            // (1 − s)² = φ_a + φ_m/4, 2s(1 − s) = φ_m/2.
            let force = rows[middle].force;
            ends.iter().for_each(|end| forces[*end] += 0.25 * force);
            forces[middle] = 0.5 * force;
        }
        let of = [Some(ends[0]), *middle, Some(ends[1])];
        for (i, row) in of.iter().enumerate() {
            let Some(row) = *row else { continue };
            diagonal[row] += length * products[i][i];
            let others = of.iter().enumerate().filter(|(j, _)| *j != i);
            let others = others.filter_map(|(j, other)| Some(((*other)?, length * products[i][j])));
            couplings[row].extend(others);
        }
    }
    let mut pressures = vec![0.0_f64; rows.len()];
    for _ in 0..SWEEPS {
        for row in 0..rows.len() {
            let others = couplings[row].iter().map(|(other, part)| part * pressures[*other]);
            let rest = forces[row] - others.sum::<f64>();
            pressures[row] =
                if diagonal[row] > 0.0 { (rest / diagonal[row]).max(0.0) } else { 0.0 };
        }
    }
    pressures
}

impl ContactEdge {
    /// The edge between two nodes, the body on its left, with the rows of its piece and their pressures.
    fn new(
        problem: &ObservedProblem,
        (rows, pressures): (&[ContactRow], &[f64]),
        piece: &Piece,
        [start, end]: [usize; 2],
        (middle_node, outward): (Option<usize>, Vector2<f64>),
    ) -> Self {
        /// Normals at a larger angle, rad, differ.
        const TURNED: f64 = 1e-6;
        let (partition, points) = (&problem.body.nodes.partition, &problem.body.nodes.points);
        let Piece { ends: [first, last], middle, length } = *piece;
        let normal = |row: usize| Vector2::new(rows[row].normal_x, rows[row].normal_y);
        let gap = |row: usize| rows[row].gap.max(0.0);
        let (a, b) = (gap(first), gap(last));
        let mean = 0.5 * (a + b);
        let [from, to] = [start, end].map(|node| points[node]);
        let number = |node: &usize| partition.global(*node, 1, 0);
        let owner = [start, end].into_iter().min_by_key(number);
        Self {
            nodes: [Some(start), middle_node, Some(end)],
            places: [from, [0, 1].map(|k| 0.5 * (from[k] + to[k])), to],
            normals: [first, middle.unwrap_or(first), last].map(normal),
            pressures: [
                pressures[first],
                middle.map_or(0.0, |row| pressures[row]),
                pressures[last],
            ],
            gaps: [a, middle.map_or(mean, |row| 2.0 * gap(row) - mean), b],
            length,
            is_turned: [first, last].iter().any(|end| (normal(*end) - outward).norm() > TURNED),
            is_own: owner.is_some_and(|node| node < partition.owned()),
        }
    }

    /// ∫ of the function of the coefficient k times 1 − s, s, and 4s(1 − s), m.
    fn moments(&self, k: usize) -> [f64; 3] {
        let linear =
            [[1.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0], [0.0; 3], [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0]];
        let moments = if self.nodes[1].is_some() { MOMENTS.map(|row| row[k]) } else { linear[k] };
        moments.map(|moment| self.length * moment)
    }

    /// Makes the gap of u + v at least 0 between the nodes, by a displacement v of the middle that is added to `moved`.
    pub(super) fn admit(&mut self, moved: &mut [f64]) {
        let Some(middle) = self.nodes[1].filter(|_| self.gaps[1] < 0.0) else { return };
        let by = 0.5 * self.gaps[1] * self.normals[1];
        (moved[2 * middle], moved[2 * middle + 1]) = (by.x, by.y);
        self.gaps[1] = 0.0;
    }

    /// ∫ −p ν ψ for the hat functions of both ends and the bubble, N per metre of thickness.
    fn all_forces(&self) -> [Vector2<f64>; 3] {
        let mut forces = [Vector2::zeros(); 3];
        for k in 0..3 {
            let traction = -self.pressures[k] * self.normals[k];
            forces.iter_mut().zip(self.moments(k)).for_each(|(sum, part)| *sum += part * traction);
        }
        forces
    }

    /// ∫ −p ν ψ for the hat functions of the nodes at its ends, which come in increasing order, N per metre of thickness.
    pub(super) fn forces(&self) -> ([usize; 2], [Vector2<f64>; 2]) {
        let [a, b, _] = self.all_forces();
        let [start, end] = [0, 2].map(|k| self.nodes[k].unwrap_or_default());
        if start < end { ([start, end], [a, b]) } else { ([end, start], [b, a]) }
    }

    /// The places of its ends, m.
    pub(super) fn ends(&self) -> [[f64; 2]; 2] {
        [self.places[0], self.places[2]]
    }

    /// The coefficients of p, Pa.
    pub(super) fn coefficients(&self) -> [f64; 3] {
        let [p, q, r] = self.pressures;
        [p, if self.nodes[1].is_some() { q } else { 0.5 * (p + r) }, r]
    }

    /// ∫ p (g − u·ν), N m per metre of thickness.
    pub(super) fn work(&self) -> f64 {
        let pressures = self.coefficients();
        let of_row = |(row, p): (&[f64; 3], f64)| {
            p * row.iter().zip(self.gaps).map(|(part, g)| part * g).sum::<f64>()
        };
        let sum = PRODUCTS.iter().zip(pressures).map(of_row).sum::<f64>();
        if self.is_own { self.length * sum } else { 0.0 }
    }
}

/// The forces of the pressures at the nodes.
pub(super) fn nodal_forces(problem: &ObservedProblem, edges: &[ContactEdge]) -> Vec<f64> {
    let mut forces = vec![0.0; 2 * problem.body.nodes.points.len()];
    for edge in edges {
        let [a, b, bubble] = edge.all_forces();
        // φ = ψ − half of the bubble at an end, if there is one in the middle.
        let of_end = if edge.nodes[1].is_some() { 0.5 } else { 0.0 };
        let parts = [a - of_end * bubble, bubble, b - of_end * bubble];
        for (node, force) in edge.nodes.into_iter().zip(parts) {
            let Some(node) = node else { continue };
            forces[2 * node] += force.x;
            forces[2 * node + 1] += force.y;
        }
    }
    forces
}

/// Gives the pressures of each foundation the resultant and the moment of its reactions, and those of all foundations the ones that
/// balance the `load` on the motions that contact alone prevents. False if no such p ≥ 0 is found. Collective.
pub(super) fn balance(
    problem: &ObservedProblem,
    foundations: &mut [Foundation],
    load: &[f64],
) -> bool {
    let (body, resisted) = (&problem.body, &problem.motions.resisted);
    let all =
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|v| RigidMotion::new(body, v));
    for Foundation { edges, reactions } in &mut *foundations {
        let mut target = DVector::zeros(all.len());
        for (at, force) in reactions {
            target +=
                DVector::from_iterator(3, all.iter().map(|m| force.dot(&Vector2::from(m.at(*at)))));
        }
        body.comm().sum(target.as_mut_slice());
        scale(problem, &mut edges.iter_mut().collect::<Vec<_>>(), &all, &target);
    }
    let target = -problem.motions.work(body, |i| [load[2 * i], load[2 * i + 1]]);
    let edges = foundations.iter_mut().flat_map(|foundation| &mut foundation.edges);
    resisted.is_empty() || scale(problem, &mut edges.collect::<Vec<_>>(), resisted, &target)
}

/// Scales the pressures by 1 + Σ c_k ν·m_k so that their work on the motions m_k is the `target`. Where this p is negative, it
/// becomes 0, and the rest is scaled again. Is the target met? Collective.
fn scale(
    problem: &ObservedProblem,
    edges: &mut [&mut ContactEdge],
    motions: &[RigidMotion],
    target: &DVector<f64>,
) -> bool {
    /// In each round but the last one some p becomes 0. Bodies that need more rounds have no bound.
    const TIMES: usize = 10;
    let (comm, count) = (problem.body.comm(), motions.len());
    // ν·m at the place `at`, with ν of the place k of an edge.
    let along = |edge: &ContactEdge, k: usize, at: [f64; 2]| {
        DVector::from_fn(count, |i, _| edge.normals[k].dot(&Vector2::from(motions[i].at(at))))
    };
    for _ in 0..TIMES {
        // The work, and its derivatives by c.
        let (mut present, mut matrix) = (DVector::zeros(count), DMatrix::zeros(count, count));
        for edge in edges.iter().filter(|edge| edge.is_own) {
            for k in 0..3 {
                let [a, b, _] = edge.moments(k);
                let [first, _, last] = edge.places;
                let work = along(edge, k, first) * a + along(edge, k, last) * b;
                let work = work * -edge.pressures[k];
                present += &work;
                matrix += work * along(edge, k, edge.places[k]).transpose();
            }
        }
        comm.sum(present.as_mut_slice());
        comm.sum(matrix.as_mut_slice());
        let (missing, size) = (target - present, 1e-10 * matrix.amax());
        let Ok(inverse) = matrix.clone().pseudo_inverse(size) else { return false };
        let factors = inverse * &missing;
        let is_met =
            (&matrix * &factors - &missing).norm() <= 1e-9 * target.norm().max(matrix.amax());
        let factor =
            |edge: &ContactEdge, k: usize| 1.0 + along(edge, k, edge.places[k]).dot(&factors);
        let pulls = |edge: &ContactEdge, k: usize| edge.pressures[k] > 0.0 && factor(edge, k) < 0.0;
        let is_last = !comm.any(edges.iter().any(|edge| (0..3).any(|k| pulls(edge, k))));
        for edge in edges.iter_mut() {
            let factors = [0, 1, 2].map(|k| factor(edge, k));
            for (p, factor) in edge.pressures.iter_mut().zip(factors) {
                *p *= if is_last { factor } else { f64::from(factor >= 0.0) };
            }
        }
        if is_last {
            return is_met;
        }
    }
    false
}
