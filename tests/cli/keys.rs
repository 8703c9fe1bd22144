//! The reference of keys beside the shipped scenes is the program's.

use crate::test_directory::TestDirectory;
use std::{fs, path::Path};

#[test]
fn the_committed_reference_and_schema_are_what_the_program_prints() {
    let geo = Path::new(env!("CARGO_MANIFEST_DIR")).join("geo");
    for (file, arguments) in
        [("KEYS.md", &["keys"][..]), ("scene.schema.json", &["keys", "--schema"])]
    {
        let committed = fs::read_to_string(geo.join(file)).expect("it is there");
        let printed = TestDirectory::new().say(arguments).out;
        let mend = format!("target/release/signorini {} > geo/{file}", arguments.join(" "));
        assert!(committed == printed, "geo/{file} is out of date; make it again: {mend}");
    }
}
