//! Two pours against time: tilt, flow, and what has been poured, and how far the scale was off.

use std::path::PathBuf;

use examples::plot::{self, Panel};
use liquid_haptics::fake::{AXIA80, TruePour};
use liquid_haptics::pour::closed_loop::{Moment, Phase};

use crate::rig::Case;
use crate::{Outcome, in_the_loop, sense};

const TRUE: &str = "black";
const BELIEVED: &str = "hsl(220,70%,45%)";
const PALE: &str = "hsl(220,60%,75%)";
const STOPPED: &str = "hsl(0,70%,45%)";

/// Draws each case in a row.
pub(crate) fn draw(cases: &[Case]) -> Outcome<PathBuf> {
    let mut panels = Vec::new();
    for case in cases {
        let mut moments = Vec::new();
        let inside = sense::felt(case)?;
        let (_, wrist) = in_the_loop(case, inside, AXIA80, &mut |m| moments.push(*m))?;
        panels.extend(row(case, &moments, wrist.history()));
    }
    Ok(plot::write("pouring.svg", &panels, 4)?)
}

fn row(case: &Case, moments: &[Moment], history: &[TruePour]) -> [Panel; 4] {
    let name = case.kind().name;
    // A fifth of a second between points is as fine as a picture shows.
    let moments: Vec<&Moment> = moments.iter().step_by(10).collect();
    let true_m3 = |t: f64| history.iter().find(|h| h.t_s >= t).map_or(f64::NAN, |h| h.poured_m3);
    let mut error = Panel::new(format!("{name}: weighed less true"), "t, s", "mL");
    let off = |m: &Moment| 1e6 * (m.poured_m3 - true_m3(m.t_s));
    for side in [-1.96, 1.96] {
        error.line(moments.iter().map(|m| [m.t_s, side * 1e6 * m.error_m3]), PALE);
    }
    error.line(moments.iter().map(|m| [m.t_s, off(m)]), BELIEVED);
    error.name("weighed less what has come off the lip", BELIEVED).name("its 95 % band", PALE);
    let history: Vec<&TruePour> = history.iter().step_by(4).collect();
    let mut tilt = Panel::new(format!("{name}: tilt"), "t, s", "rad");
    tilt.line(history.iter().map(|h| [h.t_s, h.tilt_rad]), TRUE);
    let mut flow = Panel::new(format!("{name}: flow"), "t, s", "mL/s");
    let flows = || moments.iter().filter(|m| m.flow_m3_s > 0.0 || m.phase == Phase::Pouring);
    for side in [-1.96, 1.96] {
        let edge = |m: &&&Moment| [m.t_s, 1e6 * (m.flow_m3_s + side * m.flow_error_m3_s).clamp(0.0, 1e-5)];
        flow.line(flows().map(|m| edge(&m)), PALE);
    }
    flow.line(flows().map(|m| [m.t_s, 1e6 * m.flow_m3_s.min(1e-5)]), BELIEVED);
    flow.line(history.iter().map(|h| [h.t_s, 1e6 * h.flow_m3_s]), TRUE);
    flow.name("true", TRUE).name("believed, 95 %", BELIEVED);
    let mut poured =
        Panel::new(format!("{name}: {:.0} mL wanted", 1e6 * case.wanted_m3), "t, s", "poured, mL");
    let end = history.last().map_or(0.0, |h| h.t_s);
    poured.line([[0.0, 1e6 * case.wanted_m3], [end, 1e6 * case.wanted_m3]], "hsl(0,0%,70%)");
    let pours = moments.iter().filter(|m| m.phase == Phase::Pouring);
    poured.line(pours.map(|m| [m.t_s, 1e6 * m.if_stopped_m3]), STOPPED);
    poured.line(moments.iter().map(|m| [m.t_s, 1e6 * m.poured_m3]), BELIEVED);
    poured.line(history.iter().map(|h| [h.t_s, 1e6 * h.poured_m3]), TRUE);
    poured.name("true", TRUE).name("weighed", BELIEVED).name("if it turned back now", STOPPED);
    [tilt, flow, poured, error]
}
