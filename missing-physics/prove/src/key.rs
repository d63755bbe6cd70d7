//! The sealed answers, one line each.

use serde_json::json;
use worlds::concealed::{Hidden, Key};

/// The word for a kind of world.
pub(super) fn word(hidden: Hidden) -> &'static str {
    match hidden {
        Hidden::Nothing => "nothing",
        Hidden::One => "one",
        Hidden::Two => "two",
        Hidden::Unlisted => "unlisted",
        Hidden::Leftover => "leftover",
        Hidden::Imitated => "imitated",
        Hidden::Local => "local",
    }
}

/// The kind of world of a word.
pub(super) fn hidden(wanted: &str) -> Option<Hidden> {
    use Hidden::{Imitated, Leftover, Local, Nothing, One, Two, Unlisted};
    [Nothing, One, Two, Unlisted, Leftover, Imitated, Local]
        .into_iter()
        .find(|hidden| word(*hidden) == wanted)
}

/// An answer as a line of JSON.
pub(super) fn to_json(world: &str, key: &Key) -> String {
    let parameters: Vec<_> = key
        .parameters
        .iter()
        .map(|p| json!({"mechanism": p.mechanism, "name": p.name, "value": p.value}))
        .collect();
    let place = key
        .place
        .as_ref()
        .map(|p| json!({"variable": p.variable, "from": p.from, "to": p.to, "runs": p.runs}));
    let line = json!({"world": world, "hidden": word(key.hidden), "mechanisms": key.mechanisms,
        "beside": key.beside,
        "parameters": parameters, "unlisted": key.unlisted, "place": place, "events": key.events,
        "strength": key.strength, "leftover": key.leftover});
    format!("{line}\n")
}
