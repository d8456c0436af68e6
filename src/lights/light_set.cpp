// SPDX-License-Identifier: Apache-2.0
#include "lights/light_set.h"

#include "base/check.h"
#include "geometry/surface_point.h"
#include "lights/emissive_surfaces.h"
#include "lights/emitter_tree.h"
#include "lights/emitters.h"
#include "lights/environment_map.h"
#include "lights/light_bounds.h"
#include "lights/moved_emitter.h"

#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>

namespace velatura::lights {
namespace {

Vec3d to_double(const Vec3& v) {
    return {double(v.x), double(v.y), double(v.z)};
}

/// The double of a float unit vector. Two steps, since the first leaves the square of the error.
Vec3d unit_direction(const Vec3& v) {
    return renormalize(renormalize(to_double(v)));
}

bool has_size(scene::LightKind kind) {
    return kind != scene::LightKind::Dome && kind != scene::LightKind::Distant;
}

/// Null when it is linked to everything.
template <class Light>
const scene::LightLinks* links_of(const Light& light) {
    return light.links == scene::LightLinks() ? nullptr : &light.links;
}

/// Turns scene lights into emitters and says what could not be honored.
class Preparation {
  public:
    Preparation(const scene::Scene& scene,
                const ImageLoader& load,
                Diagnostics& diagnostics,
                const LightSetOptions& options)
        : scene_(scene), load_(load), diagnostics_(diagnostics), options_(options) {}

    /// The emitter of a light; null when it is off.
    std::unique_ptr<Emitter> prepare(const scene::Light& authored) {
        scene::Light light = authored;
        if (!clean_radiance(light)) return nullptr;
        warn_about_ignored(light);
        EnvironmentImage image;
        const bool has_image = load_image(light, image);
        const EmitterInput input{light, has_image ? &image : nullptr, options_.compensate_mis};
        EmitterResult result = make(input);
        if (!result) {
            warn(light, result.error().code, result.error().message);
            return nullptr;
        }
        std::unique_ptr<Emitter> emitter = add_portals(light, std::move(result).value());
        if (options_.by_area) emitter = sampled_by_area(std::move(emitter));
        return add_filters(light, std::move(emitter));
    }

    /// Reads textures of gobos in front of the light.
    template <class Light>
    GoboLoader gobo_loader(const Light& light) {
        return [this, &light](const scene::GoboFilter& gobo) { return load_gobo(light, gobo); };
    }

    uint32_t unread_textures() const { return unread_textures_; }

  private:
    std::unique_ptr<Emitter> add_portals(const scene::Light& light, std::unique_ptr<Emitter> dome) {
        // Windows stay where a dome turns: they change no image
        if (light.kind != scene::LightKind::Dome || !light.later_render_from_light.empty())
            return dome;
        std::vector<std::unique_ptr<Emitter>> portals;
        for (const Mat4d& render_from_portal : light.render_from_portals) {
            scene::Light window;
            window.kind = scene::LightKind::Rect;
            window.render_from_light = render_from_portal;
            EmitterResult portal = make_rect({window});
            if (portal)
                portals.push_back(std::move(portal).value());
            else
                warn(light, "light-portal", "portal without area is skipped");
        }
        return portals.empty() ? std::move(dome)
                               : with_portals(std::move(dome), std::move(portals));
    }

    std::unique_ptr<Emitter> add_filters(const scene::Light& light,
                                         std::unique_ptr<Emitter> emitter) {
        if (light.filters.empty()) return emitter;
        FilterChain filters(light.filters, Mat4d(), gobo_loader(light));
        return filters.is_empty() ? std::move(emitter)
                                  : with_filters(std::move(emitter), std::move(filters));
    }

    /// Null with an error when it cannot be read. Lights share the texels of a file.
    template <class Light>
    std::shared_ptr<const EnvironmentImage> load_gobo(const Light& light,
                                                      const scene::GoboFilter& gobo) {
        const std::pair key(gobo.texture_file, gobo.texture_colors.curve);
        const auto known = gobos_.find(key);
        if (known != gobos_.end()) return known->second;
        scene::Light reader;
        reader.name = light.name;
        reader.provenance = light.provenance;
        reader.kind = scene::LightKind::Rect;
        reader.texture_file = gobo.texture_file;
        reader.texture_colors = gobo.texture_colors;
        EnvironmentImage image;
        std::shared_ptr<const EnvironmentImage> loaded;
        if (load_image(reader, image, "a gobo before the light is skipped"))
            loaded = std::make_shared<const EnvironmentImage>(std::move(image));
        return gobos_[key] = loaded;
    }

