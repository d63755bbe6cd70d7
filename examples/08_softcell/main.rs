//! Chapter 5 on a simulated tip: how firm it is, what it feels, the load at which a box slips, and a grasp that answers.
//!
//! `cargo run --release -p examples --example 08_softcell` (`--small`: fewer trials); prints the figures' tables and draws them into
//! `softcell.svg` in the temporary folder. Not drawn: photographs and schemes (figures 5.1, 5.3, 5.4, 5.8), and the radial contact of
//! 5.5 b, since the simulated dome is the same from all sides.
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

mod firmness;
mod grasp;
mod touch;

use std::error::Error;

use examples::plot;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// The probe of section 5.4, m.
const PROBE_M: f64 = 0.019;

fn main() -> Outcome<()> {
    let mut panels = touch::traces()?;
    let stiffness = firmness::curves(&mut panels)?;
    panels.push(firmness::cycles());
    panels.push(firmness::smallest(&stiffness)?);
    touch::contours(&mut panels)?;
    panels.push(touch::shear_loads()?);
    grasp::slips(&stiffness, &mut panels)?;
    panels.push(grasp::demonstration()?);
    let path = plot::write("softcell.svg", &panels, 4)?;
    println!("\nfigures drawn: {}", path.display());
    Ok(())
}
