//! A place in one texture for every triangle side that light is baked for.

use super::light::Place;
use super::look::Look;
use geometry::{Scene, Vec2};
use radiosity::element::Side;
use uvunwrap::{Density, MeshInput, Options, Packing};

/// Texels without a chart around each chart at least: bilinear look-ups reach one, the first mip level two.
pub const PADDING: u32 = 2;
/// Charts hold faces within this angle of their mean, degrees: curved ones are flattened, corners of a room are not.
const CHART_ANGLE: f32 = 45.0;

/// A triangle in the atlas.
#[derive(Clone, Copy, Debug)]
pub struct Chartlet {
    /// Scene triangle.
    pub triangle: u32,
    /// Which side of it.
    pub side: Side,
    /// Corners in the atlas, [0, 1], in the order of the scene triangle's.
    pub uv: [Vec2; 3],
}

/// An unwrapped scene.
#[derive(Clone, Debug)]
pub struct Atlas {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Every triangle side that light is baked for and that has an area.
    pub chartlets: Vec<Chartlet>,
    /// Charts.
    pub charts: u32,
    /// Texels for a metre.
    pub density: f32,
    /// Share of the texels that hold a surface.
    pub covered: f32,
}

/// Unwraps the `wanted` sides into a texture of at most `side` × `side` texels; `None` where they do not fit.
pub fn unwrap(scene: &Scene, wanted: &[(u32, Side)], side: u32) -> Option<Atlas> {
    let positions: Vec<[f32; 3]> = scene.mesh.positions.iter().map(|p| p.to_array()).collect();
    // Front and back of a sheet are two surfaces: as one mesh their charts would meet at every edge.
    let of = |s: Side| -> Vec<u32> { wanted.iter().filter(|w| w.1 == s).map(|w| w.0).collect() };
    let sides = Side::BOTH.map(of);
    let corners = |triangles: &[u32], s: Side| -> Vec<u32> {
        let turned = |t: u32| {
            let [a, b, c] = scene.mesh.triangles[t as usize];
            if s == Side::Front { [a, b, c] } else { [a, c, b] }
        };
        triangles.iter().flat_map(|&t| turned(t)).collect()
    };
    let indices = [corners(&sides[0], Side::Front), corners(&sides[1], Side::Back)];
    let materials = [0, 1].map(|s: usize| -> Vec<u32> {
        sides[s].iter().map(|&t| scene.mesh.materials[t as usize].0).collect()
    });
    let inputs: Vec<MeshInput> = (0..2)
        .map(|s| MeshInput { face_materials: Some(&materials[s]), ..MeshInput::new(&positions, &indices[s]) })
        .collect();
    let many = wanted.len() > 100_000;
    let options = Options {
        max_chart_angle: CHART_ANGLE,
        density: Density::Auto { page_size: side },
        padding: PADDING,
        packing: if many { Packing::Fast } else { Packing::Shape },
        ..Options::default()
    };
    let atlas = uvunwrap::generate(&inputs, &options).ok()?;
    if atlas.page_count != 1 {
        return None;
    }
    let mut chartlets = Vec::new();
    for (s, mesh) in atlas.meshes.iter().enumerate() {
        for (&triangle, corners) in sides[s].iter().zip(mesh.indices.chunks_exact(3)) {
            let corners = [corners[0], corners[1], corners[2]].map(|i| &mesh.vertices[i as usize]);
            if corners.iter().any(|v| v.page != Some(0)) {
                continue;
            }
            let [a, b, c] = corners.map(|v| Vec2::from(v.uv));
            let uv = if s == 0 { [a, b, c] } else { [a, c, b] };
            chartlets.push(Chartlet { triangle, side: Side::BOTH[s], uv });
        }
    }
    Some(Atlas {
        width: atlas.width,
        height: atlas.height,
        chartlets,
        charts: atlas.chart_count,
        density: atlas.texels_per_unit,
        covered: atlas.utilization,
    })
}

/// The triangle sides that light is baked for.
pub fn wanted(scene: &Scene, looks: &[Look], lit_back: impl Fn(u32) -> bool) -> Vec<(u32, Side)> {
    let mut wanted = Vec::new();
    for t in 0..scene.mesh.triangles.len() as u32 {
        let m = scene.mesh.materials[t as usize].0 as usize;
        if !looks[m].takes_light() || scene.mesh.area(t) <= 0.0 {
            continue;
        }
        wanted.push((t, Side::Front));
        if scene.materials[m].double_sided && lit_back(t) {
            wanted.push((t, Side::Back));
        }
    }
    wanted
}

impl Chartlet {
    /// The point of the triangle nearest to texture point `p`, as barycentrics of its second and third corner in the scene
    /// triangle, and its distance from there in the unit of `p` (`to_texels` scales the corners to it).
    pub fn nearest(&self, p: Vec2, to_texels: Vec2) -> ([f32; 2], f32) {
        let [a, b, c] = self.uv.map(|uv| uv * to_texels);
        let (ab, ac, ap) = (b - a, c - a, p - a);
        let area = ab.perp_dot(ac);
        if area != 0.0 {
            let (u, v) = (ap.perp_dot(ac) / area, ab.perp_dot(ap) / area);
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
                return ([u, v], 0.0);
            }
        }
        // Outside: on one of the edges.
        let on = |p0: Vec2, p1: Vec2| {
            let d = p1 - p0;
            let t = ((p - p0).dot(d) / d.length_squared().max(1e-20)).clamp(0.0, 1.0);
            (t, p.distance(p0 + d * t))
        };
        let edges = [(on(a, b), 0), (on(b, c), 1), (on(c, a), 2)];
        let ((t, distance), edge) =
            edges.into_iter().min_by(|x, y| x.0.1.total_cmp(&y.0.1)).expect("a triangle has three edges");
        let uv = match edge {
            0 => [t, 0.0],
            1 => [1.0 - t, t],
            _ => [0.0, 1.0 - t],
        };
        (uv, distance)
    }

    /// A place in the world.
    pub fn place(&self, uv: [f32; 2]) -> Place {
        Place { triangle: self.triangle, uv, side: self.side }
    }
}
