//! MARK: are the estimates of a mesh small enough for a measurement, and how much smaller must its triangles become?

use super::{
    Adapted, End, FewStepRun, Measured,
    measurement::{Cause, Measurement},
    sizes::{divided, influences, sharpened, size_ratios, touching},
};
use crate::{
    advice::unresolved,
    evolution::AIM,
    mesh::{Mesh, MeshError, Order, Refinement, sorted},
    petsc::{PetscError, Session},
    scene::Scene,
};
use std::{collections::HashSet, mem::take};

/// A mesh is good enough for a measurement if its estimates are at most this fraction of the required accuracy. It
/// must be above [`AIM`].
///
/// Tuned on the 13 adapted runs. Half: 12 runs miss their accuracy. Twice: 4 % fewer triangles, but a fifth more for
/// `lshape-rolling`.
const GOOD_ENOUGH: f64 = 0.8;
/// If measured errors are too large, a new mesh reduces the estimated errors by at most this factor: errors on coarse
/// meshes are often far too large.
///
/// Tuned on the 13 adapted runs. Half: 4 % more triangles. Twice: 11 % fewer, 6 % more meshes.
const MIN_GOAL: f64 = 0.25;
/// The time steps may use the part of the accuracy that the mesh leaves, but at most this fraction: their true error
/// may be twice the estimated one.
///
/// Tuned on the 13 adapted runs. Half: a quarter more steps. Twice: 8 % fewer.
const MAX_SHARE_OF_STEPS: f64 = 0.5;
/// The size of a triangle is multiplied by this where the data of the scene or the contact are not resolved, and for
/// the error of ζ at a point where ζ changes by more than this fraction of its largest change.
///
/// Tuned on the 13 adapted runs. Half: twice as many triangles. Twice: 11 % fewer triangles and 29 % more steps, and
/// two runs miss their accuracy.
const HALF: f64 = 0.5;

/// The estimated errors of a run with few steps on a mesh.
pub(super) struct Estimate<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) run: FewStepRun<'a>,
    pub(super) accuracy: f64,
    /// The estimated relative error of u at the worst time and its shares.
    pub(super) error: f64,
    shares: Vec<f64>,
    /// Edges on which a function of the scene is not resolved.
    unresolved: HashSet<[usize; 2]>,
    /// The allowed penetration between the nodes, m.
    deepest: f64,
    /// The length of Γ_C on which the end of contact is not known, over the allowed one.
    open: f64,
    /// The singular points of the boundary with the errors of the triangles there, m_T.
    singular: Vec<([f64; 2], f64)>,
}

impl<'a> Estimate<'a> {
    pub(super) fn new(
        session: &Session,
        mesh: &'a Mesh,
        run: FewStepRun<'a>,
        accuracy: f64,
    ) -> Result<Self, PetscError> {
        let (error, mut shares) = run.relative();
        let singular = run.problem.singular_points().into_iter().map(|point| {
            let here = shares.iter_mut().zip(touching(mesh, &[point.at]));
            let here = here.filter(|(_, touches)| *touches).map(|(share, _)| take(share));
            (point.at, here.sum())
        });
        let singular = singular.collect();
        let (displacement, end) = (run.history.displacement, &run.outcome.last.state);
        let unresolved = unresolved(session, run.problem, end, accuracy, displacement)?;
        Ok(Self {
            unresolved,
            deepest: accuracy * displacement,
            open: run.open() / accuracy,
            singular,
            mesh,
            run,
            accuracy,
            error,
            shares,
        })
    }

    /// The scene with few time steps.
    pub(super) fn scene(&self) -> &Scene {
        self.run.problem.scene()
    }

    /// Is the mesh good enough for a measurement? Its estimates must be small and the data of the scene resolved.
    pub(super) fn is_enough(&self) -> bool {
        // The errors of figures are products of two estimated errors, see [`Cause::FIGURE`].
        let named = !self.scene().accuracy_of.is_empty();
        let wanted = if named { self.accuracy.sqrt() } else { self.accuracy };
        self.error <= GOOD_ENOUGH * wanted
            && (named || self.open <= GOOD_ENOUGH)
            && self.resolves_data()
    }

