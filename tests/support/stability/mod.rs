//! Where methods fail, and what tells: every torture case over every method that claims to handle it, measured against a
//! closed form or an invariant.
//!
//! A case that a method fails as theory says it must is a *known limit*, and has to fail: a limit that is gone is told.

mod elsewhere;
mod form_factors;
mod solvers;

pub use elsewhere::ELSEWHERE;
pub use form_factors::{hemicube_errors, section as form_factors};
pub use solvers::{Solver, section as solvers};

use std::fmt::Write;

/// One method at one case.
#[derive(Clone, Debug)]
pub struct Measure {
    /// Deviation from the closed form or invariant.
    pub error: f64,
    /// The most that passes.
    pub allowed: f64,
    /// Why the method must fail this case; `None` for one that has to pass.
    pub limit: Option<&'static str>,
}

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Within what is allowed.
    Pass,
    /// Beyond it.
    Fail,
    /// Beyond it, as theory says.
    Limit,
    /// Within it, though theory says otherwise: the case no longer shows what it was made for.
    NoLimit,
}

impl Measure {
    /// A method that has to pass.
    pub fn new(error: f64, allowed: f64) -> Option<Measure> {
        Some(Measure { error, allowed, limit: None })
    }

    /// A method that has to fail, and why.
    pub fn limit(error: f64, allowed: f64, why: &'static str) -> Option<Measure> {
        Some(Measure { error, allowed, limit: Some(why) })
    }

    /// Whether it came out as it had to.
    pub fn verdict(&self) -> Verdict {
        match (self.error.is_finite() && self.error <= self.allowed, self.limit.is_some()) {
            (true, false) => Verdict::Pass,
            (true, true) => Verdict::NoLimit,
            (false, false) => Verdict::Fail,
            (false, true) => Verdict::Limit,
        }
    }
}

/// One case over all methods of its section.
#[derive(Clone, Debug)]
pub struct Row {
    /// C1 to C42.
    pub id: &'static str,
    /// What is measured.
    pub what: &'static str,
    /// For each method of the section; `None` where it makes no such claim.
    pub cells: Vec<Option<Measure>>,
}

/// Cases that the same methods answer.
#[derive(Clone, Debug)]
pub struct Section {
    /// Heading.
    pub title: &'static str,
    /// Columns.
    pub methods: Vec<&'static str>,
    /// Cases.
    pub rows: Vec<Row>,
}

impl Section {
    /// Those cells that did not come out as they had to, in words.
    pub fn surprises(&self) -> Vec<String> {
        let mut all = Vec::new();
        for row in &self.rows {
            for (method, cell) in self.methods.iter().zip(&row.cells) {
                if let Some(m) = cell
                    && matches!(m.verdict(), Verdict::Fail | Verdict::NoLimit)
                {
                    all.push(format!("{} {}, {method}: {:?} {m:?}", row.id, row.what, m.verdict()));
                }
            }
        }
        all
    }

    /// As a Markdown table with its limits explained below.
    pub fn markdown(&self) -> String {
        let mut text = format!("\n## {}\n\n| case | what is measured |", self.title);
        for method in &self.methods {
            let _ = write!(text, " {method} |");
        }
        let _ = writeln!(text, "\n|---|---|{}", "---|".repeat(self.methods.len()));
        let mut reasons: Vec<&str> = Vec::new();
        for row in &self.rows {
            let _ = write!(text, "| {} | {} |", row.id, row.what);
            for cell in &row.cells {
                let _ = match cell {
                    None => write!(text, " – |"),
                    Some(m) => {
                        let note = match (m.verdict(), m.limit) {
                            (Verdict::Pass, _) => " ✓".to_string(),
                            (Verdict::Fail, _) => " **fails**".into(),
                            (Verdict::NoLimit, _) => " **no limit any more**".into(),
                            (Verdict::Limit, why) => {
                                let why = why.unwrap_or_default();
                                let at = reasons.iter().position(|r| *r == why).unwrap_or_else(|| {
                                    reasons.push(why);
                                    reasons.len() - 1
                                });
                                format!(" limit [{}]", at + 1)
                            }
                        };
                        write!(text, " {} of {}{note} |", short(m.error), short(m.allowed))
                    }
                };
            }
            text.push('\n');
        }
        for (i, why) in reasons.iter().enumerate() {
            let _ = write!(text, "\n[{}] {why}.\n", i + 1);
        }
        text
    }
}

/// Two digits.
fn short(x: f64) -> String {
    match x {
        0.0 => "0".into(),
        x if (0.01..1000.0).contains(&x.abs()) => format!("{:.*}", if x.abs() < 0.1 { 3 } else { 2 }, x),
        x => format!("{x:.0e}"),
    }
}
