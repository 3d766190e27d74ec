//! A solution as a file: solved once, used on any day, for the scene it was made for and no other.
//!
//! ```text
//! "twolight"                        8 bytes
//! format                            u32, 3
//! number of sections                u32
//! for each: name, length, BLAKE3    8 + 8 + 32 bytes
//! BLAKE3 of all that                32 bytes
//! the sections, one after the other
//! ```
//!
//! All numbers are little-endian; lists begin with their length as u64. `about` is text, a line "key: value" each. `mesh`
//! holds vertices and nodes of the element mesh, `sources` how each slot (2 · vertex + side) draws on the sites, `sites`
//! the indirect and the direct irradiance there (lx) and the doubts of the former (lx²), `flags` what pass 2 is to mistrust, `photons` a k-d tree, `lights`
//! the groups of lamps and the light of each by itself. Every section is checked before it is believed.

use crate::bytes::{Plain, Reader, get_sources, put_all, put_sources};
use crate::caustic::Caustics;
use crate::doubt::Doubt;
use crate::element::{Elements, MIDDLE, Node, Vertex, VertexId};
use crate::field::{Source, Sources};
use crate::flags::Flags;
use crate::lights::{Lights, RelightError};
use crate::solution::{AtSites, Report, Solution};
use crate::solver::Convergence;
use geometry::light_groups::NO_GROUP;
use geometry::{Fingerprint, LightGroups, Rgb, World};
use rayon::prelude::*;
use thiserror::Error;

const MAGIC: &[u8; 8] = b"twolight";
const FORMAT: u32 = 3;
const SECTIONS: [&str; 7] = ["about", "mesh", "sources", "sites", "flags", "photons", "lights"];
/// Bytes of a section's line in the table.
const LINE: usize = 8 + 8 + 32;

/// Why a file is not believed.
#[derive(Debug, Error)]
pub enum FileError {
    /// Something else.
    #[error("it is no radiosity solution")]
    NotASolution,
    /// Of another version.
    #[error("it has format {0}, and this program reads format {FORMAT}: solve again")]
    Format(u32),
    /// The end is missing.
    #[error("it ends after {have} of {want} bytes")]
    Short {
        /// Bytes there are.
        have: usize,
        /// Bytes there should be.
        want: usize,
    },
    /// Not what was written.
    #[error("its {0} is not what was written (checksum)")]
    Altered(String),
    /// Whole, but senseless.
    #[error("its {0} makes no sense")]
    Senseless(&'static str),
    /// Of another scene.
    #[error(
        "it was solved for another scene: geometry, materials, the sky or a lamp's place differ: solve again"
    )]
    OtherScene,
    /// Of a scene with other lamps.
    #[error(transparent)]
    OtherLights(#[from] RelightError),
}

/// What a file says of how it was made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct About {
    /// Program and version.
    pub program: String,
    /// The error it was solved for, as a fraction.
    pub error: f32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Whose view it was made for; empty for all of the room alike.
    pub cameras: Vec<String>,
}

impl About {
    fn text(&self, scene: &Fingerprint) -> String {
        let scene: String = scene.iter().map(|b| format!("{b:02x}")).collect();
        let About { program, error, seed, cameras } = self;
        // A name with a line break in it would be read as a line of its own.
        let cameras: String = cameras.iter().map(|c| format!("camera: {}\n", c.replace('\n', " "))).collect();
        format!("program: {program}\nscene: {scene}\nerror: {error}\nseed: {seed}\n{cameras}")
    }

    fn of(text: &str) -> Option<(About, Fingerprint)> {
        let of = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(": "));
        let cameras =
            text.lines().filter_map(|line| line.strip_prefix("camera: ")).map(String::from).collect();
        let hex = of("scene")?;
        let mut scene = [0; 32];
        for (i, byte) in scene.iter_mut().enumerate() {
            *byte = u8::from_str_radix(hex.get(2 * i..2 * i + 2)?, 16).ok()?;
        }
        let (program, error, seed) =
            (of("program")?.into(), of("error")?.parse().ok()?, of("seed")?.parse().ok()?);
        Some((About { program, error, seed, cameras }, scene))
    }
}

/// The bytes of a file that holds `solution`, which was solved for `world`.
pub fn encode(solution: &Solution, world: &World, about: &About) -> Result<Vec<u8>, FileError> {
    let (at_sites, lights) = solution.kept_apart()?;
    let mut sections: [Vec<u8>; SECTIONS.len()] = Default::default();
    let [text, mesh, sources, sites, flags, photons, lamps] = &mut sections;
    *text = about.text(&world.scene.fingerprint()).into_bytes();
    let elements = &solution.elements;
    put_all(&elements.vertices, mesh);
    put_all(&elements.nodes, mesh);
    [elements.pieces, elements.faces, elements.roots].put(mesh);
    put_sources(&at_sites.sources.0, sources);
    put_all(&at_sites.indirect, sites);
    put_all(&at_sites.direct, sites);
    put_all(&at_sites.doubts, sites);
    put_report(&solution.report, sites);
    put_all(solution.flags.bits(), flags);
    solution.caustics.put(photons);
    put_lights(lights, lamps);

    let mut out = MAGIC.to_vec();
    FORMAT.put(&mut out);
    (SECTIONS.len() as u32).put(&mut out);
    for (name, section) in SECTIONS.iter().zip(&sections) {
        let mut padded = [0u8; 8];
        padded[..name.len()].copy_from_slice(name.as_bytes());
        padded.put(&mut out);
        (section.len() as u64).put(&mut out);
        blake3::Hasher::new().update_rayon(section).finalize().as_bytes().put(&mut out);
    }
    blake3::hash(&out).as_bytes().put(&mut out);
    sections.iter().for_each(|section| out.extend_from_slice(section));
    Ok(out)
}

