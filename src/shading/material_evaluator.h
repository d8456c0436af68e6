// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/math.h"
#include "geometry/displacement.h"
#include "geometry/surface_point.h"
#include "scene/pattern.h"
#include "scene/scene.h"
#include "shading/bsdf.h"
#include "shading/dispersion.h"
#include "shading/sheen.h"
#include "shading/texture_cache.h"

#include <algorithm>
#include <memory>
#include <vector>

namespace velatura::shading {

/// Subsurface scattering of a surface point: a homogeneous medium below the surface.
struct Subsurface {
    float weight = 0;         ///< fraction of the diffuse base that it replaces, [0, 1]
    Rgb color = Rgb(0.0f);    ///< approximate diffuse albedo of a thick flat slab
    Rgb sigma_t = Rgb(0.0f);  ///< extinction [1/scene unit, render space]
    Rgb albedo = Rgb(0.0f);   ///< single-scattering albedo
    float anisotropy = 0;     ///< mean cosine g of the phase function, in (−1, 1)
};

/// Single-scattering albedo for which a half space has the diffuse albedo `color`.
/// Args: anisotropy: mean cosine g of the phase function.
/// Ref:  van de Hulst 1980, "Multiple Light Scattering" (similarity relation for g); inverted by
///       Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks".
Rgb single_scattering_albedo(const Rgb& color, float anisotropy);

/// The materials of a scene, prepared for evaluation at surface points.
///
/// Space:   directions are unit vectors in render space and point away from the surface.
/// `footprint`: width of the ray cone where it hits the surface [scene unit]; 0 = finest texels.
/// `material`: index into Scene::materials; scene::none = the material of displayColor.
/// Threads: evaluation is safe from many threads; update() is not.
class MaterialEvaluator final : public geometry::Displacer {
  public:
    // Construction and edits

    /// Opens the textures of the scene, which must outlive this.
    /// Args:   forced: effects whose tests and lookups run even where no material uses them;
    ///         texture_bias: textures are filtered over 2^texture_bias times the footprint;
    ///         texture_bytes: capacity of the texture cache [bytes].
    /// Errors: none. A missing or damaged file is one error at its prim and gives the fallback
    ///         value.
    MaterialEvaluator(const scene::Scene& scene,
                      Diagnostics& diagnostics,
                      scene::EffectSet forced = {},
                      float texture_bias = 0.0f,
                      size_t texture_bytes = TextureCache::usual_bytes);
    ~MaterialEvaluator() override;

    MaterialEvaluator(const MaterialEvaluator&) = delete;
    MaterialEvaluator& operator=(const MaterialEvaluator&) = delete;

    /// Reads the changed materials of the scene; textures stay those that were opened. Not during
    /// evaluation.
    void update(Diagnostics& diagnostics);

    // Evaluation at a surface point

    /// BSDF at a point, seen from wo.
    /// Args: surrounding_index: index of refraction on the side of the surface that is outside of
    ///       its solid; spread: of the wavelength, see dispersion.h.
    Bsdf make_bsdf(const geometry::SurfacePoint& point,
                   const Vec3& wo,
                   float footprint,
                   float surrounding_index = 1.0f,
                   float spread = 0.0f) const;

    /// Emitted radiance towards wo, scene-linear; both sides emit. One comparison where the
    /// material does not emit.
    Rgb emission(const geometry::SurfacePoint& point, const Vec3& wo, float footprint) const;

    /// Presence: probability that the surface exists at the point, [0, 1] (opacityThreshold,
    /// opacityMode "presence", displayOpacity). Independent of transmission.
    float presence(const geometry::SurfacePoint& point, float footprint) const;

    /// Subsurface scattering at a point. Requires has_subsurface(material).
    Subsurface subsurface(const geometry::SurfacePoint& point, float footprint) const;

    /// True when the material displaces its surface.
    bool displaces(scene::MaterialId material) const override {
        return material < scene_.materials.size() &&
               scene::is_displacing(scene_.materials[material]);
    }

    /// Displacement along the normal [scene unit], see geometry::Displacer.
    float displacement(const geometry::SurfacePoint& point, float footprint) const override;

    // Properties of one material

    /// False: presence() is 1 at every point of the material.
    bool material_has_presence(scene::MaterialId material) const {
        return flags(material).has_presence;
    }

    /// True when emission() can be non-black.
    bool is_emissive(scene::MaterialId material) const { return flags(material).is_emissive; }

    /// True when the material can transmit: opacity below 1 in transparent mode, or a translucent
    /// thin wall.
    bool material_has_transmission(scene::MaterialId material) const {
        return flags(material).has_transmission;
    }

    /// True when the surface bounds a solid: it transmits and is no thin wall.
    bool bounds_solid(scene::MaterialId material) const { return flags(material).bounds_solid; }

