//! Errors against a reference solution: nested meshes, norms on them, the file the reference is
//! kept in, and the orders they show.

mod chart;
mod converge;
mod front;
mod nested;
mod norms;
mod store;

use signorini_study::{ReferenceOptions, ReferenceSpec, StudyError};
use std::{fs, path::Path};
use tempfile::TempDir;

/// A folder with a copy of a scene of geo/ and its geometry, where meshes can be made.
struct Study {
    folder: TempDir,
    scene: &'static str,
}

impl Study {
    fn of(scene: &'static str, geometry: &str) -> Self {
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
}

/// The coarsest mesh `size` refined so often, with steps k.
fn options(size: f64, refinements: usize, step: f64) -> ReferenceOptions {
    ReferenceOptions { size: Some(size), refinements, step: Some(step), ..Default::default() }
}
