//! Which extensions a file may require, and what to do about the others.

use std::path::Path;

use super::error::Error;
use super::warnings::Warnings;

/// Modelled, wherever the file uses them.
const MODELLED: [&str; 25] = [
    "EXT_lights_ies",
    "EXT_lights_image_based",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Not modelled, but the file still shows the right shapes; where a material uses one, it says so there.
const TOLERATED: [&str; 3] = ["KHR_animation_pointer", "KHR_xmp", "KHR_xmp_json_ld"];

/// Refuses a file that requires what would make it come out wrong, and warns of the rest.
pub(super) fn check(
    file: &Path,
    used: &[String],
    required: &[String],
    warnings: &mut Warnings,
) -> Result<(), Error> {
    for name in required {
        if !MODELLED.contains(&name.as_str()) && !TOLERATED.contains(&name.as_str()) {
            return Err(refusal(file, name));
        }
    }
    for name in used {
        // Those of materials are reported with the material's name.
        if !MODELLED.contains(&name.as_str()) && !name.contains("_materials_") {
            warnings.say(format!("the extension {name} is not modelled and is ignored"));
        }
    }
    Ok(())
}

/// Whether a material's use of `name` is modelled.
pub(super) fn is_modelled(name: &str) -> bool {
    MODELLED.contains(&name)
}

/// The error for a file that cannot do without the extension `name`.
pub(super) fn refusal(file: &Path, name: &str) -> Error {
    Error::Extension { file: file.into(), extension: name.into(), remedy: remedy(name) }
}

fn remedy(name: &str) -> &'static str {
    match name {
        "MSFT_texture_dds" => "export it again with PNG, JPEG, WebP or KTX2 textures instead of DDS",
        _ => {
            "export it again without this extension, or list it in extensionsUsed only if the file can do without"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(required: &str) -> Result<(), Error> {
        let list = [required.to_owned()];
        check(Path::new("a.gltf"), &list, &list, &mut Warnings::default())
    }

    #[test]
    fn unknown_requirements_are_refused_by_name_with_a_remedy() {
        for name in ["MSFT_texture_dds", "ACME_magic"] {
            let message = verdict(name).expect_err(name).to_string();
            assert!(message.contains(name) && message.contains("export"), "{message}");
        }
    }

    #[test]
    fn what_still_shows_the_right_shapes_is_let_in() {
        for name in ["KHR_materials_volume", "KHR_materials_clearcoat", "KHR_materials_pbrSpecularGlossiness"]
        {
            assert!(verdict(name).is_ok(), "{name}");
        }
    }
}
