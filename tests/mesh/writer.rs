//! A mesh that is written is read as the same mesh, by us and by gmsh.

use crate::common::{fixture, read_bytes};
use signorini::mesh::{Refinement, read};
use std::{fs, process::Command};

#[test]
fn what_is_written_is_read_back_number_by_number() {
    for name in ["plate-41", "disc-41"] {
        let mesh = Refinement::start(read(&fixture(name)).unwrap());
        let marked: Vec<bool> = (0..mesh.mesh.triangles.len()).map(|t| t % 3 == 0).collect();
        let mut mesh = mesh.refine(&marked).unwrap().mesh;
        mesh.curves.values_mut().for_each(|curve| curve.interior_edges = 0);
        let text = mesh.to_msh();
        assert_eq!(read_bytes(&text).unwrap(), mesh, "{name}");

        let folder = tempfile::tempdir().unwrap();
        let [from, to] = ["from.msh", "to.msh"].map(|file| folder.path().join(file));
        fs::write(&from, text).unwrap();
        let gmsh = ["-0", "-v", "1", "-format", "msh2", "-o"];
        let said = Command::new("gmsh").args(gmsh).arg(&to).arg(&from).output().unwrap();
        assert!(said.status.success() && said.stderr.is_empty(), "{said:?}");
        assert_eq!(read(&to).unwrap().triangles.len(), mesh.triangles.len(), "{name}");
    }
}
