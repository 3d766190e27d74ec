//! Light in a texture: what a rasteriser shows of each texel, its colour and its light in one.
//!
//! glTF has no slot for a light map beside a colour texture. So the texture is the radiance itself, an unlit material's
//! colour: every viewer shows it, and detail of the colour is as coarse as the texels. For lit materials
//! it is the emissive texture, which viewers add to what lamps give.

use super::atlas::{Atlas, Chartlet, PADDING, unwrap, wanted};
use super::light::{Lamp, Place, Seen, roughly};
use super::look::Look;
use super::vertices::relative_to;
use super::{Baked, Map, Part, Report, Settings};
use crate::render::Progress;
use geometry::sampling::{self, Rng};
use geometry::{Rgb, Vec2, World};
use radiosity::Solution;
use radiosity::element::Side;
use rayon::prelude::*;
use std::collections::HashMap;

/// Shadow rays of a place: a texel has two places, and where these differ eight others.
const SHADOW_RAYS: u32 = 4;
/// Two places in a texel that differ by more than this share are not enough.
const DIFFER: f32 = 0.03;
/// Shadow rays of the other places then.
const MORE_RAYS: u32 = 16;
/// Fresh places at which the map is judged.
const JUDGES: usize = 16_384;
/// A texel whose middle lies this far from a chart at most takes the light of the chart's border, texels.
const REACH: f32 = PADDING as f32;

/// Bakes to a texture of `side` × `side` texels at most.
pub fn bake(
    world: &World,
    solution: &Solution,
    looks: Vec<Look>,
    settings: &Settings,
    side: u32,
    progress: &dyn Progress,
) -> Baked {
    let scene = &world.scene;
    progress.stage("unwrap", 0);
    let lit_back = |triangle: u32| {
        let seen = roughly(world, solution, Place { triangle, uv: [1.0 / 3.0; 2], side: Side::Back });
        !seen.white.is_black() || !seen.emission.is_black()
    };
    let wanted = wanted(scene, &looks, lit_back);
    let mut report = Report { flux_kept: 1.0, ..Report::default() };
    let Some(atlas) = unwrap(scene, &wanted, side).filter(|a| !a.chartlets.is_empty()) else {
        report.warnings.push(match wanted.is_empty() {
            true => "there is nothing to bake light for".into(),
            false => format!("{} triangles do not fit a texture of {side} x {side}", wanted.len()),
        });
        return Baked { looks, parts: Vec::new(), map: None, report };
    };
    progress.stage("texels", u64::from(atlas.height));
    let lamps = [SHADOW_RAYS, MORE_RAYS].map(|rays| Lamp::new(world, solution, rays));
    let map = texels(world, &atlas, &lamps, settings, &looks, progress);
    report.error = error(world, &atlas, &map, &lamps[1], settings, &looks);
    let parts = parts(world, &atlas, &looks);
    Baked { looks, parts, map: Some(map), report }
}

/// What a texel shows of what is `seen` at `place`.
fn shown(world: &World, looks: &[Look], place: Place, seen: &Seen) -> Rgb {
    let look = looks[world.scene.mesh.materials[place.triangle as usize].0 as usize];
    if look == Look::Lit { seen.base * seen.white } else { seen.radiance() }
}

/// Which chartlet each texel belongs to: the nearest one within [`REACH`].
fn owners(atlas: &Atlas) -> Vec<Option<u32>> {
    let (w, h) = (atlas.width, atlas.height);
    let size = Vec2::new(w as f32, h as f32);
    let mut nearest: Vec<(f32, u32)> = vec![(REACH, u32::MAX); (w * h) as usize];
    for (i, chartlet) in atlas.chartlets.iter().enumerate() {
        let corners = chartlet.uv.map(|uv| uv * size);
        let low = corners[0].min(corners[1]).min(corners[2]) - REACH - 0.5;
        let high = corners[0].max(corners[1]).max(corners[2]) + REACH - 0.5;
        let range = |lo: f32, hi: f32, n: u32| {
            lo.ceil().max(0.0) as u32..=hi.floor().clamp(-1.0, n as f32 - 1.0) as u32
        };
        for y in range(low.y, high.y, h) {
            for x in range(low.x, high.x, w) {
                let (_, distance) = chartlet.nearest(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), size);
                let texel = &mut nearest[(y * w + x) as usize];
                if distance < texel.0 {
                    *texel = (distance, i as u32);
                }
            }
        }
    }
    nearest.into_iter().map(|(_, i)| (i != u32::MAX).then_some(i)).collect()
}

