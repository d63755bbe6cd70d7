//! What a domain wants of a table, and by which names people call it.

use std::path::Path;

use missing_physics_domains::recording::{LARGEST_FILE, quoted};
use missing_physics_domains::{self as domains, Domain};

use crate::error::ImportError;
use crate::units::{self, Unit};

/// A column that a domain reads.
#[derive(Debug, Clone)]
pub(crate) struct Target {
    /// Its name in the recording.
    pub(crate) name: String,
    /// The SI unit that its name ends in.
    pub(crate) unit: Option<Unit>,
    /// Whether it holds labels.
    pub(crate) label: bool,
    /// What people call it, words between spaces, the surest first.
    pub(crate) called: Vec<&'static str>,
}

/// What is wanted of the files.
pub(crate) struct Wanted {
    pub(crate) domain: &'static dyn Domain,
    pub(crate) targets: Vec<Target>,
    /// The header that is taken over from another recording.
    pub(crate) like: Option<Like>,
    /// The columns that this header names.
    pub(crate) named: Vec<String>,
}

/// Another recording's header.
pub(crate) struct Like {
    pub(crate) text: String,
    pub(crate) data: String,
}

/// What people call the columns of the domains, without units.
const CALLED: [(&str, &[&str]); 33] = [
    (
        "run",
        &[
            "run",
            "trial",
            "versuch",
            "throw",
            "drop",
            "episode index",
            "experiment",
            "episode",
            "sweep",
            "curve",
            "wurf",
            "lauf",
            "messung",
            "specimen",
            "probe",
            "sample id",
            "take",
            "shot",
            "test",
            "essai",
            "id",
        ],
    ),
    (
        "t_s",
        &[
            "t",
            "time",
            "zeit",
            "timestamp",
            "temps",
            "tiempo",
            "tempo",
            "elapsed",
            "time stamp",
            "date time",
            "datetime",
            "uhrzeit",
            "seconds",
            "stamp",
        ],
    ),
    (
        "z_m",
        &[
            "z",
            "height",
            "hoehe",
            "altitude",
            "elevation",
            "position z",
            "translation z",
            "pos z",
            "z pos",
            "z position",
            "hauteur",
            "altura",
            "y",
        ],
    ),
    ("x_m", &["x", "position x", "translation x", "pos x", "x pos", "x position"]),
    ("y_m", &["y", "position y", "translation y", "pos y", "y pos", "y position"]),
    (
        "accel_z_m_s2",
        &[
            "accel z",
            "acc z",
            "az",
            "a z",
            "acceleration z",
            "linear acceleration z",
            "accelerometer z",
            "beschleunigung z",
            "z acceleration",
            "acceleration",
            "beschleunigung",
            "accel",
        ],
    ),
    ("spin_x_rad_s", &["spin x", "omega x", "angular velocity x", "gyro x", "wx"]),
    ("spin_y_rad_s", &["spin y", "omega y", "angular velocity y", "gyro y", "wy"]),
    ("spin_z_rad_s", &["spin z", "omega z", "angular velocity z", "gyro z", "wz"]),
    ("theta_rad", &["theta", "tilt", "tilt angle", "angle", "winkel", "neigung", "kippwinkel", "pitch"]),
    ("fx_n", &["fx", "force x", "f x", "x force", "kraft x", "sideways force"]),
    ("fy_n", &["fy", "force y", "f y", "y force", "kraft y", "upward force"]),
    (
        "tau_z_nm",
        &[
            "tau z",
            "torque z",
            "tz",
            "mz",
            "m z",
            "moment z",
            "torque",
            "moment",
            "drehmoment",
            "tau",
            "z torque",
        ],
    ),
    ("volume_m3", &["volume", "volumen", "filled volume", "fill volume"]),
    (
        "delta_m",
        &[
            "delta",
            "indentation",
            "indentation depth",
            "depth",
            "displacement",
            "eindringtiefe",
            "tiefe",
            "weg",
            "travel",
            "extension",
            "deflection",
            "position",
            "crosshead",
            "z",
            "position z",
        ],
    ),
    (
        "force_n",
        &["force", "kraft", "load", "normal force", "f", "fz", "force z", "last", "f n", "standard force"],
    ),
    ("segment", &["segment", "phase", "direction"]),
    ("pressure_pa", &["pressure", "druck", "fluid pressure", "p", "inflation"]),
    ("stretch_m", &["stretch", "dehnung", "prestretch"]),
    ("site", &["site", "place", "ort", "location", "tissue", "sample", "probe"]),
    ("bounce", &["bounce", "impact", "impact number", "bounce number", "aufprall", "number", "nr", "no"]),
    ("step", &["step", "roll", "roll number", "schritt"]),
    ("length_m", &["length", "laenge", "length before"]),
    ("width_m", &["width", "breite", "width before"]),
    ("height_m", &["height", "hoehe", "thickness", "height before"]),
    ("throw_m", &["throw", "stroke", "hub"]),
    ("depth_m", &["depth", "press depth", "tiefe"]),
    ("next_length_m", &["next length", "length after", "length next", "laenge nachher"]),
    ("next_width_m", &["next width", "width after", "width next", "breite nachher"]),
    ("next_height_m", &["next height", "height after", "height next", "thickness after", "hoehe nachher"]),
    ("funnel_height_m", &["funnel height", "height", "pour height", "hoehe", "trichterhoehe"]),
    ("depth_image", &["depth image", "image", "file", "picture", "depth", "bild", "png"]),
    ("index", &["index"]),
];

