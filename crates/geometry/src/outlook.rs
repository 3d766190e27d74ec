//! Through which windows the sky is seen: most of a room sees little of it, and what is drawn elsewhere is lost.
//!
//! Rays from all over the surfaces tell, for places near one another that face alike, which parts of the sphere they
//! see beyond the scene. Directions are then drawn from those parts as bright as they are, mixed with the plain draw, so
//! that what no ray found is found too: unbiased whatever the rays saw (Veach and Guibas, SIGGRAPH 1995, on mixtures; the
//! learning of visibility as in Müller, Gross and Novák, "Practical Path Guiding", EGSR 2017, but of the sky alone).

use crate::flights::flights;
use crate::math::{Vec2, Vec3, offset_origin, to_world};
use crate::sampling::{self, Rng};
use crate::sky::{Sky, SkySample};
use crate::{Ray, World};
use rayon::prelude::*;
use std::f32::consts::{PI, TAU};

/// Diffuse rays from surface to surface, whose ends are the places that are asked.
const FLIGHTS: usize = 1 << 16;
/// Rays from each. With 16 the picture of an office behind blinds took 1.7 times as many rays for its noise.
const RAYS: u32 = 64;
/// The same where the windows are roughly known. Pictures of three rooms by day take as many rays with 64.
const RAYS_MORE: u32 = 32;
/// Places that share what they saw, at most; at least half as many. With twice as many, those pictures take 3 % more rays.
const TOGETHER: usize = 64;
/// What all places around see counts as so many rays that got out: it is all that is known in a niche from which no ray did.
/// With 128 a tenth more rays, with 512 a third; with 8 as many.
const AROUND: f32 = 16.0;
/// Parts of the sphere, all of one solid angle: at 24 by 48 their counts are too few, and the picture takes a tenth more rays. Rows of
/// equal height along y, columns around it.
const ROWS: usize = 16;
const COLUMNS: usize = 32;
const PARTS: usize = ROWS * COLUMNS;
/// A number for each part.
type Parts = [f32; PARTS];
/// Share of the plain draw, at least: what comes from beside the known windows has at most 1/0.08 times its second moment. With
/// 0.15 a tenth more rays.
const PLAIN: f32 = 0.08;
/// The same at most: of a panorama with a sun in it most of the light lies in a point that parts cannot tell.
const MOST_PLAIN: f32 = 0.7;
/// Looks along each edge of a part.
const LOOKS: usize = 6;
/// What is so many times as bright as the middle one of a part's looks is left to the plain draw.
const SPARKLE: f32 = 4.0;

/// Which windows every place has.
#[derive(Debug)]
pub struct Outlook {
    /// All that were asked.
    places: Vec<Place>,
    /// Inner nodes of trees over places; children are nodes, or views with the top bit set.
    nodes: Vec<Node>,
    /// For each way that a surface mostly faces ([`facing`]): the inside of a wall has nothing in common with its outside.
    roots: [u32; 6],
    views: Vec<Option<View>>,
    /// Share of the plain draw.
    plain: f32,
}

const VIEW: u32 = 1 << 31;

#[derive(Debug)]
struct Node {
    axis: usize,
    /// What lies below it goes to the first child.
    at: f32,
    children: [u32; 2],
}

/// What part of the sky to draw from.
#[derive(Debug)]
struct View {
    /// Running sums over the rows' shares, from 0 to 1.
    rows: [f32; ROWS + 1],
    /// In each row over its columns'.
    columns: [[f32; COLUMNS + 1]; ROWS],
}

/// A place that was asked, and the parts in which its rays got out, with the share of an even sky's irradiance (without
/// anything between) that each stands for.
#[derive(Clone, Debug)]
struct Place {
    at: Vec3,
    facing: usize,
    seen: Vec<(u16, f32)>,
}