    /// True when light can pass without being scattered: smooth thin walls, and interfaces of the
    /// constant index 1. Bsdf::delta() is what passes.
    bool material_is_see_through(scene::MaterialId material) const {
        return flags(material).is_see_through;
    }

    /// True when light scatters below the surface (subsurface scattering).
    bool has_subsurface(scene::MaterialId material) const { return flags(material).has_subsurface; }

    /// True when the solid refracts each wavelength by an index of its own.
    bool is_dispersive(scene::MaterialId material) const { return flags(material).is_dispersive; }

    /// True when curves of the material scatter as fibers.
    bool is_hair(scene::MaterialId material) const { return flags(material).is_hair; }

    // Interior of the solid that a material bounds

    /// Priority among overlapping dielectrics (docs/adr/0025).
    int priority(scene::MaterialId material) const { return flags(material).priority; }

    /// Index of refraction of the interior, constant.
    float index(scene::MaterialId material) const { return flags(material).index; }

    /// Extinction of the interior medium [1/scene unit]; 0 for most materials, infinite when
    /// nothing passes.
    const Rgb& extinction(scene::MaterialId material) const { return flags(material).extinction; }

    /// True when the interior medium scatters.
    bool scatters_inside(scene::MaterialId material) const {
        return flags(material).scatters_inside;
    }

    /// True when the solid has no surface, only an interior medium: light crosses it unchanged.
    bool is_bare(scene::MaterialId material) const { return flags(material).is_bare; }

    // Properties of the scene: true when some material has them

    /// Some material can have presence below 1.
    bool has_presence() const { return has_presence_; }

    /// Some material can emit.
    bool has_emission() const { return has_emission_; }

    /// Some material is see-through, see material_is_see_through().
    bool is_see_through() const { return is_see_through_; }

    /// Some material absorbs or scatters inside, or has a priority: paths have to track the solids
    /// that they are in.
    bool has_absorption() const { return has_absorption_; }

    /// Some dielectrics displace others by priority.
    bool has_priorities() const { return has_priorities_; }

    /// Some interior medium scatters, or some solid has no surface.
    bool has_interior_media() const { return has_interior_media_; }

    /// Some material has subsurface scattering.
    bool has_subsurface() const { return has_subsurface_; }

    /// Some material is dispersive.
    bool has_dispersion() const { return has_dispersion_; }

    /// Wavelengths of light of one channel of the working space.
    const WavelengthBand& wavelengths_of(int channel) const {
        return wavelength_bands_[size_t(channel)];
    }

    /// Cache of the textures, for its statistics.
    const TextureCache& textures() const { return textures_; }

  private:
    struct Flags {
        bool has_presence = false;
        bool is_emissive = false;
        bool has_transmission = false;
        bool bounds_solid = false;
        bool is_see_through = false;
        bool is_hair = false;
        bool has_subsurface = false;
        bool scatters_inside = false;
        bool is_bare = false;
        int priority = 0;
        float index = 1;
        Rgb extinction = Rgb(0.0f);
        const RoughInterface* interface = nullptr;             // of rough transmission
        std::vector<const RoughInterface*> interfaces_within;  // the same within other solids
        const AnisotropicAlbedo* anisotropic = nullptr;
        bool is_special = false;  // has more than a base and its reflection
        bool turns_normals = false;
        bool has_film = false;
        std::shared_ptr<const FilmCurve> film_curve;  // of a film that is the same everywhere
        bool is_dispersive = false;
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
    std::shared_ptr<const FilmCurve> make_film_curve(const scene::Material& material) const;

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
                                 float surrounding_index,
                                 float spread) const;
    void add_special(const scene::Material& material,
                     const Flags& flags,
                     const geometry::SurfacePoint& point,
                     float footprint,
                     SurfaceParameters& parameters) const;
    void add_extras(const scene::MaterialXInputs& extras,
                    const geometry::SurfacePoint& point,
                    float footprint,
                    float metallic,
                    SurfaceParameters& parameters) const;
    FilmParameters film_parameters(const scene::Material& material,
                                   const geometry::SurfacePoint& point,
                                   float footprint,
                                   float surrounding_index,
                                   const SurfaceParameters& parameters) const;
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
    const FilmTables* film_ = nullptr;    // where a material has a thin film
    scene::PrimvarId display_color_ = scene::none;
    scene::PrimvarId display_opacity_ = scene::none;
    bool has_presence_ = false;
    bool has_emission_ = false;
    bool is_see_through_ = false;
    bool has_absorption_ = false;
    bool has_interior_media_ = false;
    bool has_priorities_ = false;
    bool has_subsurface_ = false;
    bool has_dispersion_ = false;
    WavelengthBands wavelength_bands_ = {};
};

}  // namespace velatura::shading