impl Target {
    /// A column of this name.
    pub(crate) fn new(name: &str, label: bool) -> Self {
        let called = CALLED.iter().find(|(of, _)| *of == name).map_or(&[][..], |(_, called)| called).to_vec();
        Self { name: name.to_owned(), unit: units::of_name(name).map(|(_, unit)| unit), label, called }
    }
}

impl Wanted {
    /// What a domain wants; the header that is taken over is a text, or that of the recording in a folder.
    ///
    /// # Errors
    /// [`ImportError::UnknownDomain`], or why the other recording's header cannot be taken.
    pub(crate) fn of(domain: &str, header: Option<&str>, like: Option<&Path>) -> Result<Self, ImportError> {
        let domain = domains::find(domain)?;
        let mut targets: Vec<Target> = domain
            .columns()
            .iter()
            .filter(|c| c.name != "run")
            .map(|c| Target::new(c.name, c.label))
            .collect();
        let like = match (header, like) {
            (Some(text), _) => Some(Like::parse(Path::new("recording.toml"), text.to_owned(), domain.id())?),
            (None, Some(folder)) => Some(Like::read(folder, domain.id())?),
            (None, None) => None,
        };
        if targets.is_empty() {
            targets.push(Target::new("t_s", false));
        }
        let named = like.as_ref().map(Like::named).unwrap_or_default();
        targets.extend(named.iter().filter(|n| *n != "t_s").map(|n| Target::new(n, false)));
        Ok(Self { domain, targets, like, named })
    }
}

impl Like {
    fn read(folder: &Path, domain: &str) -> Result<Self, ImportError> {
        let file = folder.join("recording.toml");
        let open = |e: std::io::Error| ImportError::Open { file: file.clone(), why: e.to_string() };
        if std::fs::metadata(&file).map_err(open)?.len() > LARGEST_FILE {
            return Err(ImportError::broken(&file, "too large for the header of a recording"));
        }
        Self::parse(&file, std::fs::read_to_string(&file).map_err(open)?, domain)
    }

    fn parse(file: &Path, text: String, domain: &str) -> Result<Self, ImportError> {
        let table: toml::Table =
            text.parse().map_err(|e: toml::de::Error| ImportError::broken(file, e.message().to_owned()))?;
        let named = table.get("domain").and_then(toml::Value::as_str).unwrap_or_default();
        if named != domain {
            let why = format!("a recording of the domain {}, not of {domain}", quoted(named));
            return Err(ImportError::broken(file, why));
        }
        let data = table.get("data").and_then(toml::Value::as_str).unwrap_or("data.csv").to_owned();
        let plain = !data.is_empty()
            && !data.contains(['/', '\\'])
            && !data.starts_with('.')
            && data != "recording.toml";
        if !plain {
            return Err(ImportError::broken(
                file,
                format!("data = {}, expected a plain name", quoted(&data)),
            ));
        }
        Ok(Self { text, data })
    }

    /// The columns that the header itself names: of `custom` inputs and channels, of `motion` outputs and inputs.
    fn named(&self) -> Vec<String> {
        let table: toml::Table = self.text.parse().unwrap_or_default();
        let list = |key: &str| -> Vec<String> {
            let sections = table.get(key).and_then(toml::Value::as_array).into_iter().flatten();
            sections.filter_map(|s| s.get("name")?.as_str().map(str::to_owned)).collect()
        };
        let keys = |key: &str| -> Vec<String> {
            let model = table.get("model").and_then(|m| m.get(key)).and_then(toml::Value::as_table);
            model.map(|m| m.keys().cloned().collect()).unwrap_or_default()
        };
        let channels = list("channel");
        let mut names = [list("input"), channels.clone(), keys("outputs"), keys("inputs")].concat();
        if table.get("simulator").is_none() {
            names.extend(channels.iter().map(|name| format!("sim_{name}")));
        }
        names
    }
}
