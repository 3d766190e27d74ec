//! IES LM-63 files of 1986 to 2019, as makers of lamps publish them.
//!
//! Lines up to `TILT=` are for people. What follows is numbers only, wherever lines end; commas count as spaces.
//! The tilt's table is passed over: it is about lamps mounted at an angle, which a file cannot know.

use super::{Photometry, Web};
use std::fmt;

/// Bytes of a file at most: the largest webs that makers publish have one hundredth of it.
pub const LARGEST: usize = 16 << 20;
/// Directions of one web at most.
const MOST: usize = 1 << 20;

/// Why a file is no photometric web.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Line, from 1; 0 for the whole file.
    pub line: usize,
    /// What is wrong, with the value.
    pub problem: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.line > 0 {
            write!(f, "line {}: ", self.line)?;
        }
        f.write_str(&self.problem)
    }
}

impl std::error::Error for Fault {}

/// Reads a photometric web from the bytes of an LM-63 file.
///
/// Intensities are multiplied by the file's candela multiplier and its ballast factors; negative ones, which
/// measurements have by their noise, are taken as 0.
pub fn parse(bytes: &[u8]) -> Result<Web, Fault> {
    if bytes.len() > LARGEST {
        return Err(whole(format!("{} bytes are too many for a photometric file", bytes.len())));
    }
    // Keywords may be in any old code page; numbers are ASCII.
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text.split(['\n', '\r']).enumerate();
    let mut line_of = Lines::new(&text);
    let tilt = lines.find_map(|(i, line)| {
        let line = line.trim();
        let head = line.get(..5)?;
        head.eq_ignore_ascii_case("TILT=").then(|| (i, line[5..].trim().to_ascii_uppercase()))
    });
    let Some((at, tilt)) = tilt else {
        return Err(whole("no TILT= line: not an IES LM-63 file".into()));
    };
    let mut numbers = Numbers { rest: Vec::new(), next: 0, last: 0 };
    for (i, line) in lines {
        let words = line.split([' ', '\t', ',', ';', '\x0c']).filter(|w| !w.is_empty());
        numbers.rest.extend(words.map(|word| (line_of.number(i), word)));
    }
    numbers.last = line_of.number(at);
    if tilt == "INCLUDE" {
        numbers.next("the lamp's geometry")?;
        let pairs = numbers.count("tilt angles")?;
        for _ in 0..2 * pairs {
            numbers.next("the tilt's table")?;
        }
    }
    web(&mut numbers)
}

fn web(numbers: &mut Numbers) -> Result<Web, Fault> {
    numbers.next("the number of lamps")?;
    numbers.next("the lumens of a lamp")?;
    let multiplier = numbers.next("the candela multiplier")?;
    let vertical = numbers.count("vertical angles")?;
    let horizontal = numbers.count("horizontal angles")?;
    let photometry = match numbers.next("the photometric type")? {
        1.0 => Photometry::C,
        2.0 => Photometry::B,
        3.0 => Photometry::A,
        other => return Err(numbers.fault(format!("photometric type {other}; LM-63 knows 1, 2 and 3"))),
    };
    for what in ["the unit of length", "the width", "the length", "the height"] {
        numbers.next(what)?;
    }
    let ballast = numbers.next("the ballast factor")? * numbers.next("the ballast-lamp factor")?;
    numbers.next("the input watts")?;
    let factor = multiplier * ballast;
    if !(factor > 0.0 && factor.is_finite()) {
        return Err(numbers.fault(format!("multiplier times ballast factors is {factor}")));
    }
    if vertical.saturating_mul(horizontal) > MOST {
        return Err(numbers.fault(format!("{vertical} × {horizontal} directions are too many")));
    }
    let vertical = numbers.angles(vertical, "vertical angle")?;
    let horizontal = numbers.angles(horizontal, "horizontal angle")?;
    let mut candela: Vec<Vec<f32>> = Vec::with_capacity(horizontal.len());
    for _ in 0..horizontal.len() {
        let column: Result<Vec<f32>, Fault> =
            (0..vertical.len()).map(|_| Ok((numbers.next("a candela value")? * factor).max(0.0))).collect();
        candela.push(column?);
    }
    let table = Table { vertical, horizontal, candela };
    let table = match photometry {
        Photometry::C => table.of_type_c(numbers)?,
        Photometry::B | Photometry::A => table.of_type_a_or_b(photometry, numbers)?,
    };
    let Table { vertical: polar, horizontal: around, candela } = table;
    let rows = (0..polar.len()).flat_map(|row| candela.iter().map(move |column| column[row])).collect();
    let radians = |degrees: Vec<f32>| degrees.into_iter().map(f32::to_radians).collect();
    Web::new(photometry, radians(polar), radians(around), rows)
        .ok_or_else(|| whole("it shines in no direction, or beyond any number".into()))
}

