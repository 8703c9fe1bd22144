//! The mesh reader: whatever the bytes, a mesh that keeps its promises or a message.
#![no_main]

use libfuzzer_sys::fuzz_target;
use signorini::mesh::{parse, twice_area};
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    match parse(bytes, Path::new("fuzz.msh")) {
        Ok(mesh) => {
            assert!(mesh.nodes.iter().flatten().all(|x| x.is_finite()));
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|node| mesh.nodes[node]);
                assert!(twice_area(a, b, c) > 0.0, "a triangle without area");
            }
        }
        Err(error) => assert!(error.to_string().starts_with("fuzz.msh"), "{error}"),
    }
});
