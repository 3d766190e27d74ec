//! Values as people type them: 2%, 90s, 640x480, 0.2,0.3,1.

use geometry::Rgb;
use std::path::PathBuf;
use std::time::Duration;

/// The sky of `--sky`.
#[derive(Clone, Debug, PartialEq)]
pub enum SkyValue {
    /// The same radiance from everywhere, cd/m².
    Constant(Rgb),
    /// A panorama.
    File(PathBuf),
}

/// A share: "2%", or "0.02"; above 0, at most 100 %.
pub fn share(s: &str) -> Result<f32, String> {
    let value = match s.strip_suffix('%') {
        Some(percent) => number(percent)? / 100.0,
        None => {
            let value = number(s)?;
            if value >= 1.0 {
                return Err(format!("write {s}% for {s} per cent"));
            }
            value
        }
    };
    match value > 0.0 && value <= 1.0 {
        true => Ok(value),
        false => Err("it must be above 0 and at most 100%".into()),
    }
}

/// A time: "90s", "90", "5m", "1h", "1m30s".
pub fn duration(s: &str) -> Result<Duration, String> {
    let mut seconds = 0.0;
    let mut rest = s.trim();
    if rest.is_empty() {
        return Err("write a time such as 60s, 5m or 1h".into());
    }
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
        let unit_end = rest[digits..].find(|c: char| c.is_ascii_digit()).map_or(rest.len(), |i| digits + i);
        let unit = match rest[digits..unit_end].trim() {
            "" | "s" => 1.0,
            "m" | "min" => 60.0,
            "h" => 3600.0,
            other => return Err(format!("{other:?} is no unit of time; write s, m or h")),
        };
        seconds += f64::from(number(&rest[..digits])?) * unit;
        rest = &rest[unit_end..];
    }
    match seconds > 0.0 {
        true => Duration::try_from_secs_f64(seconds).map_err(|e| e.to_string()),
        false => Err("it must be above 0".into()),
    }
}

/// A size: "640x480".
pub fn size(s: &str) -> Result<(u32, u32), String> {
    let help = "write WIDTHxHEIGHT, such as 640x480";
    let (w, h) = s.split_once(['x', 'X']).ok_or(help)?;
    let side = |s: &str| s.trim().parse::<u32>().ok().filter(|&n| n > 0).ok_or(help);
    Ok((side(w)?, side(h)?))
}

/// A sky: one number or three, in cd/m², or else the name of a file.
pub fn sky(s: &str) -> Result<SkyValue, String> {
    let numbers: Option<Vec<f32>> = s.split(',').map(|v| v.trim().parse().ok()).collect();
    let Some(numbers) = numbers else {
        return Ok(SkyValue::File(s.into()));
    };
    if numbers.iter().any(|v: &f32| !v.is_finite() || *v < 0.0) {
        return Err("radiance is finite and not negative".into());
    }
    match numbers[..] {
        [v] => Ok(SkyValue::Constant(Rgb::splat(v))),
        [r, g, b] => Ok(SkyValue::Constant(Rgb::new(r, g, b))),
        _ => Err("write one number or three, R,G,B, in cd/m2".into()),
    }
}

/// A factor on the lamps of a name: "Desk lamp=0.5", "sky=1,0.9,0.8".
pub fn light(s: &str) -> Result<(String, Rgb), String> {
    let help = "write NAME=FACTOR or NAME=R,G,B, such as Lamp=0.5";
    let (name, factor) = s.rsplit_once('=').ok_or(help)?;
    let factors: Result<Vec<f32>, String> = factor.split(',').map(strength).collect();
    match factors?[..] {
        [v] if !name.is_empty() => Ok((name.into(), Rgb::splat(v))),
        [r, g, b] if !name.is_empty() => Ok((name.into(), Rgb::new(r, g, b))),
        _ => Err(help.into()),
    }
}

/// A finite number that is not negative.
pub fn strength(s: &str) -> Result<f32, String> {
    let value = number(s)?;
    if value < 0.0 { Err("it must not be negative".into()) } else { Ok(value) }
}

/// Any finite number.
pub fn number(s: &str) -> Result<f32, String> {
    let value = s.trim().parse::<f32>().ok().filter(|v| v.is_finite());
    value.ok_or_else(|| format!("{s:?} is not a number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_take_a_percent_sign_or_a_fraction() {
        assert_eq!(share("2%"), Ok(0.02));
        assert_eq!(share("0.02"), Ok(0.02));
        assert_eq!(share("0.5 %").ok(), Some(0.005));
        for bad in ["2", "0", "-1%", "nan%", "inf", "", "%", "101%"] {
            assert!(share(bad).is_err(), "{bad}");
        }
        assert!(share("3").unwrap_err().contains("3%"));
    }

    #[test]
    fn times_take_units() {
        let seconds = |s| duration(s).map(|d| d.as_secs_f64());
        assert_eq!(seconds("60s"), Ok(60.0));
        assert_eq!(seconds("1.5"), Ok(1.5));
        assert_eq!(seconds("1m30s"), Ok(90.0));
        assert_eq!(seconds("2h"), Ok(7200.0));
        for bad in ["", "s", "5d", "0s", "-3s", "1e9999", "1..2"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes_have_two_sides() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        for bad in ["640", "0x4", "4x", "axb", "4x-4", "1x2x3"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn lamps_take_a_factor_or_a_tint() {
        assert_eq!(light("Desk lamp=0.5"), Ok(("Desk lamp".into(), Rgb::splat(0.5))));
        assert_eq!(light("a=b=1,0.5,0"), Ok(("a=b".into(), Rgb::new(1.0, 0.5, 0.0))));
        for bad in ["", "Lamp", "=1", "Lamp=", "Lamp=-1", "Lamp=1,2", "Lamp=inf"] {
            assert!(light(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_sky_is_a_colour_or_a_file() {
        assert_eq!(sky("100"), Ok(SkyValue::Constant(Rgb::splat(100.0))));
        assert_eq!(sky("1, 2,3"), Ok(SkyValue::Constant(Rgb::new(1.0, 2.0, 3.0))));
        assert_eq!(sky("noon,2.hdr"), Ok(SkyValue::File("noon,2.hdr".into())));
        for bad in ["1,2", "-1", "nan", "1,2,inf"] {
            assert!(sky(bad).is_err(), "{bad}");
        }
    }
}
