//! Sensors on a surface of the scene, by the name of a node or a material, and the luminance that it shows.

use super::grid::{Grid, MOST, is_free};
use super::{Reading, Sensor};
use geometry::math::{offset_origin, to_world};
use geometry::sampling::{self, Lattice2};
use geometry::{Hit, Mesh, Ray, Rgb, Scene, Surface, Vec2, Vec3, World, photometry};
use radiosity::Solution;
use radiosity::element::Side;
use radiosity::gather::{self, Origin};

/// Points at least on a surface that is not flat.
const FEWEST: usize = 64;
/// Light samples that tell lit from dark.
const LIGHT_SAMPLES: u32 = 16;
/// Rays that look whether a place sees anything.
const LOOKS: u32 = 32;
/// A side that gets less than this share of the light of the other is no lit one.
const DARK: f32 = 1e-3;
/// How far a flat surface may be from its plane, in units of its size.
const FLAT: f32 = 1e-4;
/// Edges at most along which the rectangle around a flat surface is tried.
const TRIED: usize = 64;

/// A point of a surface, and the sensor on it.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Faces away from the side.
    pub sensor: Sensor,
    /// Triangle of the scene.
    pub triangle: u32,
    /// Barycentric (u, v).
    pub uv: [f32; 2],
    /// Which side of it.
    pub side: Side,
}

/// One side of a surface, sampled evenly in area.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Which.
    pub side: Side,
    /// The cells of a flat surface.
    pub grid: Option<Grid>,
    /// A place for each cell of the grid, `None` where the surface is not, or something stands on it; without a grid
    /// those that are free.
    pub places: Vec<Option<Place>>,
}

/// The triangles of the node or material `name`; empty when there is none of this name.
pub fn triangles_named(scene: &Scene, name: &str) -> Vec<u32> {
    let mesh = &scene.mesh;
    let of_parts = mesh.parts.iter().filter(|p| p.name == name).flat_map(|p| p.first..p.first + p.count);
    let found: Vec<u32> = of_parts.collect();
    if !found.is_empty() {
        return found;
    }
    let is_named = |t: &u32| scene.materials[mesh.materials[*t as usize].0 as usize].name == name;
    (0..mesh.triangles.len() as u32).filter(is_named).collect()
}

/// All names that [`triangles_named`] knows, each once, those of nodes first.
pub fn names(scene: &Scene) -> Vec<&str> {
    let mut seen = std::collections::HashSet::new();
    let used = |m: usize| scene.mesh.materials.iter().any(|id| id.0 as usize == m);
    let materials = scene.materials.iter().enumerate().filter(|(m, _)| used(*m)).map(|(_, m)| &*m.name);
    scene.mesh.parts.iter().map(|p| &*p.name).chain(materials).filter(|n| seen.insert(*n)).collect()
}

/// The lit sides of `triangles`, about one point for `spacing`² m²: on a grid where they lie in one plane, else spread
/// over their area. With `keep_all` also places within objects.
pub fn sheets(
    world: &World,
    solution: &Solution,
    triangles: &[u32],
    spacing: f32,
    keep_all: bool,
) -> Vec<Sheet> {
    // The solution knows no direct light where nothing reflects it.
    let about = |p: &Place| {
        let ([u, v], Sensor { position, normal: ng, .. }) = (p.uv, p.sensor);
        let (at, stream) = ([Origin { position, ng }], u64::from(p.triangle));
        let direct = gather::direct(world, &at, ng, LIGHT_SAMPLES, 0, stream, |_, _| ());
        direct + solution.irradiance(world, p.triangle, u, v, p.side)
    };
    let of = |side| sheet(world, triangles, side, spacing, keep_all, |p| !about(p).is_black());
    let sheets = [of(Side::Front), of(Side::Back)];
    let light = |sheet: &Sheet| {
        let places = || sheet.places.iter().flatten();
        places().map(|p| about(p).luminance()).sum::<f32>() / places().count().max(1) as f32
    };
    let light = [light(&sheets[0]), light(&sheets[1])];
    let brighter = light[0].max(light[1]);
    // In the dark the front stands for both.
    let is_lit = |i: usize| light[i] > DARK * brighter || (i == 0 && brighter <= 0.0);
    sheets.into_iter().enumerate().filter(|(i, _)| is_lit(*i)).map(|(_, sheet)| sheet).collect()
}

