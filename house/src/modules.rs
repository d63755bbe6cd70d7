//! The modules of a target as its files declare them, with the names that each defines, imports and uses.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};

use crate::Error;

/// A name that a `use` declaration brings into a module.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Import {
    /// The name in this module; `*` for all names.
    pub(crate) name: String,
    /// The path as it is written.
    pub(crate) path: Vec<String>,
    /// Whether other modules see it: it is handed on then, and need not be used here.
    pub(crate) handed_on: bool,
}

/// A module: a file, or a block within one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Module {
    /// The file that holds it.
    pub file: PathBuf,
    pub(crate) parent: Option<usize>,
    pub(crate) children: BTreeMap<String, usize>,
    pub(crate) defined: BTreeSet<String>,
    pub(crate) imports: Vec<Import>,
    /// Paths that its code names.
    pub(crate) named: BTreeSet<Vec<String>>,
}

/// The modules of the target with this root file, the root first; those of tests (`#[cfg(test)]`) are left out.
///
/// # Errors
/// Where a file is missing or is no Rust.
pub fn modules(root: &Path) -> Result<Vec<Module>, Error> {
    let mut reader = Reader { modules: Vec::new(), now: 0, folder: PathBuf::new(), failed: None };
    let beside = root.parent().unwrap_or(root).to_owned();
    reader.file(root, beside, None)?;
    Ok(reader.modules)
}

struct Reader {
    modules: Vec<Module>,
    /// The module that is being read.
    now: usize,
    /// Where the files of its children are.
    folder: PathBuf,
    failed: Option<Error>,
}

impl Reader {
    fn begin(&mut self, file: PathBuf, parent: Option<usize>) -> usize {
        self.modules.push(Module {
            file,
            parent,
            children: BTreeMap::new(),
            defined: BTreeSet::new(),
            imports: Vec::new(),
            named: BTreeSet::new(),
        });
        self.modules.len() - 1
    }

    fn file(&mut self, file: &Path, folder: PathBuf, parent: Option<usize>) -> Result<usize, Error> {
        let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
        let parsed = syn::parse_file(&text).map_err(|e| format!("{}: {e}", file.display()))?;
        let module = self.begin(file.to_owned(), parent);
        if !of_tests(&parsed.attrs) {
            self.inside(module, folder, &parsed.items);
        }
        self.failed.take().map_or(Ok(module), Err)
    }

    fn inside(&mut self, module: usize, folder: PathBuf, items: &[syn::Item]) {
        let before = (self.now, std::mem::replace(&mut self.folder, folder));
        self.now = module;
        items.iter().for_each(|item| self.visit_item(item));
        (self.now, self.folder) = before;
    }

    fn child(&mut self, item: &syn::ItemMod) -> Result<(), Error> {
        let name = item.ident.to_string();
        let below = self.folder.join(&name);
        let parent = self.now;
        let child = if let Some((_, items)) = &item.content {
            let module = self.begin(self.modules[parent].file.clone(), Some(parent));
            self.inside(module, below, items);
            module
        } else if let Some(path) = path_attribute(&item.attrs) {
            let file = self.modules[parent].file.with_file_name(path);
            let beside = file.parent().unwrap_or(&file).to_owned();
            self.file(&file, beside, Some(parent))?
        } else {
            let alone = self.folder.join(format!("{name}.rs"));
            let file = if alone.exists() { alone } else { below.join("mod.rs") };
            self.file(&file, below, Some(parent))?
        };
        self.modules[parent].children.insert(name, child);
        Ok(())
    }

    fn import(&mut self, tree: &syn::UseTree, before: &[String], handed_on: bool) {
        let with = |name: &syn::Ident| {
            let mut path = before.to_vec();
            // `a::{self}` is `a`.
            if path.is_empty() || name != "self" {
                path.push(name.to_string());
            }
            path
        };
        let (name, path) = match tree {
            syn::UseTree::Path(tree) => return self.import(&tree.tree, &with(&tree.ident), handed_on),
            syn::UseTree::Group(group) => {
                return group.items.iter().for_each(|tree| self.import(tree, before, handed_on));
            }
            syn::UseTree::Name(tree) => {
                let path = with(&tree.ident);
                (path.last().cloned().unwrap_or_default(), path)
            }
            syn::UseTree::Rename(tree) => (tree.rename.to_string(), with(&tree.ident)),
            syn::UseTree::Glob(_) => ("*".into(), before.to_vec()),
        };
        self.modules[self.now].imports.push(Import { name, path, handed_on });
    }

