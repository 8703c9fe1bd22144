//! `signorini explain TOPIC…`: the beginnings of the how-to pages, which notes name.

use super::Failure;
use signorini::{output::terminal::say, suggestion::suggestion};

/// The pages of geo/how-to by their topics.
macro_rules! pages {
    ($($topic:literal)*) => {
        &[$(($topic, include_str!(concat!("../../geo/how-to/", $topic, ".md")))),*]
    };
}

const PAGES: &[(&str, &str)] = pages!(
    "bars" "singular" "not-resolved" "locking" "collapse" "large-rotation" "penetration" "loads" "meshes" "studies"
    "pictures" "python" "matrices" "solvers" "petsc-options" "accuracy" "faster" "restart" "ranks" "cluster" "paper"
    "own-solver" "own-law" "stop" "cite"
);

/// The number of lines of a page that are shown.
const FIRST_LINES: usize = 20;

/// Shows the beginnings of the pages on some topics, or the list of all topics.
pub fn explain(topics: &[String]) -> Result<(), Failure> {
    for (topic, page) in PAGES.iter().filter(|_| topics.is_empty()) {
        let title = page.lines().next().unwrap_or_default();
        say(&format!("{topic:<16} {}", title.trim_start_matches("# ")));
    }
    for asked in topics {
        let Some((topic, page)) = PAGES.iter().find(|(topic, _)| topic == asked) else {
            let near = suggestion(asked, &Vec::from_iter(PAGES.iter().map(|(topic, _)| topic)));
            return Err(Failure::input(format!("there is no topic `{asked}`{near}")));
        };
        page.lines().take(FIRST_LINES).for_each(say);
        if page.lines().count() > FIRST_LINES {
            say(&format!("… more in geo/how-to/{topic}.md"));
        }
    }
    Ok(())
}
