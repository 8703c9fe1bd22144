//! The physical setting: a scene bound to its mesh, everything that does not change with time.

use super::{Foundation, Loads, resultants};
use crate::{
    contact::{
        Bound, Certificate, ConstraintError, Constraints, DrivenMotion, FixedRow, GapRow,
        RigidMotions,
    },
    fem::{Body, Elasticity, Mass, Subdomain},
    mesh::{Mesh, boundary_nodes},
    model::DamageLaw,
    petsc::{PetscError, Session},
    scene::{Scene, SceneError},
};
use std::path::PathBuf;

/// A scene on its mesh, ready to be stepped.
#[derive(Debug)]
pub struct DiscreteProblem {
    /// The body.
    pub body: Body,
    /// The undamaged elastic operator.
    pub elasticity: Elasticity,
    /// Displacement conditions as unknowns and bounds, for the solvers.
    pub constraints: Constraints,
    /// The same conditions as posed, to judge answers by.
    pub certificate: Certificate,
    /// Rigid motions that Γ_D does not hold.
    pub motions: RigidMotions,
    /// Loads and prescribed displacements.
    pub loads: Loads,
    /// The largest ‖·‖₂ of the nodal loads at some times of the run, N per metre of thickness.
    pub largest_load: f64,
    /// KKT tolerance.
    pub tolerance: f64,
    /// The foundation opposite Γ_C.
    pub foundation: Foundation,
    /// Notes on tractions that the mesh does not resolve.
    pub(super) unresolved: Vec<String>,
    scene: Scene,
}

/// Times at which the loads of a run are looked at for the largest.
const SAMPLES: usize = 9;
/// A load below this part of the largest is rounding.
const UNLOADED: f64 = 1e-14;

/// The scene and its mesh do not make a problem: bad input.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// The scene does not fit the mesh.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Displacement conditions contradict each other.
    #[error("{scene}: {source}")]
    Constraint {
        /// The scene file.
        scene: PathBuf,
        /// What contradicts what.
        source: ConstraintError,
    },
    /// A load or a prescribed displacement is not finite, and this rank cannot tell where.
    #[error(
        "{scene}: a traction, the body force or a prescribed displacement is not finite or too \
         large at t = {time}; check its expression for divisions by zero, roots and logarithms \
         of negative numbers"
    )]
    NotFinite {
        /// The scene file.
        scene: PathBuf,
        /// The time, s.
        time: f64,
    },
    /// The load drives a rigid motion.
    #[error("{scene}: at t = {time}, {source}")]
    Driven {
        /// The scene file.
        scene: PathBuf,
        /// The first such time, s.
        time: f64,
        /// The motion.
        source: DrivenMotion,
    },
}

impl DiscreteProblem {
    /// Binds `scene` to `mesh` and checks that there is a solution at all times.
    ///
    /// # Errors
    /// The scene does not fit the mesh, contradicts itself, or its load drives a rigid motion.
    pub fn new(scene: Scene, mesh: Mesh) -> Result<Self, SetupError> {
        scene.check_mesh(&mesh)?;
        let body = Body::new(mesh);
        let (mut fixed, prescribed) = fixed_rows(&scene, &body.mesh);
        let mut gaps = gap_rows(&scene, &body.mesh);
        let motions = RigidMotions::new(&body, &fixed, &gaps);
        let axes = fixed.iter_mut().zip(&prescribed).filter(|(_, value)| value.is_none());
        axes.for_each(|(row, _)| {
            row.direction = motions.tangential(&body, row.node, row.direction);
        });
        gaps.iter_mut()
            .for_each(|row| row.normal = motions.tangential(&body, row.node, row.normal));
        let mut constraints = Constraints::new(&body.mesh.nodes, &fixed, &gaps)
            .map_err(|source| SetupError::Constraint { scene: scene.path.clone(), source })?;
        let loads = Loads::new(&scene, &body, prescribed);
        motions.pin_free(&body, &mut constraints);

        let sizes = scene.sample_times(SAMPLES).into_iter();
        let sizes = sizes.map(|time| body.partition.norm(&loads.at(&body, time), 2));
        let largest_load = sizes.filter(|size| size.is_finite()).fold(0.0, f64::max);
        let problem = Self {
            largest_load,
            foundation: Foundation::new(&scene, &body.mesh, &constraints),
            unresolved: resultants::unresolved(&scene, &body.mesh),
            certificate: Certificate::new(&fixed, &constraints.gaps),
            elasticity: Elasticity::new(scene.material),
            constraints,
            motions,
            loads,
            tolerance: scene.contact.tolerance,
            body,
            scene,
        };
        problem.check_times()?;
        Ok(problem)
    }

