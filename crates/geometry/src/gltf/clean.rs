//! What is taken out of the baked mesh: triangles that no ray should meet, and the vertices only they used.

use std::collections::HashMap;

use rayon::prelude::*;

use super::warnings::Warnings;
use crate::math::Vec3;
use crate::scene::{Material, MaterialId, Scene};
use crate::{Mesh, triangle};

/// Takes out triangles with a non-finite corner, without area, or that stand in the place of another of the
/// same material, each with a counted warning.
///
/// Coincident triangles would give the tree a group that no split can part. Where the copy faces the other
/// way and the material emits from its front only, the survivor gets a double-sided copy of the material,
/// so that no light is lost.
pub(super) fn clean(scene: &mut Scene, warnings: &mut Warnings) {
    let mut fates: Vec<Fate> =
        (0..scene.mesh.triangles.len() as u32).into_par_iter().map(|t| judge(&scene.mesh, t)).collect();
    find_copies(scene, &mut fates);
    let mesh = &mut scene.mesh;
    if fates.iter().all(|&fate| fate == Fate::Stays) {
        return;
    }
    for part in &mesh.parts {
        let fates = &fates[part.first as usize..][..part.count as usize];
        for (fate, text) in [
            (Fate::NotFinite, "triangles dropped: a corner is not a finite number, or too large for one"),
            (Fate::NoArea, "triangles dropped: no area"),
            (Fate::Copy, "triangles dropped: another of the same material has the same corners"),
        ] {
            let n = fates.iter().filter(|&&f| f == fate).count();
            warnings.count(text, &part.name, n as u64);
        }
    }
    drop_triangles(mesh, &fates);
    drop_vertices(mesh);
}

#[derive(Clone, Copy, PartialEq)]
enum Fate {
    Stays,
    NotFinite,
    NoArea,
    Copy,
}

fn judge(mesh: &Mesh, t: u32) -> Fate {
    let [a, b, c] = mesh.corners(t);
    let area = triangle::area(a, b, c);
    if !(a.is_finite() && b.is_finite() && c.is_finite() && area.is_finite()) {
        Fate::NotFinite
    } else if area == 0.0 || triangle::normal(a, b, c) == Vec3::ZERO {
        Fate::NoArea
    } else {
        Fate::Stays
    }
}

/// The corners' bits in an order of their own: equal for triangles that share corners, however they turn.
fn key(mesh: &Mesh, t: u32) -> [[u32; 3]; 3] {
    // Adding 0 makes −0 equal to 0.
    let mut corners = mesh.corners(t).map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
    corners.sort_unstable();
    corners
}

fn hash(key: &[[u32; 3]; 3]) -> u64 {
    key.as_flattened().iter().fold(0, |h: u64, &x| {
        let h = (h ^ u64::from(x)).wrapping_mul(0x9E37_79B9_7F4A_7C15); // 2⁶⁴ / golden ratio
        h ^ h >> 29
    })
}

fn find_copies(scene: &mut Scene, fates: &mut [Fate]) {
    let Scene { mesh, materials, .. } = scene;
    let mut order: Vec<(u64, u32)> = (0..mesh.triangles.len() as u32)
        .into_par_iter()
        .filter(|&t| fates[t as usize] == Fate::Stays)
        .map(|t| (hash(&key(mesh, t)), t))
        .collect();
    order.par_sort_unstable();
    let mut two_sided: HashMap<MaterialId, MaterialId> = HashMap::new();
    for run in order.chunk_by_mut(|a, b| a.0 == b.0).filter(|run| run.len() > 1) {
        // Sorting, not comparing each with each: a file may hold a million copies, or collisions.
        run.sort_by_cached_key(|&(_, t)| (key(mesh, t), mesh.materials[t as usize], t));
        let mut kept = run[0].1;
        for &(_, t) in &run[1..] {
            let (k, i) = (kept as usize, t as usize);
            if mesh.materials[i] != mesh.materials[k] || key(mesh, t) != key(mesh, kept) {
                kept = t;
                continue;
            }
            fates[i] = Fate::Copy;
            let material = mesh.materials[k];
            if emits_from_front_only(&materials[material.0 as usize]) && is_reversed(mesh, kept, t) {
                two_sided.entry(material).or_insert_with(|| {
                    let base = &materials[material.0 as usize];
                    materials.push(Material { double_sided: true, name: base.name.clone(), ..base.clone() });
                    MaterialId((materials.len() - 1) as u32)
                });
            }
        }
    }
    // Only now, since the loop above tells copies by their material.
    if !two_sided.is_empty() {
        make_two_sided(mesh, &order, fates, &two_sided);
    }
}

fn emits_from_front_only(material: &Material) -> bool {
    !material.emissive.is_black() && !material.double_sided
}

fn is_reversed(mesh: &Mesh, a: u32, b: u32) -> bool {
    let ([a0, a1, a2], b) = (mesh.corners(a), mesh.corners(b));
    ![[a0, a1, a2], [a1, a2, a0], [a2, a0, a1]].contains(&b)
}

