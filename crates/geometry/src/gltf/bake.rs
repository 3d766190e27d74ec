//! A primitive under a transform, appended to the world's one mesh.

use glam::{DAffine3, DMat3};
use rayon::prelude::*;

use super::primitive::Primitive;
use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::MaterialId;
use crate::{Mesh, Part, triangle};

/// Which optional arrays the world's mesh has.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Layout {
    pub uvs: [bool; 2],
    pub colors: bool,
    pub tangents: bool,
}

/// Appends `primitive`, transformed by `world`, as one part. Returns how many normals had to be replaced
/// by that of a face, since they were zero or not finite.
///
/// Positions may come out non-finite or triangles without area: `clean` judges the whole mesh at the end. When the
/// primitive `is_last`, not needed again, a mesh still empty takes its arrays as they are: of a scan that is all of
/// one primitive, half of the memory.
pub(super) fn append(
    mesh: &mut Mesh,
    primitive: &mut Primitive,
    is_last: bool,
    world: &DAffine3,
    material: MaterialId,
    (name, source): (String, [u32; 2]),
    layout: Layout,
) -> u64 {
    let base = mesh.positions.len();
    let m = world.matrix3;
    // A mirror turns triangles inside out: glTF 2.0, 3.7.4, turns them back.
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    let takes = is_last && base == 0;
    let has_normals = !primitive.normals.is_empty();
    put(&mut mesh.positions, &mut primitive.positions, takes, |p| {
        world.transform_point3(p.as_dvec3()).as_vec3()
    });
    let corner = |v: u32| v + base as u32;
    let first = mesh.triangles.len();
    let count = primitive.triangles.len() as u32;
    put(&mut mesh.triangles, &mut primitive.triangles, takes, |&[a, b, c]| {
        if sign < 0.0 { [corner(a), corner(c), corner(b)] } else { [corner(a), corner(b), corner(c)] }
    });
    mesh.materials.resize(mesh.triangles.len(), material);
    mesh.parts.push(Part { name, first: first as u32, count, source: Some(source) });

    let replaced = if !has_normals {
        mesh.normals.resize(mesh.positions.len(), Vec3::ZERO);
        replace_normals(mesh, base, first);
        0
    } else {
        // Inverse transpose but for a positive factor; unlike that, it exists for a flattened mesh too.
        let cofactor = sign
            * DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        put(&mut mesh.normals, &mut primitive.normals, takes, |n| {
            let n = (cofactor * n.as_dvec3()).normalize_or_zero().as_vec3();
            if n.is_finite() { n } else { Vec3::ZERO }
        });
        replace_normals(mesh, base, first)
    };
    for (set, values) in mesh.uvs.iter_mut().enumerate().filter(|(set, _)| layout.uvs[*set]) {
        values.extend_from_slice(&primitive.uvs[set]);
        values.resize(mesh.positions.len(), Vec2::ZERO);
    }
    if layout.colors {
        mesh.colors.extend_from_slice(&primitive.colors);
        mesh.colors.resize(mesh.positions.len(), Vec4::ONE);
    }
    if layout.tangents {
        extend(&mut mesh.tangents, &primitive.tangents, |t| {
            let along = (m * t.truncate().as_dvec3()).normalize_or_zero().as_vec3();
            let along = if along.is_finite() && along != Vec3::ZERO { along } else { Vec3::X };
            // The bitangent w n × t must follow the mirrored v.
            along.extend(if t.w < 0.0 { -sign as f32 } else { sign as f32 })
        });
        mesh.tangents.resize(mesh.positions.len(), Vec3::X.extend(1.0));
    }
    replaced
}

/// Gives vertices from `base` on whose normal is zero that of the first triangle that uses them.
fn replace_normals(mesh: &mut Mesh, base: usize, first: usize) -> u64 {
    let missing = mesh.normals[base..].iter().filter(|&&n| n == Vec3::ZERO).count();
    if missing == 0 {
        return 0;
    }
    for t in first..mesh.triangles.len() {
        let corners = mesh.triangles[t].map(|v| v as usize);
        if corners.iter().any(|&v| mesh.normals[v] == Vec3::ZERO) {
            let [a, b, c] = corners.map(|v| mesh.positions[v]);
            // Without area the triangle will be dropped, so that any unit vector does.
            let face = triangle::normal(a, b, c);
            let face = if face.is_finite() { face } else { Vec3::ZERO };
            for v in corners {
                if mesh.normals[v] == Vec3::ZERO {
                    mesh.normals[v] = face;
                }
            }
        }
    }
    for n in mesh.normals[base..].iter_mut().filter(|n| **n == Vec3::ZERO) {
        *n = Vec3::Z;
    }
    missing as u64
}

