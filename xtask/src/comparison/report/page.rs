//! `index.html`: one file that holds everything, words, charts, pictures and script.

use super::charts::NOT_COMPARABLE;
use super::front::moment;
use super::pictures::{Encoded, Gallery};
use super::words::{count, escape, number, percent, slug};
use super::{Chart, stages, tables, viewer};
use crate::comparison::results::{Results, Scene};
use std::collections::BTreeMap;

/// Everything that the page shows beside the numbers.
pub struct Parts {
    /// The chart of each scene.
    pub scenes: Vec<Option<Chart>>,
    /// The charts of each sweep.
    pub sweeps: Vec<Vec<Chart>>,
    /// The pictures of each scene.
    pub galleries: Vec<Gallery>,
    /// The same, as text.
    pub embedded: Vec<Vec<Encoded>>,
    /// Bytes of all of them.
    pub picture_bytes: usize,
}

/// The whole page.
pub fn html(results: &Results, parts: &Parts) -> String {
    let mut nav = String::new();
    let mut link = |id: &str, name: &str| {
        nav += &format!("<li><a href=\"#{}\">{}</a></li>", escape(id), escape(name));
    };
    let mut body = overview(results, parts);
    for (i, scene) in results.scenes.iter().enumerate() {
        let id = format!("scene-{}", slug(&scene.name));
        link(&id, &scene.name);
        body += &scene_section(&id, scene, i, parts);
    }
    if !results.scaling.is_empty() {
        link("scaling", "scaling");
        body += &scaling(results, parts);
    }
    if !results.rays.is_empty() {
        link("rays", "rays per second");
        body += &format!(
            "<section id=\"rays\">\n<h2>Rays per second</h2>\n{}</section>\n",
            tables::rays(results).html("Millions of rays per second on one thread")
        );
    }
    let stability = crate::stability::html();
    if !stability.is_empty() {
        link("stability", "where methods fail");
        body += &stability;
    }
    link("methods", "methods");
    body += &methods(results);
    link("errors", "how errors are defined");

    // The script and the data last: what they hold is not searched for further names.
    let mut page = include_str!("page.html").to_string();
    for (name, value) in [
        ("{css}", include_str!("page.css")),
        ("{js}", include_str!("page.js")),
        ("{lead}", &lead(results)),
        ("{nav}", &nav),
        ("{body}", &body),
    ] {
        page = page.replacen(name, value, 1);
    }
    page
}

fn lead(results: &Results) -> String {
    let told = |text: &str, fallback: &str| escape(if text.is_empty() { fallback } else { text });
    format!(
        "Error against seconds of the whole process, all renderers on the same machine, with {} threads each. \
         Measured on {} at commit <code>{}</code>.",
        results.threads,
        told(&results.date, "an unknown day"),
        told(&results.commit, "unknown")
    )
}

fn overview(results: &Results, parts: &Parts) -> String {
    let glance = tables::at_a_glance(results);
    let glance = match glance.rows.is_empty() {
        true => "<p>No method reached 2 % on any scene.</p>\n".into(),
        false => glance.html("Seconds to an error: our fastest method, and the fastest other one"),
    };
    let machine = &results.machine;
    let pictures: usize = parts.galleries.iter().map(|g| g.pictures.len()).sum();
    let mut facts = vec![
        ("processor", machine.processor.clone()),
        ("cores", machine.cores.to_string()),
        ("memory", format!("{} GB", number(machine.memory_gb, 3))),
        ("system", machine.system.clone()),
        ("threads", results.threads.to_string()),
        ("commit", results.commit.clone()),
        (
            "this page",
            format!("{pictures} pictures and their error maps, {:.1} MB", parts.picture_bytes as f64 / 1e6),
        ),
    ];
    let versions: Vec<(&str, String)> =
        results.versions.iter().map(|(name, version)| (name.as_str(), version.clone())).collect();
    facts.extend(versions);
    let facts: String = facts
        .iter()
        .filter(|(_, value)| !value.is_empty())
        .map(|(name, value)| format!("<dt>{}</dt><dd>{}</dd>\n", escape(name), escape(value)))
        .collect();
    format!(
        "<h2>At a glance</h2>\n{glance}<details open><summary>Machine and versions</summary><dl class=\"machine\">\n{facts}</dl></details>\n"
    )
}

