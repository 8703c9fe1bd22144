//! Points of the body at which every step reports displacement, damage and stress.

use crate::{
    fem::{Body, Location, Subdomain},
    problem::{DiscreteProblem, SetupError, State},
    scene::Scene,
};
use nalgebra::Vector3;

/// The places of the probes, each with its triangles on this rank; `None` if it belongs to another rank.
#[derive(Debug)]
pub(super) struct Probes(Vec<(Vec<Location>, Option<Vec<usize>>)>);

impl Probes {
    /// Finds the probes of `scene` in the undivided `body`.
    ///
    /// # Errors
    /// A probe lies outside the body.
    pub(super) fn new(scene: &Scene, body: &Body) -> Result<Self, SetupError> {
        let (mut places, mut outside) = (Vec::new(), Vec::new());
        for probe in &scene.probes {
            let locations = Location::of(probe.point, body);
            match locations.is_empty() {
                true => outside.push(probe),
                false => {
                    let triangles = locations.iter().map(|location| location.triangle).collect();
                    places.push((locations, Some(triangles)));
                }
            }
        }
        scene.check_probes(&outside)?;
        Ok(Self(places))
    }

    /// The probes whose nearest vertex in the undivided `body` a rank owns. It keeps all triangles around this vertex.
    pub(super) fn restrict(&self, body: &Body, subdomain: &Subdomain) -> Self {
        let local = |(locations, _): &(Vec<Location>, Option<Vec<usize>>)| {
            let is_own = subdomain.owned(locations[0].nearest(body)).is_some();
            let triangles = locations.iter().map(|of| subdomain.triangle(of.triangle));
            (locations.clone(), if is_own { triangles.collect() } else { None })
        };
        Self(self.0.iter().map(local).collect())
    }

    /// u_x, u_y, m, ζ, σ_xx, σ_yy, σ_xy and the von Mises stress, Pa, at each probe; 0 at probes of other ranks. The stress is σ = η_*(ζ) 𝒜ε(u) at the point, with the mean
    /// strain of its triangles.
    pub(super) fn values(&self, problem: &DiscreteProblem, state: &State) -> Vec<[f64; 7]> {
        let (elasticity, body) = (&problem.elasticity, &problem.body);
        let values = |(locations, triangles): &(Vec<Location>, Option<Vec<usize>>)| {
            let Some(triangles) = triangles else { return [0.0; 7] };
            let values = locations.iter().zip(triangles);
            let values = values.map(|(of, &t)| of.values(body, t, &state.u, &state.zeta));
            let values = Vec::from_iter(values);
            let strain =
                values.iter().map(|at| at.strain).sum::<Vector3<f64>>() / values.len() as f64;
            let (at, t) = (values[0], triangles[0]);
            let stress = elasticity.d(body, t) * strain * problem.truncated(at.zeta);
            let von_mises = elasticity.material(body, t).von_mises(&stress);
            [at.u[0], at.u[1], at.zeta, stress[0], stress[1], stress[2], von_mises]
        };
        self.0.iter().map(values).collect()
    }
}
