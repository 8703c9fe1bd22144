//! Why the mesh does not determine an extreme stress or pressure of a state, and where contact ends.

use super::{Measured, conclusion::KINKS_OF_TABLE};
use crate::{
    advice::Singular,
    model::von_mises,
    observe::{ContactRow, Dimension, Figure, NodalStress, ObservedProblem, Of, Value, rows_of},
    petsc::PetscError,
    problem::State,
    scene::Boundary,
};
use rustc_hash::FxHashSet as HashSet;

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
}

impl Extreme {
    fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        (x - self.at[0]).hypot(y - self.at[1])
    }

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
            Some(Extreme { number, name, at, singular: None, unresolved: None })
        };
        let all = figures.filter_map(extreme).collect();
        let (_, ends) = problem.supports.contact.length(&rows);
        let unresolved = problem.unresolved_peaks(&rows);
        let mut extremes = Self { problem, all, stresses, rows, ends };
        let near = extremes.near(&unresolved, 1.001);
        extremes.all.iter_mut().zip(near).for_each(|(of, name)| of.unresolved = name);
        extremes.find_jumps();
        Ok(extremes)
    }

    /// Marks the extreme stresses in triangles near a jump of a load as not resolved: fitted strains overshoot there by the same
    /// part on all meshes. Collective.
    fn find_jumps(&mut self) {
        let (body, nodal) = (&self.problem.body, self.problem.nodal_stress());
        let near = &body.near_jumps;
        if near.is_empty() {
            return;
        }
        let triangles = body.mesh.triangles.iter();
        let next = triangles.filter(|triangle| triangle.iter().any(|&vertex| near[vertex]));
        let next: HashSet<usize> = next.flatten().copied().collect();
        let points = nodal.all().filter(|of| of.ends.iter().any(|end| next.contains(end)));
        let places = Vec::from_iter(points.map(|point| point.at));
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
        let mut all = extremes.named(&problem.singular_points());
        for extreme in &mut all {
            let part = &problem.figures[problem.part_of(extreme.number, values)];
            match measured.not_converged.contains(&part.name) {
                true if extreme.is_known() => {
                    extreme.unresolved = Some("it does not converge over the meshes".to_owned())
                }
                false if !measured.bars.is_empty() => extreme.singular = None,
                _ => {}
            }
            let shows_table = |of: &Boundary| {
                let is_other = matches!(&part.of, Of::Boundary(name) if *name != of.name);
                !is_other && of.gap().is_some_and(|gap| gap.distance.has_kinks_in_space())
            };
            if let Some(reason) = &mut extreme.unresolved
                && part.is_pressure()
                && problem.scene().boundaries.iter().any(shows_table)
            {
                *reason += &format!(": {KINKS_OF_TABLE}");
            }
        }
        all.extend(extremes.unresolved_lengths(state));
        Ok(all)
    }

    /// The lengths of contact that the mesh does not resolve: single nodes are active, or none, but the obstacle enters the body
    /// between them. Collective.
    fn unresolved_lengths(&self, state: &State) -> Vec<Extreme> {
        let penetrates = self.problem.penetration_note(&[state]).is_some();
        let unresolved = |(number, figure): (usize, &Figure)| {
            let rows = match &figure.of {
                Of::Boundary(name) => rows_of(&self.rows, name),
                _ => &self.rows,
            };
            let is_resolved = self.problem.supports.contact.resolves_length(rows);
            let reason = "contact of few nodes".to_owned();
            (!is_resolved.unwrap_or(!penetrates)).then(|| Extreme {
                number,
                name: figure.name.clone(),
                at: [f64::NAN; 2],
                singular: None,
                unresolved: Some(reason),
            })
        };
        let lengths = self.problem.figures.iter().enumerate();
        let lengths = lengths.filter(|(_, of)| of.dimension == Dimension::ContactLength);
        lengths.filter_map(unresolved).collect()
    }

    /// The extremes with the names of the singular `points` near which they are. Collective.
    pub(super) fn named(&self, points: &[Singular]) -> Vec<Extreme> {
        /// On six bodies half of it changed nothing; twice of it changed meshes.
        const EDGES: f64 = 3.001;
        let presses = |[x, y]: [f64; 2]| {
            self.rows.iter().any(|row| (row.x, row.y) == (x, y) && row.pressure > 0.0)
        };
        let points = points.iter().filter(|of| !of.is_open || !presses(of.at)).cloned();
        let extremes = self.all.iter().zip(self.near(&Vec::from_iter(points), EDGES));
        let of = |(extreme, near): (&Extreme, Option<String>)| {
            let singular = near.filter(|_| !self.problem.figures[extreme.number].is_away());
            Extreme { singular, ..extreme.clone() }
        };
        extremes.map(of).collect()
    }

    /// Per extreme: the name of the nearest of the `points` of the boundary within some `edges`. A stress that is large
    /// because of a point is large at the point itself, if it is known there. Collective.
    fn near(&self, points: &[Singular], edges: f64) -> Vec<Option<String>> {
        let named = |extreme: &Extreme| {
            let near =
                points.iter().filter(|point| extreme.distance(point.at) <= edges * point.radius);
            let nearest =
                near.min_by(|a, b| extreme.distance(a.at).total_cmp(&extreme.distance(b.at)));
            let value = |at: [f64; 2]| self.value(extreme, at);
            let there = |point: &&Singular| {
                let there = value(point.at);
                there >= 0.5 * value(extreme.at) || !there.is_finite()
            };
            nearest.filter(there).map(|point| point.name.clone())
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
        let material = match &figure.of {
            Of::Material(name) => problem.materials.iter().find(|(_, of)| of == name),
            _ => None,
        };
        let there = self.stresses.iter().zip(&problem.nodal_stress().points);
        let there = there.filter(|(_, point)| {
            point.at == at && material.is_none_or(|(number, _)| *number == point.material)
        });
        let own = there.map(|(stress, _)| von_mises(*stress)).fold(f64::NEG_INFINITY, f64::max);
        problem.body.comm().max(own)
    }
}