fn scene_section(id: &str, scene: &Scene, index: usize, parts: &Parts) -> String {
    let mut facts = vec![
        format!("{} × {} pixels", scene.width, scene.height),
        format!("{} triangles", count(scene.triangles)),
    ];
    if !scene.camera.is_empty() {
        facts.push(format!("camera “{}”", scene.camera));
    }
    facts.push(format!(
        "reference: {}, its own noise {}",
        scene.reference.made_by,
        percent(scene.reference.noise)
    ));
    facts.push(scene.file.display().to_string());
    let facts: Vec<String> = facts.iter().map(|f| escape(f)).collect();

    let chart = match parts.scenes.get(index).and_then(Option::as_ref) {
        Some(chart) => chart.html(),
        None => {
            "<p>No point has both seconds and an error above zero: there is nothing to draw.</p>\n".into()
        }
    };
    let odd = match scene.curves.iter().any(|c| !c.comparable) {
        true => format!(
            "<p class=\"hint\">† {NOT_COMPARABLE}: its error is no measure of it (see <a href=\"#methods\">methods</a>).</p>\n"
        ),
        false => String::new(),
    };
    let pictures = match (parts.galleries.get(index), parts.embedded.get(index)) {
        (Some(gallery), Some(embedded)) => viewer::html(gallery, embedded),
        _ => String::new(),
    };
    let points: usize = scene.curves.iter().map(|c| c.points.len()).sum();
    let levels = tables::seconds_to_levels(scene).html(match moment(scene) {
        Some(_) => "Seconds to an error, and how many times our fastest method’s that is",
        None => "Seconds to an error",
    });
    format!(
        "<section class=\"scene\" id=\"{}\">\n<h2>{}</h2>\n<p class=\"facts\">{}</p>\n{chart}{levels}{odd}{pictures}{}\
         <details><summary>All {points} pictures in numbers</summary>\n{}</details>\n</section>\n",
        escape(id),
        escape(&scene.name),
        facts.join(" · "),
        stages::html(scene),
        tables::points(scene).html("Every picture: its setting, cost and error")
    )
}

fn scaling(results: &Results, parts: &Parts) -> String {
    let mut text = String::from("<section id=\"scaling\">\n<h2>Scaling</h2>\n");
    for (i, sweep) in results.scaling.iter().enumerate() {
        let charts: String = parts.sweeps.get(i).into_iter().flatten().map(Chart::html).collect();
        text += &format!(
            "<h3>{0}</h3>\n<div class=\"plots\">{charts}</div>\n<details><summary>In numbers</summary>\n{1}</details>\n",
            escape(&sweep.title),
            tables::sweep(sweep).html(&sweep.title)
        );
    }
    text + "</section>\n"
}

/// What a reader must know of each method; a note that holds for several scenes is said once.
fn methods(results: &Results) -> String {
    let mut labels: Vec<(&str, &str, bool)> = Vec::new();
    let mut notes: BTreeMap<&str, Vec<(String, Vec<&str>)>> = BTreeMap::new();
    for scene in &results.scenes {
        for curve in &scene.curves {
            if !labels.iter().any(|(key, ..)| *key == curve.method) {
                labels.push((&curve.method, &curve.label, curve.ours));
            }
            let of = notes.entry(&curve.method).or_default();
            let odd = (!curve.comparable).then(|| format!("Not comparable: it {NOT_COMPARABLE}."));
            for note in odd.into_iter().chain(curve.notes.iter().cloned()) {
                match of.iter_mut().find(|(text, _)| *text == note) {
                    Some((_, scenes)) => scenes.push(&scene.name),
                    None => of.push((note, vec![&scene.name])),
                }
            }
        }
    }
    let mut text =
        String::from("<section id=\"methods\">\n<h2>Methods, and what they do differently</h2>\n<dl>\n");
    for (key, label, ours) in labels {
        let of = notes.get(key).map(Vec::as_slice).unwrap_or_default();
        let told: String = of
            .iter()
            .map(|(note, scenes)| {
                format!(
                    "<div>{} <span class=\"hint\">({})</span></div>",
                    escape(note),
                    escape(&scenes.join(", "))
                )
            })
            .collect();
        let told = match (told.is_empty(), ours) {
            (false, _) => told,
            (true, true) => "ours; nothing to note".into(),
            (true, false) => "nothing to note".into(),
        };
        text += &format!("<dt>{}</dt><dd>{told}</dd>\n", escape(label));
    }
    text + "</dl>\n</section>\n"
}
