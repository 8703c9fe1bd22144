//! Notes for the user on a problem, before any solve.

use super::unresolved;
use crate::{
    mesh::{Order, extent},
    model::Plane,
    problem::{DiscreteProblem, LoadCurve, SAMPLE_TIMES},
    scene::{Boundary, Gap, Scene},
};
use std::iter::once;

/// In plane strain, P1 triangles lock if ν is larger (STABILITY.md). P2 triangles only converge more slowly.
const LOCKING: f64 = 0.45;
/// A note is given if two moduli differ by a larger factor. The rounding of the stiffer material is then 1e-11 of
/// the forces in the other one, a tenth of the default tolerance.
const CONTRAST: f64 = 1e5;
/// A note is given if obstacles overlap the body by more than this fraction of its size.
const OVERLAP: f64 = 1e-9;
/// A note is given if a surface load exceeds this fraction of the largest E: strains are of the order of load/E, and must be small.
const LARGE_LOAD: f64 = 0.1;
/// A note is given if a triangle has a smaller angle, degrees.
const SLIVER: f64 = 1.0;

/// The largest ν of a scene, if linear triangles lock: the change to a finer mesh is then far smaller than the error.
pub fn locks(scene: &Scene) -> Option<f64> {
    let poisson = scene.materials().map(|material| material.poisson).fold(-1.0, f64::max);
    let may_lock = scene.order == Order::Linear && scene.material.plane == Plane::Strain;
    (may_lock && poisson > LOCKING).then_some(poisson)
}

impl DiscreteProblem {
    /// Notes for the user before any solve: input that was changed, unconstrained rigid motions, and functions,
    /// materials or triangles that make the discretisation poor.
    pub fn notes(&self) -> Vec<String> {
        let (scene, linear) = (self.scene(), self.scene().order == Order::Linear);
        let mut notes =
            Vec::from_iter(self.mesh().notes.iter().map(|note| format!("{note} (explain meshes)")));
        notes.extend(scene.time.and_then(|grid| grid.note()));
        notes.extend(self.motions.free.iter().map(|motion| {
            format!(
                "nothing prevents {motion}, and no load drives it: of all answers this one has the least ∫|u|² \
                 (explain collapse)"
            )
        }));
        let check_units = |contrast| {
            format!("{contrast}; if that is not meant, check their units (explain large-rotation)")
        };
        notes.extend(self.contrast().map(check_units));
        notes.extend(unresolved::notes(scene, self.mesh()));
        notes.extend(self.loads.notes(&scene.sample_times(SAMPLE_TIMES)));
        let others = [
            LoadCurve::unresolved_step(self).map(|[start, end]| {
                format!(
                    "loads, displacements or gaps change within a time step, as from t = {start:.4e} \
                     to {end:.4e}: shorten time.step, or set it to \"auto\" (explain loads)"
                )
            }),
            scene.units.contradiction(),
            self.large_load(),
            (scene.materials().any(|material| material.density > 0.0)
                && scene.gravity.iter().all(|g| g.as_constant() == Some(0.0)))
            .then(|| "material.density has no effect without body.gravity; set it (explain loads)".to_owned()),
            (scene.output.every == Some(0) && !scene.output.times.is_empty()).then(|| {
                "output.every = 0 writes no frames, so only contact.csv has the output.times (explain pictures)"
                    .to_owned()
            }),
            (scene.damage.is_some() && scene.time.is_none()).then(|| {
                "[damage] has no effect without [time]: in a static solve ζ stays damage.initial; add [time]".to_owned()
            }),
            locks(scene).map(|poisson| {
                format!(
                    "linear triangles lock in plane strain with ν = {poisson} > {LOCKING}: displacements \
                     may be far too small; set discretisation.displacement = 2 (explain locking)"
                )
            }),
            (linear && !self.mesh().curved.is_empty()).then(|| {
                "curved sides are taken as straight; set discretisation.displacement = 2 (explain meshes)".to_owned()
            }),
            self.collapse_on_a_point().map(|_| {
                "just before the body turns over, the contact shrinks to a point: displacements and stresses at \
                 the end grow as the mesh is refined; set an earlier time.end (explain collapse)"
                    .to_owned()
            }),
            self.overlap(),
            self.sliver(),
        ];
        notes.extend(others.into_iter().flatten());
        notes
    }

