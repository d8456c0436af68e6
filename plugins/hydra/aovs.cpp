// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/aovs.h"

#include "base/tasks.h"
#include "film/light_path_expression.h"
#include "film/path_automaton.h"
#include "geometry/surface_point.h"
#include "layers/resolve.h"

#include <pxr/base/tf/diagnostic.h>
#include <pxr/base/tf/token.h>
#include <pxr/imaging/hd/tokens.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <limits>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

namespace velatura::hydra {

using namespace PXR_NS;
using Kind = AovRequest::Kind;

namespace {

struct NamedKind {
    std::string_view name;
    Kind kind;
};

constexpr std::array named_kinds = {NamedKind{"color", Kind::Color},
                                    NamedKind{"beauty", Kind::Color},
                                    NamedKind{"Ci", Kind::Color},
                                    NamedKind{"depth", Kind::Depth},
                                    NamedKind{"cameraDepth", Kind::CameraDepth},
                                    NamedKind{"linearDepth", Kind::CameraDepth},
                                    NamedKind{"primId", Kind::PrimId},
                                    NamedKind{"instanceId", Kind::InstanceId},
                                    NamedKind{"elementId", Kind::ElementId},
                                    NamedKind{"normal", Kind::Normal},
                                    NamedKind{"N", Kind::Normal},
                                    NamedKind{"Neye", Kind::EyeNormal}};

/// Once per text and process.
void report_once(const std::string& text) {
    static std::mutex mutex;
    static std::set<std::string> reported;
    const std::lock_guard lock(mutex);
    if (reported.insert(text).second) TF_WARN("velatura: %s", text.c_str());
}

std::string setting(const HdRenderPassAovBinding& binding, const char* name) {
    const auto at = binding.aovSettings.find(TfToken(name));
    if (at == binding.aovSettings.end()) return {};
    if (at->second.IsHolding<std::string>()) return at->second.UncheckedGet<std::string>();
    if (at->second.IsHolding<TfToken>()) return at->second.UncheckedGet<TfToken>().GetString();
    return {};
}

/// Families that are not stored unless somebody asks for them.
void add_family(const std::string& layer, film::LayerSet& layers) {
    if (layer.starts_with("U_") || layer.starts_with("S_")) layers.shadow_layers = true;
    const bool is_bounce = layer.size() > 1 && layer[0] == 'b' &&
                           std::isdigit(static_cast<unsigned char>(layer[1])) != 0;
    if ((is_bounce || layer.starts_with("tail")) && layer.find('_') != std::string::npos)
        layers.matrix_layers = true;
}

/// The layer of the expression; nullopt where it is wrong.
std::optional<std::string> add_path(const std::string& expression, film::LayerSet& layers) {
    for (const accumulate::PathLayer& known : layers.path_layers)
        if (known.family == "paths" && known.expression == expression) return known.name;
    accumulate::PathLayer layer = film::make_path_layer(
        "lpe" + std::to_string(layers.path_layers.size()), expression, "paths");
    const auto made =
        film::PathAutomaton::make({layer}, layers.has_strict_paths, {{"light", {}, false, ""}});
    if (!made) {
        report_once("light path expression \"" + expression + "\": " + made.error().message);
        return std::nullopt;
    }
    // Names of the same expression with its prefixes taken off
    for (const accumulate::PathLayer& known : layers.path_layers)
        if (known.expression == layer.expression && known.light == layer.light) return known.name;
    layers.path_layers.push_back(layer);
    return layer.name;
}

/// An image of the size of a buffer, rows from the bottom.
template <class Number>
class BufferImage {
  public:
    BufferImage(const RenderBuffer& buffer, const BufferFrame& frame, size_t components)
        : width_(int(buffer.GetWidth())),
          height_(int(buffer.GetHeight())),
          frame_(frame),
          components_(components),
          values_(size_t(width_) * size_t(height_) * components) {}

    void fill(Number value) { std::fill(values_.begin(), values_.end(), value); }

    /// Of a pixel of the film's window; null outside of the buffer.
    Number* pixel(int x, int y) {
        const int column = frame_.left + x, row = height_ - 1 - (frame_.top + y);
        if (column < 0 || column >= width_ || row < 0 || row >= height_) return nullptr;
        return &values_[(size_t(row) * size_t(width_) + size_t(column)) * components_];
    }

    int width() const { return width_; }

    int height() const { return height_; }

    size_t components() const { return components_; }

    const std::vector<Number>& values() const { return values_; }

