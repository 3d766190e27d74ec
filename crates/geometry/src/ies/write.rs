//! A photometric web as an LM-63 file again.

use super::{Photometry, Web};
use std::fmt::Write;

impl Web {
    /// An LM-63-2002 file of the same web, without symmetries.
    pub fn to_lm63(&self) -> String {
        let degrees =
            |angles: &[f32]| angles.iter().map(|a| tidy(f64::from(*a).to_degrees())).collect::<Vec<_>>();
        let (polar, around) = (degrees(&self.polar), degrees(&self.around));
        let from_axis = |angles: &[f64]| angles.iter().rev().map(|a| tidy(90.0 - a)).collect::<Vec<_>>();
        let width = around.len();
        let at = |row: usize, column: usize| self.relative[row * width + column] * self.peak;
        let (kind, vertical, horizontal) = match self.photometry {
            Photometry::C => (1, polar.clone(), around.clone()),
            Photometry::B => (2, around.clone(), from_axis(&polar)),
            Photometry::A => (3, from_axis(&polar), around.clone()),
        };
        let candela = |v: usize, h: usize| match self.photometry {
            Photometry::C => at(v, h),
            Photometry::B => at(polar.len() - 1 - h, v),
            Photometry::A => at(polar.len() - 1 - v, h),
        };
        let mut out =
            String::from("IESNA:LM-63-2002\n[TEST] none\n[ISSUEDATE] none\n[MANUFAC] twolight\nTILT=NONE\n");
        let (nv, nh) = (vertical.len(), horizontal.len());
        // Writing to a string cannot fail.
        let _ = writeln!(out, "1 -1 1 {nv} {nh} {kind} 2 0 0 0\n1 1 0");
        let mut lines = |numbers: Vec<String>| {
            for line in numbers.chunks(10) {
                let _ = writeln!(out, "{}", line.join(" "));
            }
        };
        lines(vertical.iter().map(f64::to_string).collect());
        lines(horizontal.iter().map(f64::to_string).collect());
        for h in 0..nh {
            lines((0..nv).map(|v| candela(v, h).to_string()).collect());
        }
        out
    }
}

/// Degrees without the dust of radians.
fn tidy(degrees: f64) -> f64 {
    (degrees * 1e4).round() / 1e4
}
