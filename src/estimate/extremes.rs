//! Extreme stresses and contact pressures of a state, and the length of contact.

use super::{Measured, NodalStress, principal, strained, stress::Point};
use crate::{
    model::von_mises,
    petsc::{Communicator, PetscError},
    problem::{Bar, ContactRow, DiscreteProblem, Singular, State, peak, rows_of, whole_and_parts},
};
use rustc_hash::FxHashSet as HashSet;
use serde::Serialize;

/// An extreme of a state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Extreme {
    /// Its name, as in `summary.json`.
    #[serde(skip)]
    pub name: String,
    /// Its value, Pa.
    pub value: f64,
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

    /// The value, or its opposite if the extreme is a minimum.
    fn size(&self) -> f64 {
        if self.name.ends_with("principal_min") { -self.value } else { self.value }
    }
}

/// The extremes of a state, with the values at all points of this rank.
#[derive(Clone)]
pub struct Extremes {
    comm: Communicator,
    /// The extremes of stresses and pressures.
    pub of_points: Vec<Extreme>,
    /// Per extreme: values with their places, whose largest one is the extreme or its opposite.
    fields: Vec<Vec<(f64, [f64; 2])>>,
    /// The length of contact, m, of Γ_C at the active nodes, and of each of several foundations, with their names.
    pub contact_lengths: Vec<(String, f64)>,
    /// Each end of contact lies between an active node and the next one: their places, m.
    pub(super) ends: Vec<[[f64; 2]; 2]>,
}

impl Extremes {
    /// No extremes yet.
    pub(super) fn none(comm: Communicator) -> Self {
        Self { comm, of_points: vec![], fields: vec![], contact_lengths: vec![], ends: vec![] }
    }

    /// The extremes of `state` with `stresses` at the points of `nodal`. Collective.
    pub(super) fn new(
        problem: &DiscreteProblem,
        state: &State,
        nodal: &NodalStress,
        stresses: &[[f64; 4]],
    ) -> Self {
        let comm = problem.body.nodes.partition.comm();
        let values: [fn([f64; 4]) -> f64; 3] =
            [von_mises, |stress| principal(stress).0[0], |stress| -principal(stress).0[1]];
        let mut fields = Vec::new();
        for of in whole_and_parts(&problem.materials) {
            let is_own = |point: &Point| of.is_none_or(|(own, _)| *own == point.material);
            let points = stresses.iter().zip(&nodal.points).filter(|(_, point)| is_own(point));
            let field = |value: fn([f64; 4]) -> f64| -> Vec<_> {
                points.clone().map(|(stress, point)| (value(*stress), point.at)).collect()
            };
            fields.extend(values.map(field));
        }
        let (rows, _) = problem.supports.contact.rows(&problem.body, state);
        let foundations = whole_and_parts(&problem.foundations).filter(|_| problem.has_contact());
        let rows_of: Vec<_> =
            foundations.map(|of| of.map_or(&rows[..], |of| rows_of(&rows, of))).collect();
        let pressure = |row: &ContactRow| (row.pressure, [row.x, row.y]);
        fields.extend(rows_of.iter().map(|rows| rows.iter().map(pressure).collect::<Vec<_>>()));
        let of_stresses = fields.len() - rows_of.len();
        let mut names = problem.extremes().into_iter();
        let of_points = names.by_ref().take(fields.len()).enumerate().map(|(i, name)| {
            let own = match i.checked_sub(of_stresses) {
                Some(foundation) => peak(rows_of[foundation]).map(pressure),
                None => fields[i].iter().max_by(|a, b| a.0.total_cmp(&b.0)).copied(),
            };
            let (least, rank) = comm.min_with_rank(own.map_or(f64::INFINITY, |(value, _)| -value));
            let at = own.map_or([0.0; 2], |(_, at)| at).map(|x| comm.broadcast(rank, x));
            let value = if name.ends_with("principal_min") { least } else { -least };
            Extreme { name, value, at, singular: None, unresolved: None }
        });
        let of_points = of_points.collect();
        let lengths = rows_of.into_iter().map(|rows| problem.supports.contact.length(rows).0);
        let contact_lengths = names.zip(lengths).collect();
        let (_, ends) = problem.supports.contact.length(&rows);
        let unresolved = problem.unresolved_peaks(&rows);
        let mut extremes = Self { comm, of_points, fields, contact_lengths, ends };
        for i in 0..extremes.of_points.len() {
            extremes.of_points[i].at = extremes.of_points[extremes.part_of(i)].at;
        }
        let near = extremes.near(&unresolved, 1.001);
        extremes.of_points.iter_mut().zip(near).for_each(|(of, name)| of.unresolved = name);
        extremes.find_jumps(problem, nodal);
        extremes
    }

    /// Marks the extreme stresses in triangles near a jump of a load as not resolved: fitted strains overshoot there by the same
    /// part on all meshes. Collective.
    fn find_jumps(&mut self, problem: &DiscreteProblem, nodal: &NodalStress) {
        let near = &problem.body.near_jumps;
        if near.is_empty() {
            return;
        }
        let triangles = problem.body.mesh.triangles.iter();
        let next = triangles.filter(|triangle| triangle.iter().any(|&vertex| near[vertex]));
        let next: HashSet<usize> = next.flatten().copied().collect();
        let points = nodal.points.iter().filter(|of| of.ends.iter().any(|end| next.contains(end)));
        let places = Vec::from_iter(points.map(|point| point.at));
        for of in self.of_points.iter_mut().filter(|of| !of.name.ends_with("pressure_max")) {
            if self.comm.max(f64::from(u8::from(places.contains(&of.at)))) > 0.0 {
                of.unresolved = Some("a jump of a load".to_owned());
            }
        }
    }

