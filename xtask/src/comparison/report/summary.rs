//! `summary.md`: the tables that fit into a README or the message of a commit.

use super::words::{escape_markdown, slug};
use super::{Chart, tables};
use crate::comparison::results::Results;

/// The whole file; `charts` are those of the scenes.
pub fn markdown(results: &Results, charts: &[Option<Chart>]) -> String {
    let machine = &results.machine;
    let words = [
        ("", machine.processor.as_str()),
        ("", machine.system.as_str()),
        ("commit ", results.commit.as_str()),
        ("", results.date.as_str()),
    ];
    let words: Vec<String> = words
        .iter()
        .filter(|(_, text)| !text.is_empty())
        .map(|(before, text)| format!("{before}{}", escape_markdown(text)))
        .collect();
    let mut text = format!(
        "# Speed against accuracy\n\nSeconds of the whole process, {} threads. {}.\n",
        results.threads,
        words.join(", ")
    );
    let glance = tables::at_a_glance(results);
    if !glance.rows.is_empty() {
        text += &format!("\n{}", glance.markdown());
    }
    for (scene, chart) in results.scenes.iter().zip(charts) {
        text += &format!("\n## {}\n\n", escape_markdown(&scene.name));
        if let Some(chart) = chart {
            text += &format!("![Error against time](charts/{}.svg)\n\n", chart.name);
        }
        text += &tables::seconds_to_levels(scene).markdown();
        if scene.curves.iter().any(|c| !c.comparable) {
            text += "\n† renders another picture: its error is no measure of it.\n";
        }
    }
    for sweep in &results.scaling {
        text += &format!("\n## {}\n\n{}", escape_markdown(&sweep.title), tables::sweep(sweep).markdown());
    }
    if !results.rays.is_empty() {
        text += &format!("\n## Rays per second, one thread\n\n{}", tables::rays(results).markdown());
    }
    text
}

/// The name of a scene's chart: `charts/NAME.svg`.
pub fn chart_name(name: &str, taken: &[String]) -> String {
    let base = slug(name);
    let mut name = base.clone();
    let mut i = 2;
    while taken.contains(&name) {
        name = format!("{base}-{i}");
        i += 1;
    }
    name
}