impl Outlook {
    /// Learns what of `sky` the surfaces of `world` see; `None` where nothing does.
    pub(crate) fn learn(world: &World, sky: &Sky) -> Option<Outlook> {
        let mesh = &world.scene.mesh;
        // What is seen from elsewhere, not the outside of walls or the inside of things.
        let all = flights(mesh, &world.bvh, FLIGHTS, 0.75);
        let exposed: Vec<(Vec3, Vec3)> =
            all.iter().filter(|f| f.is_outside(mesh)).map(|f| f.end(mesh)).collect();
        let places = look(world, &exposed, RAYS, |(_, n), u| {
            let wi = to_world(sampling::cosine_hemisphere(Vec2::from(u)), n);
            (wi, sampling::cosine_hemisphere_pdf_solid_angle(wi.dot(n)))
        });
        Outlook::over(places, sky)
    }

    /// The same with what `more` points of surfaces see, each with its unit normal: many of them near one another know their
    /// windows more closely.
    pub fn with(&self, world: &World, more: &[(Vec3, Vec3)]) -> Option<Outlook> {
        let sky = world.scene.sky.as_ref()?;
        let more = look(world, more, RAYS_MORE, |(p, n), u| {
            let s = SeenSky::new(sky, Some(self), p, n).sample(u);
            (s.direction, s.pdf)
        });
        Outlook::over([&self.places[..], &more].concat(), sky)
    }

    /// Of all these places.
    fn over(places: Vec<Place>, sky: &Sky) -> Option<Outlook> {
        if places.iter().all(|place| place.seen.is_empty()) {
            return None;
        }
        let (light, plain) = brightness(sky);
        let mut outlook =
            Outlook { places: Vec::new(), nodes: Vec::new(), roots: [0; 6], views: Vec::new(), plain };
        for way in 0..6 {
            let faces = |&i: &u32| places[i as usize].facing == way;
            let mut all: Vec<u32> = (0..places.len() as u32).filter(faces).collect();
            outlook.roots[way] = outlook.divide(&places, &mut all, &[0.0; PARTS], &light);
        }
        Some(Outlook { places, ..outlook })
    }

    /// Builds the tree over `all` of `places`; returns its root.
    ///
    /// - `around`: what the places see among which these are, in sum 1 or 0.
    fn divide(&mut self, places: &[Place], all: &mut [u32], around: &Parts, light: &Parts) -> u32 {
        let of = |i: &u32, axis: usize| places[*i as usize].at[axis];
        let extent = |axis: usize| {
            let range = all.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), i| {
                (low.min(of(i, axis)), high.max(of(i, axis)))
            });
            range.1 - range.0
        };
        let axis = (0..3).max_by(|&a, &b| extent(a).total_cmp(&extent(b)).then(b.cmp(&a))).unwrap_or(0);
        let seen = seen_from(all.iter().map(|&i| &places[i as usize]), around);
        if all.len() <= TOGETHER || extent(axis) <= 0.0 {
            self.views.push(View::new(&seen, light));
            return VIEW | (self.views.len() as u32 - 1);
        }
        let middle = all.len() / 2;
        all.select_nth_unstable_by(middle, |a, b| of(a, axis).total_cmp(&of(b, axis)).then(a.cmp(b)));
        let at = of(&all[middle], axis);
        let node = self.nodes.len();
        self.nodes.push(Node { axis, at, children: [0; 2] });
        let (low, high) = all.split_at_mut(middle);
        let children = [low, high].map(|part| self.divide(places, part, &seen, light));
        self.nodes[node].children = children;
        node as u32
    }

    /// The windows of a place, with the share of the plain draw beside them.
    fn view(&self, p: Vec3, n: Vec3) -> Option<(&View, f32)> {
        let mut next = self.roots[facing(n)];
        while next & VIEW == 0 {
            let node = &self.nodes[next as usize];
            next = node.children[usize::from(p[node.axis] >= node.at)];
        }
        Some((self.views[(next & !VIEW) as usize].as_ref()?, self.plain))
    }
}

/// Which way a unit normal mostly points: the axis, and its sign.
fn facing(n: Vec3) -> usize {
    let axis = n.abs().max_position();
    2 * axis + usize::from(n[axis] < 0.0)
}