    /// The parts of the whole whose extreme is `i`: their extremes; none if it is the extreme of a part, or of one material
    /// or foundation.
    fn parts(&self, i: usize) -> impl Iterator<Item = usize> {
        let of_part = format!(".{}", self.of_points[i].name);
        let is_part = move |k: &usize| self.of_points[*k].name.ends_with(&of_part);
        let is_whole = !self.of_points[i].name.contains('.');
        (0..self.of_points.len()).filter(move |k| is_whole && is_part(k))
    }

    /// The extreme of the part in which the extreme `i` lies.
    pub(super) fn part_of(&self, i: usize) -> usize {
        let size = |k: &usize| self.of_points[*k].size();
        self.parts(i).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(i)
    }

    /// Sets the bars of the extremes of the whole, from those of its parts:
    ///
    /// v ± max_p (v_p + b_p − v),   with v = max_p v_p.
    pub(super) fn join(&self, bars: &mut [Bar]) {
        let number = |of: &Extreme| bars.iter().position(|bar| bar.name == of.name);
        let numbers = Vec::from_iter(self.of_points.iter().map(number));
        for (i, whole) in self.of_points.iter().enumerate() {
            let (Some(own), Some(_)) = (numbers[i], numbers[self.part_of(i)]) else { continue };
            let most =
                |k: usize| Some(self.of_points[k].size() - whole.size() + bars[numbers[k]?].bar);
            let most = self.parts(i).filter_map(most).reduce(f64::max);
            bars[own].bar = most.unwrap_or(bars[own].bar);
        }
    }

    /// The extremes of `state` at the points of `nodal`. They name singular points. If they were `measured`, only those that
    /// the meshes do not settle are singular or not resolved. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn of(
        problem: &DiscreteProblem,
        state: &State,
        nodal: &NodalStress,
        measured: &Measured,
    ) -> Result<Self, PetscError> {
        let vertices = &problem.body.vertices.partition;
        let state = &strained(problem, state);
        let stresses = nodal.stresses(&NodalStress::strained(problem, state), Some(vertices))?;
        let mut extremes = Self::new(problem, state, nodal, &stresses);
        extremes.of_points = extremes.named(&problem.singular_points());
        for i in 0..extremes.of_points.len() {
            let part = &extremes.of_points[extremes.part_of(i)].name;
            let is_unsettled = measured.unsettled.contains(part);
            let extreme = &mut extremes.of_points[i];
            match is_unsettled {
                true if extreme.is_known() => {
                    extreme.unresolved = Some("the meshes do not settle it".to_owned())
                }
                false if !measured.bars.is_empty() => extreme.singular = None,
                _ => {}
            }
        }
        Ok(extremes)
    }

    /// All values, in the order of [`DiscreteProblem::extremes`].
    pub(super) fn values(&self) -> Vec<f64> {
        let values = self.of_points.iter().map(|extreme| extreme.value);
        values.chain(self.contact_lengths.iter().map(|(_, length)| *length)).collect()
    }

    /// The extremes of stresses and pressures with the names of the singular `points` near which they are. Collective.
    pub(super) fn named(&self, points: &[Singular]) -> Vec<Extreme> {
        /// On six bodies half of it changed nothing; twice of it changed meshes.
        const EDGES: f64 = 3.001;
        let pressure = self.of_points.iter().position(|of| of.name == "pressure_max");
        let presses =
            |at| pressure.is_some_and(|i| self.fields[i].iter().any(|of| of.1 == at && of.0 > 0.0));
        let points = points.iter().filter(|of| !of.is_open || !presses(of.at)).cloned();
        let extremes = self.of_points.iter().zip(self.near(&Vec::from_iter(points), EDGES));
        extremes.map(|(extreme, singular)| Extreme { singular, ..extreme.clone() }).collect()
    }

    /// Per extreme: the name of the nearest of the `points` of the boundary within some `edges`. A stress that is large
    /// because of a point is large at the point itself, if it is known there. Collective.
    fn near(&self, points: &[Singular], edges: f64) -> Vec<Option<String>> {
        let named = |(i, extreme): (usize, &Extreme)| {
            let i = self.part_of(i);
            let near =
                points.iter().filter(|point| extreme.distance(point.at) <= edges * point.radius);
            let nearest =
                near.min_by(|a, b| extreme.distance(a.at).total_cmp(&extreme.distance(b.at)));
            // The von Mises stress, as other stresses may be negative at the point, or the pressure.
            let is_pressure = extreme.name.ends_with("pressure_max");
            let field = &self.fields[if is_pressure { i } else { i - i % 3 }];
            let value = |place: [f64; 2]| {
                let own = field.iter().filter(|(_, at)| *at == place).map(|(value, _)| *value);
                self.comm.max(own.fold(f64::NEG_INFINITY, f64::max))
            };
            let there = |point: &&Singular| {
                let there = value(point.at);
                there >= 0.5 * value(extreme.at) || !there.is_finite()
            };
            nearest.filter(there).map(|point| point.name.clone())
        };
        self.of_points.iter().enumerate().map(named).collect()
    }
}
