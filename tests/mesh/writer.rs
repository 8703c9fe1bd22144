//! A mesh that is written is read as the same mesh, by us and by gmsh.

use crate::common::{close, fixture, read_bytes, triangle_areas};
use signorini::mesh::{Mesh, Refinement, read};
use std::{fs, process::Command};

#[test]
fn what_is_written_is_read_back_number_by_number() {
    for name in ["plate-41", "disc-41"] {
        let mesh = Refinement::start(read(&fixture(name)).unwrap());
        let marked: Vec<bool> = (0..mesh.mesh.triangles.len()).map(|t| t % 3 == 0).collect();
        let mut mesh = mesh.refine(&marked).unwrap().mesh;
        mesh.curves.values_mut().for_each(|curve| curve.other_edges = 0);
        let text = mesh.to_msh();
        assert_eq!(read_bytes(&text).unwrap(), mesh, "{name}");

        let folder = tempfile::tempdir().unwrap();
        let [from, to] = ["from.msh", "to.msh"].map(|file| folder.path().join(file));
        // gmsh takes a triangle for several ones if it is listed for several surfaces.
        mesh.surfaces.clear();
        fs::write(&from, mesh.to_msh()).unwrap();
        let gmsh = ["-0", "-v", "1", "-format", "msh2", "-o"];
        let said = Command::new("gmsh").args(gmsh).arg(&to).arg(&from).output().unwrap();
        assert!(said.status.success() && said.stderr.is_empty(), "{said:?}");
        assert_eq!(read(&to).unwrap().triangles.len(), mesh.triangles.len(), "{name}");
    }
}

#[test]
fn surfaces_are_refined_written_and_read_whatever_they_have_in_common() {
    let mut mesh = read(&fixture("plate-41")).unwrap();
    let count = mesh.triangles.len();
    mesh.surfaces = [("all", 0..count), ("first", 0..count / 3), ("some", count / 4..count / 2)]
        .map(|(name, triangles)| (name.to_owned(), triangles.collect()))
        .into();
    let area = |mesh: &Mesh, name: &str| {
        let areas: Vec<f64> = triangle_areas(mesh).collect();
        mesh.surfaces[name].iter().map(|&t| areas[t]).sum::<f64>()
    };
    let marked: Vec<bool> = (0..count).map(|t| t % 3 == 0).collect();
    let refined = Refinement::start(mesh.clone()).refine(&marked).unwrap().mesh;
    let again = read_bytes(refined.to_msh()).unwrap();
    assert_eq!(again.surfaces, refined.surfaces);
    for name in ["all", "first", "some"] {
        close(area(&refined, name), area(&mesh, name));
    }
}
