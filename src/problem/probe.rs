//! Points of the body at which every step reports displacement, damage and stress.

use super::{DiscreteProblem, SetupError, State};
use crate::{
    fem::{Body, Location, Subdomain},
    scene::Scene,
};

/// The places of the probes, each with its triangle on this rank; `None` if another rank owns it.
#[derive(Debug)]
pub(super) struct Probes(Vec<(Location, Option<usize>)>);

/// The quantities at each probe: displacement, m; damage; stress, Pa.
pub(crate) const OBSERVED: [&str; 7] =
    ["u_x", "u_y", "zeta", "stress_xx", "stress_yy", "stress_xy", "von_mises"];

impl Probes {
    /// Finds the probes of `scene` in the undivided `body`.
    ///
    /// # Errors
    /// A probe lies outside the body.
    pub(super) fn new(scene: &Scene, body: &Body) -> Result<Self, SetupError> {
        let (mut places, mut outside) = (Vec::new(), Vec::new());
        for probe in &scene.probes {
            match Location::of(probe.point, body) {
                Some(location) => places.push((location, Some(location.triangle))),
                None => outside.push(probe),
            }
        }
        scene.check_probes(&outside)?;
        Ok(Self(places))
    }

    /// The probes in the triangles that a rank owns.
    pub(super) fn restrict(&self, subdomain: &Subdomain) -> Self {
        let local = |&(place, _): &(Location, _)| (place, subdomain.own_triangle(place.triangle));
        Self(self.0.iter().map(local).collect())
    }

    /// The quantities at all probes; 0 at probes of other ranks. The stress is σ = η_*(ζ) 𝒜ε(u) at the point.
    pub(super) fn values(&self, problem: &DiscreteProblem, state: &State) -> Vec<f64> {
        let values = |(location, triangle): &(Location, Option<usize>)| {
            let Some(t) = *triangle else { return [0.0; OBSERVED.len()] };
            let at = location.values(&problem.body, t, &state.u, &state.zeta);
            let (elasticity, body) = (&problem.elasticity, &problem.body);
            let stress = elasticity.d(body, t) * at.strain * problem.truncated(at.zeta);
            let von_mises = elasticity.material(body, t).von_mises(&stress);
            [at.u[0], at.u[1], at.zeta, stress[0], stress[1], stress[2], von_mises]
        };
        self.0.iter().flat_map(values).collect()
    }
}
