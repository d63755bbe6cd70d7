//! Files of a target that import each other in a loop.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use petgraph::algo::tarjan_scc;
use petgraph::graphmap::DiGraphMap;

use crate::modules::Module;
use crate::names::Names;

/// The items for which a file needs another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edge<'a> {
    /// The file whose code names them.
    pub from: &'a Path,
    /// The file that defines them.
    pub to: &'a Path,
    /// Their names.
    pub items: BTreeSet<String>,
}

/// Files each of which needs the others, and the imports by which they do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Circle<'a> {
    /// The files, sorted.
    pub files: Vec<&'a Path>,
    /// The imports among them, sorted.
    pub edges: Vec<Edge<'a>>,
}

/// All circles of a target.
///
/// A file needs the one that *defines* an item which its code names or imports. What it only hands on (`mod child; pub use
/// child::Item;`) it does not need, and an import of a re-exported name leads to the definition. A module is made of the modules
/// below it: that it calls them is no arrow, that they take what it defines is one.
pub fn circles(modules: &[Module]) -> Vec<Circle<'_>> {
    let arrows = arrows(modules);
    let graph = DiGraphMap::<&Path, ()>::from_edges(arrows.keys().copied());
    let mut circles: Vec<Circle<'_>> = tarjan_scc(&graph)
        .into_iter()
        .filter(|files| files.len() > 1)
        .map(|mut files| {
            files.sort_unstable();
            let within = |(from, to): &(&Path, &Path)| files.contains(from) && files.contains(to);
            let edges = arrows.iter().filter(|(ends, _)| within(ends));
            let edges = edges.map(|(&(from, to), items)| Edge { from, to, items: items.clone() }).collect();
            Circle { files, edges }
        })
        .collect();
    circles.sort_by(|a, b| a.files.cmp(&b.files));
    circles
}

/// The names for which one file needs another, by both files.
fn arrows(modules: &[Module]) -> BTreeMap<(&Path, &Path), BTreeSet<String>> {
    let names = Names(modules);
    let mut arrows: BTreeMap<_, BTreeSet<String>> = BTreeMap::new();
    for (k, module) in modules.iter().enumerate() {
        let imported = module.imports.iter().filter(|i| !i.handed_on && i.name != "*").map(|i| &i.path);
        for path in imported.chain(&module.named) {
            let Some(by) = names.definer(k, path).filter(|&by| !names.below(by, k)) else { continue };
            let ends = (&*module.file, &*modules[by].file);
            if ends.0 != ends.1 {
                arrows.entry(ends).or_default().extend(path.last().cloned());
            }
        }
    }
    arrows
}

impl std::fmt::Display for Circle<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let root = crate::root();
        let short = |path: &Path| path.strip_prefix(&root).unwrap_or(path).display().to_string();
        writeln!(f, "{} files import each other:", self.files.len())?;
        for edge in &self.edges {
            let items: Vec<&str> = edge.items.iter().map(String::as_str).collect();
            writeln!(f, "  {} -> {}: {}", short(edge.from), short(edge.to), items.join(", "))?;
        }
        Ok(())
    }
}