fn sheet(
    world: &World,
    triangles: &[u32],
    side: Side,
    spacing: f32,
    keep_all: bool,
    is_lit: impl Fn(&Place) -> bool,
) -> Sheet {
    let mesh = &world.scene.mesh;
    let place = |(triangle, uv): (u32, [f32; 2])| {
        let normal = mesh.geometric_normal(triangle) * side.sign();
        let surface = seen(world, triangle, uv, normal);
        let on_surface = surface.bsdf.has_diffuse();
        let sensor = Sensor { position: surface.position, normal, on_surface };
        let place = Place { sensor, triangle, uv, side };
        let in_room = || is_free(world, &sensor) && (sees_something(world, &sensor) || is_lit(&place));
        (keep_all || in_room()).then_some(place)
    };
    match plane(mesh, triangles, side, spacing) {
        Some(grid) => {
            let places = cells(mesh, triangles, &grid).into_iter().map(|c| c.and_then(place)).collect();
            Sheet { side, grid: Some(grid), places }
        }
        None => {
            let places = spread(mesh, triangles, spacing).into_iter().map(place).filter(Option::is_some);
            Sheet { side, grid: None, places: places.collect() }
        }
    }
}

/// Whether anything is before a sensor: the outsides of a room see nothing.
fn sees_something(world: &World, sensor: &Sensor) -> bool {
    let pattern = Lattice2::new(LOOKS);
    let from = offset_origin(sensor.position, sensor.normal);
    world.scene.sky.is_some()
        || (0..LOOKS).any(|i| {
            let wi = to_world(sampling::cosine_hemisphere(pattern.point(i, Vec2::ZERO)), sensor.normal);
            world.bvh.occluded(&Ray::new(from, wi))
        })
}

/// Luminance (cd/m²) of a place along its normal: its own light, and what it reflects or lets through diffusely. `behind`
/// is the reading on its other side.
pub fn luminance(world: &World, place: &Place, reading: &Reading, behind: Option<&Reading>) -> f32 {
    let n = place.sensor.normal;
    let surface = seen(world, place.triangle, place.uv, n);
    if let Some(colour) = surface.unlit {
        return colour.luminance();
    }
    let reflected = photometry::reflected_radiance(surface.bsdf.diffuse_albedo(n), reading.total());
    let through = behind.map_or(Rgb::BLACK, |b| {
        photometry::reflected_radiance(surface.bsdf.translucent_albedo(n), b.total())
    });
    (surface.emission + reflected + through).luminance()
}

/// The sensor on the other side of a place where light comes through diffusely.
pub fn behind(world: &World, place: &Place) -> Option<Sensor> {
    let Sensor { position, normal, .. } = place.sensor;
    let surface = seen(world, place.triangle, place.uv, normal);
    surface.bsdf.is_translucent().then_some(Sensor { position, normal: -normal, on_surface: true })
}

/// The surface at barycentric `uv`, met along −`normal`.
fn seen(world: &World, triangle: u32, [u, v]: [f32; 2], normal: Vec3) -> Surface {
    let ray =
        Ray::new(world.scene.mesh.interpolate(triangle, u, v, &world.scene.mesh.positions) + normal, -normal);
    Surface::new(&world.scene, &ray, &Hit { t: 1.0, triangle, u, v })
}