/// As [`extend`], or by `f` in place where `to` may take over the whole array.
fn put<T: Send + Sync>(to: &mut Vec<T>, from: &mut Vec<T>, takes: bool, f: impl Fn(&T) -> T + Send + Sync) {
    if takes {
        *to = std::mem::take(from);
        to.par_iter_mut().for_each(|v| *v = f(v));
    } else {
        extend(to, from, f);
    }
}

/// `to.extend(from.map(f))`, on all threads where that pays.
fn extend<S: Sync, T: Send>(to: &mut Vec<T>, from: &[S], f: impl Fn(&S) -> T + Send + Sync) {
    if from.len() < 1 << 14 {
        to.extend(from.iter().map(f));
    } else {
        to.par_extend(from.par_iter().map(f));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn slope() -> Primitive {
        // A triangle with normal (1, 1, 0)/√2 and a tangent in its plane.
        let half = 0.5f32.sqrt();
        Primitive {
            positions: vec![Vec3::X, Vec3::Y, Vec3::new(1.0, 0.0, -1.0)],
            normals: vec![Vec3::new(half, half, 0.0); 3],
            tangents: vec![Vec4::new(-half, half, 0.0, 1.0); 3],
            triangles: vec![[0, 2, 1]],
            ..Primitive::default()
        }
    }

    fn copy(p: &Primitive) -> Primitive {
        Primitive {
            positions: p.positions.clone(),
            normals: p.normals.clone(),
            uvs: p.uvs.clone(),
            colors: p.colors.clone(),
            tangents: p.tangents.clone(),
            triangles: p.triangles.clone(),
        }
    }

    fn bake(p: &Primitive, scale: DVec3) -> (Mesh, u64) {
        let mut mesh = Mesh::default();
        let layout = Layout { uvs: [true, false], colors: true, tangents: true };
        // In two copies; as the only one the primitive gives up its arrays, with the same result.
        let at = DAffine3::from_scale(scale);
        let n = append(&mut mesh, &mut copy(p), false, &at, MaterialId(0), ("x".into(), [0; 2]), layout);
        let mut only = Mesh::default();
        append(&mut only, &mut copy(p), true, &at, MaterialId(0), ("x".into(), [0; 2]), layout);
        assert_eq!((&only.positions, &only.triangles), (&mesh.positions, &mesh.triangles));
        (mesh, n)
    }

    #[test]
    fn normals_stay_at_right_angles_under_any_scale() {
        let plain = bake(&slope(), DVec3::ONE).0;
        assert!(plain.geometric_normal(0).dot(plain.normals[0]) > 0.999_999);
        for scale in
            [[3.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -2.0, 5.0], [-1.0, -2.0, -3.0], [1e-3, 1e-3, 1e-3]]
        {
            let mesh = bake(&slope(), DVec3::from_array(scale)).0;
            let face = mesh.geometric_normal(0);
            assert!(face.dot(mesh.normals[0]) > 0.999_999, "{scale:?}");
            assert!(face.dot(mesh.tangents[0].truncate()).abs() < 1e-6, "{scale:?}");
        }
    }

    #[test]
    fn the_bitangent_is_mirrored_with_the_mesh() {
        let bitangent = |mesh: &Mesh| mesh.normals[0].cross(mesh.tangents[0].truncate()) * mesh.tangents[0].w;
        let plain = bitangent(&bake(&slope(), DVec3::ONE).0);
        let mirrored = bitangent(&bake(&slope(), DVec3::new(-1.0, 1.0, 1.0)).0);
        assert!((mirrored - plain * Vec3::new(-1.0, 1.0, 1.0)).length() < 1e-6);
    }

    #[test]
    fn useless_normals_become_the_faces_and_absent_attributes_their_defaults() {
        let mut p = slope();
        p.normals[0] = Vec3::ZERO;
        p.normals[1] = Vec3::splat(f32::NAN);
        let (mesh, replaced) = bake(&p, DVec3::ONE);
        assert_eq!(replaced, 2);
        assert!(mesh.normals.iter().all(|n| n.dot(mesh.geometric_normal(0)) > 0.999_999));
        assert_eq!(
            (mesh.uvs[0].len(), mesh.uvs[1].len(), mesh.colors.as_slice()),
            (3, 0, [Vec4::ONE; 3].as_slice())
        );
    }
}
