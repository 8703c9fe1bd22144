//! Errors against a reference solution: nested meshes, norms on them, the file the reference is
//! kept in, and the orders they show.

mod converge;
mod nested;
mod norms;
mod sampler;
mod store;

use signorini::{evolution::StepRecord, petsc::Session};
use signorini_study::{Reference, ReferenceOptions, ReferenceSpec, StudyError};
use std::{fs, path::Path};
use tempfile::TempDir;

/// A folder with a copy of a scene of geo/ and its geometry, where meshes can be made.
struct Study {
    folder: TempDir,
    scene: &'static str,
}

impl Study {
    fn of(scene: &'static str, geometry: &str) -> Self {
        // MPI changes the environment while it starts: no test may start gmsh at that moment.
        drop(Session::start(&[]).unwrap());
        let folder = tempfile::tempdir().unwrap();
        for file in [format!("{scene}.toml"), geometry.to_owned()] {
            let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../geo").join(&file);
            fs::copy(shipped, folder.path().join(file)).unwrap();
        }
        Self { folder, scene }
    }

    fn try_spec(
        &self,
        set: &[&str],
        options: ReferenceOptions,
    ) -> Result<ReferenceSpec, StudyError> {
        let path = self.folder.path().join(self.scene).with_extension("toml");
        let set: Vec<String> = set.iter().map(|&set| set.to_owned()).collect();
        ReferenceSpec::new(&path, &set, &options)
    }

    fn spec(&self, options: ReferenceOptions) -> ReferenceSpec {
        self.try_spec(&[], options).unwrap()
    }

    /// Computes the states of the reference; its steps.
    fn compute(&self, spec: &ReferenceSpec) -> Vec<StepRecord> {
        let session = Session::start(&[]).unwrap();
        let mut steps = Vec::new();
        spec.compute(&session, self.folder.path(), &mut |step| steps.push(*step)).unwrap();
        steps
    }

    fn load(&self, spec: &ReferenceSpec) -> Reference {
        spec.load(self.folder.path()).unwrap()
    }
}

/// The coarsest mesh `size` refined so often, with steps k.
fn options(size: f64, refinements: usize, step: f64) -> ReferenceOptions {
    ReferenceOptions { size: Some(size), refinements, step: Some(step), ..Default::default() }
}
