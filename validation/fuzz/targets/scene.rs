//! The scene parser: a scene that can be written and read again, or a message.
#![no_main]

use libfuzzer_sys::fuzz_target;
use signorini::scene::Scene;
use std::path::Path;

fuzz_target!(|text: &str| {
    let path = Path::new("fuzz.toml");
    match Scene::parse(text, path, &[]) {
        Ok(scene) => {
            let (again, _) = scene.as_run();
            Scene::parse(&again, path, &[]).expect("what is written can be read");
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
