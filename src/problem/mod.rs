//! The discrete problem: a scene on its mesh, with everything that is the same in all steps.
//!
//! The scene has functions and names; the mesh has nodes and named curves. This room combines them:
//!
//! - [`DiscreteProblem`]: the body, its materials, its supports and the tolerance;
//! - [`Loads`]: nodal loads, prescribed displacements and gaps as functions of time, integrated so finely that no
//!   narrow load is overlooked (`LoadCase`: their values at one time);
//! - [`Singular`]: the points with singular stresses; `Corner`: those at which stresses depend on the direction;
//! - [`State`]: time, displacements, damage and contact at one time.
//!
//! What crosses the door: `evolution` advances a [`DiscreteProblem`] from [`State`] to [`State`]. The rooms
//! [`observe`](crate::observe) and [`advice`](crate::advice) read the problem and its states; this room uses neither.
//! Bad input is a [`SetupError`].

mod boundary_conditions;
mod collapse;
mod directions;
mod error;
mod loads;
mod singular;
mod state;

pub use collapse::Collapse;
pub(crate) use directions::{Corner, Effect, Ray};
pub use error::SetupError;
pub use loads::Loads;
use loads::near_jumps;
pub(crate) use loads::{
    DEVIATION, ElementLoads, LoadCurve, NOTED, SAMPLE_TIMES, centroid, edge_parts, triangle_parts,
    triangle_point,
};
pub(crate) use singular::SEEN;
pub use singular::Singular;
pub use state::State;

use crate::{
    ROUNDING,
    contact::{Bound, Certificate, Constraints, NodalConstraint, RigidMotions},
    fem::{Body, Elasticity, Mass, Subdomain},
    mesh::{Lines, Mesh},
    model::DamageLaw,
    scene::{Boundary, Scene, SceneError, Stepping, TimeGrid, rounded},
};
use boundary_conditions::BoundaryConditions;
use nalgebra::DVector;
use std::{collections::BTreeMap, sync::OnceLock};

/// A scene on its mesh, ready for the time steps.
#[derive(Debug)]
pub struct DiscreteProblem {
    /// The body.
    pub body: Body,
    /// The elasticity of the materials.
    pub elasticity: Elasticity,
    /// The damage law of each material, by its number; empty if the damage does not evolve.
    laws: Vec<DamageLaw>,
    /// Displacement conditions as unknowns and bounds, for the solvers.
    pub constraints: Constraints,
    /// The same conditions in global coordinates, to certify answers.
    pub certificate: Certificate,
    /// Rigid motions that Γ_D leaves unconstrained.
    pub motions: RigidMotions,
    /// Loads and prescribed displacements.
    pub loads: Loads,
    /// The prescribed displacements of the undivided body, each with the number of its boundary among those that support it.
    pub(crate) prescribed: Vec<(usize, NodalConstraint)>,
    /// max ‖·‖₂ of the nodal loads over sampled times of the run, N per metre of thickness.
    pub(crate) largest_load: f64,
    /// Are some straight sides chords of a curved boundary?
    pub(crate) has_chords: bool,
    /// KKT tolerance.
    pub tolerance: f64,
    /// The numbers and names of the materials of the body.
    pub(crate) materials: Vec<(usize, String)>,
    /// The names of the boundaries with a gap.
    pub foundations: Vec<String>,
    scene: Scene,
    /// The collapse at which the run ends early, if the loads drive an unsupported motion.
    pub collapse: Option<Collapse>,
    /// If `body` is a subdomain: the undivided mesh.
    undivided: Option<Mesh>,
    /// See [`Self::corners`].
    corners: OnceLock<(Vec<Singular>, Vec<Corner>)>,
}

/// The data of the contact problem (26) at one time.
#[derive(Debug)]
pub struct LoadCase {
    /// t, s.
    pub(crate) time: f64,
    /// Nodal loads f, N per metre of thickness.
    pub load: Vec<f64>,
    /// Their work on the motions that contact resists.
    pub(crate) work: DVector<f64>,
    /// The values of all constraints, m.
    pub(crate) values: Vec<f64>,
    /// The unknowns c that they prescribe, m, 0 elsewhere.
    pub c_prescribed: Vec<f64>,
    /// The bounds on the other unknowns.
    pub bounds: Vec<Bound>,
}