    /// This rank's share of a setting that every rank has made. Collective.
    ///
    /// # Errors
    /// PETSc cannot divide the mesh.
    pub fn restrict(self, session: &Session) -> Result<Self, PetscError> {
        let Some(subdomain) = Subdomain::of(session, &self.body.mesh)? else { return Ok(self) };
        Ok(Self {
            constraints: self.constraints.restrict(&subdomain),
            certificate: self.certificate.restrict(&subdomain),
            motions: self.motions.restrict(&subdomain),
            loads: self.loads.restrict(&subdomain),
            body: subdomain.body(&self.body),
            ..self
        })
    }

    /// Checks what depends on time, where times are known beforehand
    /// ([`Scene::sample_times`]), so that bad input is refused before anything is written.
    fn check_times(&self) -> Result<(), SetupError> {
        // A body force is as much work as the loads of a step.
        let most = if self.loads.body_force_depends_on_time() { 100 } else { 1000 };
        let mut times = self.scene.sample_times(most);
        times.truncate(if self.loads.depend_on_time() { usize::MAX } else { 1 });
        for time in times {
            self.posed(time)?;
            if !self.motions.all_prevented() {
                self.check_load(time, &self.load(time))?;
            }
        }
        Ok(())
    }

    /// Nodal loads at `time`, N per metre of thickness; rounding of the largest load of the run
    /// (sin(pi) = 1.2e-16) is none.
    pub fn load(&self, time: f64) -> Vec<f64> {
        let load = self.loads.at(&self.body, time);
        let size = self.body.partition.norm(&load, 2);
        match size > 0.0 && size <= UNLOADED * self.largest_load {
            true => vec![0.0; load.len()],
            false => load,
        }
    }

    /// Checks that the load at `time` is finite and drives no rigid motion that nothing holds.
    ///
    /// # Errors
    /// It is not, or it does; the error then names the motion.
    pub fn check_load(&self, time: f64, load: &[f64]) -> Result<(), SetupError> {
        let comm = self.body.partition.comm();
        if !comm.all(load.iter().all(|f| f.is_finite())) {
            return Err(self.not_finite(time));
        }
        if self.motions.all_prevented() {
            return Ok(());
        }
        self.motions.check(&self.body, load).map_err(|source| SetupError::Driven {
            scene: self.scene.path.clone(),
            time,
            source,
        })
    }

    /// Which value is not finite at `time`, as far as this rank knows.
    fn not_finite(&self, time: f64) -> SetupError {
        match self.scene.check_values(&self.body.mesh, &[time]) {
            Err(error) => error.into(),
            Ok(()) => SetupError::NotFinite { scene: self.scene.path.clone(), time },
        }
    }

    /// The prescribed unknowns at `time`, zero elsewhere.
    ///
    /// # Errors
    /// Prescribed values are not finite, contradict each other or go through the obstacle.
    pub fn lift(&self, time: f64) -> Result<Vec<f64>, SetupError> {
        let values = self.loads.prescribed_at(time);
        if !values.iter().all(|value| value.is_finite()) {
            return Err(self.not_finite(time));
        }
        self.constraints
            .lift(&values, &self.body.mesh.nodes)
            .map_err(|source| SetupError::Constraint { scene: self.scene.path.clone(), source })
    }

