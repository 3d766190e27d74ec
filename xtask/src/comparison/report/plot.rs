//! A chart of lines: its panel, axes, curves and legend, wide for a page and narrow for a phone.

use super::axis::Axis;
use super::labels::{self, Named};
use super::markers;
use super::style::{DOMINATED, FAINT, GREY, INK, PANEL, Style};
use super::svg::{Area, Drawing, Drawn, bold, px, stroke, text};
use super::words::escape;
use anyhow::Result;
use plotters::chart::ChartBuilder;
use plotters::coord::ranged1d::Ranged;
use plotters::element::{PathElement, Polygon, Rectangle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, TRANSPARENT};

/// What a chart shows.
pub struct Plot {
    /// Its heading.
    pub title: String,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// In the order of the legend.
    pub lines: Vec<Line>,
    /// Corners of the Pareto front, from left to right; empty for none.
    pub front: Vec<(f64, f64)>,
}

/// One line of it.
pub struct Line {
    /// Its `data-curve` in the SVG.
    pub key: String,
    /// In the legend.
    pub label: String,
    /// Small words under the label, such as `renders another picture`.
    pub remark: Option<&'static str>,
    /// Its looks.
    pub style: Style,
    /// In the order in which they are joined; those that an axis cannot show are skipped.
    pub points: Vec<Mark>,
}

impl Line {
    /// Height of its row in the legend, pixels.
    fn row(&self) -> f64 {
        ROW + if self.remark.is_some() { 14.0 } else { 0.0 }
    }
}

/// One point of a line.
pub struct Mark {
    /// Place on the axes.
    pub at: (f64, f64),
    /// Half the height of its error bar, on the y axis.
    pub spread: Option<f64>,
    /// What it says of itself under the mouse.
    pub tip: String,
}

/// Where a chart is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A page or a README: the legend stands beside it.
    Wide,
    /// A phone: the legend stands below.
    Narrow,
}

/// Height of a row of the legend and width of its column beside a chart, pixels.
const ROW: f64 = 25.0;
const BESIDE: f64 = 232.0;
/// Size of words and of markers, pixels.
const SMALL: f64 = 13.0;
const MARKER: f64 = 8.0;

/// Where the parts of a chart lie, pixels.
struct Layout {
    width: f64,
    height: f64,
    /// Left, top, right, bottom of the plot proper.
    frame: [f64; 4],
    /// Upper left corner of the legend.
    legend: (f64, f64),
    /// Letters of a label that find room.
    letters: usize,
    /// Letters of the title that do, and their size.
    heading: (usize, f64),
}

impl Layout {
    fn of(plot: &Plot, form: Form) -> Layout {
        let front = if plot.front.is_empty() { 0.0 } else { ROW };
        let legend: f64 = plot.lines.iter().map(Line::row).sum::<f64>() + front;
        match form {
            Form::Wide => {
                let height = (legend + 90.0).max(500.0);
                let right = 920.0 - BESIDE - 20.0;
                let frame = [72.0, 66.0, right, height - 58.0];
                Layout {
                    width: 920.0,
                    height,
                    frame,
                    legend: (right + 26.0, 78.0),
                    letters: 26,
                    heading: (85, 17.0),
                }
            }
            Form::Narrow => {
                let frame = [66.0, 62.0, 366.0, 350.0];
                let height = 350.0 + 64.0 + legend;
                Layout {
                    width: 390.0,
                    height,
                    frame,
                    legend: (20.0, 350.0 + 68.0),
                    letters: 42,
                    heading: (40, 14.0),
                }
            }
        }
    }
}

