//! A bound on the error of u that is proved.
//!
//! Let u_h be admissible (u_h = u_D on Γ_D, u_h·ν ≤ g on Γ_C), and τ a stress in equilibrium with the loads: −div τ = f_B,
//! τn = f_N on Γ_N, and on Γ_C τn is the load there minus pν with p ≥ 0. Then, in the energy norm ‖v‖² = ∫ ζAε(v) : ε(v)
//! (Prager and Synge, Quart. Appl. Math. 5, 1947; with contact Coorevits, Hild and Pelle, Comput. Methods Appl. Mech. Eng. 190, 2000),
//!
//! ‖u − u_h‖² ≤ ∫ (ζA)⁻¹(τ − ζAε(u_h)) : (τ − ζAε(u_h)) + 2 ∫_{Γ_C} p (g − u_h·ν).
//!
//! The bound contains no unknown constant. τ is made in four steps:
//!
//! 1. `pressure`: a pressure p ≥ 0 on Γ_C near the reactions at the nodes. The nodal forces of p differ from these reactions, so
//!    u_h is corrected by the w with K w = f − pν − K u_h: then u_h + w is in equilibrium with p.
//! 2. `stars`: tractions on all sides that balance each triangle, from ζAε(u_h + w).
//! 3. `airy`: tractions with a smaller bound; the changes carry no forces.
//! 4. `composite`: the stress in each triangle from its tractions.

mod airy;
mod composite;
mod pressure;
mod reservations;
mod stars;

use crate::{
    evolution::ContactStep,
    fem::{Body, at_vertices, for_elements},
    mesh::{Order, sorted},
    model::Material,
    observe::ObservedProblem,
    petsc::PetscError,
    problem::{ElementLoads, State},
    scene::Condition,
};
use composite::{Frame, LoadedTriangle, SideForces};
use nalgebra::{Matrix3, Vector2, Vector3};
use pressure::{ContactEdge, Foundation};
use rustc_hash::FxHashMap as HashMap;
use stars::{BoundaryEdge, Star, StressedTriangle};

/// A bound on the error of u in the energy norm.
#[derive(Debug, Clone)]
pub struct ProvedError {
    /// The bound over ‖u_h‖.
    pub relative: f64,
    /// The data of the scene that the proof leaves out.
    pub left_out: Vec<&'static str>,
}

/// The reason why a run has no bound, as a part of a sentence.
pub type Unproved = &'static str;

/// An imbalance of the stars up to this fraction of all forces is rounding, or the residual of the correction.
const IMBALANCE: f64 = 1e-7;
/// A bound of this many times the estimate is good enough.
const ENOUGH: f64 = 2.0;
/// Another sweep over the stars pays if the last one has multiplied the square of the bound by less than this; and the most sweeps.
///
/// They serve stretched triangles and nearly incompressible materials: in `locking` of the handbook 16 sweeps lower the bound from
/// 4.1 to 1.2 times the error.
const FALLS: f64 = 0.95;
const MOST_SWEEPS: usize = 16;
/// The sweeps over the stars at the interfaces of ranks. With them two and three ranks print nearly the bound of one.
const INTERFACE_SWEEPS: usize = 4;
/// The residual of the correction w, relative to all forces.
const CORRECTION: f64 = 0.1 * IMBALANCE;

/// The nodes of an edge of the boundary in increasing order, the middle last, and its outward normal.
type Side = ([Option<usize>; 3], Vector2<f64>);

/// The bound for a state of the problem of `contact_step`, which solves for the correction. The tractions are improved while the
/// bound is far above the relative `estimate` of the error. Collective.
pub(crate) fn proved_error(
    contact_step: &mut ContactStep,
    state: &State,
    estimate: f64,
) -> Result<Result<ProvedError, Unproved>, PetscError> {
    let mut stress = match EquilibratedStress::new(contact_step, state)? {
        Ok(stress) => stress,
        Err(reason) => return Ok(Err(reason)),
    };
    let mut before = f64::INFINITY;
    for sweep in 1.. {
        stress.improve();
        let square = stress.square();
        let relative = stress.bound(square);
        if relative <= ENOUGH * estimate || square > FALLS * before || sweep == MOST_SWEEPS {
            let left_out = reservations::of(stress.problem, &stress.edges, state.time);
            return Ok(Ok(ProvedError { relative, left_out }));
        }
        before = square;
    }
    unreachable!("the last sweep returns")
}

