//! The comparison as a page to read: `index.html`, its charts as files, and its tables as Markdown.

mod axis;
mod charts;
mod front;
mod labels;
mod markers;
mod page;
mod pictures;
mod plot;
mod stages;
mod style;
mod summary;
mod svg;
mod table;
mod tables;
mod viewer;
mod words;

use super::results::Results;
use anyhow::{Context, Result};
use plot::{Form, Plot};
use std::path::Path;

/// Writes `index.html`, `charts/` and `summary.md` into `folder`, which holds the pictures that `results` names.
///
/// The page is one file that needs no other and no network. What cannot be shown (a picture that is gone, a point
/// without an error) is said on it; only what cannot be written is an error.
pub fn write(results: &Results, folder: &Path) -> Result<()> {
    let mut names = Vec::new();
    let mut scenes = Vec::new();
    for scene in &results.scenes {
        let plot = charts::error_against_seconds(scene);
        scenes.push(plot.map(|p| Chart::draw(&scene.name, &p, &mut names)).transpose()?);
    }
    let mut sweeps = Vec::new();
    for sweep in &results.scaling {
        let draw =
            |(what, plot): (&str, Plot)| Chart::draw(&format!("{}-{what}", sweep.name), &plot, &mut names);
        sweeps.push(charts::sweep(sweep).into_iter().map(draw).collect::<Result<Vec<Chart>>>()?);
    }
    let root = crate::root();
    let galleries: Vec<_> = results.scenes.iter().map(|s| pictures::read(s, folder, &root)).collect();
    let (embedded, picture_bytes) = pictures::encode(&galleries)?;

    let charts_folder = folder.join("charts");
    std::fs::create_dir_all(&charts_folder).with_context(|| format!("making {}", charts_folder.display()))?;
    for chart in scenes.iter().flatten().chain(sweeps.iter().flatten()) {
        save(&charts_folder.join(format!("{}.svg", chart.name)), &chart.wide)?;
    }
    save(&folder.join("summary.md"), &summary::markdown(results, &scenes))?;
    let parts = page::Parts { scenes, sweeps, galleries, embedded, picture_bytes };
    save(&folder.join("index.html"), &page::html(results, &parts))
}

fn save(path: &Path, text: &str) -> Result<()> {
    raytrace::output::write_atomically(path, text.as_bytes())?;
    Ok(())
}

/// A chart in both its forms.
struct Chart {
    /// Its file is `charts/NAME.svg`.
    name: String,
    wide: String,
    narrow: String,
}

impl Chart {
    fn draw(name: &str, plot: &Plot, names: &mut Vec<String>) -> Result<Chart> {
        let name = summary::chart_name(name, names);
        names.push(name.clone());
        Ok(Chart { name, wide: plot::draw(plot, Form::Wide)?, narrow: plot::draw(plot, Form::Narrow)? })
    }

    /// Both, of which the page shows the one that fits.
    fn html(&self) -> String {
        format!(
            "<figure class=\"plot\" data-chart=\"{}\">\n{}{}</figure>\n",
            self.name, self.wide, self.narrow
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::results::{Curve, Point, Scene, Sweep};
    use super::*;

    /// A curve of (seconds, error).
    pub fn curve(method: &str, ours: bool, points: &[(f64, f64)]) -> Curve {
        let point = |&(seconds, error): &(f64, f64)| Point { seconds, error, ..Point::default() };
        let points = points.iter().map(point).collect();
        Curve { method: method.into(), label: method.into(), ours, comparable: true, points, notes: vec![] }
    }

    /// A scene of those curves.
    pub fn scene(curves: Vec<Curve>) -> Scene {
        Scene { name: "room".into(), width: 8, height: 8, curves, ..Scene::default() }
    }

    fn page(results: &Results) -> String {
        let dir = tempfile::tempdir().unwrap();
        write(results, dir.path()).unwrap();
        std::fs::read_to_string(dir.path().join("index.html")).unwrap()
    }

    #[test]
    fn nothing_is_a_page_too() {
        assert!(page(&Results::default()).contains("How errors are defined"));
        let empty =
            Results { scenes: vec![scene(vec![])], scaling: vec![Sweep::default()], ..Results::default() };
        assert!(page(&empty).contains("nothing to draw"));
    }

    #[test]
    fn no_text_of_the_data_becomes_markup() {
        let evil = "</script><script>alert(1)</script>{js}";
        let mut c = curve(evil, true, &[(1.0, 0.1), (f64::NAN, f64::NEG_INFINITY), (0.0, 0.0)]);
        c.notes.push(evil.into());
        c.comparable = false;
        c.points[0].setting = evil.into();
        c.points[0].stages.insert(evil.into(), 1.0);
        c.points[0].picture = Some(evil.into());
        let mut s = scene(vec![c]);
        s.name = evil.into();
        s.camera = evil.into();
        s.reference.made_by = evil.into();
        let mut results =
            Results { scenes: vec![s], commit: evil.into(), date: evil.into(), ..Results::default() };
        results.versions.insert(evil.into(), evil.into());
        results.machine.processor = evil.into();
        let sweep = Sweep { name: evil.into(), title: evil.into(), axis: evil.into(), ..Sweep::default() };
        results.scaling.push(sweep);
        let page = page(&results);
        assert_eq!(page.matches("<script>").count(), 1);
        assert_eq!(page.matches("</script>").count(), 1);
    }

    #[test]
    fn scenes_of_one_name_keep_their_charts_apart() {
        let one = || scene(vec![curve("split", true, &[(1.0, 0.1)])]);
        let dir = tempfile::tempdir().unwrap();
        write(&Results { scenes: vec![one(), one()], ..Results::default() }, dir.path()).unwrap();
        assert!(dir.path().join("charts/room-2.svg").is_file());
    }
}
