//! dbg
use geometry::*;
use radiosity::element::*;
use raytrace::render::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let l = geometry::gltf::load(std::path::Path::new(&a[1])).unwrap();
    let cam = l.cameras[0].clone();
    let world = World::new(l.scene);
    let s = Settings {
        width: 320,
        height: 180,
        seed: 1,
        error: 0.03,
        integrator: Integrator::Hybrid,
        diffuse: DiffuseMode::Split,
        deadline: None,
        gather_rays: None,
        samples: None,
    };
    let sol = prepass(&world, &s, &()).unwrap();
    let el = sol.elements();
    println!("pieces {} flagged {}", el.pieces, sol.report.flagged);
    let reach = radiosity::reach::Reach::explore(&world, el, 1);
    for xy in a[2..].chunks(2) {
        let (x, y): (f32, f32) = (xy[0].parse().unwrap(), xy[1].parse().unwrap());
        let ray = cam.ray(x, y, 320.0 / 180.0);
        let h = world.closest(&ray).unwrap();
        let su = Surface::new(&world.scene, &ray, &h);
        let side = Side::met(su.front);
        let p = el.piece(h.triangle).unwrap();
        println!(
            "tri {} side {:?} piece {} alive {} {} mat {} pos {} E {:?}",
            h.triangle,
            side,
            p,
            reach.alive(p, Side::Front),
            reach.alive(p, Side::Back),
            world.scene.materials[su.material.0 as usize].name,
            su.position,
            sol.irradiance(&world, h.triangle, h.u, h.v, side)
        );
        let (n, w) = el.locate(h.triangle, h.u, h.v);
        for (v, w) in el.nodes[n as usize].vertices.iter().zip(w) {
            let vv = &el.vertices[*v as usize];
            let have = sol.vertices(side).any(|(q, _)| q == vv.position);
            println!("   v {v} w {w:.2} pos {} n {} usable {have}", vv.position, vv.normal);
        }
        // what first hits
        let mut c = [0; 4];
        let mut rng = sampling::Rng::new(1, 2);
        for _ in 0..2000 {
            let d = math::to_world(sampling::cosine_hemisphere(rng.vec2()), su.ng);
            let r = Ray::new(math::offset_origin(su.position, su.ng), d);
            match world.closest(&r) {
                None => c[0] += 1,
                Some(h) => {
                    let s2 = Surface::new(&world.scene, &r, &h);
                    let p = el.piece(h.triangle);
                    c[match p {
                        None => 1,
                        Some(p) => {
                            if reach.alive(p, Side::met(s2.front)) {
                                2
                            } else {
                                3
                            }
                        }
                    }] += 1
                }
            }
        }
        println!("   escape/none/alive/dead {c:?}");
    }
}