  private:
    int width_, height_;
    const BufferFrame& frame_;
    size_t components_;
    std::vector<Number> values_;
};

/// Channels of a layer in the order of a buffer's components.
std::vector<const image::Channel*> channels_of(const image::Image& image,
                                               const std::string& layer) {
    std::vector<const image::Channel*> channels;
    if (const image::Channel* const single = image.find(layer)) return {single};
    for (const std::string_view names : {"RGBA", "XYZ", "ST", "st"}) {
        for (const char c : names)
            if (const image::Channel* const channel = image.find(layer + "." + c))
                channels.push_back(channel);
        if (!channels.empty()) return channels;
    }
    return channels;
}

/// Writes what one film holds.
class AovWriter {
  public:
    AovWriter(const film::Film& film, const NearestHits& nearest, const BufferFrame& frame)
        : resolved_(layers::resolve_layers(film.sums())),
          nearest_(nearest),
          frame_(frame),
          width_(film.window().width()),
          height_(film.window().height()) {}

    void write(const AovRequest& request) const {
        RenderBuffer& buffer = *request.buffer;
        switch (request.kind) {
            case Kind::Color:
                write_channels(buffer, {resolved_.image.find("R"), resolved_.image.find("G"),
                                        resolved_.image.find("B"), resolved_.image.find("A")});
                break;
            case Kind::Depth:
                write_depth(buffer, true);
                break;
            case Kind::CameraDepth:
                write_depth(buffer, false);
                break;
            case Kind::PrimId:
                write_ids(buffer, nearest_.prims);
                break;
            case Kind::InstanceId:
                write_ids(buffer, nearest_.instances);
                break;
            case Kind::ElementId:
                write_ids(buffer, nearest_.elements);
                break;
            case Kind::Normal:
            case Kind::EyeNormal:
                write_normals(buffer, request.kind == Kind::EyeNormal);
                break;
            case Kind::Layer:
                write_layer(request);
                break;
            case Kind::Unknown:
                break;
        }
    }

  private:
    void write_channels(RenderBuffer& buffer,
                        const std::vector<const image::Channel*>& channels) const {
        BufferImage<float> out(buffer, frame_, channels.size());
        for (size_t c = 0; c < channels.size(); ++c) {
            if (!channels[c]) continue;
            image::for_each_value(*channels[c], [&](size_t i, float value) {
                if (float* const p = out.pixel(int(i % size_t(width_)), int(i / size_t(width_))))
                    p[c] = value;
            });
        }
        buffer.write(out.width(), out.height(), out.components(), out.values());
    }

    void write_layer(const AovRequest& request) const {
        const auto channels = channels_of(resolved_.image, request.layer);
        if (!channels.empty()) {
            write_channels(*request.buffer, channels);
            return;
        }
        const bool is_black =
            std::any_of(resolved_.layers.begin(), resolved_.layers.end(),
                        [&](const accumulate::LayerEntry& e) { return e.name == request.layer; });
        if (!is_black)
            report_once("AOV \"" + request.name + "\": there is no layer " + request.layer +
                        "; the buffer is black");
        write_channels(*request.buffer, {nullptr, nullptr, nullptr});
    }

    void write_depth(RenderBuffer& buffer, bool is_clip) const {
        BufferImage<float> out(buffer, frame_, 1);
        out.fill(is_clip ? 1.0f : 0.0f);
        for_each_pixel(out, [&](float* pixel, size_t i) {
            const float depth = nearest_.depths[i];
            if (depth == std::numeric_limits<float>::infinity()) return;
            if (!is_clip) {
                *pixel = depth;
                return;
            }
            const GfVec4d clip = GfVec4d(0, 0, -double(depth), 1) * frame_.projection;
            *pixel = float(0.5 * clip[2] / clip[3] + 0.5);
        });
        buffer.write(out.width(), out.height(), 1, out.values());
    }

    void write_ids(RenderBuffer& buffer, const std::vector<int32_t>& ids) const {
        BufferImage<int32_t> out(buffer, frame_, 1);
        out.fill(-1);
        for_each_pixel(out, [&](int32_t* pixel, size_t i) { *pixel = ids[i]; });
        buffer.write(out.width(), out.height(), out.values());
    }

    void write_normals(RenderBuffer& buffer, bool is_eye) const {
        const auto channels = channels_of(resolved_.image, "N");
        BufferImage<float> out(buffer, frame_, 3);
        if (channels.size() == 3) {
            for_each_pixel(out, [&](float* pixel, size_t i) {
                GfVec3d n(channels[0]->value(i), channels[1]->value(i), channels[2]->value(i));
                if (is_eye) n = frame_.eye_from_world.TransformDir(n);
                for (int c = 0; c < 3; ++c) pixel[c] = float(n[c]);
            });
        }
        buffer.write(out.width(), out.height(), 3, out.values());
    }

    template <class Number, class Visit>
    void for_each_pixel(BufferImage<Number>& out, const Visit& visit) const {
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x)
                if (Number* const pixel = out.pixel(x, y))
                    visit(pixel, size_t(y) * size_t(width_) + size_t(x));
    }

