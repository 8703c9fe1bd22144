//! Errors of scenes, as messages for their authors.

/// The largest number of problems that are shown. Further ones are only counted.
pub(super) const MOST_SHOWN: usize = 20;

/// The problems of a scene, at least one. Each names the file and line (or the `--set`), the full key, what
/// is wrong and what to write instead, and shows the underlined line. In the text the first problem has no
/// prefix, the others follow `error: `.
#[derive(Debug, thiserror::Error)]
#[error("{}", listed(.0))]
pub struct SceneError(pub Vec<String>);

fn listed(problems: &[String]) -> String {
    let shown = problems[..problems.len().min(MOST_SHOWN)].join("\nerror: ");
    match problems.len().saturating_sub(MOST_SHOWN) {
        0 => shown,
        more => format!("{shown}\nerror: there are {more} more problems"),
    }
}
