// SPDX-License-Identifier: Apache-2.0
#include "import/context.h"
#include "import/surface.h"

#include <assimp/GltfMaterial.h>
#include <assimp/ObjMaterial.h>
#include <assimp/commonMetaData.h>
#include <assimp/material.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace velatura::import {

namespace {

template <class T>
std::optional<T> get(const aiMaterial& material, const char* key) {
    T value;
    if (material.Get(key, 0, 0, value) == aiReturn_SUCCESS) return value;
    return std::nullopt;
}

std::optional<float> number(const aiMaterial& material, const char* key) {
    const auto v = get<float>(material, key);
    return v && std::isfinite(*v) ? v : std::nullopt;
}

std::optional<Vec3> color(const aiMaterial& material, const char* key) {
    const auto c = get<aiColor4D>(material, key);
    if (!c) return std::nullopt;
    return Vec3(float(c->r), float(c->g), float(c->b));
}

constexpr const char* diffuse_key = "$clr.diffuse";
constexpr const char* specular_key = "$clr.specular";
constexpr const char* emissive_key = "$clr.emissive";
constexpr const char* opacity_key = "$mat.opacity";
constexpr const char* roughness_key = "$mat.roughnessFactor";
constexpr const char* metallic_key = "$mat.metallicFactor";
constexpr const char* shininess_key = "$mat.shininess";
constexpr const char* emission_strength_key = "$mat.emissiveIntensity";

bool is_unlit(const aiMaterial& material) {
    return get<int>(material, "$mat.shadingm") == int(aiShadingMode_Unlit);
}

/// Color texture times constant.
void author_emission(SurfaceAuthor& surface, const aiMaterial& material, float strength) {
    const Vec3 emission = color(material, emissive_key).value_or(Vec3(0.0f)) * strength;
    const TextureSlot slot{aiTextureType_EMISSIVE, 0};
    if (surface.has_texture(slot)) {
        // Formats other than glTF leave the constant black where a texture stands
        const bool is_black = emission == Vec3(0.0f) && surface.format() != Format::Gltf;
        const Vec3 scale = is_black ? Vec3(1.0f) : emission;
        if (scale == Vec3(0.0f)) return;
        surface.texture("emissiveColor", "color3f", "rgb", slot,
                        {.scale = {scale.x, scale.y, scale.z, 1}, .color_space = "sRGB"});
    } else if (emission != Vec3(0.0f)) {
        surface.constant("emissiveColor", emission);
    }
}

void author_normal_map(SurfaceAuthor& surface, const aiMaterial& material) {
    const TextureSlot slot{aiTextureType_NORMALS, 0};
    if (!surface.has_texture(slot)) return;
    float s = 1.0f;
    material.Get(AI_MATKEY_GLTF_TEXTURE_SCALE(aiTextureType_NORMALS, 0), s);
    surface.texture("normal", "normal3f", "rgb", slot,
                    {.scale = {2 * s, 2 * s, 2, 1}, .bias = {-s, -s, -1, 0}, .color_space = "raw"});
}

void author_diffuse(SurfaceAuthor& surface, const BaseColor& base, const char* input) {
    const TextureSlot slot{aiTextureType_DIFFUSE, 0};
    if (surface.has_texture(slot)) {
        surface.texture(input, "color3f", "rgb", slot,
                        {.scale = {base.color.x, base.color.y, base.color.z, base.opacity},
                         .color_space = "sRGB"});
    } else if (surface.has_vertex_colors()) {
        surface.vertex_color(input, base.color);
    } else {
        surface.constant(input, base.color);
    }
}

/// KHR_materials_clearcoat, KHR_materials_transmission, KHR_materials_ior; what UsdPreviewSurface
/// has no word for is warned about.
void author_gltf_extensions(SurfaceAuthor& surface, const aiMaterial& material) {
    if (const auto ior = number(material, "$mat.refracti"); ior && *ior > 0)
        surface.constant("ior", *ior);
    if (const auto coat = number(material, "$mat.clearcoat.factor"); coat && *coat > 0) {
        const TextureSlot coat_slot{aiTextureType_CLEARCOAT, 0},
            rough_slot{aiTextureType_CLEARCOAT, 1};
        const float rough = number(material, "$mat.clearcoat.roughnessFactor").value_or(0.0f);
        if (surface.has_texture(coat_slot))
            surface.texture("clearcoat", "float", "r", coat_slot,
                            {.scale = {*coat, 1, 1, 1}, .color_space = "raw"});
        else
            surface.constant("clearcoat", *coat);
        if (surface.has_texture(rough_slot))
            surface.texture("clearcoatRoughness", "float", "g", rough_slot,
                            {.scale = {1, rough, 1, 1}, .color_space = "raw"});
        else
            surface.constant("clearcoatRoughness", rough);
        if (surface.has_texture({aiTextureType_CLEARCOAT, 2}))
            surface.warn("the normal map of its clear coat");
    }
    if (color(material, "$clr.sheen.factor")) surface.warn("sheen");
    if (number(material, "$mat.volume.thicknessFactor").value_or(0.0f) > 0)
        surface.warn("volume absorption (glass keeps its surface)");
}

/// Opacity by alphaMode; a blended glTF surface fades as a whole.
void author_gltf_opacity(SurfaceAuthor& surface, const aiMaterial& material, float factor) {
    const float transmission = number(material, "$mat.transmission.factor").value_or(0.0f);
    if (transmission > 0) {
        surface.constant("opacity", 1.0f - std::min(transmission, 1.0f));
        if (surface.has_texture({aiTextureType_TRANSMISSION, 0}))
            surface.warn("the texture of its transmission");
        return;
    }
    aiString mode;
    if (material.Get(AI_MATKEY_GLTF_ALPHAMODE, mode) != aiReturn_SUCCESS) return;
    const std::string name = mode.C_Str();
    if (name != "MASK" && name != "BLEND") return;
    const TextureSlot slot{aiTextureType_DIFFUSE, 0};
    if (surface.has_texture(slot))
        surface.texture("opacity", "float", "a", slot, {});
    else if (surface.has_vertex_colors())
        surface.vertex_opacity("opacity", factor);
    else
        surface.constant("opacity", factor);
    if (name == "MASK") {
        float cutoff = 0.5f;
        material.Get(AI_MATKEY_GLTF_ALPHACUTOFF, cutoff);
        // A threshold of 0 would switch the cut-out off; everything is at or above the least float
        surface.constant("opacityThreshold", std::max(cutoff, 1e-6f));
    } else {
        surface.token("opacityMode", "presence");
    }
}

void author_specular_glossiness(SurfaceAuthor& surface, const aiMaterial& material, float gloss) {
    const Vec3 specular = color(material, specular_key).value_or(Vec3(1.0f));
    const TextureSlot slot{aiTextureType_SPECULAR, 0};
    surface.constant("useSpecularWorkflow", 1);
    if (surface.has_texture(slot)) {
        surface.texture("specularColor", "color3f", "rgb", slot,
                        {.scale = {specular.x, specular.y, specular.z, -gloss},
                         .bias = {0, 0, 0, 1},
                         .color_space = "sRGB"});
        surface.texture("roughness", "float", "a", slot, {});
    } else {
        surface.constant("specularColor", specular);
        surface.constant("roughness", 1.0f - gloss);
    }
}

void author_metallic_roughness(SurfaceAuthor& surface, const aiMaterial& material) {
    const float metallic = number(material, metallic_key).value_or(1.0f);
    const float roughness = number(material, roughness_key).value_or(1.0f);
    const TextureSlot slot{aiTextureType_METALNESS, 0};
    if (surface.has_texture(slot)) {
        const TextureUse use{.scale = {1, roughness, metallic, 1}, .color_space = "raw"};
        surface.texture("metallic", "float", "b", slot, use);
        surface.texture("roughness", "float", "g", slot, use);
    } else {
        surface.constant("metallic", metallic);
        surface.constant("roughness", roughness);
    }
    const TextureSlot occlusion{aiTextureType_LIGHTMAP, 0};
    if (surface.has_texture(occlusion)) {
        float s = 1.0f;
        material.Get(AI_MATKEY_GLTF_TEXTURE_STRENGTH(aiTextureType_LIGHTMAP, 0), s);
        surface.texture(
            "occlusion", "float", "r", occlusion,
            {.scale = {s, s, s, 1}, .bias = {1 - s, 1 - s, 1 - s, 0}, .color_space = "raw"});
    }
}

void author_gltf(SurfaceAuthor& surface, const aiMaterial& material, const BaseColor& base) {
    if (is_unlit(material)) {
        // Shows its color whatever the light
        surface.constant("diffuseColor", Vec3(0.0f));
        surface.constant("useSpecularWorkflow", 1);
        surface.constant("specularColor", Vec3(0.0f));
        author_diffuse(surface, base, "emissiveColor");
        author_gltf_opacity(surface, material, base.opacity);
        return;
    }
    author_diffuse(surface, base, "diffuseColor");
    const auto gloss = number(material, "$mat.glossinessFactor");
    if (gloss)
        author_specular_glossiness(surface, material, *gloss);
    else
        author_metallic_roughness(surface, material);
    // KHR_materials_emissive_strength is part of the color by now, see prepare_gltf
    author_emission(surface, material, 1.0f);
    author_gltf_opacity(surface, material, base.opacity);
    author_gltf_extensions(surface, material);
}

/// Part of the light that goes through an .mtl material, by its illumination model: 4, 6, 7 and 9
/// are glass.
float obj_transmission(const aiMaterial& material) {
    const int model = get<int>(material, "$mat.illum").value_or(0);
    if (model != 4 && model != 6 && model != 7 && model != 9) return 0.0f;
    const Vec3 filter = color(material, "$clr.transparent").value_or(Vec3(1.0f));
    return std::clamp(std::max({filter.x, filter.y, filter.z}), 0.0f, 1.0f);
}

/// The roughness that a file gives beside Phong's model. For .fbx files Assimp 5.2 makes one up out
/// of the exponent, by the rule of Blender's exporter; it counts where that wrote the file.
std::optional<float> given_roughness(const Context& ctx, const aiMaterial& material) {
    const auto roughness = number(material, roughness_key);
    const auto exponent = number(material, shininess_key);
    if (ctx.format != Format::Fbx || !roughness || !exponent) return roughness;
    aiString generator;
    if (ctx.scene.mMetaData != nullptr)
        ctx.scene.mMetaData->Get(AI_METADATA_SOURCE_GENERATOR, generator);
    const bool is_blender =
        std::string_view(generator.C_Str()).find("Blender") != std::string::npos;
    const float made_up = 1.0f - std::sqrt(std::max(*exponent, 0.0f)) / 10.0f;
    return !is_blender && std::abs(*roughness - made_up) < 1e-5f ? std::nullopt : roughness;
}

/// Phong's highlight as a microfacet lobe. The exponent n becomes the width alpha² = 2 / (n + 2)
/// (Walter et al. 2007, "Microfacet Models for Refraction", EGSR, section 5.2), and roughness is
/// the root of alpha. Its color is a weight without physical meaning: 1 stands for a reflectance
/// of 0.08 at normal incidence, or for all of it where the .mtl file speaks of ray-traced mirrors.
void author_highlight(SurfaceAuthor& surface, const aiMaterial& material) {
    const auto roughness = given_roughness(surface.context(), material);
    const auto metallic = number(material, metallic_key);
    const int model = get<int>(material, "$mat.illum").value_or(2);
    if (metallic) {
        surface.constant("metallic", std::clamp(*metallic, 0.0f, 1.0f));
    } else {
        Vec3 specular = color(material, specular_key).value_or(Vec3(0.0f));
        if (const auto strength = number(material, "$mat.shinpercent")) specular *= *strength;
        if (model < 2) specular = Vec3(0.0f);
        if (model < 3) specular *= 0.08f;
        for (int i = 0; i < 3; ++i) specular[i] = std::clamp(specular[i], 0.0f, 1.0f);
        if (obj_transmission(material) <= 0) {
            surface.constant("useSpecularWorkflow", 1);
            surface.constant("specularColor", specular);
        }
    }
    const float exponent = std::max(number(material, shininess_key).value_or(0.0f), 0.0f);
    const bool is_mirror = model >= 3 && exponent >= 1000;
    const float from_exponent = is_mirror ? 0.0f : std::pow(2.0f / (exponent + 2.0f), 0.25f);
    surface.constant("roughness", std::clamp(roughness.value_or(from_exponent), 0.0f, 1.0f));
    const TextureSlot rough_slot{aiTextureType_DIFFUSE_ROUGHNESS, 0};
    if (surface.has_texture(rough_slot))
        surface.texture("roughness", "float", "r", rough_slot, {.color_space = "raw"});
    const TextureSlot metal_slot{aiTextureType_METALNESS, 0};
    if (surface.has_texture(metal_slot))
        surface.texture("metallic", "float", "r", metal_slot, {.color_space = "raw"});
}

void author_phong(SurfaceAuthor& surface, const aiMaterial& material, const BaseColor& base) {
    author_diffuse(surface, base, "diffuseColor");
    author_highlight(surface, material);
    author_emission(surface, material, number(material, emission_strength_key).value_or(1.0f));
    const TextureSlot opacity_slot{aiTextureType_OPACITY, 0};
    const float transmission = obj_transmission(material);
    if (surface.has_texture(opacity_slot)) {
        surface.texture("opacity", "float", "r", opacity_slot,
                        {.scale = {base.opacity, 1, 1, 1}, .color_space = "raw"});
    } else if (transmission > 0 || base.opacity < 1) {
        surface.constant("opacity", base.opacity * (1.0f - transmission));
    }
    const auto ior = number(material, "$mat.refracti");
    // 1, the default of exporters, would switch every reflection off
    if (ior && *ior > 1) surface.constant("ior", *ior);
    if (const auto coat = number(material, "$mat.clearcoat.factor"); coat && *coat > 0) {
        surface.constant("clearcoat", *coat);
        surface.constant("clearcoatRoughness",
                         number(material, "$mat.clearcoat.roughnessFactor").value_or(0.0f));
    }
    for (const auto& [type, what] :
         {std::pair(aiTextureType_SPECULAR, "the texture of its highlight"),
          std::pair(aiTextureType_SHININESS, "the texture of its shininess"),
          std::pair(aiTextureType_HEIGHT, "its bump map"),
          std::pair(aiTextureType_DISPLACEMENT, "its displacement"),
          std::pair(aiTextureType_REFLECTION, "its reflection map")})
        if (surface.has_texture({type, 0})) surface.warn(what);
}

}  // namespace

