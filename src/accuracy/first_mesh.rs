//! The mesh from which the rounds start: coarse, and finer where arcs follow another smooth curve.

use crate::{
    mesh::{self, Kink, Mesh, MeshError, Order},
    scene::{Boundary, Condition, MeshSource, Scene},
};
use std::collections::HashSet;

/// The angle, rad, at which arcs along a smooth curve may meet, over the accuracy. A note tells twice as large ones.
const KINK: f64 = 0.1;

/// The angles at which arcs meet along the curves of a mesh, and the allowed ones. Contact presses on a small part of a
/// curve, where it may turn by a hundredth only: the angles must be much smaller there.
pub fn kinks(scene: &Scene, mesh: &Mesh, accuracy: f64) -> Vec<(f64, Kink)> {
    const IN_CONTACT: f64 = 0.03;
    let nodes_where = |is_so: &dyn Fn(&Boundary) -> bool| -> HashSet<usize> {
        let named = scene.boundaries.iter().filter(|boundary| is_so(boundary));
        named.flat_map(|boundary| mesh.edges_of(&boundary.name)).flatten().copied().collect()
    };
    let touching = nodes_where(&|boundary| boundary.gap().is_some());
    let mirror = nodes_where(&|boundary| {
        boundary.conditions.iter().any(|condition| matches!(condition, Condition::Symmetry))
    });
    let part = |kink: &Kink| if touching.contains(&kink.node) { IN_CONTACT } else { 1.0 };
    let allowed = |kink: Kink| (KINK * accuracy * part(&kink), kink);
    let is_meant = |kink: &Kink| !kink.is_mirrored || mirror.contains(&kink.node);
    mesh.kinks().into_iter().filter(is_meant).map(allowed).collect()
}

/// The mesh of a `.geo` from which the adaptation to an accuracy starts. Its order is 2 also for linear elements, so
/// that refined sides stay on the arcs through the nodes of this mesh.
///
/// Where arcs follow another smooth curve, they meet at a small angle, which stays. Stresses at an angle δ grow like
/// h^(−δ/π), about. So the mesh becomes finer there until these angles are a tenth of the accuracy; they fall like h³.
///
/// # Errors
/// gmsh cannot mesh the `.geo`.
pub fn first_mesh(scene: &Scene, accuracy: f64) -> Result<Mesh, MeshError> {
    /// Triangles along the body. Their number is doubled, at most up to the second value, while curved sides of a hole fold some of
    /// them, or while some are slivers between a small size at a point and large sizes beside it.
    const CELLS: f64 = 4.0;
    const MOST_CELLS: f64 = 64.0;
    /// A mesh has slivers if its smallest angle is below this part of that of the usual mesh. Bisection keeps slivers.
    const THINNER: f64 = 0.25;
    /// Meshes that are graded towards angles, as the third power holds for small ones, corners stay, and gmsh may fail.
    const GRADINGS: usize = 8;
    let MeshSource { file, parameters, .. } = &scene.mesh;
    let usual = mesh::load(file, parameters, Order::Linear)?;
    let scaling = mesh::scaling_factor(file)?;
    let mut parameters = parameters.clone();
    let mut of_cells = |cells: f64| {
        parameters.insert("size".to_owned(), mesh::extent(&usual.nodes) / scaling / cells);
        mesh::load(file, &parameters, Order::Quadratic)
    };
    let thin = THINNER * usual.smallest_angle().0;
    let mut cells = CELLS;
    let mut first = loop {
        match of_cells(cells) {
            Err(MeshError::File { .. }) if cells < MOST_CELLS => cells *= 2.0,
            Ok(mesh) if cells < MOST_CELLS && mesh.smallest_angle().0 < thin => cells *= 2.0,
            made => break made?,
        }
    };
    // The smallest ratio of the sizes in one grading. gmsh fails at some strong ones.
    let mut ratio = 0.25_f64;
    for grading in 0..GRADINGS {
        // The same faults are reported for the last mesh.
        let _ = scene.name_edges(&mut first);
        // The end of a slender ellipse is no corner, though it looks like one on the first meshes.
        let is_corner = |kink: &Kink| grading >= 2 && kink.is_corner;
        let is_rough = |(allowed, kink): &(f64, Kink)| kink.angle > *allowed && !is_corner(kink);
        let rough = kinks(scene, &first, accuracy).into_iter().filter(is_rough);
        let size = |(allowed, kink): (f64, Kink)| {
            (kink.node, kink.length * (0.5 * allowed / kink.angle).cbrt().max(ratio))
        };
        let wanted = Vec::from_iter(rough.map(size));
        if wanted.is_empty() {
            break;
        }
        let sizes = (&first, &first.graded_sizes(wanted)[..]);
        first = match mesh::load_graded(file, &parameters, Order::Quadratic, sizes) {
            Ok(finer) => finer,
            Err(MeshError::File { .. }) => {
                ratio = ratio.sqrt();
                continue;
            }
            Err(error) => return Err(error),
        };
    }
    Ok(first)
}