/// Light of all texels.
fn texels(
    world: &World,
    atlas: &Atlas,
    lamps: &[Lamp; 2],
    settings: &Settings,
    looks: &[Look],
    progress: &dyn Progress,
) -> Map {
    let (w, h) = (atlas.width, atlas.height);
    let size = Vec2::new(w as f32, h as f32);
    let owners = owners(atlas);
    let light = |i: usize| -> Option<(Rgb, f32)> {
        let chartlet = &atlas.chartlets[owners[i]? as usize];
        let mut rng = Rng::new(settings.seed ^ 0x7465_7865, i as u64);
        let corner = Vec2::new((i as u32 % w) as f32, (i as u32 / w) as f32);
        // In the quarter `k` of the texel.
        let mut look = |lamp: &Lamp, k: u32| {
            let jitter = (Vec2::new((k % 2) as f32, (k / 2 % 2) as f32) + rng.vec2()) * 0.5;
            let (uv, _) = chartlet.nearest(corner + jitter, size);
            let place = chartlet.place(uv);
            let seen = lamp.look(place, &mut rng);
            (shown(world, looks, place, &seen), seen.alpha)
        };
        let mut all = vec![look(&lamps[0], 0), look(&lamps[0], 3)];
        let (a, b) = (all[0].0.luminance(), all[1].0.luminance());
        if (a - b).abs() > DIFFER * (a + b) || all[0].1 != all[1].1 {
            all = (0..8).map(|k| look(&lamps[1], k)).collect();
        }
        let n = all.len() as f32;
        Some((all.iter().map(|l| l.0).sum::<Rgb>() / n, all.iter().map(|l| l.1).sum::<f32>() / n))
    };
    let rows: Vec<Vec<Option<(Rgb, f32)>>> = (0..h as usize)
        .into_par_iter()
        .map(|y| {
            let row = (0..w as usize).map(|x| light(y * w as usize + x)).collect();
            progress.advance(1);
            row
        })
        .collect();
    let mut texels: Vec<Option<(Rgb, f32)>> = rows.into_iter().flatten().collect();
    spread(&mut texels, w as usize, h as usize);
    let (texels, alpha) = texels.into_iter().map(|t| t.unwrap_or((Rgb::BLACK, 1.0))).unzip();
    Map {
        width: w,
        height: h,
        texels,
        alpha,
        charts: atlas.charts,
        density: atlas.density,
        covered: atlas.covered,
    }
}

/// Fills what no chart reaches from the nearest texels on: mip levels mix it in.
fn spread(texels: &mut [Option<(Rgb, f32)>], w: usize, h: usize) {
    // From coarse to fine: a texel without light takes the mean of those of its quarter, sixteenth, ... of the texture.
    if w <= 1 && h <= 1 {
        return;
    }
    let (cw, ch) = (w.div_ceil(2), h.div_ceil(2));
    let mut coarse: Vec<Option<(Rgb, f32)>> = (0..cw * ch)
        .map(|i| {
            let (x, y) = (2 * (i % cw), 2 * (i / cw));
            let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
            let lit =
                || four.into_iter().filter(|&(x, y)| x < w && y < h).filter_map(|(x, y)| texels[y * w + x]);
            let n = lit().count() as f32;
            (n > 0.0).then(|| (lit().map(|t| t.0).sum::<Rgb>() / n, lit().map(|t| t.1).sum::<f32>() / n))
        })
        .collect();
    spread(&mut coarse, cw, ch);
    for i in 0..w * h {
        if texels[i].is_none() {
            texels[i] = coarse[i / w / 2 * cw + i % w / 2];
        }
    }
}

