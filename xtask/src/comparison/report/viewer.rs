//! The pictures of a scene on the page: a strip of all, and a stage on which any two are laid over one another.

use super::pictures::{ERROR, Encoded, Gallery, Picture};
use super::words::{escape, number, seconds, short_percent};
use raytrace::difference::{SCALE, false_colour};

/// Width at which small pictures are shown, pixels, at most: pixels are repeated a whole number of times.
const STAGE: u32 = 800;

/// The pictures of one scene; says why if there are none. `embedded` holds the files of `gallery.pictures`.
pub fn html(gallery: &Gallery, embedded: &[Encoded]) -> String {
    let missing: String = gallery.missing.iter().map(|m| format!("<li>{}</li>\n", escape(m))).collect();
    let missing = match missing.is_empty() {
        true => String::new(),
        false => format!("<p>Not shown:</p>\n<ul class=\"missing\">\n{missing}</ul>\n"),
    };
    let pictures: Vec<(&Picture, &Encoded)> = gallery.pictures.iter().zip(embedded).collect();
    if pictures.len() < 2 {
        return missing;
    }
    let intro = format!(
        "<p>All at the exposure of the reference (EV {}). Of each method the picture nearest to {}{} \
         Below each: where it errs.</p>\n",
        number(f64::from(gallery.exposure), 3),
        gallery.moment.map(|m| format!("{} and the one nearest to ", seconds(m))).unwrap_or_default(),
        short_percent(ERROR) + "."
    );
    format!(
        "<h3>Pictures</h3>\n{intro}{}{}{}{missing}",
        stage(gallery, &pictures),
        scale(),
        strip(gallery, &pictures)
    )
}

/// Two pictures over one another; the script fills it from the strip.
fn stage(gallery: &Gallery, pictures: &[(&Picture, &Encoded)]) -> String {
    let (width, height) = pictures[0].1.size;
    let shown = width * (STAGE / width.max(1)).clamp(1, 8);
    let options = |chosen: usize| -> String {
        let option = |(i, (p, _)): (usize, &(&Picture, &Encoded))| {
            let selected = if i == chosen { " selected" } else { "" };
            format!("<option value=\"{i}\"{selected}>{}</option>", escape(&title(p)))
        };
        pictures.iter().enumerate().map(option).collect()
    };
    let mut text = include_str!("viewer.html").to_string();
    for (name, value) in [
        ("{left}", options(gallery.first.min(pictures.len() - 1))),
        ("{right}", options(0)),
        ("{width}", shown.to_string()),
        ("{columns}", width.to_string()),
        ("{rows}", height.to_string()),
    ] {
        text = text.replace(name, &value);
    }
    text
}

fn title(picture: &Picture) -> String {
    match picture.is_reference() || picture.caption.is_empty() {
        true => picture.name.clone(),
        false => format!("{} · {}", picture.name, picture.caption),
    }
}

/// The colours of the error maps.
fn scale() -> String {
    let steps = 24;
    let [low, high] = SCALE.map(f32::ln);
    let colour = |i: usize| {
        let [r, g, b] = false_colour((low + (high - low) * i as f32 / steps as f32).exp());
        format!("rgb({r} {g} {b})")
    };
    let colours: Vec<String> = (0..=steps).map(colour).collect();
    let decades = (SCALE[1] / SCALE[0]).log10().round() as i32;
    let ticks: String = (0..=decades)
        .map(|d| {
            let percent = 100.0 * f64::from(SCALE[0]) * 10f64.powi(d);
            format!("<span>{}&nbsp;%</span>", number(percent, 1))
        })
        .collect();
    format!(
        "<div class=\"scale\"><span>Error of a pixel</span><div><i style=\"background:linear-gradient(to right,{})\">\
         </i><div class=\"ticks\">{ticks}</div></div></div>\n",
        colours.join(",")
    )
}

fn strip(gallery: &Gallery, pictures: &[(&Picture, &Encoded)]) -> String {
    let badge = |on: bool, text: Option<String>| match text.filter(|_| on) {
        Some(text) => format!("<b class=\"badge\">nearest to {text}</b>"),
        None => String::new(),
    };
    let shot = |(i, (p, e)): (usize, &(&Picture, &Encoded))| {
        let name = escape(&p.name);
        // The reference stands for every time and error, and needs no badge to say so.
        let badges = match p.is_reference() {
            true => String::new(),
            false => {
                badge(p.at_time, gallery.moment.map(seconds)) + &badge(p.at_error, Some(short_percent(ERROR)))
            }
        };
        let errors = e
            .errors
            .as_ref()
            .map(|uri| format!("<img class=\"errors\" src=\"{uri}\" alt=\"error map of {name}\">"));
        format!(
            "<figure class=\"shot\" data-index=\"{i}\"><button type=\"button\" title=\"Put it on the stage\">\
             <img class=\"shown\" src=\"{}\" alt=\"{name}\">{}</button>\
             <figcaption><strong>{name}</strong> {}<br>{badges}</figcaption></figure>\n",
            e.shown,
            errors.unwrap_or_default(),
            escape(&p.caption),
        )
    };
    let shots: String = pictures.iter().enumerate().map(shot).collect();
    format!("<div class=\"strip\">\n{shots}</div>\n")
}
