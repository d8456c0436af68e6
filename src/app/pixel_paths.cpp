// SPDX-License-Identifier: Apache-2.0
#include "app/pixel_paths.h"

#include "layers/resolve.h"
#include "lights/emissive_surfaces.h"

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace velatura::app {

namespace {

/// Whether a deposit is of light that the observer was told of when it was found.
bool is_of_found_light(std::string_view what) {
    return what == "light sampled" || what == "light hit by the path" || what == "surface emission";
}

/// Writes one sample down while it is traced.
class PathRecorder final : public integrator::PathObserver {
  public:
    PathRecorder(const integrator::World& world,
                 const film::LayerSet& layers,
                 film::SampleRadiance& sample)
        : world_(world), scene_(world.scene), layers_(layers), sample_(sample) {}

    SamplePaths take() { return std::exchange(out_, {}); }

    void on_camera(const geometry::Ray& ray) override {
        out_.origin = to_world(ray.o);
        out_.direction = ray.d;
        out_.time = ray.time;
        at_ = divided_at_ = PathVertex::camera;
        direction_ = ray.d;
    }

    void on_hit(int bounce,
                const geometry::SurfacePoint& point,
                float t,
                const Rgb& beta) override {
        PathVertex vertex;
        vertex.prim = prim_of(point.provenance);
        vertex.material = point.material < scene_.materials.size()
                              ? scene_.materials[point.material].name
                              : "displayColor";
        vertex.face = point.face;
        vertex.n = point.ns;
        add(bounce, point.p, t, beta, std::move(vertex));
    }

    void on_volume(int bounce, const Vec3& p, float t, const Rgb& beta) override {
        add(bounce, p, t, beta, {});
    }

    void on_light(const integrator::FoundLight& found) override {
        PathLight light;
        light.vertex = at_;
        light.found = found;
        if (found.light) light.light = light_name(*found.light);
        out_.lights.push_back(std::move(light));
        is_pending_ = true;
    }

    void on_deposit(int bounce,
                    scene::GroupId group,
                    const Rgb& radiance,
                    const char* what) override {
        // After a light in shadow other light may come
        if (!std::exchange(is_pending_, false) || !is_of_found_light(what)) {
            out_.lights.emplace_back();
            out_.lights.back().vertex = at_;
        }
        PathLight& light = out_.lights.back();
        light.bounce = bounce;
        light.group = layers_.groups[group].name;
        light.what = what;
        light.contribution = radiance;
        light.layers = layers_of(bounce, int(group));
    }

    void on_turn(int, const integrator::PathTurn& turn) override {
        is_pending_ = false;
        direction_ = turn.wi;
        if (at_ != PathVertex::camera) out_.vertices[size_t(at_)].turn = turn;
    }

    void on_split() override { divided_at_ = at_; }

    void on_end(int, const char* why) override {
        is_pending_ = false;
        PathEnd end{at_, why, {}};
        // A path that roulette ends has a direction, too
        if (end.why == "escaped") end.escape = direction_;
        out_.ends.push_back(std::move(end));
        at_ = divided_at_;
    }

  private:
    Vec3d to_world(const Vec3& p) const { return Vec3d(p) + scene_.camera.world_position; }

    std::string prim_of(scene::ProvenanceId id) const {
        return id < scene_.provenance.size() ? scene_.provenance[id].prim_path : std::string();
    }

    std::string light_name(lights::LightId id) const {
        const lights::LightSet& lights = world_.lights;
        if (!lights.is_surface(id.index)) return lights.light(id.index).name;
        return prim_of(lights.surfaces()->provenance({id.index - lights.size(), id.part}));
    }

    void add(int bounce, const Vec3& p, float t, const Rgb& beta, PathVertex vertex) {
        is_pending_ = false;
        vertex.from = at_;
        vertex.bounce = bounce;
        vertex.p = to_world(p);
        vertex.distance = t;
        vertex.beta = beta;
        at_ = int(out_.vertices.size());
        out_.vertices.push_back(std::move(vertex));
    }

    /// The layers of a file that a deposit goes to.
    std::vector<PathLight::Layer> layers_of(int bounce, int group) const {
        const std::string column = layers_.column_name(bounce),
                          &name = layers_.groups[size_t(group)].name;
        std::vector<PathLight::Layer> out;
        if (layers_.bounce_layers) out.push_back({column});
        if (layers_.group_layers) out.push_back({"C_" + name});
        if (layers_.matrix_layers) out.push_back({column + "_" + name});
        film::PathLabels* labels = sample_.labels();
        if (!labels) return out;
        std::map<std::string, accumulate::Triple> by_name;
        for (const auto& [state, part] : labels->parts()) {
            for (const uint16_t index : labels->automaton().layers_of(state, group)) {
                const accumulate::PathLayer& layer = layers_.path_layers[index];
                if (layer.light == accumulate::PathLayer::Light::Unoccluded) continue;
                const bool is_cell = layer.family == accumulate::lobe_matrix_family;
                by_name[is_cell ? column + "_" + name + "_" + layer.lobe : layer.name] += part;
            }
        }
        for (const auto& [layer, part] : by_name) out.push_back({layer, {part.x, part.y, part.z}});
        return out;
    }

    const integrator::World& world_;
    const scene::Scene& scene_;
    const film::LayerSet& layers_;
    film::SampleRadiance& sample_;
    SamplePaths out_;
    int at_ = PathVertex::camera;          ///< the vertex where the path is
    int divided_at_ = PathVertex::camera;  ///< from which its branches go on
    Vec3 direction_ = Vec3(0.0f);          ///< of its ray
    bool is_pending_ = false;              ///< the last light waits for what arrives of it
};

}  // namespace

PixelPaths trace_pixel_paths(const integrator::PathTracer& tracer,
                             const film::LayerSet& layers,
                             const integrator::World& world,
                             const PixelPaths& what) {
    PixelPaths out = what;
    // The sums of the image, of one pixel
    film::Film film({out.x, out.y, out.x + 1, out.y + 1}, layers);
    film::PixelAccumulator pixel(layers);
    film.begin_pixel(pixel, out.x, out.y, out.first);
    film::SampleRadiance radiance(layers);
    integrator::RayCounts counts;
    PathRecorder recorder(world, layers, radiance);
    for (uint64_t s = out.first; s < out.end; ++s) {
        radiance.clear();
        tracer.trace(out.x, out.y, s, radiance, counts, &recorder);
        pixel.add(radiance);
        SamplePaths sample = recorder.take();
        sample.sample = s;
        sample.weight = radiance.weight;
        sample.radiance = radiance.radiance();
        if (radiance.is_bad()) sample.skipped = to_string(radiance.bad_reason());
        out.samples.push_back(std::move(sample));
    }
    film.end_pixel(pixel);
    const layers::ResolvedLayers resolved = layers::resolve_layers(film.sums());
    for (int c = 0; c < 3; ++c)
        if (const image::Channel* channel = resolved.image.find(std::string(1, "RGB"[c])))
            out.value[c] = channel->value(0);
    return out;
}

}  // namespace velatura::app
