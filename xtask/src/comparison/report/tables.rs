//! The tables of a comparison: who is first at which error, every picture, every sweep, every kind of ray.

use super::front::{LEVELS, fastest, seconds_to};
use super::style;
use super::table::{Cell, Table};
use super::words::{
    NONE, count, megabytes, number, percent, percent_with_error, ratio, seconds, short, short_percent,
    signed_percent,
};
use crate::comparison::results::{Curve, Point, Results, Scene, Sweep};

/// Our fastest method beside the fastest other one, a row for each scene and error that anyone reaches.
pub fn at_a_glance(results: &Results) -> Table {
    let mut table = Table::new(2, &["scene", "error", "twolight", "fastest other", "other / twolight"]);
    for scene in &results.scenes {
        for level in [0.05, 0.02, 0.01] {
            let side = |ours: bool| fastest(scene, level, |c| c.ours == ours);
            let (ours, other) = (side(true), side(false));
            if ours.is_none() && other.is_none() {
                continue;
            }
            let told = |found: Option<(&Curve, f64)>, ours: bool| match found {
                Some((curve, s)) => format!("{} ({})", seconds(s), curve.label),
                None if scene.curves.iter().any(|c| c.comparable && c.ours == ours) => "not reached".into(),
                None => "not measured".into(),
            };
            let factor = ours.zip(other).map_or(NONE.into(), |(o, x)| ratio(x.1 / o.1));
            let row =
                [scene.name.clone(), short_percent(level), told(ours, true), told(other, false), factor];
            table.rows.push(row.into_iter().map(Cell::from).collect());
        }
    }
    table
}

/// Seconds of each method to each of [`LEVELS`], with the factor on our fastest, and the best each one reached.
pub fn seconds_to_levels(scene: &Scene) -> Table {
    let levels = LEVELS.map(|l| format!("to {}", short_percent(l)));
    let mut head = vec!["method"];
    head.extend(levels.iter().map(String::as_str));
    head.push("smallest error");
    let mut table = Table::new(1, &head);
    for (i, curve) in scene.curves.iter().enumerate() {
        let mut row = vec![method(curve, i)];
        for level in LEVELS {
            let first = fastest(scene, level, |_| true).map(|(c, _)| c.method.as_str());
            let ours = fastest(scene, level, |c| c.ours).map(|(_, s)| s);
            let text = match (seconds_to(curve, level), ours) {
                (Some(s), Some(ours)) if curve.comparable => format!("{} ({})", seconds(s), ratio(s / ours)),
                (Some(s), _) => seconds(s),
                (None, _) => NONE.into(),
            };
            let best = first == Some(curve.method.as_str());
            row.push(Cell { text, best, swatch: None, faint: !curve.comparable });
        }
        let best = curve.best().map(|p| format!("{} at {}", percent(p.error), seconds(p.seconds)));
        row.push(Cell { faint: !curve.comparable, ..best.unwrap_or(NONE.into()).into() });
        table.rows.push(row);
    }
    table
}

fn method(curve: &Curve, index: usize) -> Cell {
    let style = style::of_method(&curve.method, curve.ours, curve.comparable, index);
    let text = if curve.comparable { curve.label.clone() } else { format!("{} †", curve.label) };
    Cell { swatch: Some(style::css(style.colour)), ..text.into() }
}

/// Every picture of a scene, a row each.
pub fn points(scene: &Scene) -> Table {
    let head =
        ["method", "setting", "stages", "seconds", "memory", "rays", "error", "bias", "99 % below", "FLIP"];
    let mut table = Table::new(3, &head);
    for (i, curve) in scene.curves.iter().enumerate() {
        for point in &curve.points {
            let mut row = vec![method(curve, i), point.setting.clone().into(), stages(point).into()];
            let numbers = [
                seconds(point.seconds),
                megabytes(point.peak_mb),
                point.rays.map_or(NONE.into(), count),
                percent_with_error(point.error, point.error_se),
                signed_percent(point.bias),
                percent(point.p99),
                number(point.flip, 2),
            ];
            row.extend(numbers.into_iter().map(|text| Cell { faint: !curve.comparable, ..text.into() }));
            table.rows.push(row);
        }
    }
    table
}