/// The part of the sphere that a unit direction lies in.
fn part(d: Vec3) -> usize {
    let row = ((0.5 + 0.5 * d.y) * ROWS as f32) as usize;
    let column = ((0.5 + d.z.atan2(d.x) / TAU) * COLUMNS as f32) as usize;
    row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)
}

/// The direction at `x` columns and `y` rows.
fn direction(x: f32, y: f32) -> Vec3 {
    let height = (2.0 * y / ROWS as f32 - 1.0).clamp(-1.0, 1.0);
    let (sin, cos) = (TAU * (x / COLUMNS as f32 - 0.5)).sin_cos();
    let r = (1.0 - height * height).sqrt();
    Vec3::new(r * cos, height, r * sin)
}

/// How bright the sky is in each part, but for what sparkles; and the share of the plain draw that the rest asks for.
fn brightness(sky: &Sky) -> (Parts, f32) {
    let mut light = [1.0; PARTS];
    if let Sky::Constant(_) = sky {
        return (light, PLAIN);
    }
    for (i, light) in light.iter_mut().enumerate() {
        let look = |k: usize| {
            let along = |k: usize| (k as f32 + 0.5) / LOOKS as f32;
            let (x, y) = ((i % COLUMNS) as f32 + along(k % LOOKS), (i / COLUMNS) as f32 + along(k / LOOKS));
            sky.radiance(direction(x, y)).mean()
        };
        let mut looks: Vec<f32> = (0..LOOKS * LOOKS).map(look).collect();
        looks.sort_unstable_by(f32::total_cmp);
        let most = SPARKLE * looks[looks.len() / 2];
        *light = looks.iter().map(|l| l.min(most)).sum::<f32>() / looks.len() as f32;
    }
    let even = light.iter().sum::<f32>() / PARTS as f32;
    (light, (1.0 - even / sky.mean().mean().max(1e-30)).clamp(PLAIN, MOST_PLAIN))
}

/// Shares of the parts in what `places` see, with what is seen `around` them, in sum 1; or 0.
fn seen_from<'a>(places: impl Iterator<Item = &'a Place>, around: &Parts) -> Parts {
    let (mut seen, mut count) = ([0.0; PARTS], 0.0);
    for &(part, share) in places.flat_map(|place| &place.seen) {
        seen[part as usize] += share;
        count += 1.0;
    }
    let weight = count / seen.iter().sum::<f32>().max(1e-30);
    for (seen, around) in seen.iter_mut().zip(around) {
        *seen = weight * *seen + AROUND * around;
    }
    let all = seen.iter().sum::<f32>().max(1e-30);
    seen.map(|part| part / all)
}

/// What `points`, each with its unit normal, see by so many `rays` each, which `draw` gives, with their densities (1/sr).
fn look(
    world: &World,
    points: &[(Vec3, Vec3)],
    rays: u32,
    draw: impl Fn((Vec3, Vec3), [f32; 2]) -> (Vec3, f32) + Sync,
) -> Vec<Place> {
    let place = |(i, &(p, n)): (usize, &(Vec3, Vec3))| {
        let shift = Rng::new(0x6f_7574_6c6f_6f6b, i as u64).vec2();
        let out = |k: u32| {
            // Of a golden sequence, so that few rays look everywhere.
            let u = [(k as f32 + shift.x) / rays as f32, (k as f32 * 0.618_034 + shift.y).fract()];
            let (wi, pdf) = draw((p, n), u);
            let cos = wi.dot(n);
            if cos <= 0.0 || pdf <= 0.0 {
                return None;
            }
            let left = world.transmittance(&Ray::new(offset_origin(p, n), wi)).mean();
            (left > 0.0).then(|| (part(wi) as u16, left * cos / (PI * pdf * rays as f32)))
        };
        Place { at: p, facing: facing(n), seen: (0..rays).filter_map(out).collect() }
    };
    points.par_iter().enumerate().map(place).collect()
}