impl DiscreteProblem {
    /// Binds `scene` to `mesh`, in which boundaries with `where` get their edges if it has no curves of these names, and checks at sampled times that a solution exists. If the body loses its support at
    /// some time, the scene ends just before.
    ///
    /// # Errors
    /// The scene does not fit the mesh, contradicts itself, or its load drives a rigid motion from the start.
    pub fn new(scene: Scene, mut mesh: Mesh) -> Result<Self, SetupError> {
        let is_there = |of: &Boundary| of.selection.is_none() || mesh.curves.contains_key(&of.name);
        if !scene.boundaries.iter().all(is_there) {
            scene.name_edges(&mut mesh)?;
        }
        scene.check_mesh(&mesh)?;
        let mut body = Body::new(mesh, scene.order);
        body.materials = scene.materials_of(&body.mesh);
        let lines = Lines::boundary(&body.mesh);
        body.near_jumps = near_jumps(&scene, &body.mesh, &lines);
        let mut conditions = BoundaryConditions::new(&scene, &body, &lines);
        let motions = conditions.resolve_motions(&body);
        let loads = Loads::new(&body, &scene, &mut conditions);
        let (points, values) = (&body.nodes.points, loads.values_at(scene.start()));
        let mut constraints =
            Constraints::new(points, &mut conditions.rows, &values).map_err(|source| {
                SetupError::Constraint { scene: scene.path.clone(), time: None, source }
            })?;
        motions.pin_free(&body, &mut constraints);
        let certificate = Certificate::new(&conditions.rows);
        let prescribed = conditions.prescribed_by.iter().copied().zip(conditions.rows);
        let norms = (scene.sample_times(SAMPLE_TIMES).into_iter())
            .map(|time| body.nodes.partition.norm(&loads.at(&body, time), 2));
        let foundations = scene.boundaries.iter().filter(|boundary| boundary.gap().is_some());
        let has_chords = lines.have_chords();
        let problem = Self {
            has_chords,
            largest_load: norms.filter(|norm| norm.is_finite()).fold(0.0, f64::max),
            certificate,
            elasticity: conditions.elasticity,
            laws: if scene.time.is_some() { scene.damage_laws() } else { Vec::new() },
            constraints,
            motions,
            loads,
            prescribed: prescribed.collect(),
            tolerance: scene.contact.tolerance,
            materials: scene.materials_in(&body.materials),
            foundations: foundations.map(|boundary| boundary.name.clone()).collect(),
            body,
            scene,
            undivided: None,
            corners: OnceLock::new(),
            collapse: None,
        };
        problem.until_collapse()
    }

    /// Restricts a problem that every rank has made to this rank's subdomain.
    pub(crate) fn restrict(self, subdomain: Subdomain) -> Self {
        Self {
            constraints: self.constraints.restrict(&subdomain),
            certificate: self.certificate.restrict(&subdomain),
            loads: self.loads.restrict(&subdomain),
            body: subdomain.body(&self.body),
            undivided: Some(self.body.mesh),
            ..self
        }
    }

    /// The names of the materials of the body.
    pub fn materials(&self) -> impl Iterator<Item = &str> + Clone {
        self.materials.iter().map(|(_, name)| &**name)
    }

    /// Nodal loads at `time`, N per metre of thickness. Rounding, as in sin(pi) = 1.2e-16, counts as zero.
    pub fn load(&self, time: f64) -> Vec<f64> {
        let mut load = self.loads.at(&self.body, time);
        let rounding = ROUNDING * self.largest_load;
        // Loads whose squares underflow have no norm; a later check refuses them.
        if rounding > 0.0 && self.body.nodes.partition.norm(&load, 2) <= rounding {
            load.fill(0.0);
        }
        load
    }

    /// The data of (26) at `time`.
    ///
    /// # Errors
    /// The load is not finite or drives an unconstrained rigid motion; prescribed values are not finite, contradict
    /// each other or penetrate the obstacle; or the obstacles leave a node no space.
    pub fn load_case(&self, time: f64) -> Result<LoadCase, SetupError> {
        let load = self.motions.balanced(&self.body, self.checked_load(time)?);
        let work = self.motions.work(&self.body, |i| [load[2 * i], load[2 * i + 1]]);
        let values = self.loads.values_at(time);
        let (c_prescribed, bounds) = self.prescribed_and_bounds(time, &values)?;
        Ok(LoadCase { time, load, work, values, c_prescribed, bounds })
    }

