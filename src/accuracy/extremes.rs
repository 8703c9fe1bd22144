//! Why the mesh does not determine an extreme stress or pressure of a state, and where contact ends.

use super::Measured;
use crate::{
    advice::{Kink, SEEN, Singular},
    fem::ON_SIDE,
    mesh::{TIES, distance, extent},
    model::von_mises,
    observe::{
        ContactRow, Dimension, Figure, NodalStress, ObservedProblem, Of, Rays, Value, principal,
        rows_of,
    },
    petsc::{Communicator, PetscError},
    problem::State,
};
use rustc_hash::FxHashSet as HashSet;

/// Why a stress at a corner has no value.
pub const BY_DIRECTION: &str = "it depends on the direction there";

/// An extreme of a state.
#[derive(Debug, Clone, PartialEq)]
pub struct Extreme {
    /// Its number in the list of figures.
    pub(super) number: usize,
    /// Its name.
    pub name: String,
    /// Its place, m.
    pub at: [f64; 2],
    /// If the stress is singular there, and so grows as the mesh is refined: the reason.
    pub singular: Option<String>,
    /// If the mesh does not resolve it, as at a peak of the contact pressure: the reason.
    pub unresolved: Option<String>,
    /// The part that kinks of the gap add to a pressure on finer meshes, Pa; infinite if no bar can bear it.
    pub(super) growth: f64,
}

impl Extreme {
    /// Does the mesh determine its value?
    pub fn is_known(&self) -> bool {
        self.singular.is_none() && self.unresolved.is_none()
    }
}

/// The extremes of a state, with the stresses and pressures from which they come.
pub struct Extremes<'a> {
    problem: &'a ObservedProblem,
    /// The extremes of stresses and pressures, in the order of the figures.
    pub all: Vec<Extreme>,
    /// The stresses at the points of this rank, Pa, and the rows of Γ_C.
    stresses: Vec<[f64; 4]>,
    rows: Vec<ContactRow>,
    /// Each end of contact lies between an active node and the next one: their places, m.
    pub(super) ends: Vec<[[f64; 2]; 2]>,
    /// The corners at which stresses depend on the direction, m.
    directions: Vec<[f64; 2]>,
}