impl View {
    /// Of places that see the parts in these shares, each as bright as `light`; `None` where they see none.
    fn new(seen: &Parts, light: &Parts) -> Option<View> {
        // Neighbouring parts are seen from places between those that were asked.
        let around = |row: usize, column: usize| {
            let mut sum = 0.0;
            for (dy, by) in [(0, 1.0), (1, 2.0), (2, 1.0)] {
                let Some(y) = (row + dy).checked_sub(1).filter(|&y| y < ROWS) else { continue };
                for (dx, bx) in [(COLUMNS - 1, 1.0), (0, 2.0), (1, 1.0)] {
                    sum += by * bx * seen[y * COLUMNS + (column + dx) % COLUMNS];
                }
            }
            sum * light[row * COLUMNS + column]
        };
        let mut rows = [0f64; ROWS + 1];
        let mut columns = [[0f32; COLUMNS + 1]; ROWS];
        for row in 0..ROWS {
            let weights: Vec<f64> = (0..COLUMNS).map(|column| f64::from(around(row, column))).collect();
            let whole: f64 = weights.iter().sum();
            let mut sum = 0.0;
            for (column, weight) in weights.iter().enumerate() {
                sum += weight;
                columns[row][column + 1] =
                    if whole > 0.0 { (sum / whole) as f32 } else { (column + 1) as f32 / COLUMNS as f32 };
            }
            columns[row][COLUMNS] = 1.0;
            rows[row + 1] = rows[row] + whole;
        }
        let whole = rows[ROWS];
        (whole > 0.0 && whole.is_finite())
            .then(|| View { rows: rows.map(|sum| (sum / whole) as f32), columns })
    }

    /// Density of [`View::draw`] in a part, 1/sr.
    fn pdf(&self, part: usize) -> f32 {
        let (row, column) = (part / COLUMNS, part % COLUMNS);
        let columns = &self.columns[row];
        let share = (self.rows[row + 1] - self.rows[row]) * (columns[column + 1] - columns[column]);
        share * PARTS as f32 / (4.0 * PI)
    }

    /// A direction; `u` in [0, 1)².
    fn draw(&self, u: [f32; 2]) -> Vec3 {
        let pick = |sums: &[f32], u: f32| {
            let i = sums.partition_point(|&s| s <= u).clamp(1, sums.len() - 1) - 1;
            let width = sums[i + 1] - sums[i];
            i as f32 + if width > 0.0 { ((u - sums[i]) / width).clamp(0.0, 0.999_999) } else { 0.5 }
        };
        let y = pick(&self.rows, u[1]);
        direction(pick(&self.columns[y as usize], u[0]), y)
    }
}

/// A sky as one place sees it: what all draws from there share.
#[derive(Clone, Debug)]
pub struct SeenSky<'a> {
    sky: &'a Sky,
    n: Vec3,
    view: Option<(&'a View, f32)>,
}

