//! Which module defines what a path names.

use crate::modules::Module;

/// What a path leads to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Found {
    Module(usize),
    /// An item, by the module that defines it.
    Item(usize),
}

/// The modules of a target, in which names are looked up.
pub(crate) struct Names<'a>(pub(crate) &'a [Module]);

impl Names<'_> {
    /// The module that defines the item to which a path in a module leads; none for a module, a local name or another crate's item.
    pub(crate) fn definer(&self, module: usize, path: &[String]) -> Option<usize> {
        match self.follow(module, path, &mut Vec::new())? {
            Found::Item(by) => Some(by),
            Found::Module(_) => None,
        }
    }

    /// Whether one module stands below another, at any depth.
    pub(crate) fn below(&self, module: usize, above: usize) -> bool {
        std::iter::successors(self.0[module].parent, |&m| self.0[m].parent).any(|m| m == above)
    }

    fn follow(&self, module: usize, path: &[String], seen: &mut Vec<(usize, String)>) -> Option<Found> {
        let mut found = Found::Module(module);
        for (k, name) in path.iter().enumerate() {
            // What follows an item is its variant, method or constant.
            let Found::Module(inside) = found else { break };
            found = match name.as_str() {
                "crate" if k == 0 => Found::Module(0),
                "self" if k == 0 => Found::Module(module),
                "super" => Found::Module(self.0[inside].parent?),
                _ => self.find(inside, name, k + 1 == path.len(), seen)?,
            };
        }
        Some(found)
    }

    /// A name within a module; one name may be a module's and an item's at once, and the last of a path is the item's.
    fn find(&self, module: usize, name: &str, last: bool, seen: &mut Vec<(usize, String)>) -> Option<Found> {
        let key = (module, name.to_owned());
        if seen.contains(&key) {
            return None;
        }
        seen.push(key);
        let here = &self.0[module];
        let child = here.children.get(name).map(|&c| Found::Module(c));
        let item = here.defined.contains(name).then_some(Found::Item(module));
        let own = if last { item.or(child) } else { child.or(item) };
        if own.is_some() && !(last && item.is_none()) {
            return own;
        }
        let mut imported = |glob: bool| {
            here.imports.iter().filter(|i| if glob { i.name == "*" } else { i.name == name }).find_map(|i| {
                let mut path = i.path.clone();
                path.extend(glob.then(|| name.to_owned()));
                self.follow(module, &path, seen)
            })
        };
        imported(false).or_else(|| imported(true)).or(own)
    }
}
