//! What can be wrong with a scene, said to the person who wrote it.

/// More problems than this are counted, not shown.
pub(super) const MOST_SHOWN: usize = 20;

/// Why a scene was refused: its problems, at least one. Each tells the file and line (or the `--set`), the
/// key in full, what is wrong and what to write instead, and shows the line underlined. The first is
/// displayed as it is, the others after `error: `.
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
