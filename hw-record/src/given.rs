use std::net::SocketAddr;

use crate::error::SourceError;

/// What is expected, in a line.
const EXPECTED: &str = "[NAME:]KIND=ADDRESS[?KEY=VALUE&...] with a KIND of ati, ur, robotiq (HOST:PORT), dynamixel, dcon (HOST:PORT or \
                        PORT@BAUD), depth (FOLDER), wav (FILE) or microphones";

/// A device in words: `NAME:KIND=ADDRESS?KEY=VALUE&KEY=VALUE`.
pub(crate) struct Given {
    given: String,
    pub(crate) name: String,
    pub(crate) kind: String,
    pub(crate) address: String,
    more: Vec<(String, String)>,
}

impl Given {
    pub(crate) fn parse(given: &str) -> Result<Self, SourceError> {
        let wrong = || SourceError::Words { given: given.to_owned(), expected: EXPECTED.to_owned() };
        let (what, rest) = given.split_once('=').ok_or_else(wrong)?;
        let (name, kind) = what.split_once(':').unwrap_or((what, what));
        // A name is that of a file as well.
        let plain = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || !name.chars().all(plain) {
            return Err(wrong());
        }
        let (address, more) = rest.split_once('?').unwrap_or((rest, ""));
        let pair = |word: &str| word.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned()));
        let more: Option<Vec<_>> = more.split('&').filter(|w| !w.is_empty()).map(pair).collect();
        Ok(Self {
            given: given.to_owned(),
            name: name.to_owned(),
            kind: kind.to_owned(),
            address: address.to_owned(),
            more: more.ok_or_else(wrong)?,
        })
    }

    pub(crate) fn wrong(&self) -> SourceError {
        SourceError::Words { given: self.given.clone(), expected: EXPECTED.to_owned() }
    }

    pub(crate) fn socket(&self) -> Result<SocketAddr, SourceError> {
        self.address.parse().map_err(|_| self.wrong())
    }

    fn value<T: std::str::FromStr>(&self, key: &str) -> Result<Option<T>, SourceError> {
        let found =
            self.more.iter().find(|(k, _)| k == key).map(|(_, v)| v.parse().map_err(|_| self.wrong()));
        found.transpose()
    }

    /// A number, or the usual one where none is given.
    pub(crate) fn number(&self, key: &str, usual: f64) -> Result<f64, SourceError> {
        Ok(self.value(key)?.unwrap_or(usual))
    }

    pub(crate) fn whole(&self, key: &str, usual: u8) -> Result<u8, SourceError> {
        Ok(self.value(key)?.unwrap_or(usual))
    }

    pub(crate) fn needed(&self, key: &str) -> Result<f64, SourceError> {
        let missing =
            || SourceError::Words { given: self.given.clone(), expected: format!("{key}= in its address") };
        self.value(key)?.ok_or_else(missing)
    }
}
