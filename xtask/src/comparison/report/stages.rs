//! Where the seconds of each method go: a bar of its stages, as shares of the whole process.

use super::pictures::ERROR;
use super::words::{escape, percent, seconds, short_percent};
use crate::comparison::results::{Curve, Point, Scene};

/// Colours of the stages that we know, and of those that we do not.
const KNOWN: [(&str, &str); 7] = [
    ("load", "#8c96a3"),
    ("build", "#c45f99"),
    ("prepass", "#0072b2"),
    ("image", "#d98e00"),
    ("render", "#d98e00"),
    ("denoise", "#009e73"),
    ("write", "#7b61c4"),
];
const UNKNOWN: [&str; 3] = ["#8a6a3b", "#3fa4dd", "#d55e00"];
/// What no stage accounts for: starting, reading, writing.
const REST: (&str, &str) = ("rest", "#c9ced4");

/// The bars of a scene, at the point of each method that is nearest to 2 %; nothing if no renderer tells its stages.
pub fn html(scene: &Scene) -> String {
    let rows: Vec<(&Curve, &Point, Vec<Part>)> = scene
        .curves
        .iter()
        .filter_map(|curve| {
            let point = nearest(curve)?;
            Some((curve, point, parts(point)))
        })
        .filter(|(_, _, parts)| !parts.is_empty())
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let mut legend: Vec<(Vec<&str>, &str)> = Vec::new();
    let mut body = String::new();
    for (curve, point, parts) in &rows {
        let mut bar = String::new();
        for part in parts {
            match legend.iter_mut().find(|(_, colour)| *colour == part.colour) {
                Some((names, _)) if names.contains(&part.name) => {}
                Some((names, _)) => names.push(part.name),
                None => legend.push((vec![part.name], part.colour)),
            }
            bar += &format!(
                "<i style=\"width:{:.2}%;background:{}\" title=\"{} {}\"></i>",
                100.0 * part.share,
                part.colour,
                escape(part.name),
                seconds(part.seconds)
            );
        }
        body += &format!(
            "<li><span class=\"name\">{}</span><span class=\"bar\">{bar}</span><span class=\"total\">{}, {}</span></li>\n",
            escape(&curve.label),
            seconds(point.seconds),
            percent(point.error)
        );
    }
    let legend: String = legend
        .iter()
        .map(|(names, colour)| {
            format!(
                "<span><i class=\"swatch\" style=\"background:{colour}\"></i>{}</span> ",
                escape(&names.join(", "))
            )
        })
        .collect();
    format!(
        "<h3>Where the seconds go</h3>\n<p>Share of each process, at its picture nearest to {}.</p>\n\
         <p class=\"key\">{legend}</p>\n<ul class=\"bars\">\n{body}</ul>\n",
        short_percent(ERROR)
    )
}

/// One piece of a bar.
struct Part<'a> {
    name: &'a str,
    colour: &'static str,
    seconds: f64,
    share: f64,
}

fn nearest(curve: &Curve) -> Option<&Point> {
    let distance = |p: &Point| (p.error / ERROR).ln().abs();
    let points = curve.points.iter().filter(|p| distance(p).is_finite());
    points.min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// In the order in which stages happen; none where a renderer tells nothing.
fn parts(point: &Point) -> Vec<Part<'_>> {
    // What takes less than a two-hundredth cannot be seen, and would only lengthen the key.
    let seen = |s: f64| s.is_finite() && s > 0.005 * point.seconds.max(0.0);
    let told: Vec<(&String, f64)> =
        point.stages.iter().map(|(n, s)| (n, *s)).filter(|(_, s)| seen(*s)).collect();
    let sum: f64 = told.iter().map(|(_, s)| s).sum();
    if sum <= 0.0 {
        return Vec::new();
    }
    // Stages that overlap, or were timed by another clock, can add up to more than the process took.
    let whole = if point.seconds.is_finite() { point.seconds.max(sum) } else { sum };
    let mut parts: Vec<(usize, Part)> = Vec::new();
    for (i, &(name, seconds)) in told.iter().enumerate() {
        let known = KNOWN.iter().position(|(n, _)| n == name);
        let colour = known.map_or(UNKNOWN[i % UNKNOWN.len()], |k| KNOWN[k].1);
        parts.push((known.unwrap_or(KNOWN.len()), Part { name, colour, seconds, share: seconds / whole }));
    }
    parts.sort_by_key(|(order, _)| *order);
    let mut parts: Vec<Part> = parts.into_iter().map(|(_, part)| part).collect();
    let rest = whole - sum;
    if rest > 0.01 * whole {
        parts.push(Part { name: REST.0, colour: REST.1, seconds: rest, share: rest / whole });
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::report::tests::{curve, scene};

    #[test]
    fn a_bar_is_whole_and_in_order() {
        let mut c = curve("split", true, &[(2.0, 0.02)]);
        let stages = [("image", 0.5), ("prepass", 1.0), ("<zeal>", 0.25), ("load", f64::NAN)];
        c.points[0].stages = stages.map(|(n, s)| (n.to_string(), s)).into();
        let parts = parts(&c.points[0]);
        let names: Vec<&str> = parts.iter().map(|p| p.name).collect();
        assert_eq!(names, ["prepass", "image", "<zeal>", "rest"]);
        assert!((parts.iter().map(|p| p.share).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(html(&scene(vec![c])).contains("&lt;zeal&gt;"));
    }

    #[test]
    fn without_stages_there_is_no_bar() {
        assert_eq!(html(&scene(vec![curve("x", false, &[(1.0, 0.1), (0.0, 0.0)])])), "");
    }
}
