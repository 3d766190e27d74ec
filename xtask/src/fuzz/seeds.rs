//! Sound files to spoil: those of assets/, and small ones that between them use everything the loader reads.

use super::spoil::Seed;
use crate::base64;
use crate::scenes::downlight;
use anyhow::Result;
use std::path::{Path, PathBuf};

/// Larger files are spoiled where it does not matter.
const LARGEST: u64 = 200_000;

/// All seeds: made here, of assets/, and of the `files` given.
pub fn all(files: &[PathBuf]) -> Result<Vec<Seed>> {
    let mut seeds: Vec<Seed> = [materials(), bent(), odd()].map(|json| Seed::Gltf(json.into_bytes())).into();
    seeds.push(Seed::Glb { json: plain().into_bytes(), bin: buffer() });
    let mut open = vec![crate::root().join("assets")];
    open.extend(files.iter().cloned());
    while let Some(path) = open.pop() {
        if path.is_dir() {
            let mut inside: Vec<PathBuf> =
                std::fs::read_dir(&path)?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
            inside.sort();
            open.extend(inside);
        } else if is_gltf(&path) && path.metadata()?.len() <= LARGEST {
            seeds.push(Seed::read(&std::fs::read(&path)?));
        }
    }
    Ok(seeds)
}

/// Writes `seeds` as the targets of `tests/fuzz` read them: JSON, or JSON, a zero byte and the binary chunk; and a
/// photometric file.
pub fn write(seeds: &[Seed], corpus: &Path) -> Result<()> {
    for folder in ["gltf", "glb", "ies"] {
        std::fs::create_dir_all(corpus.join(folder))?;
    }
    for (i, seed) in seeds.iter().enumerate() {
        match seed {
            Seed::Gltf(json) => std::fs::write(corpus.join("gltf").join(format!("{i}")), json)?,
            Seed::Glb { json, bin } => {
                let parts = [json, &b"\0"[..], bin].concat();
                std::fs::write(corpus.join("glb").join(format!("{i}")), parts)?;
            }
        }
    }
    std::fs::write(corpus.join("ies/0"), downlight::downlight())?;
    Ok(())
}

fn is_gltf(path: &Path) -> bool {
    matches!(path.extension().and_then(|e| e.to_str()), Some("gltf" | "glb"))
}

/// Positions, normals, uv of four vertices, six indices, joints, weights, a matrix, two keys.
fn buffer() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut floats = |values: &[f32]| bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]); // 0
    floats(&[0.0, 0.0, 1.0].repeat(4)); // 48
    floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0]); // 96
    floats(&[0.5, 0.5, 0.0, 0.0].repeat(4)); // 128: weights
    floats(&[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0].repeat(2)); // 192
    floats(&[0.0, 1.0]); // 320: keys
    bytes.extend([0u8, 1, 2, 2, 1, 3, 0, 0]); // 328: indices
    bytes.extend([0u8, 1, 0, 0].repeat(4)); // 336: joints
    bytes
}

const ACCESSORS: &str = r#"
    {"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
    {"bufferView":0,"byteOffset":48,"componentType":5126,"count":4,"type":"VEC3"},
    {"bufferView":0,"byteOffset":96,"componentType":5126,"count":4,"type":"VEC2"},
    {"bufferView":0,"byteOffset":128,"componentType":5126,"count":4,"type":"VEC4"},
    {"bufferView":0,"byteOffset":192,"componentType":5126,"count":2,"type":"MAT4"},
    {"bufferView":0,"byteOffset":320,"componentType":5126,"count":2,"type":"SCALAR"},
    {"bufferView":0,"byteOffset":328,"componentType":5121,"count":6,"type":"SCALAR"},
    {"bufferView":0,"byteOffset":336,"componentType":5121,"count":4,"type":"VEC4"},
    {"componentType":5126,"count":4,"type":"VEC3","sparse":{"count":2,
        "indices":{"bufferView":0,"byteOffset":328,"componentType":5121},"values":{"bufferView":0,"byteOffset":48}}}"#;

const MESH: &str = r#"{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2},"indices":6,"material":0,
    "extensions":{"KHR_materials_variants":{"mappings":[{"material":1,"variants":[0]}]}}}]}"#;

/// `rest` after the parts that all have in common, the buffer inside as base64 or left to a GLB.
fn document(rest: &str, inside: bool) -> String {
    let bytes = buffer();
    let uri = match inside {
        true => format!(r#""uri":"data:application/octet-stream;base64,{}","#, base64::base64(&bytes)),
        false => String::new(),
    };
    let n = bytes.len();
    format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{{uri}"byteLength":{n}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{n}}}],"accessors":[{ACCESSORS}],{rest}}}"#
    )
}

