//! Texts of MSH 4.1 for tests.

use std::collections::BTreeSet;

/// A text file of version 4.1 with these physical groups (`dimension tag "name"`), nodes (`tag x y z`) and
/// elements (`tag type group nodes…`), each of which is a block of its own. Each group is an entity; what
/// is in group 0 is in none.
pub fn msh(names: &[&str], nodes: &[impl AsRef<str>], elements: &[impl AsRef<str>]) -> String {
    let mut entities = [const { BTreeSet::new() }; 4];
    let mut blocks = Vec::new();
    for element in elements {
        let words: Vec<&str> = element.as_ref().splitn(4, ' ').collect();
        let [tag, kind, group, nodes] = words[..] else { panic!("{words:?}") };
        let dimension = match kind {
            "15" => 0,
            "1" | "8" => 1,
            "4" => 3,
            _ => 2,
        };
        entities[dimension].insert(group.to_owned());
        blocks.push(format!("{dimension} {group} {kind} 1\n{tag} {nodes}\n"));
    }
    let entity = |dimension: usize, group: &str| {
        let bounds = if dimension == 0 { "0 0 0" } else { "0 0 0 0 0 0" };
        let groups = if group == "0" { "0".to_owned() } else { format!("1 {group}") };
        format!("{group} {bounds} {groups}{}\n", if dimension == 0 { "" } else { " 0" })
    };
    let listed: String = (entities.iter().enumerate())
        .flat_map(|(dimension, groups)| groups.iter().map(move |group| entity(dimension, group)))
        .collect();
    let counts = entities.each_ref().map(|groups| groups.len().to_string()).join(" ");
    let (tags, points): (Vec<_>, Vec<_>) =
        nodes.iter().filter_map(|node| node.as_ref().split_once(' ')).unzip();
    let named: String = names.iter().map(|name| format!("{name}\n")).collect();
    let (n, e) = (nodes.len(), elements.len());
    format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
         $PhysicalNames\n{}\n{named}$EndPhysicalNames\n\
         $Entities\n{counts}\n{listed}$EndEntities\n\
         $Nodes\n1 {n} 1 {n}\n2 1 0 {n}\n{}\n{}\n$EndNodes\n\
         $Elements\n{e} {e} 1 {e}\n{}$EndElements\n",
        names.len(),
        tags.join("\n"),
        points.join("\n"),
        blocks.concat(),
    )
}