/// The solution that `bytes` hold, for `world` as its lamps shine now.
pub fn decode(bytes: &[u8], world: &World) -> Result<(Solution, About), FileError> {
    let [text, mesh, sources, sites, flags, photons, lamps] = sections(bytes)?;
    let senseless = FileError::Senseless;
    let text = std::str::from_utf8(text).ok().and_then(About::of);
    let (about, scene) = text.ok_or(senseless("about"))?;
    if scene != world.scene.fingerprint() {
        return Err(FileError::OtherScene);
    }
    let triangles = world.scene.mesh.triangles.len();
    let elements = whole(mesh, |r| get_elements(r, triangles)).ok_or(senseless("mesh"))?;
    let slots = 2 * elements.vertices.len();
    let get = |r: &mut Reader| Some((r.all::<Rgb>()?, r.all::<Rgb>()?, r.all::<Doubt>()?, get_report(r)?));
    let (indirect, direct, doubts, report) = whole(sites, get).ok_or(senseless("sites"))?;
    let count = indirect.len();
    let sources = whole(sources, get_sources)
        .filter(|all| all.len() == slots && all.iter().enumerate().all(|(s, source)| fits(source, s, count)))
        .ok_or(senseless("sources"))?;
    let flags = whole(flags, |r| r.all::<u8>())
        .filter(|bits| bits.is_empty() || bits.len() == 2 * elements.nodes.len())
        .ok_or(senseless("flags"))?;
    let lights = whole(lamps, |r| get_lights(r, count)).ok_or(senseless("lights"))?;
    let caustics = whole(photons, |r| Caustics::get(r, &world.scene.mesh, lights.groups.len()))
        .ok_or(senseless("photons"))?;
    let sound = |d: &Doubt| d.mesh >= 0.0 && d.ray >= 0.0 && d.mesh.is_finite() && d.ray.is_finite();
    if direct.len() != count
        || doubts.len() != count
        || !doubts.iter().all(sound)
        || !indirect.iter().chain(&direct).all(|e| e.is_finite())
    {
        return Err(senseless("sites"));
    }
    let at_sites = AtSites { sources: Sources(sources), indirect, direct, doubts, lights: Some(lights) };
    let solution = Solution::of_sites(elements, Flags::of_bits(flags), at_sites, caustics, report);
    Ok((solution.into_relit(world)?, about))
}

/// What a file says of itself, as text, and the names of its groups of lamps; nothing else of it is looked at.
pub fn describe(bytes: &[u8]) -> Result<(About, Vec<String>), FileError> {
    let [text, .., lamps] = sections(bytes)?;
    let (about, _) =
        std::str::from_utf8(text).ok().and_then(About::of).ok_or(FileError::Senseless("about"))?;
    let names = get_names(&mut Reader(lamps)).ok_or(FileError::Senseless("lights"))?;
    Ok((about, names))
}

/// The sections of a file, each as it was written.
fn sections(bytes: &[u8]) -> Result<[&[u8]; SECTIONS.len()], FileError> {
    let mut reader = Reader(bytes);
    if reader.take(8) != Some(&MAGIC[..]) {
        return Err(FileError::NotASolution);
    }
    let short = |want| FileError::Short { have: bytes.len(), want };
    let head = 16 + SECTIONS.len() * LINE;
    let format: u32 = reader.one().ok_or(short(head))?;
    if format != FORMAT {
        return Err(FileError::Format(format));
    }
    let _count: u32 = reader.one().ok_or(short(head))?;
    let table = reader.take(SECTIONS.len() * LINE).ok_or(short(head + 32))?;
    let checksum = reader.take(32).ok_or(short(head + 32))?;
    if blake3::hash(&bytes[..head]) != blake3::Hash::from_bytes(Plain::get(checksum)) {
        return Err(FileError::Altered("head".into()));
    }
    let mut lengths = table.chunks_exact(LINE).map(|line| u64::get(&line[8..]) as usize);
    let want = lengths.try_fold(head + 32, usize::checked_add).ok_or(FileError::NotASolution)?;
    if bytes.len() < want {
        return Err(short(want));
    }
    let mut found = [&[][..]; SECTIONS.len()];
    for ((name, line), found) in SECTIONS.iter().zip(table.chunks_exact(LINE)).zip(&mut found) {
        *found = reader.take(u64::get(&line[8..]) as usize).ok_or(short(want))?;
        let hash = blake3::Hasher::new().update_rayon(found).finalize();
        if hash != blake3::Hash::from_bytes(Plain::get(&line[16..])) {
            return Err(FileError::Altered(name.to_string()));
        }
    }
    if !reader.is_at_end() {
        return Err(FileError::Altered("end".into()));
    }
    Ok(found)
}

