//! `cargo xtask stability`: the torture cases over every method, as `assets/stability.md` and a chart.

use anyhow::{Context, Result, ensure};
use std::fmt::Write;
use support::stability::{ELSEWHERE, Section, form_factors, hemicube_errors, solvers};

/// Measures, writes, and fails if anything did not come out as it had to.
pub fn run() -> Result<()> {
    let sections = [form_factors(), solvers()];
    let errors = hemicube_errors();
    let assets = crate::root().join("assets");
    let page = assets.join("stability.md");
    std::fs::write(&page, markdown(&sections, &errors))
        .with_context(|| format!("writing {}", page.display()))?;
    let picture = assets.join("charts/hemicube.svg");
    std::fs::write(&picture, chart(&errors)).with_context(|| format!("writing {}", picture.display()))?;
    for section in &sections {
        println!("{}", section.markdown());
    }
    let surprises: Vec<String> = sections.iter().flat_map(Section::surprises).collect();
    ensure!(surprises.is_empty(), "not as it has to be:\n  {}", surprises.join("\n  "));
    println!("written to {} and {}", page.display(), picture.display());
    Ok(())
}

fn markdown(sections: &[Section], errors: &[(u32, f64)]) -> String {
    let mut text = String::from(
        "# Where methods fail\n\nMeasured by `cargo xtask stability`, and held by the tests `stability` and `random_rooms`: every \
         case over every method that claims to handle it, its error against a closed form or an invariant. ✓ is within what \
         is allowed; a limit is a case that a method must fail, as theory says, and does.\n",
    );
    for section in sections {
        text += &section.markdown();
    }
    text += "\n## The hemicube's error\n\nA lamp of a tenth of its distance, at 24 places, root mean square. It falls about as \
             one over the resolution, as pixels at its edges are counted whole or not at all.\n\n![Hemicube's error](charts/hemicube.svg)\n\n| pixels | error |\n|---|---|\n";
    for (n, error) in errors {
        let _ = writeln!(text, "| {n} | {:.2} % |", 100.0 * error);
    }
    text += "\n## Held by tests of their own, or not yet\n\n| case | what | where |\n|---|---|---|\n";
    for (id, what, test) in ELSEWHERE {
        let _ = writeln!(text, "| {id} | {what} | {} |", test.unwrap_or("**not yet**"));
    }
    text
}

/// Error against resolution, both by their logarithm, beside a line that falls as 1/n.
fn chart(errors: &[(u32, f64)]) -> String {
    let (w, h, left, top) = (480.0, 300.0, 60.0, 20.0);
    let (inner_w, inner_h) = (w - left - 20.0, h - top - 50.0);
    let x = |n: f64| left + inner_w * (n / 8.0).log2() / 6.0;
    // From 1000 % down to 0.1 %.
    let y = |e: f64| top + inner_h * (1.0 - e.log10()) / 4.0;
    let path = |points: &[(f64, f64)]| {
        points.iter().map(|&(n, e)| format!("{:.1},{:.1}", x(n), y(e))).collect::<Vec<_>>().join(" ")
    };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <title>Error of a hemicube's form factor against its resolution</title>\n<rect width=\"{w}\" height=\"{h}\" fill=\"#fff\"/>\n"
    );
    for (e, label) in [(10.0, "1000 %"), (1.0, "100 %"), (0.1, "10 %"), (0.01, "1 %"), (0.001, "0.1 %")] {
        let _ = writeln!(
            svg,
            "<line x1=\"{left}\" x2=\"{0:.1}\" y1=\"{1:.1}\" y2=\"{1:.1}\" stroke=\"#ddd\"/>",
            left + inner_w,
            y(e)
        );
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
            left - 6.0,
            y(e) + 4.0
        );
    }
    for (n, _) in errors {
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{n}</text>",
            x(f64::from(*n)),
            h - 34.0
        );
    }
    let points: Vec<(f64, f64)> = errors.iter().map(|&(n, e)| (f64::from(n), e.clamp(1e-3, 10.0))).collect();
    let first = points.first().copied().unwrap_or((8.0, 1.0));
    let ideal: Vec<(f64, f64)> =
        points.iter().map(|&(n, _)| (n, (first.1 * first.0 / n).max(1e-3))).collect();
    let _ = writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#999\" stroke-dasharray=\"4 3\"/>",
        path(&ideal)
    );
    let _ = writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#b03a2e\" stroke-width=\"2\"/>",
        path(&points)
    );
    for &(n, e) in &points {
        let _ = writeln!(svg, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"#b03a2e\"/>", x(n), y(e));
    }
    let _ = writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">pixels along an edge (dashed: 1/n)</text>\n</svg>",
        left + inner_w / 2.0,
        h - 12.0
    );
    svg
}

/// `assets/stability.md` as a section of a page; nothing if it was never written.
pub fn html() -> String {
    let Ok(text) = std::fs::read_to_string(crate::root().join("assets/stability.md")) else {
        return String::new();
    };
    let escape =
        |s: &str| s.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace("**", "");
    let mut out = String::from("<section id=\"stability\">\n<h2>Where methods fail</h2>\n");
    let mut rows: Vec<&str> = Vec::new();
    let flush = |rows: &mut Vec<&str>, out: &mut String| {
        for (i, row) in rows.iter().enumerate().filter(|(_, row)| !row.starts_with("|---")) {
            let (open, close) = match i {
                0 => (
                    "<div class=\"scroll\" tabindex=\"0\" role=\"region\"><table>\n<thead><tr><th>",
                    "</th></tr></thead>\n<tbody>",
                ),
                _ => ("<tr><td>", "</td></tr>"),
            };
            let between = if i == 0 { "</th><th>" } else { "</td><td>" };
            let cells: Vec<String> = row.trim_matches('|').split('|').map(|c| escape(c.trim())).collect();
            *out += &format!("{open}{}{close}\n", cells.join(between));
        }
        if !rows.is_empty() {
            *out += "</tbody></table></div>\n";
        }
        rows.clear();
    };
    for line in text.lines().skip(1) {
        if line.starts_with('|') {
            rows.push(line);
            continue;
        }
        flush(&mut rows, &mut out);
        match line.strip_prefix("## ") {
            Some(heading) => out += &format!("<h3>{}</h3>\n", escape(heading)),
            None if line.is_empty() || line.starts_with("![") => {}
            None => out += &format!("<p>{}</p>\n", escape(line)),
        }
    }
    flush(&mut rows, &mut out);
    out + "</section>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chart_spans_its_axes() {
        let svg = chart(&[(8, 0.5), (64, 0.05), (512, 0.001)]);
        assert!(
            svg.contains("<polyline points=\"60.0,") && svg.ends_with("</svg>\n") && !svg.contains("NaN")
        );
    }

    #[test]
    fn the_page_has_a_table_for_every_one_of_the_file() {
        let page = html();
        if page.is_empty() {
            println!("skipped: assets/stability.md was not written yet");
            return;
        }
        assert!(page.matches("<table>").count() == 4 && page.matches("</table>").count() == 4, "{page}");
        assert!(!page.contains("| "), "a row was left as it was");
    }
}
