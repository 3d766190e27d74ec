//! What is swept: a plan for each sweep, its scenes written to a folder.

use super::rooms;
use crate::comparison::method::Program;
use crate::comparison::results::Sweep;
use crate::comparison::scene::Subject;
use crate::scenes::cornell::{cornell_box_in, cornell_specular_in};
use crate::scenes::document::Document;
use crate::scenes::furnace::furnace_of;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};

/// A sweep before it was run.
pub struct Plan {
    /// As the results show it, without lines.
    pub sweep: Sweep,
    /// A label and its runs, cheapest first.
    pub lines: Vec<(String, Vec<Case>)>,
}

/// One run.
#[derive(Clone)]
pub struct Case {
    /// What the axis counts.
    pub x: f64,
    /// What is seen, and how large; a camera called `all` means every camera of the file.
    pub subject: Subject,
    /// Cameras of the file that get a process each, in place of that of `subject`; none: one process does it all.
    pub apart: Vec<String>,
    /// The picture that is held against the truth: the first of several.
    pub first: PathBuf,
    /// What renders.
    pub program: Program,
    /// Threads to render with.
    pub threads: u32,
    /// What it is told beside that.
    pub args: &'static [&'static str],
    /// What the picture is held against.
    pub truth: Truth,
}

/// What a picture is held against.
#[derive(Clone, PartialEq)]
pub enum Truth {
    /// Nothing is at hand.
    Unknown,
    /// The reference of the subject.
    Reference,
    /// 1 cd/m² everywhere: see `scenes/furnace.rs`.
    White,
}

/// The two-pass method as most sweeps run it, and the path tracer beside it.
const SPLIT: &[&str] = &["--error", "3%"];
const PATH: &[&str] = &["--integrator", "path", "--spp", "16"];
/// Their labels.
const METHODS: [(&str, &[&str]); 2] =
    [("twolight split, --error 3%", SPLIT), ("twolight path, 16 spp", PATH)];
/// Where each picture goes.
pub const PICTURE: &str = "picture.exr";
/// The gallery at 5 %, and what other renderers take there for about as much: label, script, samples.
const FIVE: &[&str] = &["--error", "5%"];
const OTHERS: [(&str, &str, &[&str]); 2] = [
    ("Mitsuba path + OIDN, 64 spp", "mitsuba", &["--effort", "64", "--denoise"]),
    ("Cycles + OIDN, 64 spp", "cycles", &["--effort", "64", "--denoise"]),
];
/// Errors asked, and the number that stands for each on an axis, %.
const ERRORS: [(f64, &[&str]); 6] = [
    (10.0, &["--error", "10%"]),
    (5.0, &["--error", "5%"]),
    (3.0, &["--error", "3%"]),
    (2.0, &["--error", "2%"]),
    (1.0, &["--error", "1%"]),
    (0.5, &["--error", "0.5%"]),
];

/// Writes generated scenes, and knows those of `assets/` that have references.
pub struct Planner<'a> {
    /// Where generated scenes go.
    pub folder: &'a Path,
    /// Threads, unless they are what is swept.
    pub threads: u32,
    /// Scenes with references.
    pub known: &'a [Subject],
}

/// Makes one plan.
type Make = fn(&Planner) -> Result<Plan>;

/// Every sweep, by its name.
pub const SWEEPS: [(&str, Make); 8] = [
    ("error", |planner| planner.error()),
    ("triangles", |planner| planner.triangles()),
    ("lights", |planner| planner.lights()),
    ("albedo", |planner| planner.albedo()),
    ("pixels", |planner| planner.pixels()),
    ("threads", |planner| planner.threads()),
    ("views", |planner| planner.views()),
    ("tour", |planner| planner.tour()),
];