    /// Does the mesh resolve the data of the scene? Another mesh may miss a whole peak of a foundation.
    pub(super) fn resolves_data(&self) -> bool {
        let is_allowed = |&depth: &f64| depth <= self.deepest;
        self.unresolved.is_empty() && self.run.history.depths.iter().all(is_allowed)
    }

    /// The mesh with its errors.
    pub(super) fn adapted(
        &self,
        measured: Option<&Measurement>,
        rounds: usize,
        end: Option<&End>,
    ) -> Adapted {
        let worst = |measured: &Measurement| {
            let errors = measured.errors(&self.scene().accuracy_of).into_iter();
            errors.map(|error| (error.name, error.relative)).next()
        };
        Adapted {
            mesh: self.mesh.clone().in_morton_order(),
            unknowns: 2 * self.run.problem.body.nodes.partition.total(),
            rounds,
            error: self.error,
            damage_error: self
                .run
                .problem
                .damage()
                .and(measured)
                .map(|of| of.result.damage.unwrap_or(0.0)),
            damage: self.run.damage(),
            // The steps of this run may be what it takes to reach ζ_* or not.
            steps: (MAX_SHARE_OF_STEPS * self.accuracy).min(self.scene().step_tolerance()),
            measured: measured.map_or_else(Measured::default, |of| of.result.clone()),
            worst: measured.and_then(worst),
            not_reached: end.filter(|end| **end != End::Reached).map(End::to_string),
        }
    }

    /// The measured errors that miss the accuracy, over the allowed ones, with their causes.
    fn missed(&self, measured: Option<&Measurement>) -> Vec<(f64, Cause)> {
        let Some(measured) = measured else { return Vec::new() };
        let has_points = !self.singular.is_empty() || !self.run.extremes.ends.is_empty();
        let errors = measured.errors(&self.scene().accuracy_of).into_iter();
        let errors = errors.map(|error| {
            (error.over_accuracy(self.accuracy), measured.cause(&error.name, self.run.problem))
        });
        let with_points = |(over, cause)| match cause {
            Cause::Reactions if !has_points => (over, Cause::FIGURE),
            cause => (over, cause),
        };
        errors.filter(|(over, _)| *over > 1.0).map(with_points).collect()
    }

    /// The next mesh. After a measurement it has at least 1.3 times as many triangles, if smaller goals for
    /// the errors of the figures give them: a mesh that is hardly finer is not worth its measurement.
    pub(super) fn refined(
        &self,
        refinement: &Refinement,
        measured: Option<&Measurement>,
    ) -> Result<Refinement, MeshError> {
        /// After a measurement, the next mesh has at least this many times as many triangles.
        ///
        /// Tuned on the 13 adapted runs. Half: 5 % fewer triangles. Twice: 19 % more.
        const GROWTH: f64 = 1.3;
        let enough = measured.map_or(0.0, |_| GROWTH * self.mesh.triangles.len() as f64);
        let halvings_near = self.halvings_near(measured);
        let mut next = refinement.clone();
        for goal in (0..5).map(|power| AIM.powi(power)) {
            next = divided(refinement.clone(), &self.size_ratios(measured, goal))?;
            next = sharpened(next, &halvings_near)?;
            if next.mesh.triangles.len() as f64 >= enough {
                break;
            }
        }
        Ok(next)
    }