/// Gives survivors that lost a copy facing the other way their two-sided material.
fn make_two_sided(
    mesh: &mut Mesh,
    order: &[(u64, u32)],
    fates: &[Fate],
    to: &HashMap<MaterialId, MaterialId>,
) {
    let mut kept = 0;
    let mut changes = Vec::new();
    for &(_, t) in order {
        if fates[t as usize] != Fate::Copy {
            kept = t;
        } else if let Some(&material) = to.get(&mesh.materials[t as usize])
            && is_reversed(mesh, kept, t)
        {
            changes.push((kept, material));
        }
    }
    for (t, material) in changes {
        mesh.materials[t as usize] = material;
    }
}

fn drop_triangles(mesh: &mut Mesh, fates: &[Fate]) {
    for part in &mut mesh.parts {
        let (first, count) = (part.first as usize, part.count as usize);
        part.count = fates[first..first + count].iter().filter(|&&f| f == Fate::Stays).count() as u32;
    }
    mesh.parts.retain(|part| part.count > 0);
    let mut first = 0;
    for part in &mut mesh.parts {
        part.first = first;
        first += part.count;
    }
    let mut fate = fates.iter();
    mesh.triangles.retain(|_| fate.next() == Some(&Fate::Stays));
    let mut fate = fates.iter();
    mesh.materials.retain(|_| fate.next() == Some(&Fate::Stays));
}

fn drop_vertices(mesh: &mut Mesh) {
    let used = super::topology::compact(&mut mesh.triangles, mesh.positions.len());
    fn pick<T: Copy>(values: &mut Vec<T>, used: &[u32]) {
        if !values.is_empty() {
            *values = used.iter().map(|&v| values[v as usize]).collect();
        }
    }
    pick(&mut mesh.positions, &used);
    pick(&mut mesh.normals, &used);
    mesh.uvs.iter_mut().for_each(|set| pick(set, &used));
    pick(&mut mesh.colors, &used);
    pick(&mut mesh.tangents, &used);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Part, Rgb};

    /// Parts of one triangle each, every corner a vertex of its own.
    fn scene(triangles: &[[Vec3; 3]], materials: &[u32]) -> Scene {
        let mut scene = Scene { materials: vec![Material::default(); 2], ..Scene::default() };
        scene.materials[1].emissive = Rgb::WHITE;
        for (t, corners) in triangles.iter().enumerate() {
            scene.mesh.positions.extend(corners);
            scene.mesh.normals.extend([Vec3::Z; 3]);
            scene.mesh.triangles.push([0, 1, 2].map(|k| (3 * t + k) as u32));
            scene.mesh.materials.push(MaterialId(materials[t]));
            scene.mesh.parts.push(Part {
                name: format!("part {t}"),
                first: t as u32,
                count: 1,
                source: None,
            });
        }
        scene
    }

    const T: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];
    const TURNED: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::ZERO];
    const REVERSED: [Vec3; 3] = [Vec3::ZERO, Vec3::Y, Vec3::X];

    #[test]
    fn useless_triangles_and_their_vertices_go_and_are_counted() {
        let nan = [Vec3::NAN, Vec3::X, Vec3::Y];
        let line = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0];
        let huge = [Vec3::ZERO, Vec3::X * 1e30, Vec3::Y * 1e30];
        let mut scene = scene(&[nan, T, line, huge], &[0; 4]);
        let mut warnings = Warnings::default();
        clean(&mut scene, &mut warnings);
        assert_eq!(
            (scene.mesh.triangles.len(), scene.mesh.positions.len(), scene.mesh.parts.len()),
            (1, 3, 1)
        );
        assert_eq!(scene.mesh.corners(0), T);
        let lines = warnings.into_lines();
        assert!(lines[0].ends_with("2 (part 0, part 3)") && lines[1].ends_with("1 (part 2)"), "{lines:?}");
    }

    #[test]
    fn copies_of_one_material_go_and_those_of_another_stay() {
        let mut scene = scene(&[T, TURNED, REVERSED, T, T], &[0, 0, 0, 1, 1]);
        clean(&mut scene, &mut Warnings::default());
        assert_eq!(scene.mesh.materials, [MaterialId(0), MaterialId(1)]);
        assert_eq!(scene.materials.len(), 2);
    }

    #[test]
    fn a_lamp_modelled_on_both_sides_keeps_shining_to_both() {
        let shifted = T.map(|p| p + Vec3::Z);
        let mut scene = scene(&[T, T, REVERSED, T, shifted], &[1; 5]);
        clean(&mut scene, &mut Warnings::default());
        assert_eq!(scene.mesh.triangles.len(), 2);
        assert!(scene.materials[scene.mesh.materials[0].0 as usize].double_sided);
        assert_eq!(scene.mesh.materials[1], MaterialId(1));
    }

    #[test]
    fn a_hundred_thousand_copies_take_no_time() {
        let mut scene = scene(&vec![T; 100_000], &vec![0; 100_000]);
        clean(&mut scene, &mut Warnings::default());
        assert_eq!(scene.mesh.triangles.len(), 1);
    }
}