impl<'a> Extremes<'a> {
    /// The extremes of `state` with the figures `values`. They name no singular points. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub(super) fn new(
        problem: &'a ObservedProblem,
        state: &State,
        values: &[Value],
    ) -> Result<Self, PetscError> {
        let strained = NodalStress::strained(problem, &problem.strained(state));
        let vertices = &problem.body.vertices.partition;
        let stresses = problem.nodal_stress().stresses(&strained, Some(vertices))?;
        let (rows, _) = problem.supports.contact.rows(&problem.body, state);
        let figures = problem.figures.iter().enumerate().filter(|(_, figure)| figure.is_extreme());
        let extreme = |(number, _): (usize, _)| {
            let part = problem.part_of(number, values);
            let (name, at) = (problem.figures[number].name.clone(), values[part].at?);
            Some(Extreme { number, name, at, singular: None, unresolved: None, growth: 0.0 })
        };
        let all = figures.filter_map(extreme).collect();
        let (_, ends) = problem.supports.contact.length(&rows);
        let unresolved = problem.unresolved_peaks(&rows);
        let rays = problem.rays(state);
        let directions = rays.iter().map(|rays| rays.at).collect();
        let mut extremes = Self { problem, all, stresses, rows, ends, directions };
        let near = extremes.near(&unresolved);
        extremes.all.iter_mut().zip(near).for_each(|(of, name)| of.unresolved = name);
        extremes.find_jumps(&rays);
        extremes.add_kinks(&problem.kinks(state, &extremes.rows), values);
        Ok(extremes)
    }

    /// Makes the largest pressure, and the smallest σ₂, which is its opposite at a kink of the gap, infinite if finer meshes exceed it there
    /// by a part that is seen, or by half of the accuracy. The bar of others bears the part. Collective.
    fn add_kinks(&mut self, kinks: &[Kink], values: &[Value]) {
        let (problem, points) = (self.problem, &self.problem.nodal_stress().points);
        let accuracy = problem.scene().accuracy.unwrap_or(1.0);
        for extreme in &mut self.all {
            let figure = &problem.figures[extreme.number];
            let shown = figure.size(values[extreme.number].value);
            let is_there = |kink: &&Kink| match &figure.of {
                Of::Boundary(name) => kink.boundary == *name,
                Of::Material(name) => problem.body.comm().any(points.iter().any(|point| {
                    let is_of = problem.materials.contains(&(point.material, name.clone()));
                    is_of && kink.nodes.contains(&point.at)
                })),
                _ => true,
            };
            let bears = figure.is_pressure() || figure.kind == "principal_min";
            let kinks = kinks.iter().filter(|_| bears).filter(is_there);
            let Some(kink) = kinks.max_by(|a, b| a.pressure.total_cmp(&b.pressure)) else {
                continue;
            };
            extreme.growth = (kink.pressure - shown).max(0.0);
            if extreme.growth > SEEN.min(0.5 * accuracy) * shown {
                let place = problem.mesh().place(kink.at);
                extreme.singular =
                    Some(format!("a kink of the gap of `{}` at {place}", kink.boundary));
                extreme.growth = f64::INFINITY;
            }
        }
    }

    /// Does a figure of stresses describe this material?
    fn is_in(&self, figure: &Figure, material: usize) -> bool {
        match &figure.of {
            Of::Material(name) => self.problem.materials.contains(&(material, name.clone())),
            _ => true,
        }
    }

    /// Marks the extreme stresses in triangles near a jump of a load, or at a corner where other loads determine a part of them, as
    /// not resolved: fitted strains overshoot there by the same part on all meshes. Collective.
    fn find_jumps(&mut self, rays: &[Rays]) {
        let (body, nodal) = (&self.problem.body, self.problem.nodal_stress());
        let jumps = &body.near_jumps;
        let triangles = body.mesh.triangles.iter();
        let next =
            triangles.filter(|triangle| triangle.iter().any(|&v| jumps.get(v) == Some(&true)));
        let next: HashSet<usize> = next.flatten().copied().collect();
        let unknown = rays.iter().filter(|of| of.stresses.is_none());
        let unknown = Vec::from_iter(unknown.map(|of| of.near(self.problem)));
        let points = nodal.all().enumerate().filter(|(i, of)| {
            of.ends.iter().any(|end| next.contains(end)) || unknown.iter().any(|near| near[*i])
        });
        let places = Vec::from_iter(points.map(|(_, point)| point.at));
        for of in &mut self.all {
            let is_there = body.comm().any(places.contains(&of.at));
            if is_there && !self.problem.figures[of.number].is_pressure() {
                of.unresolved = Some("a jump of a load".to_owned());
            }
        }
    }

    /// The extremes of the last state of a run with the figures `values`. They name singular points. If they were `measured`,
    /// only those that do not converge over the meshes are singular or not resolved. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn of(
        problem: &ObservedProblem,
        state: &State,
        values: &[Value],
        measured: &Measured,
    ) -> Result<Vec<Extreme>, PetscError> {
        let extremes = Extremes::new(problem, state, values)?;
        let points = problem.singular_points();
        let mut all = extremes.named(&points);
        for extreme in &mut all {
            let part = &problem.figures[problem.part_of(extreme.number, values)];
            match measured.not_converged.contains(&part.name) {
                true if extreme.is_known() => {
                    extreme.unresolved = Some("it does not converge over the meshes".to_owned())
                }
                false if !measured.bars.is_empty() && extreme.growth.is_finite() => {
                    (extreme.singular, extreme.unresolved) = (None, None);
                }
                _ => {}
            }
        }
        all.extend(extremes.at_probes(&points));
        all.extend(extremes.unresolved_lengths(state));
        Ok(all)
    }

    /// The stresses at probes at the singular `points`, and at corners where the stress depends on the direction.
    pub(super) fn at_probes(&self, points: &[Singular]) -> Vec<Extreme> {
        let (scene, rounding) =
            (self.problem.scene(), ON_SIDE * extent(&self.problem.mesh().nodes));
        let presses = |at: [f64; 2]| self.presses(at);
        let of_figure = |(number, figure): (usize, &Figure)| {
            let Of::Probe(name) = &figure.of else { return None };
            let at = scene.probes.iter().find(|probe| probe.name == *name)?.point;
            let is_here = |place: &[f64; 2]| distance(*place, at) <= rounding;
            let singular =
                points.iter().find(|of| is_here(&of.at) && !(of.is_open && presses(of.at)));
            let by_direction = self.directions.iter().any(is_here);
            (figure.dimension == Dimension::Stress && (singular.is_some() || by_direction)).then(
                || Extreme {
                    number,
                    name: figure.name.clone(),
                    at,
                    singular: singular.map(|point| point.name.clone()),
                    unresolved: singular.is_none().then(|| BY_DIRECTION.to_owned()),
                    growth: 0.0,
                },
            )
        };
        self.problem.figures.iter().enumerate().filter_map(of_figure).collect()
    }

    /// The lengths of contact that the mesh does not resolve: single nodes are active, or none, but the obstacle enters the body
    /// between them. Collective.
    fn unresolved_lengths(&self, state: &State) -> Vec<Extreme> {
        let penetrates = self.problem.penetration_note(&[state]).is_some();
        let unresolved = |(number, figure): (usize, &Figure)| {
            let is_resolved = self.problem.supports.contact.resolves_length(self.rows_of(figure));
            let reason = "contact of few nodes".to_owned();
            (!is_resolved.unwrap_or(!penetrates)).then(|| Extreme {
                number,
                name: figure.name.clone(),
                at: [f64::NAN; 2],
                singular: None,
                unresolved: Some(reason),
                growth: 0.0,
            })
        };
        let lengths = self.problem.figures.iter().enumerate();
        let lengths = lengths.filter(|(_, of)| of.dimension == Dimension::ContactLength);
        lengths.filter_map(unresolved).collect()
    }

    /// The rows of Γ_C of a figure of contact.
    fn rows_of(&self, figure: &Figure) -> &[ContactRow] {
        match &figure.of {
            Of::Boundary(name) => rows_of(&self.rows, name),
            _ => &self.rows,
        }
    }

    /// The points at which the extreme of number `i` is looked for, m, and the sizes of the values there, Pa; none at corners with
    /// directions, and none for other figures. Collective.
    pub(super) fn points(&self, i: usize) -> Vec<([f64; 2], f64)> {
        let figure = &self.problem.figures[i];
        let size = |stress: [f64; 4]| match figure.kind {
            "von_mises_max" => Some(von_mises(stress)),
            "principal_max" => Some(principal(stress)[0]),
            "principal_min" => Some(-principal(stress)[1]),
            _ => None,
        };
        if !figure.is_extreme() || figure.is_away() {
            return Vec::new();
        }
        if figure.is_pressure() {
            return self.rows_of(figure).iter().map(|row| ([row.x, row.y], row.pressure)).collect();
        }
        let points = self.stresses.iter().zip(&self.problem.nodal_stress().points);
        let points = points.filter(|(_, point)| {
            self.is_in(figure, point.material) && !self.directions.contains(&point.at)
        });
        let own = points.filter_map(|(stress, of)| Some([of.at[0], of.at[1], size(*stress)?]));
        points_of_ranks(self.problem.body.comm(), own)
    }

    /// The part of a length of contact, m, on which the pressure is below its `error`, Pa: there the body may be apart from the
    /// obstacle.
    pub(super) fn faint_length(&self, figure: &Figure, error: f64) -> f64 {
        let is_faint = |row: &ContactRow| row.active == 1 && row.pressure < error;
        let length = |edge: &[ContactRow]| {
            let [a, b] = edge else { return 0.0 };
            let is_edge = (&a.boundary, a.part) == (&b.boundary, b.part);
            let counts = is_edge && is_faint(a) && is_faint(b);
            if counts { b.arc_length - a.arc_length } else { 0.0 }
        };
        self.rows_of(figure).windows(2).map(length).sum()
    }

    /// The extremes with the names of the singular `points` near which they are. Collective.
    pub(super) fn named(&self, points: &[Singular]) -> Vec<Extreme> {
        let points = points.iter().filter(|of| !of.is_open || !self.presses(of.at)).cloned();
        let extremes = self.all.iter().zip(self.near(&Vec::from_iter(points)));
        let named = |(extreme, near): (&Extreme, Option<String>)| {
            let near = near.filter(|_| !self.problem.figures[extreme.number].is_away());
            Extreme { singular: extreme.singular.clone().or(near), ..extreme.clone() }
        };
        extremes.map(named).collect()
    }

    fn presses(&self, [x, y]: [f64; 2]) -> bool {
        self.rows.iter().any(|row| (row.x, row.y) == (x, y) && row.pressure > 0.0)
    }

    /// Per extreme: the name of the nearest of the `points` that have it in a triangle. The means of fitted strains reach one
    /// triangle farther. A value that is large because of a point is large at the point itself: a pressure, on its boundary. Collective.
    fn near(&self, points: &[Singular]) -> Vec<Option<String>> {
        let named = |extreme: &Extreme| {
            let of_fits = !self.problem.figures[extreme.number].is_pressure();
            let from = |at: [f64; 2]| distance(extreme.at, at);
            let reach = if of_fits { 2.0 / TIES } else { 1.0 / TIES };
            let near = points.iter().filter(|point| from(point.at) <= reach * point.radius);
            let nearest = near.min_by(|a, b| from(a.at).total_cmp(&from(b.at)));
            let value = |at: [f64; 2]| self.value(extreme, at);
            let is_large = |point: &&Singular| value(point.at) >= 0.5 * value(extreme.at);
            nearest.filter(is_large).map(|point| point.name.clone())
        };
        self.all.iter().map(named).collect()
    }

    /// The pressure at a place, Pa, or the von Mises stress, as other stresses may be negative there; −∞ if it is not known.
    /// Collective.
    fn value(&self, extreme: &Extreme, at: [f64; 2]) -> f64 {
        let (problem, figure) = (self.problem, &self.problem.figures[extreme.number]);
        if figure.is_pressure() {
            let there = self.rows.iter().filter(|row| [row.x, row.y] == at);
            let there = there.filter(|row| match &figure.of {
                Of::Boundary(name) => row.boundary == *name,
                _ => true,
            });
            return there.map(|row| row.pressure).fold(f64::NEG_INFINITY, f64::max);
        }
        let there = self.stresses.iter().zip(&problem.nodal_stress().points);
        let there = there.filter(|(_, point)| point.at == at && self.is_in(figure, point.material));
        let own = there.map(|(stress, _)| von_mises(*stress)).fold(f64::NEG_INFINITY, f64::max);
        problem.body.comm().max(own)
    }
}

/// The places, m, and values of all ranks. Collective.
pub(super) fn points_of_ranks(
    comm: Communicator,
    own: impl Iterator<Item = [f64; 3]>,
) -> Vec<([f64; 2], f64)> {
    let all = comm.gather(own.collect::<Vec<_>>().as_flattened());
    all.chunks_exact(3).map(|of| ([of[0], of[1]], of[2])).collect()
}
