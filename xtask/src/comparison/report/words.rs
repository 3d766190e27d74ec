//! Numbers and texts as a reader sees them; nothing from the data reaches a page but through here.

/// Stands for a number that is not there, or is none.
pub const NONE: &str = "–";

/// Binds a number to its unit, so that no line breaks between them.
const BOUND: char = '\u{a0}';

/// Text for HTML and SVG, in elements and in quoted attributes.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            // XML has no place for these, not even escaped.
            c if c.is_control() && !matches!(c, '\n' | '\t') => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}

/// Text for a cell of a Markdown table: one line, no markup of its own.
pub fn escape_markdown(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '|' | '*' | '_' | '`' | '[' | ']' | '<' | '>' | '\\' | '#' => safe.extend(['\\', c]),
            c if c.is_control() => safe.push(' '),
            c => safe.push(c),
        }
    }
    safe
}

/// A name that is safe in a file name, a URL and an `id`: letters, digits, `-`, `_` and `.`.
pub fn slug(name: &str) -> String {
    let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let safe: String = name.chars().map(|c| if fits(c) { c } else { '-' }).collect();
    match safe.trim_matches('.').is_empty() {
        true => "unnamed".into(),
        false => safe.trim_matches('.').into(),
    }
}

/// `value` with `digits` digits that count, never as 1e-5; integers keep all theirs.
pub fn number(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return NONE.into();
    }
    if value == 0.0 {
        return "0".into();
    }
    // Twelve decimals and a thousand digits both end somewhere, whatever a damaged file claims.
    let magnitude = value.abs().log10().floor().clamp(-12.0, 300.0) as i32;
    let decimals = (digits - 1 - magnitude).max(0) as usize;
    let text = format!("{:.decimals$}", value.abs());
    let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
    let mut grouped = String::new();
    for (i, digit) in whole.chars().enumerate() {
        // Four digits read well without a gap.
        if i > 0 && whole.len() > 4 && (whole.len() - i).is_multiple_of(3) {
            grouped.push('\u{202f}');
        }
        grouped.push(digit);
    }
    let sign = if value < 0.0 { "−" } else { "" };
    match fraction.is_empty() {
        true => format!("{sign}{grouped}"),
        false => format!("{sign}{grouped}.{fraction}"),
    }
}

fn with_unit(value: f64, digits: i32, unit: &str) -> String {
    match value.is_finite() {
        true => format!("{}{BOUND}{unit}", number(value, digits)),
        false => NONE.into(),
    }
}

/// A fraction as percent: 0.0234 is 2.3 %.
pub fn percent(fraction: f64) -> String {
    with_unit(100.0 * fraction, 2, "%")
}

/// A fraction as percent with its sign, for what can be too much or too little.
pub fn signed_percent(fraction: f64) -> String {
    match fraction > 0.0 {
        true => format!("+{}", percent(fraction)),
        false => percent(fraction),
    }
}

/// An error and its standard error, to the same decimal: 2.31 ± 0.04 %.
pub fn percent_with_error(fraction: f64, error: Option<f64>) -> String {
    let Some(error) = error.filter(|e| e.is_finite() && *e > 0.0 && fraction.is_finite()) else {
        return percent(fraction);
    };
    let (value, error) = (100.0 * fraction, 100.0 * error);
    let decimals = (-error.log10().floor()).clamp(0.0, 4.0) as usize;
    format!("{value:.decimals$} ± {error:.decimals$}{BOUND}%")
}

/// A round fraction as percent, without needless zeros: 0.005 is 0.5 %.
pub fn short_percent(fraction: f64) -> String {
    format!("{}{BOUND}%", short(100.0 * fraction))
}

/// Up to four digits that count, without zeros behind the point.
pub fn short(value: f64) -> String {
    let text = number(value, 4);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}

/// Seconds of a clock.
pub fn seconds(s: f64) -> String {
    with_unit(s, if s < 100.0 { 2 } else { 3 }, "s")
}

/// Megabytes.
pub fn megabytes(mb: f64) -> String {
    with_unit(mb, if mb < 100.0 { 2 } else { 3 }, "MB")
}

/// How many times as much, against something that is 1.
pub fn ratio(times: f64) -> String {
    match times.is_finite() && times > 0.0 {
        true => format!("×{BOUND}{}", number(times, 2)),
        false => NONE.into(),
    }
}

/// A large count, in thousands, millions and so on.
pub fn count(n: u64) -> String {
    let n = n as f64;
    let units = [(1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k")];
    match units.iter().find(|(size, _)| n >= 10.0 * size) {
        Some((size, unit)) => format!("{}{BOUND}{unit}", number(n / size, 3)),
        None => number(n, 0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_never_absurd() {
        let cases = [
            (0.0, "0"),
            (0.0123, "0.012"),
            (1.0, "1.0"),
            (9.96, "10.0"),
            (59.4, "59"),
            (1234.0, "1234"),
            (12345.0, "12\u{202f}345"),
            (-0.5, "−0.50"),
            (f64::NAN, NONE),
            (f64::INFINITY, NONE),
        ];
        for (value, text) in cases {
            assert_eq!(number(value, 2), text, "{value}");
        }
        assert!(number(1e-300, 2).len() < 20);
        assert!(number(f64::MAX, 2).starts_with("179"));
    }

    #[test]
    fn errors_share_their_decimals() {
        assert_eq!(percent_with_error(0.02314, Some(0.0004)), "2.31 ± 0.04\u{a0}%");
        assert_eq!(percent_with_error(0.02314, None), "2.3\u{a0}%");
        assert_eq!(percent_with_error(f64::NAN, Some(0.1)), NONE);
        assert_eq!(percent_with_error(0.5, Some(0.0)), "50\u{a0}%");
        assert_eq!(
            (short_percent(0.005), short(0.3), short(1e6)),
            ("0.5\u{a0}%".into(), "0.3".into(), "1\u{202f}000\u{202f}000".into())
        );
        assert_eq!(signed_percent(0.012), "+1.2\u{a0}%");
        assert_eq!(signed_percent(-0.012), "−1.2\u{a0}%");
    }

    #[test]
    fn counts_have_a_unit() {
        assert_eq!(count(0), "0");
        assert_eq!(count(34), "34");
        assert_eq!(count(9999), "9999");
        assert_eq!(count(12_345), "12.3\u{a0}k");
        assert_eq!(count(2_500_000), "2500\u{a0}k");
        assert_eq!(count(u64::MAX), "18\u{202f}446\u{202f}744\u{a0}T");
    }

    #[test]
    fn no_text_escapes_from_its_place() {
        assert_eq!(escape("<b a='1'>&\"\u{0}"), "&lt;b a=&#39;1&#39;&gt;&amp;&quot;\u{fffd}");
        assert_eq!(escape_markdown("a|b\n<c>"), "a\\|b \\<c\\>");
        assert_eq!(slug("../Küche 1"), "-K-che-1");
        assert_eq!(slug(".."), "unnamed");
    }
}