/// What `get` makes of all of a section, and of no more.
fn whole<T>(section: &[u8], get: impl FnOnce(&mut Reader) -> Option<T>) -> Option<T> {
    let mut reader = Reader(section);
    get(&mut reader).filter(|_| reader.is_at_end())
}

/// Whether the source of slot `s` names sites and slots that there are; the ends of an edge are older than its middle.
fn fits(source: &Source, s: usize, sites: usize) -> bool {
    match source {
        Source::Nothing => true,
        Source::Site(i) => (*i as usize) < sites,
        Source::Near(near, weights) => {
            near.iter().all(|&i| (i as usize) < sites.max(1)) && weights.iter().all(|w| w.is_finite())
        }
        Source::Between(a, b) => (*a.max(b) as usize) < s,
    }
}

fn get_elements(from: &mut Reader, triangles: usize) -> Option<Elements> {
    let vertices: Vec<Vertex> = from.all()?;
    let nodes: Vec<Node> = from.all()?;
    let [pieces, faces, roots] = from.one()?;
    let sound = |(i, node): (usize, &Node)| {
        let corner = |v: VertexId| (v as usize) < vertices.len() || (v == VertexId::MAX && i < triangles);
        // Children come after their parents, so that no way down has no end.
        let down =
            node.child == 0 || (node.child as usize > i && node.children().end as usize <= nodes.len());
        node.vertices.iter().all(|&v| corner(v)) && down && node.edge <= MIDDLE
    };
    let whole =
        nodes.par_iter().enumerate().all(sound) && roots as usize == triangles && nodes.len() >= triangles;
    let parts = vertices.iter().all(|v| v.piece < pieces && v.face < faces);
    (whole && parts).then_some(Elements { vertices, nodes, pieces, faces, roots })
}

fn put_report(r: &Report, out: &mut Vec<u8>) {
    let counts = [r.vertices, r.elements, r.sites, r.landings, r.row_bytes, r.photons].map(|n| n as u64);
    counts.put(out);
    let c = &r.convergence;
    [c.iterations, u32::from(c.converged)].put(out);
    [c.residual, c.bound].put(out);
    [r.norm, r.balance, r.flagged].put(out);
    [r.mean, r.caustic_flux].put(out);
}

fn get_report(from: &mut Reader) -> Option<Report> {
    let [vertices, elements, sites, landings, row_bytes, photons] =
        from.one::<[u64; 6]>()?.map(|n| n as usize);
    let [iterations, converged] = from.one()?;
    let [residual, bound] = from.one()?;
    let [norm, balance, flagged] = from.one()?;
    let [mean, caustic_flux] = from.one()?;
    let convergence = Convergence { iterations, residual, bound, converged: converged != 0 };
    Some(Report {
        solver: String::new(),
        vertices,
        elements,
        sites,
        landings,
        row_bytes,
        convergence,
        norm,
        mean,
        balance,
        flagged,
        photons,
        caustic_flux,
    })
}

fn put_lights(lights: &Lights, out: &mut Vec<u8>) {
    (lights.groups.len() as u64).put(out);
    lights.groups.names.iter().for_each(|name| put_all(name.as_bytes(), out));
    put_all(lights.groups.of_emissions(), out);
    put_all(&lights.emissions, out);
    for part in lights.indirect.iter().chain(&lights.direct) {
        put_all(part, out);
    }
}

fn get_names(from: &mut Reader) -> Option<Vec<String>> {
    let count = from.one::<u64>()?;
    (0..count).map(|_| String::from_utf8(from.all()?).ok()).collect()
}

fn get_lights(from: &mut Reader, sites: usize) -> Option<Lights> {
    let names = get_names(from)?;
    let of_emissions: Vec<u16> = from.all()?;
    let emissions: Vec<Rgb> = from.all()?;
    let mut parts = || -> Option<Vec<Vec<Rgb>>> {
        names.iter().map(|_| from.all().filter(|part: &Vec<Rgb>| part.len() == sites)).collect()
    };
    let (indirect, direct) = (parts()?, parts()?);
    let known = of_emissions.iter().all(|&g| (g as usize) < names.len() || g == NO_GROUP);
    let finite = indirect.iter().chain(&direct).flatten().all(|e| e.is_finite());
    (known && finite && of_emissions.len() == emissions.len()).then(|| Lights {
        groups: LightGroups::stored(names, of_emissions),
        emissions,
        indirect,
        direct,
    })
}
