//! What the files of a recording say: the rig, and the drops.

use bounce_audio::flight::drag_per_m;

use super::drop::Drop;
use crate::reading::GRAVITY_M_S2;
use crate::reading::check_runs;
use crate::recording::{Header, ReadError, Table};

const AIR_DENSITY_KG_M3: f64 = 1.2;

/// What the header says of the rig.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rig {
    pub(super) gravity_m_s2: f64,
    /// Drag (1/m) of a drag coefficient of one.
    pub(super) drag_unit: Option<f64>,
    pub(super) drop_height_m: Option<f64>,
}

impl Rig {
    pub(super) fn read(header: &Header) -> Result<Self, ReadError> {
        let rig = header.section("rig")?;
        let drop_height_m = rig.number("drop_height_m", 1e-3, 1e3)?;
        let mass = rig.number("mass_kg", 1e-9, 1e6)?;
        let diameter = rig.number("diameter_m", 1e-5, 1e2)?;
        let gravity_m_s2 = rig.number("gravity_m_s2", 1e-3, 100.0)?.unwrap_or(GRAVITY_M_S2);
        let drag_unit =
            mass.zip(diameter).map(|(mass, diameter)| drag_per_m(1.0, diameter, mass, AIR_DENSITY_KG_M3));
        Ok(Self { gravity_m_s2, drag_unit, drop_height_m })
    }

    /// Impacts without which a drop says nothing.
    pub(super) fn fewest(&self) -> usize {
        if self.drop_height_m.is_some() { 2 } else { 3 }
    }
}

/// One drop as the file has it: its label, the first of its rows, its impacts and their numbers.
pub(super) struct Heard {
    pub(super) label: String,
    pub(super) row: usize,
    pub(super) drop: Drop,
    pub(super) numbers: Vec<f64>,
}

/// The drops of a table.
///
/// # Errors
/// [`ReadError`].
pub(super) fn heard(table: &Table, rig: &Rig) -> Result<Vec<Heard>, ReadError> {
    let labels = table.labels("run", "the label of each row's run")?;
    let times = table.numbers("t_s").ok_or_else(|| table.missing("t_s", "time in seconds"))?;
    let numbers = table.numbers("bounce").ok_or_else(|| table.missing("bounce", "number of the impact"))?;
    let places = match (table.numbers("x_m"), table.numbers("y_m")) {
        (Some(x), Some(y)) => Some((x, y)),
        (None, None) => None,
        (Some(_), None) => return Err(table.missing("y_m", "the other coordinate of each place")),
        (None, Some(_)) => return Err(table.missing("x_m", "the other coordinate of each place")),
    };
    let mut all = Vec::new();
    for (label, rows) in check_runs(table, labels, rig.fewest(), Some("t_s"))? {
        let mut known = vec![0; rows.len()];
        for (i, pair) in rows.windows(2).enumerate() {
            let (before, now) = (numbers[pair[0]], numbers[pair[1]]);
            if now.fract() != 0.0 || now <= before {
                let expected = format!("a whole number above {before}, the one before it");
                return Err(table.cell(pair[1], "bounce", now, expected));
            }
            known[i + 1] = (now - before) as usize - 1;
        }
        // The first impact that was heard is where a known fall ends, whatever its number.
        let drop = Drop {
            times_s: rows.iter().map(|&r| times[r]).collect(),
            places_m: places.map(|(x, y)| rows.iter().map(|&r| [x[r], y[r]]).collect()).unwrap_or_default(),
            height_m: rig.drop_height_m,
            unheard: known.clone(),
            known,
            ..Drop::default()
        };
        let numbers = rows.iter().map(|&r| numbers[r]).collect();
        all.push(Heard { label, row: rows[0], drop, numbers });
    }
    Ok(all)
}