/// The chart as SVG of class `chart` and the form's own.
pub fn draw(plot: &Plot, form: Form) -> Result<String> {
    let layout = Layout::of(plot, form);
    let [left, top, right, bottom] = layout.frame;
    let mut drawing = Drawing::new(layout.width as u32, layout.height as u32);
    let place =
        |(x, y): (f64, f64)| (plot.x.map(&x, (px(left), px(right))), plot.y.map(&y, (px(bottom), px(top))));

    drawing.layer("class=\"panel\"", None, |area| {
        area.draw(&Rectangle::new([(0, 0), area.dim_in_pixel_i32()], PANEL.filled()))?;
        let (letters, size) = layout.heading;
        area.draw_text(&cut(&plot.title, letters), &bold(size, INK), (px(16.0), px(14.0)))?;
        area.draw_text(&plot.y.title, &text(SMALL, GREY), (px(16.0), px(40.0)))?;
        let below = text(SMALL, GREY).pos(Pos::new(HPos::Right, VPos::Bottom));
        area.draw_text(&plot.x.title, &below, (px(right), px(bottom + 46.0)))
    })?;
    let frame = layout.frame.map(px);
    let corners: Vec<(i32, i32)> = plot.front.iter().map(|&p| place(p)).collect();
    let steps = steps(&corners, frame);
    if !steps.is_empty() {
        drawing.layer("class=\"dominated\"", None, |area| land(area, &steps, frame))?;
    }
    drawing.layer("class=\"grid\"", None, |area| mesh(area, plot, &layout))?;
    for line in &plot.lines {
        curve(&mut drawing, plot, line, place)?;
    }
    let named = |line: &Line| Named {
        name: line.label.clone(),
        style: line.style,
        points: shown(plot, line).map(|m| place(m.at)).collect(),
    };
    let ends: Vec<Named> = plot.lines.iter().map(named).collect();
    drawing.layer("class=\"names\"", None, |area| labels::draw(area, &ends, &steps, frame))?;
    drawing.layer("class=\"legend\"", None, |area| legend(area, plot, &layout))?;
    let class = if form == Form::Wide { "chart wide" } else { "chart narrow" };
    Ok(drawing.finish(class, &plot.title))
}

/// Points that both axes can show.
fn shown<'a>(plot: &'a Plot, line: &'a Line) -> impl Iterator<Item = &'a Mark> {
    line.points.iter().filter(|m| plot.x.shows(m.at.0) && plot.y.shows(m.at.1))
}

fn mesh(area: &Area, plot: &Plot, layout: &Layout) -> Drawn<()> {
    let [left, top, right, bottom] = layout.frame.map(px);
    let (width, height) = area.dim_in_pixel_i32();
    let label = text(SMALL, GREY);
    let mut chart = ChartBuilder::on(area)
        .margin_top(top)
        .margin_right(width - right)
        .set_left_and_bottom_label_area_size(0)
        .x_label_area_size(height - bottom)
        .y_label_area_size(left)
        .build_cartesian_2d(plot.x.clone(), plot.y.clone())?;
    chart
        .configure_mesh()
        .bold_line_style(stroke(1.0, FAINT))
        .light_line_style(TRANSPARENT)
        .axis_style(stroke(1.0, GREY))
        .label_style(label)
        .set_all_tick_mark_size(px(5.0))
        .draw()
}

/// Corners of the front as it is drawn: from the top down to its first point, then by steps to the right edge.
fn steps(front: &[(i32, i32)], [_, top, right, _]: [i32; 4]) -> Vec<(i32, i32)> {
    let (Some(first), Some(last)) = (front.first(), front.last()) else { return Vec::new() };
    let mut steps = vec![(first.0, top), *first];
    for pair in front.windows(2) {
        steps.extend([(pair[1].0, pair[0].1), pair[1]]);
    }
    steps.push((right, last.1));
    steps
}

/// The grey land behind the front: for every point in it, there is a better one.
fn land(area: &Area, steps: &[(i32, i32)], [_, top, right, _]: [i32; 4]) -> Drawn<()> {
    let land: Vec<(i32, i32)> = steps.iter().copied().chain([(right, top)]).collect();
    area.draw(&Polygon::new(land, DOMINATED.filled()))?;
    area.draw(&PathElement::new(steps.to_vec(), stroke(1.0, GREY)))
}

