//! What is hidden in a recording, and the answer that goes with it.

/// The kind of effect that is hidden in a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Hidden {
    /// Nothing: noise and nuisances alone.
    Nothing,
    /// One mechanism of the domain's list.
    One,
    /// Two mechanisms of the list.
    Two,
    /// An effect that is not on the list.
    Unlisted,
    /// One strong mechanism of the list with a smaller effect that is not on it.
    Leftover,
    /// A strong effect that is not on the list, of which the best mechanism on it takes away 40 to 85 % of the squares.
    Imitated,
    /// An effect that is not on the list and acts at a place only: the key says where.
    Local,
}

impl Hidden {
    /// How many mechanisms of the list are at work.
    pub(crate) const fn listed(self) -> usize {
        match self {
            Self::Nothing | Self::Unlisted | Self::Imitated | Self::Local => 0,
            Self::One | Self::Leftover => 1,
            Self::Two => 2,
        }
    }

    /// Whether something is at work that is not on the list.
    pub(crate) const fn unlisted(self) -> bool {
        matches!(self, Self::Unlisted | Self::Leftover | Self::Imitated | Self::Local)
    }

    /// The kind that stands in for this one where no world has a leftover or an imitation.
    pub(crate) const fn without_leftovers(self) -> Self {
        match self {
            Self::Leftover => Self::One,
            Self::Imitated => Self::Unlisted,
            other => other,
        }
    }
}

/// A recording with its answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Concealed {
    /// The files of the recording's folder: name and contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// The answer.
    pub key: Key,
}

impl Concealed {
    /// The recording without all but its first runs (at least one), where it is a table; sounds stay as they are. A table's runs follow each
    /// other.
    pub fn first_runs(mut self, count: usize) -> Self {
        for (_, contents) in self.files.iter_mut().filter(|(name, _)| name == "data.csv") {
            let text = String::from_utf8_lossy(contents);
            let mut lines = text.lines();
            let header = lines.next().unwrap_or_default();
            let (mut run, mut runs) = ("", 0);
            let kept = lines.take_while(|line| {
                let label = line.split(',').next().unwrap_or_default();
                runs += usize::from(label != run);
                run = label;
                runs <= count.max(1)
            });
            *contents = std::iter::once(header)
                .chain(kept)
                .map(|line| format!("{line}\n"))
                .collect::<String>()
                .into_bytes();
        }
        self
    }

    /// A recording of one table.
    pub(crate) fn table(header: String, data: String, key: Key) -> Self {
        let files = [("recording.toml", header), ("data.csv", data)];
        Self { files: files.map(|(name, text)| (name.to_owned(), text.into_bytes())).into(), key }
    }
}

/// The answer: what was hidden in a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// The kind of world.
    pub hidden: Hidden,
    /// Identifiers of the listed mechanisms at work, in alphabetical order.
    pub mechanisms: Vec<String>,
    /// Identifiers of companions: mechanisms that may be named beside those at work or not (the drag through which a wind acts).
    pub beside: Vec<String>,
    /// Parameters of the mechanisms at work, by the names of the recordings' format.
    pub parameters: Vec<HiddenParameter>,
    /// The unlisted effect in words.
    pub unlisted: Option<String>,
    /// Where a local effect acts.
    pub place: Option<Place>,
    /// Single events at which it acts, as run and number of the row: each acts at this row or between it and the next.
    pub events: Vec<(String, f64)>,
    /// Strength of the hidden effects, where the maker knows it: the root of the sum of squares of their response in the readings,
    /// in sigmas of white noise, less the part that the baseline's nuisance parameters can take away (and, for an unlisted effect,
    /// any two listed mechanisms with them).
    pub strength: Option<f64>,
    /// Strength of an unlisted effect beside a listed one, less the part that the latter can take away.
    pub leftover: Option<f64>,
}

impl Key {
    /// An answer without parameters or place.
    pub fn new(hidden: Hidden) -> Self {
        Self {
            hidden,
            mechanisms: Vec::new(),
            beside: Vec::new(),
            parameters: Vec::new(),
            unlisted: None,
            place: None,
            events: Vec::new(),
            strength: None,
            leftover: None,
        }
    }

    /// Adds a mechanism at work, with its parameters.
    pub fn add(&mut self, mechanism: &str, parameters: &[(&str, f64)]) {
        self.mechanisms.push(mechanism.into());
        self.mechanisms.sort();
        self.parameters.extend(parameters.iter().map(|&(name, value)| HiddenParameter {
            mechanism: mechanism.into(),
            name: name.into(),
            value,
        }));
    }

    /// States the share of the runs in which an impact went unheard, as the format asks for: that of these very runs.
    pub(crate) fn state_missed(&mut self, unheard: usize, runs: usize) {
        let missed = self.parameters.iter_mut().filter(|p| p.mechanism == "missed-impact");
        missed.for_each(|p| p.value = unheard as f64 / runs as f64);
    }

    /// Takes a mechanism and its parameters out again.
    pub(crate) fn remove(&mut self, mechanism: &str) {
        self.mechanisms.retain(|m| m != mechanism);
        self.parameters.retain(|p| p.mechanism != mechanism);
    }
}

/// A parameter of a hidden mechanism.
#[derive(Debug, Clone, PartialEq)]
pub struct HiddenParameter {
    /// Identifier of the mechanism.
    pub mechanism: String,
    /// Name with its unit as a suffix.
    pub name: String,
    /// True value.
    pub value: f64,
}

/// Where a local effect acts: the readings change at those ends of the interval that lie within the recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Name of the variable.
    pub variable: String,
    /// Start of the interval; `-inf` for the beginning.
    pub from: f64,
    /// End of the interval; `inf` for the end.
    pub to: f64,
    /// Labels of the runs in which it acts; empty for all of them.
    pub runs: Vec<String>,
}

impl Place {
    /// A place in all runs.
    pub fn new(variable: &str, from: f64, to: f64) -> Self {
        Self { variable: variable.into(), from, to, runs: Vec::new() }
    }

    /// The same place in some runs only.
    #[must_use]
    pub fn in_runs(self, runs: impl IntoIterator<Item = String>) -> Self {
        Self { runs: runs.into_iter().collect(), ..self }
    }

    /// The same place in those of a recording's runs (by their labels) that show it; in all where all do, or none does.
    pub(crate) fn in_the_runs(self, shown: impl IntoIterator<Item = (String, bool)>) -> Self {
        let (there, elsewhere): (Vec<_>, Vec<_>) = shown.into_iter().partition(|(_, shows)| *shows);
        if elsewhere.is_empty() { self } else { self.in_runs(there.into_iter().map(|(run, _)| run)) }
    }
}
