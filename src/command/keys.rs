//! `signorini keys`: the reference of all keys of a scene, in Markdown or as a JSON schema.

use super::Failure;
use signorini::{output::terminal::say, scene::SCHEMA};

/// Made of the schema by scripts/keys.py.
const PAGE: &str = include_str!("../../geo/KEYS.md");

/// `signorini keys [--schema]`.
pub fn keys(as_schema: bool) -> Result<(), Failure> {
    say(if as_schema { SCHEMA } else { PAGE }.trim_end());
    Ok(())
}