/// Columns of intensities, one for each horizontal angle; degrees, both rising.
struct Table {
    vertical: Vec<f32>,
    horizontal: Vec<f32>,
    candela: Vec<Vec<f32>>,
}

impl Table {
    /// All planes around, whatever symmetry the file makes use of.
    fn of_type_c(mut self, numbers: &Numbers) -> Result<Table, Fault> {
        self.within("vertical", &self.vertical, [0.0, 180.0], numbers)?;
        if self.vertical.len() < 2 {
            return Err(numbers.fault("one vertical angle only".into()));
        }
        if self.horizontal.len() == 1 {
            self.horizontal = vec![0.0, 360.0];
            self.candela.push(self.candela[0].clone());
            return Ok(self);
        }
        self.within("horizontal", &self.horizontal, [0.0, 360.0], numbers)?;
        let ends = [self.horizontal[0], self.horizontal[self.horizontal.len() - 1]];
        match ends {
            [0.0, 360.0] => {}
            [0.0, 90.0] => {
                self.mirror(180.0);
                self.mirror(360.0);
            }
            [0.0, 180.0] => self.mirror(360.0),
            // LM-63-1995: symmetric about the plane from 90° to 270°. C and 540° − C are alike, which are 180° to 360° + 90°.
            [90.0, 270.0] => {
                self.mirror(540.0);
                self.turn();
            }
            // A last plane left out, as it is the first one again.
            [0.0, last] if last > 180.0 => {
                self.horizontal.push(360.0);
                self.candela.push(self.candela[0].clone());
            }
            [first, last] => {
                let problem =
                    format!("horizontal angles from {first} to {last}; type C has 0 to 0, 90, 180 or 360");
                return Err(numbers.fault(problem));
            }
        }
        Ok(self)
    }

    /// Polar angles from the axis that type A or B turns about, both symmetric halves where the file has one.
    fn of_type_a_or_b(mut self, photometry: Photometry, numbers: &Numbers) -> Result<Table, Fault> {
        self.within("vertical", &self.vertical, [-90.0, 90.0], numbers)?;
        self.within("horizontal", &self.horizontal, [-90.0, 90.0], numbers)?;
        if self.horizontal.len() < 2 || self.vertical.len() < 2 {
            return Err(numbers.fault("one angle only, of a type that needs several".into()));
        }
        if self.horizontal[0] == 0.0 {
            let columns = self.horizontal.iter().zip(&self.candela).skip(1).rev();
            let (left, values): (Vec<f32>, Vec<Vec<f32>>) = columns.map(|(h, c)| (-h, c.clone())).unzip();
            self.horizontal.splice(0..0, left);
            self.candela.splice(0..0, values);
        }
        let from_axis = |angles: &[f32]| angles.iter().rev().map(|a| 90.0 - a).collect();
        Ok(match photometry {
            Photometry::A => Table {
                vertical: from_axis(&self.vertical),
                horizontal: self.horizontal,
                candela: self.candela.into_iter().map(|c| c.into_iter().rev().collect()).collect(),
            },
            // The horizontal angle is the one from the axis here.
            _ => Table {
                vertical: from_axis(&self.horizontal),
                candela: (0..self.vertical.len())
                    .map(|v| self.candela.iter().rev().map(|column| column[v]).collect())
                    .collect(),
                horizontal: self.vertical,
            },
        })
    }