    /// The prescribed unknowns at `time`, and the bounds on the others.
    ///
    /// # Errors
    /// Those of [`Self::lift`], and obstacles that leave a node no room.
    pub fn posed(&self, time: f64) -> Result<(Vec<f64>, Vec<Bound>), SetupError> {
        let lift = self.lift(time)?;
        let bounds = self
            .constraints
            .bounds_at(&lift, &self.body.mesh.nodes)
            .map_err(|source| SetupError::Constraint { scene: self.scene.path.clone(), source })?;
        Ok((lift, bounds))
    }

    /// The time of the first solve, s: 0, or 1 where there is no time.
    pub fn start(&self) -> f64 {
        if self.scene.time.is_some() { 0.0 } else { 1.0 }
    }

    /// The damage law, where the material can be damaged in time.
    pub fn damage(&self) -> Option<DamageLaw> {
        self.scene.time?;
        self.scene.damage.as_ref().map(|damage| damage.law)
    }

    /// How the damage steps are integrated.
    pub fn mass(&self) -> Mass {
        self.scene.damage.as_ref().map(|damage| damage.mass).unwrap_or_default()
    }

    /// ζ₀ at the nodes: π^h ζ₀, or 1 for a material that is not damaged.
    pub fn initial_damage(&self) -> Vec<f64> {
        let nodes = &self.body.mesh.nodes;
        match &self.scene.damage {
            Some(damage) => nodes.iter().map(|&[x, y]| damage.initial.eval(x, y, 0.0)).collect(),
            None => vec![1.0; nodes.len()],
        }
    }

    /// ζ_*, 0 for a material that is not damaged.
    pub fn threshold(&self) -> f64 {
        self.scene.damage.as_ref().map_or(0.0, |damage| damage.law.threshold)
    }

    /// The mean of η_*(ζ) over each triangle.
    pub fn triangle_means(&self, zeta: &[f64]) -> Vec<f64> {
        let truncate = |z: f64| match &self.scene.damage {
            Some(damage) => damage.law.truncate(z),
            None => z,
        };
        let mean = |t: &[usize; 3]| t.iter().map(|&node| truncate(zeta[node])).sum::<f64>() / 3.0;
        self.body.mesh.triangles.iter().map(mean).collect()
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}

type Prescribed = Vec<Option<([f64; 2], crate::scene::Expression)>>;

/// Prescribed components and symmetry axes as rows u·d = value, with their values' sources.
fn fixed_rows(scene: &Scene, mesh: &Mesh) -> (Vec<FixedRow>, Prescribed) {
    let (mut rows, mut sources) = (Vec::new(), Vec::new());
    for boundary in &scene.boundaries {
        let Some(curve) = mesh.curves.get(&boundary.name) else { continue };
        for point in boundary_nodes(mesh, &curve.edges) {
            let node = point.node;
            let components = boundary.displacement.iter().flatten();
            for (component, direction) in components.zip([[1.0, 0.0], [0.0, 1.0]]) {
                if let Some(value) = component {
                    rows.push(FixedRow { node, direction });
                    sources.push(Some((mesh.nodes[node], value.clone())));
                }
            }
            if boundary.symmetry {
                for face in &point.faces {
                    rows.push(FixedRow { node, direction: face.normal });
                    sources.push(None);
                }
            }
        }
    }
    (rows, sources)
}

/// The gap conditions u·ν ≤ g of Γ_C, node by node, joined where boundaries meet smoothly.
fn gap_rows(scene: &Scene, mesh: &Mesh) -> Vec<GapRow> {
    let mut rows = Vec::new();
    for boundary in &scene.boundaries {
        let (Some(gap), Some(curve)) = (&boundary.gap, mesh.curves.get(&boundary.name)) else {
            continue;
        };
        for point in boundary_nodes(mesh, &curve.edges) {
            let node = point.node;
            let distance = gap.at(mesh.nodes[node]);
            let row =
                |normal, tributary_length| GapRow { node, normal, gap: distance, tributary_length };
            match gap.normal {
                Some(normal) => rows.push(row(normal, point.faces.iter().map(|f| f.length).sum())),
                None => rows.extend(point.faces.iter().map(|face| row(face.normal, face.length))),
            }
        }
    }
    GapRow::joined(rows)
}