/// The smallest rectangle around triangles that lie in one plane and face one way; `None` where they do not.
fn plane(mesh: &Mesh, triangles: &[u32], side: Side, spacing: f32) -> Option<Grid> {
    let sound = || triangles.iter().copied().filter(|&t| mesh.area(t) > 0.0);
    let largest = sound().max_by(|a, b| mesh.area(*a).total_cmp(&mesh.area(*b)))?;
    let n = mesh.geometric_normal(largest);
    let corners = || sound().flat_map(|t| mesh.corners(t));
    let first = mesh.corners(largest)[0];
    let size = corners().map(|p| p.distance(first)).fold(0.0, f32::max);
    let flat = sound().all(|t| mesh.geometric_normal(t).dot(n) > 0.99)
        && corners().all(|p| (p - first).dot(n).abs() <= FLAT * size);
    if !flat {
        return None;
    }
    let n = n * side.sign();
    let mut edges: Vec<Vec3> = sound()
        .flat_map(|t| {
            let [a, b, c] = mesh.corners(t);
            [b - a, c - b, a - c]
        })
        .collect();
    edges.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    let rectangle = |edge: &Vec3| {
        // Right is where x points on a floor, and level on a wall; up is −z or y.
        let right = if n.y.abs() > 0.9 { Vec3::X } else { Vec3::Y.cross(n) };
        let edge = edge.normalize();
        let turned = n.cross(edge);
        let u = if edge.dot(right).abs() > turned.dot(right).abs() { edge } else { turned };
        let u = if u.dot(right) < 0.0 { -u } else { u };
        let v = n.cross(u);
        let far = Vec2::splat(f32::INFINITY);
        let (lo, hi) = corners().fold((far, -far), |(lo, hi), p| {
            let at = Vec2::new((p - first).dot(u), (p - first).dot(v));
            (lo.min(at), hi.max(at))
        });
        (first + u * lo.x + v * lo.y, u * (hi.x - lo.x), v * (hi.y - lo.y))
    };
    let area = |r: &(Vec3, Vec3, Vec3)| r.1.length() * r.2.length();
    let best = edges.iter().take(TRIED).map(rectangle).min_by(|a, b| area(a).total_cmp(&area(b)))?;
    Grid::new(best.0, best.1, best.2, spacing).ok()
}

/// The triangle under the middle of each cell, with barycentric (u, v).
fn cells(mesh: &Mesh, triangles: &[u32], grid: &Grid) -> Vec<Option<(u32, [f32; 2])>> {
    let mut out = vec![None; grid.len()];
    let (du, dv) = (grid.across.length_squared(), grid.up.length_squared());
    let flat = |p: Vec3| {
        let p = p - grid.corner;
        Vec2::new(p.dot(grid.across) / du * grid.columns as f32, p.dot(grid.up) / dv * grid.rows as f32)
    };
    for &t in triangles {
        let [a, b, c] = mesh.corners(t).map(flat);
        let (e, f) = (b - a, c - a);
        let det = e.perp_dot(f);
        if det == 0.0 {
            continue;
        }
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        let range =
            |lo: f32, hi: f32, n: usize| (lo - 0.5).ceil().max(0.0) as usize..((hi + 0.5) as usize).min(n);
        for row in range(lo.y, hi.y, grid.rows) {
            for column in range(lo.x, hi.x, grid.columns) {
                let p = Vec2::new(column as f32 + 0.5, row as f32 + 0.5) - a;
                let (u, v) = (p.perp_dot(f) / det, e.perp_dot(p) / det);
                // A middle on the edge of two triangles belongs to one of them at least.
                const SLACK: f32 = 1e-5;
                if u >= -SLACK && v >= -SLACK && u + v <= 1.0 + SLACK {
                    let u = u.clamp(0.0, 1.0);
                    out[row * grid.columns + column] = Some((t, [u, v.clamp(0.0, 1.0 - u)]));
                }
            }
        }
    }
    out
}

/// About one point for `spacing`² m² of `triangles`.
fn spread(mesh: &Mesh, triangles: &[u32], spacing: f32) -> Vec<(u32, [f32; 2])> {
    let area: f64 = triangles.iter().map(|&t| f64::from(mesh.area(t))).sum();
    let n = (area / f64::from(spacing).powi(2)) as usize;
    even(mesh, triangles, n.clamp(FEWEST, MOST) as u32)
}

/// `n` points spread evenly over the area of `triangles`; none where these have none.
pub(super) fn even(mesh: &Mesh, triangles: &[u32], n: u32) -> Vec<(u32, [f32; 2])> {
    let mut sums = Vec::with_capacity(triangles.len());
    let mut area = 0.0;
    for &t in triangles {
        area += f64::from(mesh.area(t));
        sums.push(area);
    }
    if area <= 0.0 {
        return Vec::new();
    }
    let pattern = Lattice2::new(n);
    let point = |i: u32| {
        let u = pattern.point(i, Vec2::splat(0.5 / pattern.len() as f32));
        let at = f64::from(u.x) * area;
        let k = sums.partition_point(|&s| s <= at).min(sums.len() - 1);
        let t = triangles[k];
        let within = (at - (sums[k] - f64::from(mesh.area(t)))) / f64::from(mesh.area(t));
        let (a, b) = sampling::triangle(Vec2::new(within.clamp(0.0, 0.999_999) as f32, u.y));
        (t, [a, b])
    };
    (0..pattern.len()).map(point).collect()
}
