//! Errors of scenes, as messages for their authors.

/// The problems of a scene, at least one. Each names the file and line (or the `--set`), the full key, what
/// is wrong and what to write instead, and shows the underlined line. In the text the first problem has no
/// prefix, the others follow `error: `.
#[derive(thiserror::Error)]
#[error("{}", .0.join("\nerror: "))]
pub struct SceneError(pub Vec<String>);

debug_is_message!(SceneError);