    layers::ResolvedLayers resolved_;
    const NearestHits& nearest_;
    const BufferFrame& frame_;
    int width_, height_;
};

}  // namespace

std::vector<AovRequest> read_bindings(const HdRenderPassAovBindingVector& bindings,
                                      film::LayerSet& layers) {
    std::vector<AovRequest> requests;
    for (const HdRenderPassAovBinding& binding : bindings) {
        AovRequest request;
        request.name = binding.aovName.GetString();
        request.buffer = static_cast<RenderBuffer*>(binding.renderBuffer);
        if (!request.buffer) continue;
        std::string source = setting(binding, "sourceName");
        if (source.empty()) source = request.name;
        constexpr std::string_view lpe = "lpe:";
        const auto known = std::find_if(named_kinds.begin(), named_kinds.end(),
                                        [&](const NamedKind& k) { return k.name == source; });
        if (source.starts_with(lpe) || setting(binding, "sourceType") == "lpe") {
            const std::string expression =
                source.starts_with(lpe) ? source.substr(lpe.size()) : source;
            if (const auto layer = add_path(expression, layers)) {
                request.kind = Kind::Layer;
                request.layer = *layer;
            }
        } else if (known != named_kinds.end()) {
            request.kind = known->kind;
        } else {
            request.kind = Kind::Layer;
            request.layer = source;
            add_family(source, layers);
        }
        requests.push_back(std::move(request));
    }
    return requests;
}

NearestHits find_nearest(const integrator::World& world,
                         const film::Window& window,
                         const LayerPlaces& places) {
    const size_t width = size_t(window.width()), count = width * size_t(window.height());
    NearestHits nearest;
    for (auto* const ids : {&nearest.prims, &nearest.instances, &nearest.elements})
        ids->assign(count, -1);
    nearest.depths.assign(count, std::numeric_limits<float>::infinity());
    // Hydra counts the instances of each prototype
    std::vector<int32_t> ranks, next(world.scene.prototypes.size(), 0);
    for (const scene::Instance& instance : world.scene.instances)
        ranks.push_back(next[instance.prototype]++);
    std::vector<int32_t> prim_of(world.scene.provenance.size(), -1);
    for (size_t i = 0; i < prim_of.size(); ++i) {
        const auto at = places.prim_ids.find(world.scene.provenance[i].prim_path);
        if (at != places.prim_ids.end()) prim_of[i] = at->second;
    }
    parallel_for(count, [&](size_t i) {
        const Vec2 center(float(window.x0 + int(i % width)) + 0.5f,
                          float(window.y0 + int(i / width)) + 0.5f);
        const camera::CameraRay camera_ray = world.camera.generate_ray(center, Vec2(0.5f), 0.0f);
        geometry::Ray ray{camera_ray.o, camera_ray.d};
        ray.t_max = camera_ray.t_max;
        const geometry::Hit hit = world.accelerator->intersect(ray);
        if (!hit.is_valid()) return;
        const geometry::SurfacePoint point =
            geometry::make_surface_point(world.scene, world.geometry, ray, hit);
        if (point.provenance < prim_of.size()) nearest.prims[i] = prim_of[point.provenance];
        nearest.instances[i] = point.instance < ranks.size() ? ranks[point.instance] : 0;
        nearest.elements[i] = int32_t(point.face);
        nearest.depths[i] = world.camera.depth(point.p);
    });
    return nearest;
}

void write_aovs(const std::vector<AovRequest>& requests,
                const film::Film& film,
                const NearestHits& nearest,
                const BufferFrame& frame) {
    const AovWriter writer(film, nearest, frame);
    for (const AovRequest& request : requests) writer.write(request);
}

HdAovDescriptor default_descriptor(const TfToken& name) {
    for (const char* const number : {"Z", "variance", "sampleCount", "invalid"})
        if (name == number) return {HdFormatFloat32, false, VtValue(0.0f)};
    const auto known = std::find_if(named_kinds.begin(), named_kinds.end(),
                                    [&](const NamedKind& k) { return k.name == name.GetString(); });
    switch (known == named_kinds.end() ? Kind::Layer : known->kind) {
        case Kind::Color:
            return {HdFormatFloat32Vec4, false, VtValue(GfVec4f(0.0f))};
        case Kind::Depth:
            return {HdFormatFloat32, false, VtValue(1.0f)};
        case Kind::CameraDepth:
            return {HdFormatFloat32, false, VtValue(0.0f)};
        case Kind::PrimId:
        case Kind::InstanceId:
        case Kind::ElementId:
            return {HdFormatInt32, false, VtValue(-1)};
        default:
            return {HdFormatFloat32Vec3, false, VtValue(GfVec3f(0.0f))};
    }
}

}  // namespace velatura::hydra