    static EmitterResult make(const EmitterInput& input) {
        switch (input.light.kind) {
            case scene::LightKind::Distant:
                return make_distant(input);
            case scene::LightKind::Dome:
                return make_dome(input);
            case scene::LightKind::Rect:
                return make_rect(input);
            case scene::LightKind::Disk:
                return make_disk(input);
            case scene::LightKind::Sphere:
                return make_sphere(input);
            case scene::LightKind::Cylinder:
                return make_cylinder(input);
        }
        return Error{"light-unknown-kind", "light of an unknown kind emits nothing"};
    }

    SourceLoc loc_of(const scene::Light& light) const {
        return light.provenance < scene_.provenance.size() ? scene_.provenance[light.provenance].loc
                                                           : SourceLoc();
    }

    void warn(const scene::Light& light, const std::string& code, const std::string& message) {
        diagnostics_.warn(code, loc_of(light), light.name, message);
    }

    /// False when nothing shines. A black light is the user's wish, no warning.
    bool clean_radiance(scene::Light& light) {
        if (!is_finite(light.Le)) {
            warn(light, "light-radiance",
                 "light emits nothing: its radiance is not finite, found a size of zero with "
                 "normalize, or an intensity or exposure out of range");
            return false;
        }
        bool has_negative = false;
        for (int i = 0; i < 3; ++i) {
            if (light.Le[i] >= 0.0f) continue;
            light.Le[i] = 0.0f;
            has_negative = true;
        }
        if (has_negative)
            warn(light, "light-radiance", "negative radiance of the light is set to 0");
        return !is_black(light.Le);
    }

    void warn_about_ignored(const scene::Light& light) {
        using scene::LightKind;
        if ((light.shaping.is_active || light.shaping.ies) && !has_size(light.kind))
            warn(light, "light-ignored", "shaping is not applied to distant and dome lights");
        if (!light.texture_file.empty() && light.kind != LightKind::Rect &&
            light.kind != LightKind::Dome)
            warn(light, "light-ignored", "texture is applied to rect and dome lights only");
        if (light.kind != LightKind::Dome || light.texture_file.empty()) return;
        if (!is_similarity(light.render_from_light))
            warn(light, "light-ignored",
                 "scale and shear of the dome light are ignored; only its rotation is used");
        if (light.dome_format != scene::DomeFormat::Automatic &&
            light.dome_format != scene::DomeFormat::LatLong)
            warn(light, "light-dome-format",
                 "dome texture is resampled to latlong; the schema does not fix how this format is "
                 "oriented, Debevec's convention is used");
    }

    /// consequence: of an image that cannot be had.
    bool load_image(const scene::Light& light,
                    EnvironmentImage& image,
                    const std::string& consequence = "light emits without its texture") {
        const bool takes_texture =
            light.kind == scene::LightKind::Rect || light.kind == scene::LightKind::Dome;
        if (!takes_texture || light.texture_file.empty()) return false;
        Result<EnvironmentImage> loaded =
            load_ ? load_(light)
                  : Result<EnvironmentImage>(Error{"light-texture", "no plugin reads images"});
        if (!loaded) {
            diagnostics_.error("light-texture", loc_of(light), light.name,
                               consequence + ": " + loaded.error().message);
            ++unread_textures_;
            return false;
        }
        image = std::move(loaded).value();
        if (image.width <= 0 || image.height <= 0 ||
            image.texels.size() != size_t(image.width) * size_t(image.height)) {
            warn(light, "light-texture", consequence + ": the image is empty");
            return false;
        }
        const size_t bad = remove_bad_texels(image);
        if (bad > 0)
            warn(light, "light-texture",
                 std::to_string(bad) +
                     " texels of the texture are negative or not finite; they are set to 0");
        return true;
    }