/// Stages that take more than a hundredth of the process.
fn stages(point: &Point) -> String {
    let told = point.stages.iter().filter(|(_, s)| **s > 0.01 * point.seconds);
    let stages: Vec<String> = told.map(|(name, s)| format!("{name} {}", seconds(*s))).collect();
    if stages.is_empty() { NONE.into() } else { stages.join(", ") }
}

/// The runs of a sweep, a row each.
pub fn sweep(sweep: &Sweep) -> Table {
    let mut table = Table::new(1, &["", &sweep.axis, "seconds", "first pass", "memory", "error"]);
    for line in &sweep.lines {
        for p in &line.points {
            let row = [
                line.label.clone(),
                short(p.x),
                seconds(p.seconds),
                seconds(p.prepass_seconds),
                megabytes(p.peak_mb),
                p.error.map_or(NONE.into(), percent),
            ];
            table.rows.push(row.into_iter().map(Cell::from).collect());
        }
    }
    table
}

/// Rays per second, beside Embree's.
pub fn rays(results: &Results) -> Table {
    let mut table = Table::new(2, &["scene", "rays", "twolight", "Embree", "twolight / Embree"]);
    for r in &results.rays {
        let millions = |v: f64| if v.is_finite() { format!("{} M/s", number(v, 3)) } else { NONE.into() };
        let factor = r.embree.map_or(NONE.into(), |e| ratio(r.ours / e));
        let row = [
            r.scene.clone(),
            r.kind.clone(),
            millions(r.ours),
            r.embree.map_or(NONE.into(), millions),
            factor,
        ];
        table.rows.push(row.into_iter().map(Cell::from).collect());
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::report::tests::{curve, scene};

    #[test]
    fn seconds_are_read_off_and_compared() {
        let ours = curve("split", true, &[(1.0, 0.05), (4.0, 0.0125)]);
        let mut odd = curve("odd", false, &[(0.1, 0.01)]);
        odd.comparable = false;
        let scene = scene(vec![ours, curve("mitsuba", false, &[(4.0, 0.02)]), odd]);
        let table = seconds_to_levels(&scene);
        let row = |i: usize| table.rows[i].iter().map(|c| c.text.replace('\u{a0}', " ")).collect::<Vec<_>>();
        let head: Vec<String> = table.head.iter().map(|h| h.replace('\u{a0}', " ")).collect();
        assert_eq!(head, ["method", "to 5 %", "to 2 %", "to 1 %", "to 0.5 %", "smallest error"]);
        assert_eq!(row(0), ["split", "1.0 s (× 1.0)", "2.5 s (× 1.0)", "–", "–", "1.2 % at 4.0 s"]);
        assert_eq!(row(1), ["mitsuba", "4.0 s (× 4.0)", "4.0 s (× 1.6)", "–", "–", "2.0 % at 4.0 s"]);
        assert_eq!(row(2)[0..4], ["odd †", "0.10 s", "0.10 s", "0.10 s"]);
        assert!(table.rows[0][1].best && !table.rows[2][1].best);
        let glance = at_a_glance(&Results { scenes: vec![scene], ..Results::default() });
        assert_eq!(glance.rows.len(), 2);
        assert_eq!(glance.rows[1][4].text, "×\u{a0}1.6");
    }

    #[test]
    fn empty_data_makes_empty_tables() {
        let empty = scene(vec![curve("split", true, &[])]);
        assert_eq!(seconds_to_levels(&empty).rows[0].len(), 6);
        assert!(points(&empty).rows.is_empty());
        assert!(
            at_a_glance(&Results::default()).rows.is_empty() && rays(&Results::default()).rows.is_empty()
        );
        assert!(sweep(&Sweep::default()).rows.is_empty());
    }
}