/// A stress τ in equilibrium with the loads, near that of a computed state, and its pressure p ≥ 0 on Γ_C.
pub struct EquilibratedStress<'a> {
    problem: &'a ObservedProblem,
    triangles: Vec<StressedTriangle>,
    stars: Vec<Star>,
    boundary: HashMap<[usize; 2], BoundaryEdge>,
    edges: Vec<ContactEdge>,
    tractions: Vec<SideForces>,
    /// ζ at the vertices, and the strains of an admissible u_h at the quadrature points.
    zeta: Vec<f64>,
    strains: Vec<Vector3<f64>>,
    /// The energy norms of the computed u, and of the displacement that makes it admissible.
    norm: f64,
    of_moved: f64,
}

impl<'a> EquilibratedStress<'a> {
    /// The stress for a state of the problem of `contact_step`, which solves for the correction; or why there is none. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn new(
        contact_step: &mut ContactStep<'a>,
        state: &State,
    ) -> Result<Result<Self, Unproved>, PetscError> {
        let problem = contact_step.problem;
        let (body, elasticity) = (&problem.body, &problem.elasticity);
        let (partition, points) = (&body.nodes.partition, problem.zeta_at_points(&state.zeta));
        let comm = partition.comm();
        let norm = |u: &[f64]| comm.total(elasticity.energy(body, &points, u)).max(0.0).sqrt();
        let size = norm(&problem.strained(state).u);
        if comm.any((0..body.triangles.len()).any(|t| body.is_curved(t))) {
            return Ok(Err("sides are curved"));
        }
        if size <= 0.0 {
            return Ok(Err("nothing is deformed"));
        }
        // The pressure, and an admissible u_h.
        let vertices = body.node_of_vertex();
        let corners =
            Vec::from_iter(body.mesh.triangles.iter().map(|t| t.map(|vertex| vertices[vertex])));
        let stars = Star::all(&corners, partition.owned());
        if comm.any(stars.is_none()) {
            return Ok(Err("parts of the body touch in a point"));
        }
        let stars = stars.unwrap_or_default();
        let sides = sides(body, &stars);
        let mut foundations = Foundation::all(problem, state, &sides);
        let load = problem.load(state.time);
        if !pressure::balance(problem, &mut foundations, &load) {
            return Ok(Err("no contact pressure on whole edges was found that balances the loads"));
        }
        let edges = foundations.into_iter().flat_map(|foundation| foundation.edges);
        let mut edges = Vec::from_iter(edges);
        let mut moved = vec![0.0; state.u.len()];
        edges.iter_mut().for_each(|edge| edge.admit(&mut moved));
        partition.update(&mut moved, 2)?;
        let admitted: Vec<f64> = state.u.iter().zip(&moved).map(|(u, v)| u + v).collect();
        // The correction w.
        let contact = pressure::nodal_forces(problem, &edges);
        let internal = elasticity.internal_force(body, &points, &state.u);
        let rest = load.iter().zip(&contact).zip(&internal).map(|((f, p), k)| f + p - k).collect();
        let held = contact_step.holding();
        let forces = partition.norm(&internal, 2).max(partition.norm(&load, 2));
        let (_, w) = contact_step.corrected(&points, rest, &held, |_| CORRECTION * forces)?;
        let corrected: Vec<f64> = state.u.iter().zip(&w).map(|(u, w)| u + w).collect();
        // The tractions.
        let zeta = Vec::from_iter(state.zeta.iter().map(|zeta| problem.truncated(*zeta)));
        let loads = problem.loads.by_elements(body, state.time);
        let triangles = stressed(problem, [&points, &zeta], &corrected, &loads);
        let boundary = boundary(problem, &edges, &sides, &loads);
        let found = stars::tractions(&triangles, &stars, &boundary);
        if comm.any(found.is_none()) {
            return Ok(Err("a part of the boundary is not known"));
        }
        let (parts, imbalance) = found.unwrap_or_default();
        if comm.total(imbalance).sqrt() > IMBALANCE * forces {
            return Ok(Err("the stiffness is ill-conditioned"));
        }
        let mut tractions = summed(body, parts);
        for (sides, triangle) in tractions.iter_mut().zip(&triangles) {
            (0..3).for_each(|s| sides[s][2] = triangle.bubble(s, (s + 1) % 3));
        }
        let (strains, of_moved) = (body.strains(&admitted), norm(&moved));
        Ok(Ok(Self {
            problem,
            triangles,
            stars,
            boundary,
            edges,
            tractions,
            zeta,
            strains,
            norm: size,
            of_moved,
        }))
    }

    /// Improves the tractions star by star. Collective.
    pub fn improve(&mut self) {
        let Self { triangles, stars, boundary, tractions, .. } = self;
        let body = &self.problem.body;
        let (comm, known) = (body.comm(), (&triangles[..], &stars[..], &*boundary));
        let mut improve = |is_wanted: &dyn Fn(&Star) -> bool, part: f64| {
            let before = (!comm.is_serial()).then(|| tractions.clone());
            let (linear, quadratic) = (&composite::LINEAR, &composite::QUADRATIC);
            match body.order() {
                Order::Linear => airy::improve::<8, 18, 5>(linear, known, is_wanted, tractions),
                Order::Quadratic => {
                    airy::improve::<12, 24, 9>(quadratic, known, is_wanted, tractions)
                }
            }
            if let Some(before) = before {
                *tractions = joined(body, &before, tractions, part);
            }
        };
        // Stars in the subdomain of a rank share no triangle with those of other ranks. At an interface up to three
        // do: the mean of three improvements is one.
        let is_inside = |star: &Star| star.triangles.iter().all(|(t, _)| *t < body.own_triangles);
        improve(&is_inside, 1.0);
        if !comm.is_serial() {
            (0..INTERFACE_SWEEPS).for_each(|_| improve(&|star| !is_inside(star), 1.0 / 3.0));
        }
    }

    /// ∫ (ζA)⁻¹(τ − ζAε(u_h)) : (τ − ζAε(u_h)), N m per metre of thickness, with an admissible u_h. Collective.
    fn square(&self) -> f64 {
        let body = &self.problem.body;
        let square = |t: usize| {
            let triangle = self.loaded(t);
            match body.order() {
                Order::Linear => composite::LINEAR.square(&triangle),
                Order::Quadratic => composite::QUADRATIC.square(&triangle),
            }
        };
        body.comm().total((0..body.own_triangles).map(square).sum())
    }

    /// The bound on ‖u − u_h‖ / ‖u_h‖ for the `square` of τ. Collective.
    fn bound(&self, square: f64) -> f64 {
        let contact = 2.0 * self.edges.iter().map(ContactEdge::work).sum::<f64>();
        let contact = self.problem.body.comm().total(contact);
        ((square + contact).sqrt() + self.of_moved) / self.norm
    }

    /// (τ_xx, τ_yy, τ_xy) in triangle `t`, Pa, at seven points, m, of each of the three parts between a side and the centroid. They
    /// determine τ, which is a polynomial in each part, of the degree of the displacements.
    pub fn stresses(&self, t: usize) -> [[([f64; 2], Vector3<f64>); 7]; 3] {
        let triangle = self.loaded(t);
        let stresses = match self.problem.body.order() {
            Order::Linear => composite::LINEAR.stresses(&triangle),
            Order::Quadratic => composite::QUADRATIC.stresses(&triangle),
        };
        let corners = self.triangles[t].corners;
        let place = |at: [f64; 3]| corners.iter().zip(at).map(|(x, l)| x * l).sum::<Vector2<f64>>();
        let at = |q: usize| (<[f64; 2]>::from(place(stresses[q].0)), stresses[q].1);
        [0, 1, 2].map(|part| std::array::from_fn(|q| at(7 * part + q)))
    }

    /// The edges of Γ_C: the places of their ends, m, and p = p_a (1 − s)² + 2c s (1 − s) + p_b s² as (p_a, c, p_b), Pa.
    pub fn pressures(&self) -> impl Iterator<Item = ([[f64; 2]; 2], [f64; 3])> {
        self.edges.iter().map(|edge| (edge.ends(), edge.coefficients()))
    }

    /// Triangle `t` with its strains, its ζ and the forces on it.
    fn loaded(&self, t: usize) -> LoadedTriangle<'_> {
        let (problem, triangle) = (self.problem, &self.triangles[t]);
        let per_triangle = problem.body.points_per_triangle();
        LoadedTriangle {
            frame: Frame::new(triangle.corners),
            d: problem.elasticity.d(&problem.body, t),
            compliance: &triangle.compliance,
            strains: at_vertices(&self.strains[per_triangle * t..per_triangle * (t + 1)]),
            zeta: problem.body.mesh.triangles[t].map(|vertex| self.zeta[vertex]),
            sides: &self.tractions[t],
            body: triangle.body,
        }
    }
}