    /// A note on the largest surface load, if it is large beside E of the stiffest material.
    pub fn large_load(&self) -> Option<String> {
        let (scene, mesh, mut largest) = (self.scene(), self.mesh(), (0.0, ""));
        let times = scene.sample_times(SAMPLE_TIMES);
        for boundary in &scene.boundaries {
            for edge in mesh.edges_of(&boundary.name) {
                let (at, normal) = (mesh.midpoint(*edge), mesh.edge_normal(*edge).0);
                for f in boundary.loads().flat_map(|f| times.iter().map(|&t| f.at(at, normal, t))) {
                    let load = f[0].hypot(f[1]);
                    largest = if load > largest.0 { (load, &*boundary.name) } else { largest };
                }
            }
        }
        let young = scene.materials().map(|material| material.young).fold(0.0, f64::max);
        let ((load, name), unit) = (largest, &scene.units.stress);
        let note = format!(
            "the load {load:.1e} {unit} on `{name}` is more than a tenth of E = {young:e} {unit}"
        );
        (load > LARGE_LOAD * young)
            .then(|| note + ": are the units consistent? (explain large-rotation)")
    }

    /// A note on the foundation that overlaps the body most at the start, as for a press fit.
    fn overlap(&self) -> Option<String> {
        let mesh = self.mesh();
        let least_gap = |boundary: &Boundary| {
            let Gap { distance, .. } = boundary.gap()?;
            let gaps = mesh.edges_of(&boundary.name).iter().flatten().map(|&node| {
                let [x, y] = mesh.nodes[node];
                distance.eval(x, y, self.scene().start())
            });
            Some(gaps.fold(0.0, f64::min))
        };
        let boundaries = self.scene().boundaries.iter();
        let gaps = boundaries.filter_map(|boundary| Some((least_gap(boundary)?, &boundary.name)));
        let (least, name) = gaps.min_by(|(a, _), (b, _)| a.total_cmp(b))?;
        (least < -OVERLAP * extent(&mesh.nodes)).then(|| {
            format!(
                "the body starts up to {:.3e} {} inside the foundation of `{name}` (a negative gap, as for a \
                 press fit); if that is not meant, check the sign of the gap (explain penetration)",
                -least,
                self.scene().units.length
            )
        })
    }

    /// A note on the ratio of the moduli of the stiffest and the softest material, if it is large.
    pub(crate) fn contrast(&self) -> Option<String> {
        let (scene, used) = (self.scene(), self.scene().materials_of(self.mesh()));
        let names = once("[material]".to_owned())
            .chain(scene.surfaces.keys().map(|name| format!("[material.{name}]")));
        let materials = scene.materials().map(|material| material.young).zip(names).zip(0..);
        let mut materials: Vec<_> =
            materials.filter(|(_, number)| used.contains(number)).map(|(of, _)| of).collect();
        materials.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let [(low, soft), .., (high, stiff)] = &materials[..] else { return None };
        let unit = &scene.units.stress;
        (high / low > CONTRAST).then(|| {
            format!(
                "E differs by a factor of {:.0e} between two materials: {high:e} {unit} in {stiff}, \
                 {low:e} {unit} in {soft}",
                high / low
            )
        })
    }

    /// A note on the triangle with the smallest angle, if this angle is small.
    fn sliver(&self) -> Option<String> {
        let (angle, at) = self.mesh().smallest_angle();
        let at = self.mesh().place(at);
        (angle < SLIVER).then(|| {
            format!("a triangle at {at} has an angle of {angle:.1e}°: mend the mesh there (explain meshes)")
        })
    }
}