    /// The nodal loads at `time`, if they are finite and drive no unconstrained rigid motion. Collective.
    pub(super) fn checked_load(&self, time: f64) -> Result<Vec<f64>, SetupError> {
        let load = self.load(time);
        if !self.body.comm().all(load.iter().all(|f| f.is_finite())) {
            return Err(self.not_finite(time));
        }
        let driven = |source| SetupError::Driven { scene: self.scene.path.clone(), time, source };
        let error = || self.loads.resultant_error(&self.body, time);
        self.motions.check(&self.body, &load, error).map_err(driven)?;
        Ok(load)
    }

    /// The error for a value that is not finite at `time`. It names the value if it is at a point of the check.
    fn not_finite(&self, time: f64) -> SetupError {
        let unknown = || {
            SceneError(vec![format!(
                "{}: the body force or a value of a boundary is not finite or too large at t = {}; check its \
                 expression for divisions by zero, roots and logarithms of negative numbers",
                self.scene.path.display(),
                rounded(time)
            )])
        };
        self.scene.check_values(self.mesh(), &[time]).err().unwrap_or_else(unknown).into()
    }

    /// The prescribed unknowns and the bounds on the others at `time`, from the values of all rows.
    pub(super) fn prescribed_and_bounds(
        &self,
        time: f64,
        values: &[f64],
    ) -> Result<(Vec<f64>, Vec<Bound>), SetupError> {
        if !values.iter().all(|value| value.is_finite()) {
            return Err(self.not_finite(time));
        }
        let (scene, time) = (self.scene.path.clone(), self.scene.time.map(|_| time));
        let constraint = |source| SetupError::Constraint { scene, time, source };
        self.constraints.prescribed_and_bounds(values, &self.body.nodes.points).map_err(constraint)
    }

    /// Is there a Γ_C?
    pub fn has_contact(&self) -> bool {
        !self.foundations.is_empty()
    }

    /// The damage law of each material, by its number; `None` if the damage does not evolve.
    pub fn damage(&self) -> Option<&[DamageLaw]> {
        Some(&self.laws[..]).filter(|laws| !laws.is_empty())
    }

    /// κ of each material, by its number, m²/s.
    pub fn diffusions(&self) -> Vec<f64> {
        self.laws.iter().map(|law| law.diffusion).collect()
    }

    /// The mass matrix of the damage steps.
    pub fn mass(&self) -> Mass {
        self.scene.damage.as_ref().map(|damage| damage.mass).unwrap_or_default()
    }

    /// ζ₀ at the nodes: π^h ζ₀, or 1 without damage.
    pub fn initial_damage(&self) -> Vec<f64> {
        let points = &self.body.mesh.nodes;
        match &self.scene.damage {
            Some(damage) => points.iter().map(|&[x, y]| damage.initial.eval(x, y, 0.0)).collect(),
            None => vec![1.0; points.len()],
        }
    }

    /// ζ_*, or 0 without damage.
    pub fn threshold(&self) -> f64 {
        self.scene.damage.as_ref().map_or(0.0, |damage| damage.law.threshold)
    }

    /// η_*(ζ).
    pub(crate) fn truncated(&self, zeta: f64) -> f64 {
        self.scene.damage.as_ref().map_or(zeta, |damage| damage.law.truncate(zeta))
    }

    /// η_*(ζ) at the quadrature points of the elements of u, interpolated between the vertices.
    pub fn zeta_at_points(&self, zeta: &[f64]) -> Vec<f64> {
        self.body.at_points(&zeta.iter().map(|&z| self.truncated(z)).collect::<Vec<_>>())
    }

    /// The undivided mesh.
    pub fn mesh(&self) -> &Mesh {
        self.undivided.as_ref().unwrap_or(&self.body.mesh)
    }

    /// The named curves of the whole mesh: the ends of their edges, m, the body on the left.
    pub fn boundaries(&self) -> BTreeMap<&str, Vec<[[f64; 2]; 2]>> {
        let mesh = self.mesh();
        let ends = |edge: &[usize; 2]| edge.map(|node| mesh.nodes[node]);
        let curves = mesh.curves.iter();
        curves.map(|(name, curve)| (&**name, curve.edges.iter().map(ends).collect())).collect()
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Sets the tolerance of steps that are chosen by their error.
    pub fn set_step_tolerance(&mut self, of_steps: f64) {
        if let Some(TimeGrid { stepping: Stepping::Auto { tolerance, .. }, .. }) =
            &mut self.scene.time
        {
            *tolerance = of_steps;
        }
    }
}