/// The sides on the boundary with an end that this rank owns, by their ends in increasing order.
fn sides(body: &Body, stars: &[Star]) -> HashMap<[usize; 2], Side> {
    let points = &body.nodes.points;
    let side = |(t, s): (usize, usize)| {
        for_elements!(body, cells => {
            let nodes = &cells.nodes[t];
            let (a, b) = (nodes[s], nodes[(s + 1) % 3]);
            let along = Vector2::from(points[b]) - Vector2::from(points[a]);
            let normal = Vector2::new(along.y, -along.x).normalize();
            let [first, last] = sorted([a, b]);
            ([first, last], ([Some(first), Some(last), nodes.get(3 + s).copied()], normal))
        })
    };
    stars.iter().flat_map(Star::boundary_sides).map(side).collect()
}

/// The triangles with stresses that have the same forces at the nodes as those of the stiffness matrix: affine between the vertices
/// or the quadrature points.
fn stressed(
    problem: &ObservedProblem,
    [zeta_at_points, zeta_at_vertices]: [&[f64]; 2],
    u: &[f64],
    loads: &ElementLoads,
) -> Vec<StressedTriangle> {
    let (body, elasticity) = (&problem.body, &problem.elasticity);
    let strains = body.strains(u);
    let per_triangle = body.points_per_triangle();
    let vertices = body.node_of_vertex();
    let infinite = Matrix3::repeat(f64::INFINITY);
    let inverse = |of: &Material| of.stiffness().try_inverse().unwrap_or(infinite);
    let compliances = Vec::from_iter(elasticity.materials().map(inverse));
    let of_triangle = |t: usize| {
        let own = per_triangle * t..per_triangle * (t + 1);
        let (d, zeta) = (elasticity.d(body, t), &zeta_at_points[own.clone()]);
        let stresses =
            strains[own.clone()].iter().zip(zeta).map(|(strain, zeta)| d * strain * *zeta);
        let mean = zeta.iter().sum::<f64>() / per_triangle as f64;
        let load = loads.triangles[t].map(Vector2::from);
        let triangle = body.mesh.triangles[t];
        let stresses = match &strains[own] {
            // With a constant strain, σ_h is affine and has the same mean.
            [strain] => triangle.map(|vertex| d * strain * zeta_at_vertices[vertex]),
            _ => at_vertices(&stresses.collect::<Vec<Vector3<f64>>>()),
        };
        StressedTriangle {
            nodes: triangle.map(|vertex| vertices[vertex]),
            corners: triangle.map(|vertex| body.mesh.nodes[vertex].into()),
            gradients: *body.triangles[t].gradients(),
            area: body.triangles[t].area(),
            stresses,
            flexibility: 1.0 / (d[(2, 2)] * mean),
            zeta: mean,
            compliance: compliances[body.material(t)],
            // ψ = φ + half of the bubbles of both sides.
            body: [0, 1, 2].map(|i| load[i] + 0.5 * (load[3 + i] + load[3 + (i + 2) % 3])),
            bubbles: [load[3], load[4], load[5]],
        }
    };
    (0..body.triangles.len()).map(of_triangle).collect()
}