/// The error at fresh places, spread evenly over the area, of what a viewer's bilinear look-up shows.
fn error(
    world: &World,
    atlas: &Atlas,
    map: &Map,
    lamp: &Lamp,
    settings: &Settings,
    looks: &[Look],
) -> Option<f32> {
    let mut sum = 0.0;
    let glows =
        |c: &Chartlet| looks[world.scene.mesh.materials[c.triangle as usize].0 as usize] == Look::Glowing;
    let sums: Vec<f64> = (atlas.chartlets.iter())
        .map(|c| {
            sum += if glows(c) { 0.0 } else { f64::from(world.scene.mesh.area(c.triangle)) };
            sum
        })
        .collect();
    // Lamps are among the texels: the median tells more of the room than the mean.
    let mean = median(map.texels.iter().map(|t| f64::from(t.luminance())).collect());
    if sum <= 0.0 || mean <= 0.0 {
        return None;
    }
    let judged: Vec<(f64, f64)> = (0..JUDGES)
        .into_par_iter()
        .map(|i| {
            let mut rng = Rng::new(settings.seed ^ 0x6a75_6467, i as u64);
            let at = (i as f64 + f64::from(rng.f32())) / JUDGES as f64 * sum;
            let chartlet = &atlas.chartlets[sums.partition_point(|&s| s <= at).min(sums.len() - 1)];
            let (u, v) = sampling::triangle(rng.vec2());
            let place = chartlet.place([u, v]);
            let two = [0, 1].map(|_| lamp.look(place, &mut rng));
            if two[0].hidden {
                return (0.0, 0.0);
            }
            let [one, other] = two.map(|seen| shown(world, looks, place, &seen).luminance());
            let [a, b, c] = chartlet.uv;
            let held = map.look_up(a + (b - a) * u + (c - a) * v).luminance();
            // Two independent looks: their noise is not in the mean of the products.
            let light = f64::from(held.max(0.5 * (one + other)));
            (f64::from(held - one) * f64::from(held - other) / relative_to(light, mean), 1.0)
        })
        .collect();
    let (off, count) = judged.iter().fold((0.0, 0.0), |(a, b), &(x, y)| (a + x, b + y));
    (count > 0.0).then(|| (off.max(0.0) / count).sqrt() as f32)
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

impl Map {
    /// Light at `uv`, bilinear between the middles of texels.
    pub fn look_up(&self, uv: Vec2) -> Rgb {
        let at = uv * Vec2::new(self.width as f32, self.height as f32) - 0.5;
        let base = at.floor();
        let f = at - base;
        let texel = |dx: f32, dy: f32| {
            let x = (base.x + dx).clamp(0.0, self.width as f32 - 1.0) as usize;
            let y = (base.y + dy).clamp(0.0, self.height as f32 - 1.0) as usize;
            self.texels[y * self.width as usize + x]
        };
        texel(0.0, 0.0).lerp(texel(1.0, 0.0), f.x).lerp(texel(0.0, 1.0).lerp(texel(1.0, 1.0), f.x), f.y)
    }
}

/// The scene's parts with their places in the atlas.
fn parts(world: &World, atlas: &Atlas, looks: &[Look]) -> Vec<Part> {
    let mesh = &world.scene.mesh;
    let mut of_triangle: HashMap<u32, Vec<usize>> = HashMap::new();
    for (i, chartlet) in atlas.chartlets.iter().enumerate() {
        of_triangle.entry(chartlet.triangle).or_default().push(i);
    }
    let mut parts = Vec::new();
    for range in &mesh.parts {
        let mut triangles: Vec<u32> = (range.first..range.first + range.count).collect();
        triangles.sort_by_key(|&t| mesh.materials[t as usize]);
        for run in triangles.chunk_by(|&a, &b| mesh.materials[a as usize] == mesh.materials[b as usize]) {
            let material = mesh.materials[run[0] as usize].0;
            let takes = looks[material as usize].takes_light();
            let mut part = Part { name: range.name.clone(), material, ..Part::default() };
            let mut known: HashMap<(u32, bool, [u32; 2]), u32> = HashMap::new();
            let mut vertex = |part: &mut Part, v: u32, side: Side, uv: Option<Vec2>| {
                let key = (v, side == Side::Front, uv.unwrap_or_default().to_array().map(f32::to_bits));
                *known.entry(key).or_insert_with(|| {
                    let v = v as usize;
                    part.positions.push(mesh.positions[v]);
                    part.normals.push(mesh.normals.get(v).copied().unwrap_or_default() * side.sign());
                    for (set, from) in part.uvs.iter_mut().zip(&mesh.uvs) {
                        set.extend(from.get(v));
                    }
                    part.colors.extend(mesh.colors.get(v).map(|c| c.to_array()));
                    part.map_uvs.extend(uv);
                    part.positions.len() as u32 - 1
                })
            };
            for &t in run {
                let corners = mesh.triangles[t as usize];
                if !takes {
                    let triangle = corners.map(|v| vertex(&mut part, v, Side::Front, None));
                    part.triangles.push(triangle);
                }
                for &i in of_triangle.get(&t).into_iter().flatten() {
                    let Chartlet { side, uv, .. } = atlas.chartlets[i];
                    let [a, b, c] = [0, 1, 2].map(|k| vertex(&mut part, corners[k], side, Some(uv[k])));
                    part.triangles.push(if side == Side::Front { [a, b, c] } else { [a, c, b] });
                }
            }
            if !part.triangles.is_empty() {
                parts.push(part);
            }
        }
    }
    parts
}
