//! Other renderers: those that `xtask/peers` has a script for.

use super::method::{Method, Program, Rung, by_samples};

/// Quality levels of the renderers that have no samples to count.
const LEVELS: [u32; 6] = [1, 2, 3, 4, 5, 6];

/// Every method of another renderer. A new one is a line here and a script.
pub fn all() -> Vec<Method> {
    let denoise = &["--denoise"][..];
    vec![
        by_samples("mitsuba", "Mitsuba path", Program::Peer("mitsuba"), &[]),
        by_samples("mitsuba-oidn", "Mitsuba path + OIDN", Program::Peer("mitsuba"), denoise),
        by_samples("cycles", "Cycles", Program::Peer("cycles"), &[]),
        by_samples("cycles-oidn", "Cycles + OIDN", Program::Peer("cycles"), denoise),
        by_samples("luxcore", "LuxCore path", Program::Peer("luxcore"), &[]),
        by_level("povray", "POV-Ray radiosity"),
        by_level("radiance", "Radiance"),
    ]
}

fn by_level(key: &'static str, label: &'static str) -> Method {
    let ladder = LEVELS.map(|n| Rung::new(format!("level {n}"), &[], "--effort", &n.to_string()));
    Method { key, label, program: Program::Peer(key), ladder: ladder.into() }
}
