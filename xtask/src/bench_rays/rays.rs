//! The rays: what a renderer shoots, in the order in which it does.

use geometry::bvh::{Bvh, Hit, Ray};
use geometry::math::{offset_origin, to_world};
use geometry::{Camera, Mesh, Vec3};

/// Rays of one kind.
pub struct Batch {
    /// For the table.
    pub name: &'static str,
    /// Whether any hit will do.
    pub any: bool,
    /// In the order they are traced.
    pub rays: Vec<Ray>,
}

const WIDTH: u32 = 1024;
const HEIGHT: u32 = 768;
/// Side of the square tiles the picture is traced in, pixels.
const TILE: u32 = 8;

/// Camera rays, a cosine-distributed ray from each of their hits, and a ray from each to a point below the
/// ceiling.
pub fn batches(mesh: &Mesh, camera: &Camera, bvh: &Bvh) -> Vec<Batch> {
    let tiles = (0..HEIGHT / TILE).flat_map(|y| (0..WIDTH / TILE).map(move |x| (x * TILE, y * TILE)));
    let pixels = tiles.flat_map(|(x, y)| (0..TILE * TILE).map(move |i| (x + i % TILE, y + i / TILE)));
    let film = |(x, y): (u32, u32)| {
        let (x, y) = ((x as f32 + 0.5) / WIDTH as f32, (y as f32 + 0.5) / HEIGHT as f32);
        camera.ray(x, y, WIDTH as f32 / HEIGHT as f32)
    };
    let primary: Vec<Ray> = pixels.map(film).collect();
    let hits: Vec<(Ray, Hit)> = primary.iter().filter_map(|r| Some((*r, bvh.closest_hit(r)?))).collect();

    let mut random = Random(1);
    let (lo, hi) = mesh.bounds().unwrap_or_default();
    let (mut diffuse, mut shadow) = (Vec::new(), Vec::new());
    for (ray, hit) in hits {
        let n = mesh.geometric_normal(hit.triangle);
        let n = if n.dot(ray.direction) < 0.0 { n } else { -n };
        let p = mesh.interpolate(hit.triangle, hit.u, hit.v, &mesh.positions);
        let origin = offset_origin(p, n);
        let (r, phi) = (random.unit().sqrt(), std::f32::consts::TAU * random.unit());
        let local = Vec3::new(r * phi.cos(), r * phi.sin(), (1.0 - r * r).sqrt());
        diffuse.push(Ray::new(origin, to_world(local, n)));

        let place = Vec3::new(0.4 + 0.2 * random.unit(), 0.95, 0.4 + 0.2 * random.unit());
        let away = lo + place * (hi - lo) - origin;
        let distance = away.length();
        shadow.push(Ray { t_max: 0.999 * distance, ..Ray::new(origin, away / distance) });
    }
    let batch = |name, any, rays| Batch { name, any, rays };
    vec![batch("camera", false, primary), batch("diffuse", false, diffuse), batch("shadow", true, shadow)]
}

/// xorshift64* (Marsaglia 2003; Vigna 2016): the same rays in every run.
struct Random(u64);

impl Random {
    /// In [0, 1).
    fn unit(&mut self) -> f32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f32 / (1u64 << 24) as f32
    }
}