/// The forces of loads and contact on the edges of the boundary, and the directions in which supports hold them.
fn boundary(
    problem: &ObservedProblem,
    edges: &[ContactEdge],
    sides: &HashMap<[usize; 2], Side>,
    loads: &ElementLoads,
) -> HashMap<[usize; 2], BoundaryEdge> {
    let body = &problem.body;
    let vertices = body.node_of_vertex();
    let mut boundary: HashMap<[usize; 2], BoundaryEdge> =
        sides.keys().map(|ends| (*ends, BoundaryEdge::default())).collect();
    for (ends, load) in &loads.edges {
        let [a, b, middle] = load.map(Vector2::from);
        let Some(edge) = boundary.get_mut(ends) else { continue };
        edge.forces = [a + 0.5 * middle, b + 0.5 * middle];
    }
    for contact in edges {
        let (ends, [a, b]) = contact.forces();
        let Some(edge) = boundary.get_mut(&ends) else { continue };
        edge.forces = [edge.forces[0] + a, edge.forces[1] + b];
    }
    for part in &problem.scene().boundaries {
        for edge in body.mesh.edges_of(&part.name) {
            let ends = sorted(edge.map(|vertex| vertices[vertex]));
            let (Some(known), Some((_, normal))) = (boundary.get_mut(&ends), sides.get(&ends))
            else {
                continue;
            };
            for condition in &part.conditions {
                match condition {
                    Condition::Displacement([x, y]) => {
                        known.supported.extend(x.as_ref().map(|_| Vector2::x()));
                        known.supported.extend(y.as_ref().map(|_| Vector2::y()));
                    }
                    Condition::Symmetry => known.supported.push(*normal),
                    Condition::Gap(_) | Condition::Load(_) => {}
                }
            }
        }
    }
    boundary
}

