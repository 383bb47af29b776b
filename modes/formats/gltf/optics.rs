//! What materials of glTF files mirror and let through.
//!
//! - A metal (`metallicFactor` of at least one half) that is smooth (`roughnessFactor` up to 0.2, and no texture beside them) is a
//!   mirror of its base colour. Rough surfaces would blur what they mirror, and are none.
//! - `KHR_materials_transmission` is glass: light passes by `transmissionFactor` times the base colour. With the thickness of
//!   `KHR_materials_volume` it is bent by `KHR_materials_ior`, 1.5 without it; a thin wall bends nothing and mirrors
//!   R₀ = ((ior − 1)/(ior + 1))².
//!
//! Textures, absorption inside of volumes and other extensions are not looked at.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, section 3.9 "Materials", and the extensions named.

use crate::formats::gltf::document::Surface;
use crate::scene::optics::Optics;

/// The least share of metal in a mirror.
const LEAST_METALLIC: f32 = 0.5;
/// The greatest roughness of a mirror.
const GREATEST_ROUGHNESS: f32 = 0.2;
/// The refractive index where the file names none.
const DEFAULT_INDEX: f32 = 1.5;
/// The greatest refractive index.
const GREATEST_INDEX: f32 = 10.0;

/// The optics of a material with this base colour.
pub(crate) fn optics(surface: &Surface, base_colour: [f32; 3]) -> Optics {
    let extensions = &surface.extensions;
    let passes =
        extensions.transmission.as_ref().map_or(0.0, |found| found.transmission_factor.clamp(0.0, 1.0));
    if passes > 0.0 {
        let ior = extensions.ior.as_ref().and_then(|found| found.ior).unwrap_or(DEFAULT_INDEX);
        // 0 stands for a surface that mirrors everything, in a workflow that is not followed.
        let ior = if (1.0..=GREATEST_INDEX).contains(&ior) { ior } else { DEFAULT_INDEX };
        let transmission = base_colour.map(|part| part * passes);
        let is_thin = extensions.volume.as_ref().is_none_or(|volume| volume.thickness_factor <= 0.0);
        let root = (ior - 1.0) / (ior + 1.0);
        return match is_thin {
            true => Optics { mirror: [root * root; 3], transmission, ior: 1.0 },
            false => Optics { transmission, ior, ..Optics::OPAQUE },
        };
    }
    let pbr = &surface.pbr_metallic_roughness;
    let metallic = pbr.metallic_factor.unwrap_or(1.0);
    let is_smooth =
        pbr.metallic_roughness_texture.is_none() && pbr.roughness_factor.unwrap_or(1.0) <= GREATEST_ROUGHNESS;
    match is_smooth && metallic >= LEAST_METALLIC {
        true => Optics { mirror: base_colour.map(|part| part * metallic.min(1.0)), ..Optics::OPAQUE },
        false => Optics::OPAQUE,
    }
}