BaseColor base_color(const Context& ctx, const aiMaterial& material) {
    BaseColor base;
    base.color =
        color(material, diffuse_key).value_or(Vec3(ctx.format == Format::Ply ? 1.0f : 0.6f));
    base.opacity = std::clamp(number(material, opacity_key).value_or(1.0f), 0.0f, 1.0f);
    const bool has_texture = material.GetTextureCount(aiTextureType_DIFFUSE) > 0;
    // In .dae and .fbx files a texture takes the place of the color; in .obj files it multiplies
    // it, but some exporters leave black
    const bool replaces = ctx.format == Format::Collada || ctx.format == Format::Fbx;
    if (has_texture && (replaces || (base.color == Vec3(0.0f) && ctx.format == Format::Obj)))
        base.color = Vec3(1.0f);
    // The colors of a .ply file are those of its points; its material is Assimp's invention
    if (ctx.format == Format::Ply && !has_texture) base.color = Vec3(1.0f);
    return base;
}

bool has_shown_colors(Context& ctx, const aiMesh& mesh) {
    if (!mesh.HasVertexColors(0) || mesh.mMaterialIndex >= ctx.scene.mNumMaterials) return false;
    // Only .gltf and .ply files say that vertex colors show
    if (ctx.format != Format::Gltf && ctx.format != Format::Ply) return false;
    const aiMaterial& material = *ctx.scene.mMaterials[mesh.mMaterialIndex];
    if (material.GetTextureCount(aiTextureType_DIFFUSE) == 0) return true;
    ctx.warn("import-colors",
             fmt::format("vertex colors do not multiply the texture of material \"{}\"",
                         material.GetName().C_Str()));
    return false;
}

Path material_prim(Context& ctx, unsigned index, bool has_colors) {
    const std::string key = std::to_string(index) + (has_colors ? "c" : "");
    const auto found = ctx.materials.find(key);
    if (found != ctx.materials.end()) return found->second;
    if (ctx.materials_scope.is_empty())
        ctx.materials_scope = ctx.author.define(ctx.root, "Materials", "Scope");
    const aiMaterial& material = *ctx.scene.mMaterials[index];
    SurfaceAuthor surface(ctx, material, has_colors);
    const BaseColor base = base_color(ctx, material);
    if (ctx.format == Format::Gltf)
        author_gltf(surface, material, base);
    else
        author_phong(surface, material, base);
    author_normal_map(surface, material);
    ++ctx.summary.materials;
    return ctx.materials[key] = surface.prim();
}

void bind_material(Context& ctx, Path prim, const aiMesh& mesh) {
    if (mesh.mMaterialIndex >= ctx.scene.mNumMaterials) return;
    const Path material = material_prim(ctx, mesh.mMaterialIndex, has_shown_colors(ctx, mesh));
    ctx.author.apply_schema(prim, "MaterialBindingAPI");
    ctx.author.relationship(prim, "material:binding", material);
}

}  // namespace velatura::import
