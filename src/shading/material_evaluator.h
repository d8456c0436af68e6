// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/math.h"
#include "geometry/displacement.h"
#include "geometry/surface_point.h"
#include "scene/pattern.h"
#include "scene/scene.h"
#include "shading/bsdf.h"
#include "shading/sheen.h"
#include "shading/texture_cache.h"

#include <algorithm>
#include <memory>
#include <vector>

namespace velatura::shading {

/// What is below a surface: a medium that scatters.
struct Subsurface {
    float weight = 0;         ///< share of the base that it takes the place of
    Rgb color = Rgb(0.0f);    ///< of a large flat piece of it, about
    Rgb sigma_t = Rgb(0.0f);  ///< [1/render-space unit]
    Rgb albedo = Rgb(0.0f);   ///< of one scattering
    float anisotropy = 0;     ///< mean cosine of one
};

/// The albedo of one scattering with which a half space has the albedo `color` under diffuse light.
/// Ref: van de Hulst 1980, "Multiple Light Scattering", with his similarity for anisotropy;
/// inverted by Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks".
Rgb single_scattering_albedo(const Rgb& color, float anisotropy);

/// Every material of a scene, ready to be evaluated at surface points from many threads.
/// `footprint` is the width of the ray cone where it meets the surface, in render-space units; 0 =
/// finest texels.
class MaterialEvaluator final : public geometry::Displacer {
  public:
    /// Opens the textures: a missing or broken file costs one error naming file and prim, and gives
    /// the fallback value. The scene must outlive this. Of `forced` effects the tests and lookups
    /// are made though they find nothing. Textures are filtered over 2^texture_bias times the
    /// footprint. texture_bytes: of their cache.
    MaterialEvaluator(const scene::Scene& scene,
                      Diagnostics& diagnostics,
                      scene::EffectSet forced = {},
                      float texture_bias = 0.0f,
                      size_t texture_bytes = TextureCache::usual_bytes);
    ~MaterialEvaluator() override;

    /// Reads the scene's materials again, which have changed; their textures are those that were
    /// opened. Not while it is looked at.
    void update(Diagnostics& diagnostics);

    MaterialEvaluator(const MaterialEvaluator&) = delete;
    MaterialEvaluator& operator=(const MaterialEvaluator&) = delete;

    /// The scattering function at a point seen from wo (render space, unit, away from the surface).
    /// surrounding_index: of refraction, of what is on the side of the surface that its body is
    /// not.
    Bsdf make_bsdf(const geometry::SurfacePoint& point,
                   const Vec3& wo,
                   float footprint,
                   float surrounding_index = 1.0f) const;

    /// Emitted radiance towards wo; both sides emit. Black for most materials at the cost of one
    /// comparison.
    Rgb emission(const geometry::SurfacePoint& point, const Vec3& wo, float footprint) const;

    /// Probability that the surface is there at all, [0, 1]: cut-out by opacityThreshold,
    /// opacityMode "presence" and displayOpacity. Not to be mixed up with transmission.
    float presence(const geometry::SurfacePoint& point, float footprint) const;

    bool displaces(scene::MaterialId material) const override {
        return material < scene_.materials.size() &&
               scene::is_displacing(scene_.materials[material]);
    }

    float displacement(const geometry::SurfacePoint& point, float footprint) const override;

    /// False: presence() is 1 everywhere on the material. `none` = the displayColor material.
    bool material_has_presence(scene::MaterialId material) const {
        return flags(material).has_presence;
    }

    /// Some material of the scene may have presence below 1.
    bool has_presence() const { return has_presence_; }

    bool is_emissive(scene::MaterialId material) const { return flags(material).is_emissive; }

    bool has_emission() const { return has_emission_; }

    /// The material may transmit (opacity below 1 in transparent mode, or a translucent sheet).
    bool material_has_transmission(scene::MaterialId material) const {
        return flags(material).has_transmission;
    }

    /// Light that crosses the surface may enter or leave a body: it transmits and is no thin wall.
    bool bounds_body(scene::MaterialId material) const { return flags(material).bounds_body; }

    /// Some light may pass the surface straight on, without being scattered: smooth thin walls, and
    /// interfaces of the constant index 1. What passes is Bsdf::delta.
    bool material_is_see_through(scene::MaterialId material) const {
        return flags(material).is_see_through;
    }

    bool is_see_through() const { return is_see_through_; }

    /// Some material of the scene absorbs or scatters inside, or has a priority: whoever goes
    /// through surfaces has to know what is inside of what.
    bool has_absorption() const { return has_absorption_; }

    /// Bodies displace each other by priorities.
    bool has_priorities() const { return has_priorities_; }

    int priority(scene::MaterialId material) const { return flags(material).priority; }

    /// Of refraction inside a body, wherever in it.
    float index(scene::MaterialId material) const { return flags(material).index; }

    /// What goes no further inside a body of the material [1/scene unit]; 0 for most. Infinite
    /// where nothing passes.
    const Rgb& extinction(scene::MaterialId material) const { return flags(material).extinction; }

    /// A part of that is scattered.
    bool scatters_inside(scene::MaterialId material) const {
        return flags(material).scatters_inside;
    }

