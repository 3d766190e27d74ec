//! The charts of a comparison: error against seconds for each scene, and what grows in each sweep.

use super::axis::Axis;
use super::front::pareto;
use super::plot::{Line, Mark, Plot};
use super::style;
use super::words::{percent, percent_with_error, seconds};
use crate::comparison::results::{Point, Scene, Sweep, SweepLine, SweepPoint};

/// Said of a curve whose error is no measure of it.
pub const NOT_COMPARABLE: &str = "renders another picture";

/// Ticks that find room on an axis of a narrow chart.
const X_TICKS: usize = 7;
const Y_TICKS: usize = 9;

/// Error against seconds, on logarithmic axes; `None` if no point has both.
pub fn error_against_seconds(scene: &Scene) -> Option<Plot> {
    let usable = |p: &&Point| p.seconds > 0.0 && p.error > 0.0;
    let points = || scene.curves.iter().flat_map(|c| &c.points).filter(usable);
    let x = Axis::around("seconds, whole process", " s", true, points().map(|p| p.seconds), X_TICKS)?;
    let errors = points().map(|p| 100.0 * p.error);
    let y = Axis::around("error against the reference", " %", true, errors, Y_TICKS)?;
    let mark = |label: &str, p: &Point| Mark {
        at: (p.seconds, 100.0 * p.error),
        spread: p.error_se.map(|e| 100.0 * e),
        tip: format!(
            "{label}, {}: {} in {}",
            p.setting,
            percent_with_error(p.error, p.error_se),
            seconds(p.seconds)
        ),
    };
    let lines = scene.curves.iter().enumerate().map(|(i, c)| Line {
        key: c.method.clone(),
        label: c.label.clone(),
        remark: (!c.comparable).then_some(NOT_COMPARABLE),
        style: style::of_method(&c.method, c.ours, c.comparable, i),
        points: c.points.iter().map(|p| mark(&c.label, p)).collect(),
    });
    Some(Plot {
        title: format!("{}: error against time", scene.name),
        x,
        y,
        lines: lines.collect(),
        front: pareto(scene).into_iter().map(|(s, e)| (s, 100.0 * e)).collect(),
    })
}

/// The charts of a sweep, each with a short name: seconds, memory, error; those without any data are left out.
pub fn sweep(sweep: &Sweep) -> Vec<(&'static str, Plot)> {
    let mut charts = Vec::new();
    let prepass = |p: &SweepPoint| Some(p.prepass_seconds);
    let mut times = lines(sweep, "", |p| Some(p.seconds));
    for mut line in lines(sweep, ", first pass", prepass) {
        line.style.dashed = true;
        line.style.hollow = true;
        line.key += "-prepass";
        times.push(line);
    }
    charts.extend(chart(sweep, "seconds", "seconds: whole process, and its first pass", " s", times));
    charts.extend(chart(sweep, "memory", "peak memory", " MB", lines(sweep, "", |p| Some(p.peak_mb))));
    let error = |p: &SweepPoint| p.error.map(|e| 100.0 * e);
    charts.extend(chart(sweep, "error", "error against the reference", " %", lines(sweep, "", error)));
    charts
}

fn lines(sweep: &Sweep, suffix: &str, y: impl Fn(&SweepPoint) -> Option<f64>) -> Vec<Line> {
    let tip = |line: &SweepLine, p: &SweepPoint| {
        let error = p.error.map(|e| format!(", error {}", percent(e))).unwrap_or_default();
        format!("{}, {} {}: {}{error}", line.label, sweep.axis, p.x, seconds(p.seconds))
    };
    let marks = |line: &SweepLine| -> Vec<Mark> {
        let points = line.points.iter();
        points.filter_map(|p| Some(Mark { at: (p.x, y(p)?), spread: None, tip: tip(line, p) })).collect()
    };
    let drawn = sweep.lines.iter().enumerate().map(|(i, line)| Line {
        key: line.label.clone(),
        label: format!("{}{suffix}", line.label),
        remark: None,
        style: style::of_index(i),
        points: marks(line),
    });
    drawn.collect()
}

fn chart(
    sweep: &Sweep,
    name: &'static str,
    title: &str,
    unit: &'static str,
    lines: Vec<Line>,
) -> Option<(&'static str, Plot)> {
    let points = || lines.iter().flat_map(|l| &l.points);
    let x = Axis::around(sweep.axis.clone(), "", sweep.logarithmic, points().map(|m| m.at.0), X_TICKS)?;
    let y = Axis::around(title, unit, sweep.logarithmic, points().map(|m| m.at.1), Y_TICKS)?;
    Some((name, Plot { title: sweep.title.clone(), x, y, lines, front: Vec::new() }))
}

#[cfg(test)]
mod tests {
    use super::super::plot::{Form, draw};
    use super::*;
    use crate::comparison::report::tests::{curve, scene};

    #[test]
    fn every_curve_is_a_group_whatever_it_is_called() {
        let nasty = curve("<&\"'>", false, &[(1.0, 0.1), (10.0, 0.01)]);
        let scene = scene(vec![curve("split", true, &[(0.5, 0.04)]), nasty]);
        let plot = error_against_seconds(&scene).unwrap();
        for form in [Form::Wide, Form::Narrow] {
            let svg = draw(&plot, form).unwrap();
            assert_eq!(svg.matches("class=\"curve\"").count(), 2);
            assert_eq!(svg.matches("class=\"point\"").count(), 3);
            assert!(svg.contains("data-curve=\"&lt;&amp;&quot;&#39;&gt;\"") && !svg.contains("<&"));
        }
    }

    #[test]
    fn huge_ranges_and_missing_numbers_are_drawn_as_far_as_they_go() {
        let odd =
            [(1e-300, 0.1), (f64::NAN, 1.0), (1.0, 0.0), (1e300, 1e300), (f64::INFINITY, -1.0), (3.0, 1e-9)];
        let plot = error_against_seconds(&scene(vec![curve("x", false, &odd)])).unwrap();
        draw(&plot, Form::Wide).unwrap();
        let none = scene(vec![curve("x", false, &[(1.0, 0.0), (f64::NAN, 0.1)]), curve("y", true, &[])]);
        assert!(error_against_seconds(&none).is_none());
    }

    #[test]
    fn a_sweep_draws_what_it_has() {
        let point = |x: f64| SweepPoint { x, seconds: x, prepass_seconds: 0.0, peak_mb: 10.0, error: None };
        let line = SweepLine { label: "room".into(), points: vec![point(10.0), point(100.0)] };
        let mut s = Sweep { lines: vec![line], ..Sweep::default() };
        let names = |s: &Sweep| sweep(s).iter().map(|(n, _)| *n).collect::<Vec<_>>();
        assert_eq!(names(&s), ["seconds", "memory"]);
        s.logarithmic = true;
        for (_, plot) in sweep(&s) {
            draw(&plot, Form::Narrow).unwrap();
        }
        assert!(sweep(&Sweep::default()).is_empty());
    }
}
