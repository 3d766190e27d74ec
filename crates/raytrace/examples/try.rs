//! try
use geometry::*;
use raytrace::render::*;
use raytrace::*;
static T: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
struct P;
impl Progress for P {
    fn stage(&self, n: &'static str, t: u64) {
        eprintln!("[{:.1}] {n} {t}", T.get_or_init(std::time::Instant::now).elapsed().as_secs_f32())
    }
    fn advance(&self, _: u64) {}
    fn stopped(&self) -> bool {
        false
    }
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let l = gltf::load(std::path::Path::new(&a[1])).unwrap();
    for w in &l.warnings {
        eprintln!("W {w}")
    }
    let (w, h): (u32, u32) = (a[3].parse().unwrap(), a[4].parse().unwrap());
    let err: f32 = a[5].parse().unwrap();
    let cam = l.cameras.get(a.get(6).map_or(0, |s| s.parse().unwrap())).cloned().unwrap_or_else(|| {
        let (lo, hi) = l.scene.mesh.bounds().unwrap();
        Camera::framing(lo, hi)
    });
    let spp: Option<u32> = a.get(7).map(|s| s.parse().unwrap());
    let t = std::time::Instant::now();
    let world = World::new(l.scene);
    eprintln!(
        "world {:.2}s tris {} lights {}",
        t.elapsed().as_secs_f32(),
        world.scene.mesh.triangles.len(),
        world.emitters.len()
    );
    let mode = match std::env::var("MODE").as_deref() {
        Ok("vertex") => DiffuseMode::Vertex,
        Ok("gather") => DiffuseMode::Gather,
        _ => DiffuseMode::Split,
    };
    let s = Settings {
        width: w,
        height: h,
        seed: 0,
        error: err,
        integrator: match spp {
            Some(n) => Integrator::Path { spp: n },
            None => Integrator::Hybrid,
        },
        diffuse: mode,
        deadline: None,
        gather_rays: None,
        samples: None,
    };
    let t = std::time::Instant::now();
    let o = render(&world, &cam, None, &s, &P).unwrap();
    eprintln!("{:?} total {:.2}s repaired {}", o.report, t.elapsed().as_secs_f32(), o.film.repaired);
    exr::write(&o.film, &exr::Metadata::default(), std::path::Path::new(&a[2])).unwrap();
    let b = o.film.beauty();
    let ev = tonemap::automatic_exposure(&b);
    tonemap::write_png(w, h, &tonemap::to_srgb(&b, ev), &std::path::Path::new(&a[2]).with_extension("png"))
        .unwrap();
}
