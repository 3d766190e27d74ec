//! Values as people type them: 2%, 90s, 640x480, 0.2,0.3,1.

use geometry::{Rgb, Vec3};
use std::ops::Range;
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

/// Frames: "0..120" (the last is 119), or "7".
pub fn frames(s: &str) -> Result<Range<u32>, String> {
    let help = "write FIRST..END, such as 0..120, or one number";
    let number = |s: &str| s.trim().parse::<u32>().map_err(|_| help);
    let range = match s.split_once("..") {
        Some((a, b)) => number(a)?..number(b)?,
        None => number(s)?..number(s)?.checked_add(1).ok_or(help)?,
    };
    if range.is_empty() { Err("there is no frame among these".into()) } else { Ok(range) }
}

/// Two places or more, m.
#[derive(Clone, Debug, PartialEq)]
pub struct Places(pub Vec<Vec3>);

/// Places: "0,1.6,3 2,1.6,0", also with ; between them.
pub fn places(s: &str) -> Result<Places, String> {
    let all: Result<Vec<Vec3>, String> = s.split([' ', ';']).filter(|p| !p.is_empty()).map(place).collect();
    let all = all?;
    if all.len() < 2 { Err("write two places at least: \"0,1.6,3 2,1.6,0\"".into()) } else { Ok(Places(all)) }
}

/// A place or a direction: "1,0.85,2".
pub fn place(s: &str) -> Result<Vec3, String> {
    let numbers: Result<Vec<f32>, String> = s.split(',').map(number).collect();
    match numbers?[..] {
        [x, y, z] => Ok(Vec3::new(x, y, z)),
        _ => Err(format!("{s:?} is no place: write X,Y,Z")),
    }
}

/// A finite number above 0.
pub fn positive(s: &str) -> Result<f32, String> {
    let value = number(s)?;
    if value > 0.0 { Ok(value) } else { Err("it must be above 0".into()) }
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

/// A photometric file for the lamps of a name: "Desk lamp=downlight.ies".
pub fn web(s: &str) -> Result<(String, PathBuf), String> {
    match s.split_once('=') {
        Some((name, file)) if !name.is_empty() && !file.is_empty() => Ok((name.into(), file.into())),
        _ => Err("write NAME=FILE, such as Lamp=downlight.ies".into()),
    }
}

/// A finite number that is not negative.
pub fn strength(s: &str) -> Result<f32, String> {
    let value = number(s)?;
    if value < 0.0 { Err("it must not be negative".into()) } else { Ok(value) }
}

/// A finite number above 0.
pub fn length(s: &str) -> Result<f32, String> {
    let value = number(s)?;
    if value > 0.0 { Ok(value) } else { Err("it must be above 0".into()) }
}

/// A point or a direction: "1,0.85,-2".
pub fn vector(s: &str) -> Result<Vec3, String> {
    let numbers = numbers(s)?;
    match numbers[..] {
        [x, y, z] => Ok(Vec3::new(x, y, z)),
        _ => Err(format!("{s:?} is no X,Y,Z")),
    }
}

/// A rectangle, corner and two edges: "0,1,0 4,0,0 0,2,0".
pub fn rectangle(s: &str) -> Result<[Vec3; 3], String> {
    let vectors: Vec<Vec3> = s.split_whitespace().map(vector).collect::<Result<_, _>>()?;
    let [corner, across, up] = vectors[..] else {
        return Err("write corner, lower edge and left edge: \"X,Y,Z X,Y,Z X,Y,Z\"".into());
    };
    let cos = across.normalize_or_zero().dot(up.normalize_or_zero());
    match cos.abs() < 1e-3 {
        true => Ok([corner, across, up]),
        false => Err("the edges must be at right angles".into()),
    }
}

/// Values for lines to be drawn at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Levels(pub Vec<f64>);

/// Levels: "100,200,300", or "none".
pub fn levels(s: &str) -> Result<Levels, String> {
    if s == "none" {
        return Ok(Levels::default());
    }
    let levels = numbers(s)?.into_iter().map(f64::from).collect();
    Ok(Levels(levels))
}

fn numbers(s: &str) -> Result<Vec<f32>, String> {
    s.split(',').map(number).collect()
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
    fn frames_and_places_are_read() {
        assert_eq!(frames("0..120"), Ok(0..120));
        assert_eq!(frames("7"), Ok(7..8));
        for bad in ["", "..", "3..3", "5..2", "a..b", "-1..2", "0..=4", "4294967295"] {
            assert!(frames(bad).is_err(), "{bad}");
        }
        assert_eq!(places("0,1,2 3,4,5;6,7,8").map(|p| p.0.len()), Ok(3));
        for bad in ["", "0,1,2", "0,1 2,3", "a,b,c d,e,f", "0,0,inf 1,1,1"] {
            assert!(places(bad).is_err(), "{bad}");
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
    fn points_and_rectangles_are_in_metres() {
        assert_eq!(vector("1, -2,.5"), Ok(Vec3::new(1.0, -2.0, 0.5)));
        assert!(vector("1,2").is_err() && vector("1,2,x").is_err() && vector("1,2,inf").is_err());
        assert_eq!(rectangle("0,1,0 4,0,0  0,0,-2"), Ok([Vec3::Y, Vec3::X * 4.0, Vec3::NEG_Z * 2.0]));
        assert!(
            rectangle("0,1,0 4,0,0").is_err()
                && rectangle("0,1,0 4,0,0 1,1,0").unwrap_err().contains("right")
        );
        assert_eq!(levels("100,2.5"), Ok(Levels(vec![100.0, 2.5])));
        assert_eq!(levels("none"), Ok(Levels(vec![])));
        assert!(levels("1,,2").is_err() && length("0").is_err());
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