    /// Adds the planes at `sum` − C for each C, but for the last.
    fn mirror(&mut self, sum: f32) {
        for i in (0..self.horizontal.len() - 1).rev() {
            self.horizontal.push(sum - self.horizontal[i]);
            self.candela.push(self.candela[i].clone());
        }
    }

    /// Planes from 90° to 450° as planes from 0° to 360°.
    fn turn(&mut self) {
        self.horizontal.pop();
        self.candela.pop();
        let beyond = self.horizontal.iter().filter(|h| **h >= 360.0).count();
        self.horizontal.rotate_right(beyond);
        self.candela.rotate_right(beyond);
        self.horizontal[..beyond].iter_mut().for_each(|h| *h -= 360.0);
        if self.horizontal[0] > 0.0 {
            // No plane at 0°: halfway between its neighbours, which are alike by symmetry or nearly.
            let last = self.candela.len() - 1;
            let mean = self.candela[0].iter().zip(&self.candela[last]).map(|(a, b)| 0.5 * (a + b)).collect();
            self.horizontal.insert(0, 0.0);
            self.candela.insert(0, mean);
        }
        self.horizontal.push(360.0);
        self.candela.push(self.candela[0].clone());
    }

    fn within(&self, what: &str, angles: &[f32], [low, high]: [f32; 2], at: &Numbers) -> Result<(), Fault> {
        match angles.iter().find(|a| !(low..=high).contains(*a)) {
            Some(a) => Err(at.fault(format!("the {what} angle {a} is not within {low} to {high}"))),
            None => Ok(()),
        }
    }
}

/// The words after the tilt, each with its line.
struct Numbers<'a> {
    rest: Vec<(usize, &'a str)>,
    next: usize,
    /// Line of the word read last.
    last: usize,
}

impl Numbers<'_> {
    fn fault(&self, problem: String) -> Fault {
        Fault { line: self.last, problem }
    }

    fn next(&mut self, what: &str) -> Result<f32, Fault> {
        let Some(&(line, word)) = self.rest.get(self.next) else {
            return Err(self.fault(format!("the file ends before {what}")));
        };
        (self.next, self.last) = (self.next + 1, line);
        match word.parse::<f32>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => {
                let word: String = word.chars().take(40).collect();
                Err(self.fault(format!("{word:?} is not a number, where {what} should be")))
            }
        }
    }

    fn count(&mut self, of: &str) -> Result<usize, Fault> {
        let number = self.next(&format!("the number of {of}"))?;
        match number {
            n if (1.0..=MOST as f32).contains(&n) && n.fract() == 0.0 => Ok(n as usize),
            n => Err(self.fault(format!("{n} {of}"))),
        }
    }

    fn angles(&mut self, count: usize, what: &str) -> Result<Vec<f32>, Fault> {
        let mut angles: Vec<f32> = Vec::new();
        for _ in 0..count {
            let angle = self.next(&format!("a {what}"))?;
            if let Some(before) = angles.last().filter(|before| **before >= angle) {
                return Err(self.fault(format!("the {what} {angle} comes after {before}: they must rise")));
            }
            angles.push(angle);
        }
        Ok(angles)
    }
}

/// Numbers lines as an editor does, where each CR LF was split twice.
struct Lines {
    extra: Vec<usize>,
}

impl Lines {
    fn new(text: &str) -> Lines {
        let breaks = text.bytes().enumerate().filter(|(_, b)| *b == b'\n' || *b == b'\r');
        let bytes = text.as_bytes();
        let extra = breaks.enumerate().filter(|(_, (i, b))| *b == b'\n' && *i > 0 && bytes[i - 1] == b'\r');
        Lines { extra: extra.map(|(nth, _)| nth).collect() }
    }

    fn number(&mut self, split: usize) -> usize {
        split + 1 - self.extra.partition_point(|&nth| nth < split)
    }
}

fn whole(problem: String) -> Fault {
    Fault { line: 0, problem }
}