    uint32_t unread_textures_ = 0;
    std::map<std::pair<std::string, scene::SourceColorSpace>,
             std::shared_ptr<const EnvironmentImage>>
        gobos_;  // [file, color space]
    const scene::Scene& scene_;
    const ImageLoader& load_;
    Diagnostics& diagnostics_;
    const LightSetOptions& options_;
};

}  // namespace

LightSet::LightSet(const scene::Scene& scene,
                   const ImageLoader& load,
                   Diagnostics& diagnostics,
                   const LightSetOptions& options)
    : scene_(&scene) {
    Preparation preparation(scene, load, diagnostics, options);
    std::vector<EmitterTree::Item> finite;
    for (const scene::Light& light : scene.lights) {
        const uint32_t index = uint32_t(emitters_.size());
        emitters_.push_back(preparation.prepare(light));
        records_.push_back(
            {light.group,
             {light.diffuse_multiplier, light.specular_multiplier},
             is_on(index) && emitters_[index]->is_infinite(),
             light.is_camera_visible,
             !light.render_from_portals.empty() && light.later_render_from_light.empty(),
             is_on(index) && &emitters_[index]->unfiltered() != emitters_[index].get(),
             scene::none,
             links_of(light)});
        if (!is_on(index)) continue;
        if (!light.later_render_from_light.empty()) {
            records_.back().motion = uint32_t(motions_.size());
            motions_.emplace_back(light.render_from_light, light.later_render_from_light);
        }
        note_links(light.links);
        if (is_infinite(index)) {
            infinite_.push_back(index);
        } else {
            const scene::AffineMotion* motion = motion_of(index);
            const Box3d box = emitters_[index]->bounds();
            finite.push_back({index, motion ? carried(box, *motion) : box});
        }
    }
    finite_ = std::make_unique<EmitterTree>(std::move(finite));
    for (const scene::MeshLight& light : scene.mesh_lights) note_links(light.links);
    plain_links_ = scene::plain_links(scene);
    note_links(plain_links_);
    const GobosOfLight gobos = [&](const scene::MeshLight& light) {
        return preparation.gobo_loader(light);
    };
    if (options.geometry != nullptr && options.materials != nullptr)
        emission_ = std::make_unique<SurfaceEmission>(scene, *options.geometry, *options.materials,
                                                      gobos, diagnostics);
    unread_textures_ = preparation.unread_textures();
    if (!emission_) return;
    surfaces_ = std::make_unique<EmissiveSurfaces>(scene, *options.geometry, *options.materials,
                                                   *emission_, options.by_area);
    if (surfaces_->item_count() == 0) surfaces_.reset();
}

void LightSet::note_links(const scene::LightLinks& links) {
    has_light_links_ |= links.lit != scene::none;
    has_custom_shadows_ |= links.has_custom_shadows();
}

LightSet::~LightSet() = default;
LightSet::LightSet(LightSet&&) noexcept = default;
LightSet& LightSet::operator=(LightSet&&) noexcept = default;

uint32_t LightSet::item_count() const {
    return size() + (surfaces_ ? surfaces_->item_count() : 0);
}

bool LightSet::is_instance(uint32_t item) const {
    return is_surface(item) && surfaces_->is_instance(item - size());
}

uint32_t LightSet::group_of_instance(uint32_t item) const {
    return surfaces_->group_of(item - size());
}

scene::GroupId LightSet::group(LightId id) const {
    if (!is_surface(id.index)) return records_[id.index].group;
    const scene::MeshLight* light = surfaces_->mesh_light(in_surfaces(id));
    return light ? light->group : scene_->emissive_group();
}

const scene::LightLinks* LightSet::links(LightId id) const {
    if (!is_surface(id.index)) return records_[id.index].links;
    const scene::MeshLight* light = surfaces_->mesh_light(in_surfaces(id));
    return light ? links_of(*light) : plain_links();
}

bool LightSet::item_illuminates(uint32_t item, scene::LinkClass c) const {
    if (!is_instance(item)) return illuminates(item, c);
    const uint32_t parts = surfaces_->part_count(item - size());
    for (uint32_t part = 0; part < parts; ++part)
        if (illuminates(LightId(item, part), c)) return true;
    return false;
}

LobeMultipliers LightSet::lobe_multipliers(LightId id) const {
    if (!is_surface(id.index)) return records_[id.index].multipliers;
    const scene::MeshLight* light = surfaces_->mesh_light(in_surfaces(id));
    return light ? LobeMultipliers{light->diffuse_multiplier, light->specular_multiplier}
                 : LobeMultipliers();
}

SurfaceRadiance LightSet::surface_radiance(const geometry::SurfacePoint& point,
                                           const Vec3& wo,
                                           float footprint,
                                           EmissionReceiver emission_receiver,
                                           const Vec3* filtered_for) const {
    SurfaceRadiance out;
    out.Le = emission_->radiance(point, wo, footprint, emission_receiver, filtered_for);
    const scene::MeshLight* light = emission_->light(point.instance, point.shape);
    out.group = light ? light->group : scene_->emissive_group();
    // A material that shows itself is no light to who sees it
    const bool is_light =
        light && !(emission_receiver == EmissionReceiver::Camera && light->shows_material);
    if (!is_light) {
        if (emission_receiver == EmissionReceiver::Scattering) out.links = plain_links();
        return out;
    }
    out.multipliers = {light->diffuse_multiplier, light->specular_multiplier};
    out.links = links_of(*light);
    return out;
}

bool LightSet::is_on(LightId id) const {
    return is_surface(id.index) ? surfaces_->is_on(id.index - size(), id.part)
                                : emitters_[id.index] != nullptr;
}

bool LightSet::is_delta(uint32_t item) const {
    return !is_surface(item) && is_on(item) && emitters_[item]->is_delta();
}

std::optional<LightSample> LightSet::sample(
    LightId id, const Vec3& p, const Vec2& u, const RayCone& cone, float time) const {
    if (!is_on(id)) return std::nullopt;
    const uint32_t index = id.index;
    if (is_surface(index)) return surfaces_->sample(in_surfaces(id), p, u, cone, time);
    const scene::AffineMotion* const motion = motion_of(index);
    const std::optional<EmitterSample> s =
        motion ? sample_moved(*emitters_[index], motion->at(double(time)), to_double(p), u)
               : emitters_[index]->sample(to_double(p), u);
    // Written so that NaN counts as no sample
    if (!s || !(s->pdf > 0.0) || !(s->distance > 0.0)) return std::nullopt;
    LightSample result;
    result.wi = Vec3(float(s->wi.x), float(s->wi.y), float(s->wi.z));
    result.distance = float(s->distance);
    result.Le = s->Le;
    result.pdf = float(s->pdf);
    result.is_delta = emitters_[index]->is_delta();
    if (!std::isfinite(result.pdf)) return std::nullopt;
    return result;
}

std::optional<EmitterHit> LightSet::hit_emitter(
    uint32_t index, const Vec3d& o, const Vec3d& d, float time, bool is_filtered) const {
    const Emitter& emitter = is_filtered ? *emitters_[index] : emitters_[index]->unfiltered();
    const scene::AffineMotion* const motion = motion_of(index);
    return motion ? intersect_moved(emitter, motion->at(double(time)), o, d)
                  : emitter.intersect(o, d);
}

std::optional<LightHit> LightSet::intersect(LightId id,
                                            const Vec3& o,
                                            const Vec3& d,
                                            float time) const {
    if (!is_on(id)) return std::nullopt;
    const uint32_t index = id.index;
    if (is_surface(index)) {
        std::optional<LightHit> hit = surfaces_->intersect(in_surfaces(id), o, d, time);
        if (hit) hit->light = index;
        return hit;
    }
    const std::optional<EmitterHit> h = hit_emitter(index, to_double(o), unit_direction(d), time);
    if (!h || !(h->t > 0.0)) return std::nullopt;
    return LightHit{index, float(h->t), h->Le, float(h->pdf)};
}

float LightSet::pdf(LightId id, const Vec3& p, const Vec3& wi, float time) const {
    const std::optional<LightHit> hit = intersect(id, p, wi, time);
    return hit ? hit->pdf : 0.0f;
}

bool LightSet::has_points(uint32_t item) const {
    return !is_surface(item) && is_on(item) && light(item).kind != scene::LightKind::Dome;
}

EmitterPoint LightSet::sample_point(uint32_t index,
                                    const Vec2& u,
                                    const std::optional<Vec3d>& facing,
                                    float time) const {
    const scene::AffineMotion* const motion = motion_of(index);
    const std::optional<EmitterPoint> point =
        motion ? sample_point_moved(*emitters_[index], motion->at(double(time)), u, facing)
               : emitters_[index]->sample_point(u, facing);
    VELATURA_CHECK(point.has_value(), "a light without points was sampled");
    return *point;
}

Rgb LightSet::radiance_at(
    uint32_t index, const EmitterPoint& point, const Vec3d& o, const Vec3d& d, float time) const {
    const scene::AffineMotion* const motion = motion_of(index);
    return motion ? radiance_moved(*emitters_[index], motion->at(double(time)), point, o, d)
                  : emitters_[index]->radiance_at(point, o, d);
}

std::optional<LightId> LightSet::find_surface(const geometry::SurfacePoint& point) const {
    if (!surfaces_) return std::nullopt;
    const std::optional<LightId> id = surfaces_->find(point);
    if (!id) return std::nullopt;
    return LightId(id->index + size(), id->part);
}

float LightSet::surface_pdf(LightId id, const Vec3& p, const Vec3& q, float time) const {
    return float(surfaces_->pdf(in_surfaces(id), p, q, time));
}

double LightSet::power(uint32_t item, double scene_radius) const {
    if (is_surface(item)) return surfaces_->power(item - size());
    return is_on(item) ? emitters_[item]->power(scene_radius) : 0.0;
}

double LightSet::area(uint32_t item) const {
    if (is_surface(item)) return surfaces_->area(item - size());
    return is_on(item) ? area_of(*emitters_[item]) : 0.0;
}

LightBounds LightSet::bounds(uint32_t item) const {
    if (is_surface(item)) return surfaces_->bounds(item - size());
    const LightBounds bounds{emitters_[item]->bounds(), emitters_[item]->emission_cone()};
    const scene::AffineMotion* const motion = motion_of(item);
    return motion ? carried(bounds, *motion) : bounds;
}

LightBounds LightSet::place(uint32_t item, const LightBounds& bounds) const {
    return surfaces_->place(item - size(), bounds);
}

double LightSet::mean_irradiance(uint32_t index) const {
    // Flux into a unit ball: π E of a distant light, 4 π² L of a dome whose mean irradiance is π L
    const bool is_dome = light(index).kind == scene::LightKind::Dome;
    return power(index, 1.0) / (is_dome ? 4.0 * pi_d : pi_d);
}

double LightSet::sampled_share(uint32_t index) const {
    return emitters_[index]->sampled_share();
}

Rgb LightSet::background(const Vec3& d) const {
    Rgb sum(0.0f);
    for (const uint32_t index : infinite_) {
        const std::optional<LightHit> hit = intersect(index, Vec3(0.0f), d);
        if (hit) sum += unfiltered_radiance(*hit, Vec3(0.0f), d);
    }
    return sum;
}

Rgb LightSet::unfiltered_radiance(const LightHit& hit,
                                  const Vec3& o,
                                  const Vec3& d,
                                  float time) const {
    if (!is_filtered(hit.light)) return hit.Le;
    const std::optional<EmitterHit> h =
        hit_emitter(hit.light, to_double(o), unit_direction(d), time, false);
    return h ? h->Le : Rgb(0.0f);
}

void LightSet::for_each_hit_raw(
    const Vec3& o, const Vec3& d, float t_max, float time, RawVisitor visit, void* context) const {
    const Vec3d origin = to_double(o), direction = unit_direction(d);
    const auto report = [&](uint32_t index) {
        const std::optional<EmitterHit> h = hit_emitter(index, origin, direction, time);
        if (!h || !(h->t > 0.0)) return;
        const LightHit hit{index, float(h->t), h->Le, float(h->pdf)};
        if (hit.t < t_max || std::isinf(hit.t)) visit(context, hit);
    };
    finite_->for_each(origin, direction, double(t_max), report);
    if (!std::isinf(t_max)) return;
    for (const uint32_t index : infinite_) report(index);
}

}  // namespace velatura::lights