impl Planner<'_> {
    /// Those sweeps whose names are `wanted`.
    pub fn plans(&self, wanted: impl Fn(&str) -> bool) -> Result<Vec<Plan>> {
        std::fs::create_dir_all(self.folder).with_context(|| format!("making {}", self.folder.display()))?;
        SWEEPS.iter().filter(|(name, _)| wanted(name)).map(|(_, make)| make(self)).collect()
    }

    fn error(&self) -> Result<Plan> {
        let line = |subject: &Subject| {
            let case =
                |(x, args)| Case { args, truth: Truth::Reference, ..self.case(x, subject.clone(), SPLIT) };
            (subject.name.clone(), ERRORS.map(case).to_vec())
        };
        // Of a black room no error is relative.
        let lit = self.known.iter().filter(|s| s.name != "two-rooms");
        let title = "Cost against the error asked, twolight split";
        Ok(plan("error", title, "error asked, %", lit.map(line).collect()))
    }

    /// The same surfaces in ever smaller triangles: the same picture, so that one reference serves all.
    fn triangles(&self) -> Result<Plan> {
        type Fill = fn(Document) -> Document;
        let rooms: [(&str, Fill); 2] =
            [("cornell-box", cornell_box_in), ("cornell-specular", cornell_specular_in)];
        let mut lines = Vec::new();
        for (name, describe) in rooms {
            let known = self.known.iter().find(|s| s.name == name);
            let mut cases = Vec::new();
            for splits in [0, 1, 2, 3, 4].into_iter().filter(|&n| name == "cornell-box" || n <= 3) {
                let doc = describe(Document::split(splits));
                let x = doc.triangles() as f64;
                let mut subject =
                    self.subject(&format!("{name}-{}", 1 << (2 * splits)), doc, "camera", 256)?;
                subject.reference = known.map(|s| s.reference.clone()).unwrap_or_default();
                let truth = if known.is_some() { Truth::Reference } else { Truth::Unknown };
                cases.push(Case { truth, ..self.case(x, subject, SPLIT) });
            }
            lines.push((name.to_string(), cases));
        }
        Ok(plan("triangles", "Cost against triangles of the same surfaces, --error 3%", "triangles", lines))
    }

    fn lights(&self) -> Result<Plan> {
        let mut subjects = Vec::new();
        for n in [1, 4, 16, 64, 256, 1024] {
            let name = format!("lights-{n}");
            subjects.push((f64::from(n), self.subject(&name, rooms::room(n, 0.6, 1), &rooms::view(0), 256)?));
        }
        Ok(self.by_method("lights", "Cost against lamps, of one brightness in all", "lamps", &subjects))
    }

    fn albedo(&self) -> Result<Plan> {
        let (mut furnaces, mut rooms) = (Vec::new(), Vec::new());
        for rho in [0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 0.99] {
            let x = f64::round(1000.0 / (1.0 - rho)) / 1000.0;
            let furnace = self.subject(&format!("furnace-{rho}"), furnace_of(rho), "camera", 256)?;
            furnaces.push(Case { truth: Truth::White, ..self.case(x, furnace, SPLIT) });
            let room = rooms::room(1, rho, 1);
            rooms.push(self.case(
                x,
                self.subject(&format!("albedo-{rho}"), room, &rooms::view(0), 256)?,
                SPLIT,
            ));
        }
        let lines = vec![("furnace".to_string(), furnaces), ("room with one lamp".to_string(), rooms)];
        let axis = "1 / (1 - albedo), how often light strikes a wall of a closed room";
        Ok(plan("albedo", "Cost against albedo 0.2 ... 0.99, --error 3%", axis, lines))
    }

    fn pixels(&self) -> Result<Plan> {
        let room = self.subject("room", rooms::room(1, 0.6, 1), &rooms::view(0), 256)?;
        let sized = |n: u32| (f64::from(n * n), Subject { width: n, height: n, ..room.clone() });
        let subjects = [64, 128, 256, 512, 1024].map(sized);
        Ok(self.by_method("pixels", "Cost against the size of the picture", "pixels", &subjects))
    }

    fn threads(&self) -> Result<Plan> {
        let room = self.subject("room", rooms::room(1, 0.6, 1), &rooms::view(0), 256)?;
        let mut counts: Vec<u32> = (0..).map(|i| 1 << i).take_while(|&n| n < self.threads).collect();
        counts.push(self.threads);
        let line = |(label, args): (&str, _)| {
            let case = |&n: &u32| Case { threads: n, ..self.case(f64::from(n), room.clone(), args) };
            (label.to_string(), counts.iter().map(case).collect())
        };
        Ok(plan("threads", "Cost against threads", "threads", METHODS.map(line).into()))
    }

    fn views(&self) -> Result<Plan> {
        let mut subjects = Vec::new();
        for n in [1, 2, 4, 8, 16] {
            subjects.push((
                f64::from(n),
                self.subject(&format!("views-{n}"), rooms::room(1, 0.6, n), "all", 256)?,
            ));
        }
        Ok(self.by_method("views", "Cost against views of one room, in one call", "views", &subjects))
    }

    /// More and more views of a furnished room: solved once for all, or each by itself, as other renderers do. The error is that of
    /// the first.
    fn tour(&self) -> Result<Plan> {
        let gallery = self.known.iter().find(|s| s.name == "gallery");
        let (mut once, mut apart, mut others) = (Vec::new(), Vec::new(), OTHERS.map(|_| Vec::new()));
        for n in [1, 3, 10] {
            let (doc, cameras) = rooms::tour(n);
            let (camera, first) = match n {
                1 => (&*cameras[0], PICTURE.into()),
                _ => ("all", Path::new(PICTURE).with_extension(format!("{}.exr", cameras[0]))),
            };
            let mut subject = self.subject(&format!("tour-{n}"), doc, camera, 384)?;
            subject.height = 256;
            subject.reference = gallery.map(|s| s.reference.clone()).unwrap_or_default();
            let truth = if gallery.is_some() { Truth::Reference } else { Truth::Unknown };
            let case = |program, args| Case {
                truth: truth.clone(),
                program,
                apart: cameras.clone(),
                ..self.case(f64::from(n), subject.clone(), args)
            };
            once.push(Case { apart: Vec::new(), first, ..case(Program::Twolight, FIVE) });
            apart.push(case(Program::Twolight, FIVE));
            for (line, (_, name, args)) in others.iter_mut().zip(OTHERS) {
                line.push(case(Program::Peer(name), args));
            }
        }
        let ours = [("twolight, solved once", once), ("twolight, each view by itself", apart)];
        let others = OTHERS.iter().zip(others).map(|((label, ..), cases)| (*label, cases));
        let lines = ours.into_iter().chain(others).map(|(label, cases)| (label.to_string(), cases)).collect();
        Ok(plan("tour", "Cost against views of the gallery, at about 5 %", "views", lines))
    }

    /// A line for each of [`METHODS`] over the same subjects.
    fn by_method(&self, name: &str, title: &str, axis: &str, subjects: &[(f64, Subject)]) -> Plan {
        let line = |(label, args): (&str, _)| {
            let cases = subjects.iter().map(|(x, subject)| self.case(*x, subject.clone(), args));
            (label.to_string(), cases.collect())
        };
        plan(name, title, axis, METHODS.map(line).into())
    }

    fn case(&self, x: f64, subject: Subject, args: &'static [&'static str]) -> Case {
        let (apart, program) = (Vec::new(), Program::Twolight);
        let first = PICTURE.into();
        Case { x, subject, apart, first, program, threads: self.threads, args, truth: Truth::Unknown }
    }

    /// Writes a scene, to be seen in a square picture of `size` pixels a side.
    fn subject(&self, name: &str, doc: Document, camera: &str, size: u32) -> Result<Subject> {
        let file: PathBuf = self.folder.join(format!("{name}.glb"));
        let triangles = doc.triangles() as u64;
        std::fs::write(&file, doc.into_glb()).with_context(|| format!("writing {}", file.display()))?;
        Ok(Subject {
            name: name.into(),
            file,
            camera: camera.into(),
            width: size,
            height: size,
            triangles,
            reference: Default::default(),
        })
    }
}

fn plan(name: &str, title: &str, axis: &str, lines: Vec<(String, Vec<Case>)>) -> Plan {
    let sweep = Sweep {
        name: name.into(),
        title: title.into(),
        axis: axis.into(),
        logarithmic: true,
        lines: Vec::new(),
    };
    Plan { sweep, lines }
}
