//! The gallery's paints, woods, cloths, metals, glasses and lamps.

use crate::scenes::document::{Document, MaterialId};
use crate::scenes::material::{Material, Volume};
use crate::scenes::paint;

/// Every material of the gallery, each named for what it is. Albedos of large surfaces lie between 0.2 and 0.8, as in
/// real rooms.
pub struct Palette {
    pub white: MaterialId,
    pub plaster: MaterialId,
    pub sage: MaterialId,
    pub planks: MaterialId,
    pub oak: MaterialId,
    pub walnut: MaterialId,
    pub rug: MaterialId,
    pub rug_edge: MaterialId,
    pub teal: MaterialId,
    pub ochre: MaterialId,
    pub terracotta: MaterialId,
    pub linen: MaterialId,
    pub books: [MaterialId; 5],
    pub landscape: MaterialId,
    pub fields: MaterialId,
    pub circles: MaterialId,
    pub relief: MaterialId,
    pub marble: MaterialId,
    pub glaze: MaterialId,
    pub copper: MaterialId,
    pub steel: MaterialId,
    pub mirror: MaterialId,
    pub pane: MaterialId,
    pub table_glass: MaterialId,
    pub ceiling_lamp: MaterialId,
    pub pendant: MaterialId,
    pub sky: MaterialId,
}

impl Palette {
    /// Adds all of them, and their textures, to `doc`.
    pub fn new(doc: &mut Document) -> Palette {
        let mut textured = |name: &'static str, png: Vec<u8>| {
            let texture = doc.texture(name, &png);
            doc.material(&Material { base_color_texture: Some(texture), ..Material::lambert(name, [1.0; 3]) })
        };
        let planks = textured("planks", paint::planks());
        let rug = textured("rug", paint::rug());
        let landscape = textured("landscape", paint::landscape());
        let fields = textured("fields", paint::fields());
        let circles = textured("circles", paint::circles());
        let waves = doc.texture("waves", &paint::relief());
        let dusk = doc.texture("dusk", &paint::dusk());

        let mut lambert = |name, reflectance| doc.material(&Material::lambert(name, reflectance));
        let white = lambert("white", [0.80, 0.79, 0.77]);
        let plaster = lambert("plaster", [0.74, 0.70, 0.63]);
        let sage = lambert("sage", [0.36, 0.44, 0.38]);
        let oak = lambert("oak", [0.45, 0.30, 0.17]);
        let walnut = lambert("walnut", [0.22, 0.13, 0.075]);
        let rug_edge = lambert("rug edge", [0.03, 0.04, 0.07]);
        let teal = lambert("teal", [0.10, 0.25, 0.27]);
        let ochre = lambert("ochre", [0.60, 0.37, 0.11]);
        let terracotta = lambert("terracotta", [0.52, 0.23, 0.14]);
        let linen = lambert("linen", [0.68, 0.62, 0.52]);
        let books = [
            lambert("red book", [0.45, 0.10, 0.08]),
            lambert("blue book", [0.10, 0.18, 0.36]),
            lambert("green book", [0.14, 0.28, 0.18]),
            lambert("yellow book", [0.62, 0.46, 0.16]),
            lambert("grey book", [0.50, 0.48, 0.46]),
        ];

        let dielectric = |roughness, lambert| Material { roughness, specular: 1.0, ..lambert };
        // Soda-lime glass with a trace of iron: clear through the plate, green along it.
        let green = Volume {
            thickness: 0.012,
            attenuation_color: [0.62, 0.85, 0.75],
            attenuation_distance: Some(0.25),
        };
        Palette {
            white,
            plaster,
            sage,
            planks,
            oak,
            walnut,
            rug,
            rug_edge,
            teal,
            ochre,
            terracotta,
            linen,
            books,
            landscape,
            fields,
            circles,
            relief: doc.material(&Material {
                normal_texture: Some(waves),
                ..Material::lambert("relief", [0.72, 0.68, 0.60])
            }),
            marble: doc.material(&dielectric(0.4, Material::lambert("marble", [0.78, 0.76, 0.72]))),
            glaze: doc.material(&dielectric(0.15, Material::lambert("glaze", [0.07, 0.20, 0.28]))),
            copper: doc.material(&Material::metal("copper", [0.93, 0.62, 0.48], 0.25)),
            steel: doc.material(&Material::metal("steel", [0.62, 0.60, 0.57], 0.3)),
            mirror: doc.material(&Material::metal("mirror", [0.92; 3], 0.0)),
            pane: doc.material(&Material {
                volume: None,
                double_sided: true,
                ..Material::glass("window pane", green)
            }),
            table_glass: doc.material(&Material::glass("table glass", green)),
            ceiling_lamp: doc.material(&Material::lamp("ceiling lamp", [4500.0, 3850.0, 3000.0], [0.8; 3])),
            pendant: doc.material(&Material::lamp("pendant", [2400.0, 1850.0, 1200.0], [0.8; 3])),
            sky: doc.material(&Material {
                emissive_texture: Some(dusk),
                ..Material::lamp("sky", [400.0; 3], [0.0; 3])
            }),
        }
    }
}