/// A line and its points; each point is a group of its own, so that it can say what it is.
fn curve(
    drawing: &mut Drawing,
    plot: &Plot,
    line: &Line,
    place: impl Fn((f64, f64)) -> (i32, i32),
) -> Result<()> {
    let dash = match line.style.dashed {
        true => format!(" stroke-dasharray=\"{} {}\"", px(6.0), px(5.0)),
        false => String::new(),
    };
    drawing.open(&format!("class=\"curve\" data-curve=\"{}\"", escape(&line.key)));
    let path: Vec<(i32, i32)> = shown(plot, line).map(|m| place(m.at)).collect();
    if path.len() > 1 {
        drawing.layer(&format!("class=\"line\"{dash}"), Some(&line.label), |area| {
            area.draw(&PathElement::new(path, stroke(f64::from(line.style.width), line.style.colour)))
        })?;
    }
    let size = if line.style.width > 2 { MARKER + 1.5 } else { MARKER };
    for mark in shown(plot, line) {
        let (x, y) = mark.at;
        drawing.layer("class=\"point\"", Some(&mark.tip), |area| {
            if let Some(spread) = mark.spread {
                let (at, low) = (place((x, y + spread)), place((x, (y - spread).max(plot.y.range().start))));
                // Shorter than the marker, it would only smear it.
                if low.1 - at.1 > px(size + 4.0) {
                    area.draw(&PathElement::new(vec![at, low], stroke(1.0, line.style.colour)))?;
                }
            }
            markers::draw(area, &line.style, place(mark.at), size)
        })?;
    }
    drawing.close();
    Ok(())
}

fn legend(area: &Area, plot: &Plot, layout: &Layout) -> Drawn<()> {
    let (x, mut y) = layout.legend;
    let middle = |style: plotters::style::TextStyle<'static>| style.pos(Pos::new(HPos::Left, VPos::Center));
    for line in &plot.lines {
        let path = vec![(px(x), px(y)), (px(x + 30.0), px(y))];
        let ink = stroke(f64::from(line.style.width), line.style.colour);
        match line.style.dashed {
            false => area.draw(&PathElement::new(path, ink))?,
            true => {
                for from in [0.0, 11.0, 22.0] {
                    let dash = vec![(px(x + from), px(y)), (px(x + from + 7.0), px(y))];
                    area.draw(&PathElement::new(dash, ink))?;
                }
            }
        }
        markers::draw(area, &line.style, (px(x + 15.0), px(y)), MARKER + 1.0)?;
        let words = cut(&line.label, layout.letters);
        area.draw_text(&words, &middle(text(SMALL + 1.0, INK)), (px(x + 40.0), px(y)))?;
        if let Some(remark) = line.remark {
            area.draw_text(remark, &middle(text(SMALL - 2.0, GREY)), (px(x + 40.0), px(y + 15.0)))?;
        }
        y += line.row();
    }
    if !plot.front.is_empty() {
        let path = [(0.0, -6.0), (14.0, -6.0), (14.0, 6.0), (30.0, 6.0)];
        let path: Vec<(i32, i32)> = path.iter().map(|(dx, dy)| (px(x + dx), px(y + dy))).collect();
        area.draw(&PathElement::new(path, stroke(1.0, GREY)))?;
        area.draw_text("Pareto front", &middle(text(SMALL + 1.0, GREY)), (px(x + 40.0), px(y)))?;
    }
    Ok(())
}

/// The first letters of a label, and a sign that there are more.
fn cut(label: &str, letters: usize) -> String {
    match label.chars().count() > letters {
        true => label.chars().take(letters - 1).chain(['…']).collect(),
        false => label.into(),
    }
}

/// What plotters lacks a short word for.
trait Shorthand {
    fn dim_in_pixel_i32(&self) -> (i32, i32);
}

impl Shorthand for Area<'_> {
    fn dim_in_pixel_i32(&self) -> (i32, i32) {
        let (w, h) = self.dim_in_pixel();
        (w as i32, h as i32)
    }
}