/// The sum of the parts of the forces that all ranks have. Collective.
fn summed(body: &Body, parts: Vec<SideForces>) -> Vec<SideForces> {
    let comm = body.comm();
    if comm.is_serial() {
        return parts;
    }
    let last = body.global_triangles.iter().copied().max().unwrap_or(0);
    let mut all = vec![[0.0; 18]; comm.max(last as f64) as usize + 1];
    for (sides, &triangle) in parts.iter().zip(&body.global_triangles) {
        let parts = sides.as_flattened().iter().flat_map(|force| <[f64; 2]>::from(*force));
        all[triangle].iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
    }
    comm.sum(all.as_flattened_mut());
    let of_triangle = |&triangle: &usize| {
        let forces = &all[triangle];
        std::array::from_fn(|s| {
            std::array::from_fn(|k| Vector2::new(forces[6 * s + 2 * k], forces[6 * s + 2 * k + 1]))
        })
    };
    body.global_triangles.iter().map(of_triangle).collect()
}

/// Tractions with a part of the changes that the ranks have made to those of their stars. Collective.
fn joined(body: &Body, before: &[SideForces], after: &[SideForces], part: f64) -> Vec<SideForces> {
    let of = |(a, b): (&SideForces, &SideForces), multiple: f64| {
        std::array::from_fn(|s| std::array::from_fn(|k| a[s][k] + multiple * b[s][k]))
    };
    let changes = Vec::from_iter(after.iter().zip(before).map(|pair| of(pair, -1.0)));
    before.iter().zip(&summed(body, changes)).map(|pair| of(pair, part)).collect()
}