    fn name(&mut self, path: Vec<String>) {
        self.modules[self.now].named.insert(path);
    }

    /// Paths of two names and more among a macro's tokens, which syn does not parse.
    fn tokens(&mut self, tokens: TokenStream) {
        let (mut path, mut colons) = (Vec::new(), 0);
        for token in tokens {
            match token {
                TokenTree::Ident(name) if path.is_empty() || colons == 2 => {
                    path.push(name.to_string());
                    colons = 0;
                }
                TokenTree::Punct(p) if p.as_char() == ':' && !path.is_empty() => colons += 1,
                other => {
                    self.end_of_path(&mut path);
                    colons = 0;
                    match other {
                        TokenTree::Ident(name) => path.push(name.to_string()),
                        TokenTree::Group(group) => self.tokens(group.stream()),
                        _ => {}
                    }
                }
            }
        }
        self.end_of_path(&mut path);
    }

    fn end_of_path(&mut self, path: &mut Vec<String>) {
        let path = std::mem::take(path);
        if path.len() > 1 {
            self.name(path);
        }
    }
}

impl<'a> Visit<'a> for Reader {
    fn visit_item(&mut self, item: &'a syn::Item) {
        let Some((attributes, name)) = attributes_and_name(item) else {
            return visit::visit_item(self, item);
        };
        if of_tests(attributes) {
            return;
        }
        if let Some(name) = name {
            self.modules[self.now].defined.insert(name.to_string());
        }
        visit::visit_item(self, item);
    }

    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        if let Err(error) = self.child(item) {
            self.failed.get_or_insert(error);
        }
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        if item.leading_colon.is_none() {
            self.import(&item.tree, &[], !matches!(item.vis, syn::Visibility::Inherited));
        }
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        self.name(path.segments.iter().map(|s| s.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, called: &'a syn::Macro) {
        visit::visit_macro(self, called);
        self.tokens(called.tokens.clone());
    }

    fn visit_impl_item_fn(&mut self, item: &'a syn::ImplItemFn) {
        if !of_tests(&item.attrs) {
            visit::visit_impl_item_fn(self, item);
        }
    }

    // `pub(in path)` and `#[attribute]` name no item of another file.
    fn visit_visibility(&mut self, _: &'a syn::Visibility) {}
    fn visit_attribute(&mut self, _: &'a syn::Attribute) {}
}

/// An item's attributes, and the name that it defines in its module.
fn attributes_and_name(item: &syn::Item) -> Option<(&[syn::Attribute], Option<&syn::Ident>)> {
    Some(match item {
        syn::Item::Const(i) => (&i.attrs, Some(&i.ident)),
        syn::Item::Enum(i) => (&i.attrs, Some(&i.ident)),
        syn::Item::Fn(i) => (&i.attrs, Some(&i.sig.ident)),
        syn::Item::Impl(i) => (&i.attrs, None),
        syn::Item::Macro(i) => (&i.attrs, i.ident.as_ref()),
        syn::Item::Mod(i) => (&i.attrs, None),
        syn::Item::Static(i) => (&i.attrs, Some(&i.ident)),
        syn::Item::Struct(i) => (&i.attrs, Some(&i.ident)),
        syn::Item::Trait(i) => (&i.attrs, Some(&i.ident)),
        syn::Item::Type(i) => (&i.attrs, Some(&i.ident)),
        syn::Item::Union(i) => (&i.attrs, Some(&i.ident)),
        syn::Item::Use(i) => (&i.attrs, None),
        _ => return None,
    })
}

/// Whether what bears these attributes is compiled for tests only.
pub(crate) fn of_tests(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().filter(|a| a.path().is_ident("cfg")).any(|a| match &a.meta {
        syn::Meta::List(list) => {
            let condition = list.tokens.to_string();
            condition == "test" || (condition.starts_with("all") && condition.contains("test"))
        }
        _ => false,
    })
}

/// The file that `#[path = "..."]` names.
fn path_attribute(attributes: &[syn::Attribute]) -> Option<String> {
    attributes.iter().filter(|a| a.path().is_ident("path")).find_map(|a| match &a.meta {
        syn::Meta::NameValue(syn::MetaNameValue {
            value: syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(path), .. }),
            ..
        }) => Some(path.value()),
        _ => None,
    })
}