fn plain() -> String {
    document(
        &format!(
            r#""meshes":[{MESH}],"materials":[{{}},{{}}],"nodes":[{{"mesh":0,"scale":[1,-1,1]}},{{"camera":0}}],
            "cameras":[{{"type":"perspective","perspective":{{"yfov":1,"znear":0.1}}}}],
            "extensions":{{"KHR_materials_variants":{{"variants":[{{"name":"a"}}]}}}},
            "scene":0,"scenes":[{{"nodes":[0,1]}}]"#
        ),
        false,
    )
}

fn materials() -> String {
    let png =
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNkYPhfDwAChwGA60e6kgAAAABJRU5ErkJggg==";
    let t =
        r#"{"index":0,"extensions":{"KHR_texture_transform":{"offset":[0.5,0],"rotation":1,"scale":[2,3]}}}"#;
    document(
        &format!(
            r#""meshes":[{MESH}],"images":[{{"uri":"data:image/png;base64,{png}"}}],
            "samplers":[{{"wrapS":33071,"magFilter":9728}}],"textures":[{{"source":0,"sampler":0}}],"materials":[
            {{"pbrMetallicRoughness":{{"baseColorTexture":{t},"metallicRoughnessTexture":{t},"baseColorFactor":[1,1,1,0.5]}},
            "normalTexture":{{"index":0,"scale":0.5}},"emissiveTexture":{t},"emissiveFactor":[1,1,1],"alphaMode":"MASK","alphaCutoff":0.3,
            "extensions":{{"KHR_materials_clearcoat":{{"clearcoatFactor":1,"clearcoatTexture":{t},"clearcoatNormalTexture":{{"index":0}}}},
            "KHR_materials_sheen":{{"sheenColorFactor":[1,0.5,0],"sheenRoughnessFactor":0.5,"sheenColorTexture":{t}}},
            "KHR_materials_anisotropy":{{"anisotropyStrength":0.5,"anisotropyRotation":1,"anisotropyTexture":{t}}},
            "KHR_materials_iridescence":{{"iridescenceFactor":1,"iridescenceIor":1.3,"iridescenceThicknessMaximum":400}},
            "KHR_materials_specular":{{"specularFactor":0.5,"specularColorTexture":{t}}},"KHR_materials_ior":{{"ior":1.4}},
            "KHR_materials_emissive_strength":{{"emissiveStrength":5}}}}}},
            {{"alphaMode":"BLEND","extensions":{{"KHR_materials_transmission":{{"transmissionFactor":1,"transmissionTexture":{t}}},
            "KHR_materials_volume":{{"thicknessFactor":1,"attenuationDistance":2,"attenuationColor":[1,0.5,0.2]}},
            "KHR_materials_diffuse_transmission":{{"diffuseTransmissionFactor":0.5,"diffuseTransmissionColorFactor":[1,1,0]}},
            "KHR_materials_pbrSpecularGlossiness":{{"diffuseFactor":[1,0,0,1],"specularFactor":[0.5,0.5,0.5],"glossinessFactor":0.5,
            "specularGlossinessTexture":{t}}},"KHR_materials_unlit":{{}}}}}}],"nodes":[{{"mesh":0}}],"scenes":[{{"nodes":[0]}}]"#
        ),
        true,
    )
}

fn bent() -> String {
    document(
        r#""meshes":[{"weights":[0.5],"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"JOINTS_0":7,"WEIGHTS_0":3},
        "indices":6,"targets":[{"POSITION":8,"NORMAL":1}]}]}],"skins":[{"joints":[1,2],"inverseBindMatrices":4}],
        "animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}],"samplers":[{"input":5,"output":5}]}],
        "nodes":[{"mesh":0,"skin":0},{"children":[2],"translation":[0,1,0]},{"rotation":[0,0,0.7,0.7]}],"scenes":[{"nodes":[0,1]}]"#,
        true,
    )
}

fn odd() -> String {
    document(
        r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":5},{"attributes":{"POSITION":0},"mode":6},
        {"attributes":{"POSITION":0},"mode":1},{"attributes":{"POSITION":0,"COLOR_0":3},"indices":6,
        "extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0}}}}]}],
        "extensionsUsed":["EXT_mesh_gpu_instancing","EXT_meshopt_compression","KHR_lights_punctual"],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","intensity":5,"range":3,"spot":{"innerConeAngle":0.1,"outerConeAngle":0.5}}]}},
        "nodes":[{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0,"SCALE":1}}}},
        {"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,3,0,0,1],"extensions":{"KHR_lights_punctual":{"light":0}}}],
        "scenes":[{"name":"s","nodes":[0]},{"nodes":[1]}]"#,
        true,
    )
}