    /// There is no surface: light goes straight on between the body and what is around it.
    bool is_bare(scene::MaterialId material) const { return flags(material).is_bare; }

    /// Light scatters inside some body, or some has no surface.
    bool has_interior_media() const { return has_interior_media_; }

    /// Light scatters inside what some material bounds.
    bool has_subsurface() const { return has_subsurface_; }

    bool has_subsurface(scene::MaterialId material) const { return flags(material).has_subsurface; }

    /// Of a material that has one.
    Subsurface subsurface(const geometry::SurfacePoint& point, float footprint) const;

    /// Curves of the material scatter as fibres.
    bool is_hair(scene::MaterialId material) const { return flags(material).is_hair; }

    const TextureCache& textures() const { return textures_; }

  private:
    struct Flags {
        bool has_presence = false;
        bool is_emissive = false;
        bool has_transmission = false;
        bool bounds_body = false;
        bool is_see_through = false;
        bool is_hair = false;
        bool has_subsurface = false;
        bool scatters_inside = false;
        bool is_bare = false;
        int priority = 0;
        float index = 1;
        Rgb extinction = Rgb(0.0f);
        const RoughInterface* interface = nullptr;             // of rough transmission
        std::vector<const RoughInterface*> interfaces_within;  // the same within other bodies
        const AnisotropicAlbedo* anisotropic = nullptr;
        bool is_special = false;  // has more than a base and its reflection
        bool turns_normals = false;
    };

    const Flags& flags(scene::MaterialId material) const {
        return flags_[std::min(size_t(material), flags_.size() - 1)];
    }

    void set_transport(const scene::Material& material, Flags& flags, Diagnostics& diagnostics);
    const RoughInterface* make_interface(const scene::Material& material,
                                         const Flags& flags,
                                         float surrounding_index,
                                         Diagnostics& diagnostics);
    void set_priorities(Diagnostics& diagnostics);
    const AnisotropicAlbedo* make_anisotropy(const scene::Material& material);

    Rgb color(const scene::Input& input,
              const geometry::SurfacePoint& point,
              float footprint) const {
        return scene::is_constant(input) ? input.value : varying(input, point, footprint);
    }

    float scalar(const scene::Input& input,
                 const geometry::SurfacePoint& point,
                 float footprint) const {
        return scene::is_constant(input) ? input.value.x : varying(input, point, footprint).x;
    }

    Rgb varying(const scene::Input& input,
                const geometry::SurfacePoint& point,
                float footprint) const;
    TexelRgba texture(scene::TextureId id,
                      const geometry::SurfacePoint& point,
                      float footprint) const;
    scene::PatternValue pattern(scene::PatternId id,
                                const geometry::SurfacePoint& point,
                                float footprint) const;
    scene::PatternValue pattern_source(const scene::Pattern& pattern,
                                       const scene::PatternStep& step,
                                       const scene::PatternValue* values,
                                       const geometry::SurfacePoint& point,
                                       float footprint) const;
    Rgb display_color(const geometry::SurfacePoint& point) const;
    HairParameters hair_parameters(const scene::Hair& hair,
                                   const geometry::SurfacePoint& point,
                                   float footprint) const;
    float subsurface_weight(const scene::Material& material,
                            const geometry::SurfacePoint& point,
                            float footprint) const;
    Vec3 mapped_normal(const scene::Material& material,
                       const geometry::SurfacePoint& point,
                       float footprint) const;
    SurfaceParameters parameters(scene::MaterialId material,
                                 const geometry::SurfacePoint& point,
                                 float footprint,
                                 float surrounding_index) const;
    void add_special(const scene::Material& material,
                     const Flags& flags,
                     const geometry::SurfacePoint& point,
                     float footprint,
                     SurfaceParameters& parameters) const;
    void add_extras(const scene::SurfaceExtras& extras,
                    const geometry::SurfacePoint& point,
                    float footprint,
                    float metallic,
                    SurfaceParameters& parameters) const;
    void add_anisotropy(const scene::Material& material,
                        const geometry::SurfacePoint& point,
                        float footprint,
                        SurfaceParameters& parameters) const;
    void add_thin_wall(const scene::Material& material,
                       const geometry::SurfacePoint& point,
                       float footprint,
                       SurfaceParameters& parameters) const;

    const scene::Scene& scene_;
    scene::EffectSet forced_;
    float texture_width_;  // over that of footprints
    TextureCache textures_;
    std::vector<TextureCache::Handle> texture_handles_;  // [texture]
    std::vector<Flags> flags_;  // [material], then the displayColor material
    std::vector<std::unique_ptr<RoughInterface>> interfaces_;  // shared by materials alike
    std::vector<std::unique_ptr<AnisotropicAlbedo>> anisotropies_;
    const SheenAlbedo* sheen_ = nullptr;  // where a material has sheen
    scene::PrimvarId display_color_ = scene::none;
    scene::PrimvarId display_opacity_ = scene::none;
    bool has_presence_ = false;
    bool has_emission_ = false;
    bool is_see_through_ = false;
    bool has_absorption_ = false;
    bool has_interior_media_ = false;
    bool has_priorities_ = false;
    bool has_subsurface_ = false;
};

}  // namespace velatura::shading