    /// The factors by which to multiply the sizes of the triangles for the next mesh. If a few triangles cause the
    /// error of a figure, these become smaller; the error is of first order in their size. Any other error requires
    /// smaller errors of u and the damage. The errors of the figures are to become `goal` times the usual aim.
    fn size_ratios(&self, measured: Option<&Measurement>, goal: f64) -> Vec<f64> {
        let order = if self.scene().order == Order::Quadratic { 2 } else { 1 };
        let (mut shares, mut depths) = (self.shares.clone(), self.run.history.depths.clone());
        if let Some(measured) = measured {
            let larger = |(own, of_parts): (&mut f64, &f64)| *own = own.max(*of_parts);
            shares.iter_mut().zip(&measured.shares).for_each(larger);
            depths.iter_mut().zip(&measured.depths).for_each(larger);
        }
        let (mut ratios, mut smaller) = (vec![1.0_f64; shares.len()], 1.0_f64);
        let take_smaller = |ratios: &mut [f64], others: Vec<f64>| {
            ratios.iter_mut().zip(others).for_each(|(ratio, other)| *ratio = ratio.min(other));
        };
        for (over, cause) in self.missed(measured) {
            let goal = (goal * AIM / over).max(MIN_GOAL);
            match cause {
                Cause::Ends | Cause::Reactions => {}
                Cause::Change(zeta) => {
                    let largest = zeta.iter().copied().fold(0.0, f64::max);
                    let size = |change| if change > HALF * largest { goal.min(HALF) } else { 1.0 };
                    take_smaller(&mut ratios, zeta.into_iter().map(size).collect());
                }
                Cause::Damage(shares) => {
                    take_smaller(&mut ratios, size_ratios(&shares, 2, AIM * self.accuracy));
                }
                Cause::Around(point, derivative) => {
                    let shares = influences(self.mesh, &shares, order, point, derivative);
                    let all: f64 = shares.iter().sum();
                    take_smaller(&mut ratios, size_ratios(&shares, order, (goal * all).sqrt()));
                }
                Cause::Fields(power) => smaller = smaller.min(goal.powf(power)),
            }
        }
        let of_u = if smaller < 1.0 { smaller * self.error } else { self.accuracy };
        take_smaller(&mut ratios, size_ratios(&shares, order, AIM * of_u.min(self.accuracy)));
        for ((ratio, &[a, b, c]), depth) in ratios.iter_mut().zip(&self.mesh.triangles).zip(depths)
        {
            let mut sides = [[a, b], [b, c], [c, a]].into_iter();
            let is_unresolved = sides.any(|side| self.unresolved.contains(&sorted(side)));
            if is_unresolved || depth > self.deepest {
                *ratio = ratio.min(HALF);
            }
        }
        // If no estimate shows which triangles are too large, all become smaller.
        let none =
            ratios.iter().all(|&ratio| ratio == 1.0) && self.halvings_near(measured).is_empty();
        if measured.is_some() && none {
            ratios.fill(smaller.min(HALF));
        }
        ratios
    }

    /// How often to halve the triangles at some points. At singular points the squared error falls like h, as at a crack;
    /// together they may cause the part that the others leave. The ends of contact are known up to half of an edge.
    fn halvings_near(&self, measured: Option<&Measurement>) -> Vec<([f64; 2], usize)> {
        let halvings = |over: f64| over.log2().ceil().max(0.0) as usize;
        let (mut of_reactions, mut of_length, mut points) = (0, 0, Vec::new());
        for (over, cause) in self.missed(measured) {
            match cause {
                Cause::Ends => of_length = 2,
                Cause::Reactions => of_reactions = of_reactions.max(halvings(over / AIM)),
                Cause::Around(at, _) => points.push((at, 1)),
                _ => {}
            }
        }
        let left = (GOOD_ENOUGH * GOOD_ENOUGH - AIM * AIM) * self.accuracy.powi(2);
        let aim = left / self.singular.len() as f64;
        let singular = self.singular.iter();
        let singular = singular.map(|(at, share)| (*at, halvings(share / aim).max(of_reactions)));
        // A mesh that is far too coarse does not know the ends.
        let is_known = self.error < 2.0 * self.accuracy;
        let open = if is_known { self.open } else { 0.0 };
        let at_ends = halvings(open / AIM).max(of_length).max(of_reactions);
        let ends = self.run.extremes.ends.as_flattened().iter().map(|&end| (end, at_ends));
        singular.chain(ends).chain(points).filter(|(_, halvings_near)| *halvings_near > 0).collect()
    }
}