impl<'a> SeenSky<'a> {
    /// As seen from `p` with unit normal `n` by what `outlook` knows; zero `n`: from all sides.
    pub(crate) fn new(sky: &'a Sky, outlook: Option<&'a Outlook>, p: Vec3, n: Vec3) -> SeenSky<'a> {
        let view = outlook.filter(|_| n != Vec3::ZERO).and_then(|outlook| outlook.view(p, n));
        SeenSky { sky, n, view }
    }

    /// A direction; `u` in [0, 1)².
    pub fn sample(&self, u: [f32; 2]) -> SkySample {
        let Some((view, plain)) = self.view else { return self.sample_plainly(u) };
        let [u, v] = u;
        if v < plain {
            let s = self.sample_plainly([u, v / plain]);
            return SkySample { pdf: self.pdf(s.direction), ..s };
        }
        let direction = view.draw([u, (v - plain) / (1.0 - plain)]);
        SkySample { direction, radiance: self.sky.radiance(direction), pdf: self.pdf(direction) }
    }

    /// The density with which [`SeenSky::sample`] gives the unit direction `d`, 1/sr.
    pub fn pdf(&self, d: Vec3) -> f32 {
        match self.view {
            Some((view, plain)) => plain * self.plain_pdf(d) + (1.0 - plain) * view.pdf(part(d)),
            None => self.plain_pdf(d),
        }
    }

    /// By the sky alone; an even one by the cosine.
    fn sample_plainly(&self, u: [f32; 2]) -> SkySample {
        match self.sky {
            Sky::Constant(radiance) if self.n != Vec3::ZERO => {
                let direction = to_world(sampling::cosine_hemisphere(Vec2::from(u)), self.n);
                SkySample { direction, radiance: *radiance, pdf: self.plain_pdf(direction) }
            }
            sky => sky.sample(u),
        }
    }

    fn plain_pdf(&self, d: Vec3) -> f32 {
        match self.sky {
            Sky::Constant(_) if self.n != Vec3::ZERO => {
                sampling::cosine_hemisphere_pdf_solid_angle(d.dot(self.n))
            }
            sky => sky.pdf(d),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emitter::testing::points;
    use crate::polygon::polygon_irradiance;
    use crate::{Material, MaterialId, Mesh, Rgb, Scene};

    /// A room of 4 × 3 × 4 m under `sky`, with a window where x = 4, 1 < y < 2, 1 < z < 2, or without.
    fn room(sky: Sky, open: bool) -> World {
        let mut mesh = Mesh::default();
        let mut quad = |o: [f32; 3], u: [f32; 3], v: [f32; 3]| {
            let (o, u, v) = (Vec3::from(o), Vec3::from(u), Vec3::from(v));
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([o, o + u, o + u + v, o + v]);
            mesh.normals.extend([u.cross(v).normalize(); 4]);
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        };
        quad([0.0, 0.0, 0.0], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0]);
        quad([0.0, 3.0, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]);
        quad([0.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]);
        quad([0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]);
        quad([0.0, 0.0, 4.0], [0.0, 3.0, 0.0], [4.0, 0.0, 0.0]);
        for (y, z, h, w) in
            [(0.0, 0.0, 1.0, 4.0), (2.0, 0.0, 1.0, 4.0), (1.0, 0.0, 1.0, 1.0), (1.0, 2.0, 1.0, 2.0)]
        {
            quad([4.0, y, z], [0.0, 0.0, w], [0.0, h, 0.0]);
        }
        if !open {
            quad([4.0, 1.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]);
        }
        mesh.materials = vec![MaterialId(0); mesh.triangles.len()];
        World::new(Scene { mesh, materials: vec![Material::default()], sky: Some(sky), ..Scene::default() })
    }

    /// Irradiance at `p` with shadows by `n` draws, and the variance of one; each draw carries the density that is told of it.
    fn irradiance<'a>(
        world: &World,
        outlook: impl Into<Option<&'a Outlook>>,
        p: Vec3,
        n: Vec3,
        draws: u32,
    ) -> (f32, f32) {
        let sky = world.scene.sky.as_ref().expect("a sky");
        let seen = SeenSky::new(sky, outlook.into(), p, n);
        let (mut sum, mut square) = (0f64, 0f64);
        for u in points(draws) {
            let s = seen.sample([u[0], u[1]]);
            let told = seen.pdf(s.direction);
            assert!((told / s.pdf - 1.0).abs() < 1e-3, "{} {told} {}", s.direction, s.pdf);
            let left = world.transmittance(&Ray::new(offset_origin(p, n), s.direction));
            let brought = f64::from((s.radiance * left).g * s.direction.dot(n).max(0.0) / s.pdf);
            sum += brought / f64::from(draws);
            square += brought * brought / f64::from(draws);
        }
        (sum as f32, (square - sum * sum) as f32)
    }

    #[test]
    fn a_window_lights_the_room_as_its_form_factor_says() {
        let bright = (0..32 * 16).map(|i| Rgb::splat(if i % 32 == 7 { 30.0 } else { 3.0 })).collect();
        let skies = [
            (Sky::Constant(Rgb::splat(3.0)), true),
            (Sky::image(8, 4, vec![Rgb::splat(3.0); 32]).expect("32 pixels"), true),
            (Sky::image(32, 16, bright).expect("512 pixels"), false),
        ];
        let window = [[4.0, 1.0, 1.0], [4.0, 1.0, 2.0], [4.0, 2.0, 2.0], [4.0, 2.0, 1.0]].map(Vec3::from);
        for (sky, even) in skies {
            let world = room(sky, true);
            assert!(world.emitters.outlook.is_some());
            for (p, n) in
                [([0.0, 1.6, 1.2], Vec3::X), ([2.5, 0.0, 1.5], Vec3::Y), ([1.0, 0.7, 4.0], Vec3::NEG_Z)]
            {
                let p = Vec3::from(p);
                let (e, variance) = irradiance(&world, world.emitters.outlook(), p, n, 400_000);
                let (plain, plain_variance) = irradiance(&world, None, p, n, 400_000);
                if even {
                    let exact = 3.0 * PI * polygon_irradiance(p, n, &window).abs();
                    assert!((e / exact - 1.0).abs() < 1e-3, "{p}: {e} {exact}");
                }
                assert!((e / plain - 1.0).abs() < 0.01, "{p}: {e} {plain}");
                // 16 times and more, measured with 16 rays from each place.
                assert!(10.0 * variance < plain_variance, "{p}: {variance} {plain_variance}");
            }
        }
    }

    #[test]
    fn a_niche_goes_by_what_is_seen_around_it() {
        let place = |i: usize, seen| Place { at: Vec3::new(i as f32, 0.0, 0.0), facing: 2, seen };
        let lit = (0..TOGETHER).map(|i| place(i, vec![(100, 0.01)]));
        let dark = (TOGETHER..2 * TOGETHER).map(|i| place(i, Vec::new()));
        let outlook =
            Outlook::over(lit.chain(dark).collect(), &Sky::Constant(Rgb::WHITE)).expect("one is seen");
        for x in [0.0, 1.5 * TOGETHER as f32] {
            let (view, _) = outlook.view(Vec3::new(x, 0.0, 0.0), Vec3::Y).expect("there is a window");
            // A part, a quarter of it blurred away to each side along rows and columns.
            let share = view.pdf(100) * 4.0 * PI / PARTS as f32;
            assert!((share - 0.25).abs() < 1e-3, "{x}: {share}");
        }
        assert!(outlook.view(Vec3::ZERO, Vec3::X).is_none());
    }

    #[test]
    fn whoever_asks_more_near_by_knows_the_window_better() {
        let world = room(Sky::Constant(Rgb::splat(3.0)), true);
        let coarse = world.emitters.outlook().expect("a window");
        let near =
            |i: u32| Vec3::new(2.3 + 0.4 * (i % 16) as f32 / 16.0, 0.0, 1.3 + 0.4 * (i / 16) as f32 / 16.0);
        let places: Vec<_> = (0..256).map(|i| (near(i), Vec3::Y)).collect();
        let fine = coarse.with(&world, &places).expect("a window");
        let (p, n) = (Vec3::new(2.5, 0.0, 1.5), Vec3::Y);
        let by = |outlook| irradiance(&world, outlook, p, n, 400_000);
        let ((e, variance), (told, more)) = (by(&fine), by(coarse));
        assert!((e / told - 1.0).abs() < 2e-3, "{e} {told}");
        assert!(variance < more, "{variance} {more}");
    }

    #[test]
    fn a_roof_that_goes_by_the_windows_below_it_gets_all_of_the_sky() {
        let world = room(Sky::Constant(Rgb::WHITE), true);
        let (e, _) = irradiance(&world, world.emitters.outlook(), Vec3::new(2.0, 3.0, 2.0), Vec3::Y, 40_000);
        assert!((e / PI - 1.0).abs() < 0.01, "{e}");
    }

    #[test]
    fn without_a_window_there_is_nothing_to_know() {
        assert!(room(Sky::Constant(Rgb::WHITE), false).emitters.outlook.is_none());
        assert!(World::new(Scene::default()).emitters.outlook.is_none());
    }
}
