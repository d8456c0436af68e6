// SPDX-License-Identifier: Apache-2.0
// Light paths of a pixel as JSON and as curves of a USD layer: docs/reference/paths.md.
#include "app/pixel_paths.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

namespace velatura::app {

namespace {

using json = nlohmann::ordered_json;

/// Names of files may be no UTF-8.
std::string utf8_text(const json& j, int indent = -1) {
    return j.dump(indent, ' ', false, json::error_handler_t::replace);
}

template <class T>
json triple(const Imath::Vec3<T>& v) {
    return {v.x, v.y, v.z};
}

/// What light path expressions tell apart.
const char* name_of(film::PathEvent event) {
    using film::PathEvent;
    switch (event) {
        case PathEvent::Diffuse:
            return "diffuse";
        case PathEvent::Subsurface:
            return "subsurface";
        case PathEvent::Glossy:
            return "specular";
        case PathEvent::Mirror:
            return "mirror";
        case PathEvent::GlossyCoat:
            return "coat";
        case PathEvent::MirrorCoat:
            return "mirror coat";
        case PathEvent::DiffuseTransmission:
            return "diffuse transmission";
        case PathEvent::GlossyTransmission:
            return "transmission";
        case PathEvent::Refraction:
            return "refraction";
        case PathEvent::Volume:
            return "volume";
    }
    return "";
}

json turn_of(const integrator::PathTurn& turn) {
    json j{{"direction", triple(turn.wi)}, {"pdf", turn.pdf}, {"delta", turn.is_delta}};
    json lobes = json::object();
    for (const auto& [event, share] : turn.events)
        lobes[name_of(event)] = {share.x, share.y, share.z};
    if (lobes.empty()) lobes["straight"] = {1.0, 1.0, 1.0};
    j["lobes"] = std::move(lobes);
    return j;
}

json vertex_of(const PathVertex& v) {
    json j{{"from", v.from}, {"bounce", v.bounce}, {"prim", v.prim}};
    if (!v.material.empty()) {
        j["material"] = v.material;
        j["face"] = v.face;
        j["normal"] = triple(v.n);
    }
    j["position"] = triple(v.p);
    j["distance"] = v.distance;
    j["throughput"] = triple(v.beta);
    if (v.turn) j["scattering"] = turn_of(*v.turn);
    return j;
}

/// Where the light is, as far as it is anywhere.
Vec3d end_of(const SamplePaths& sample, const PathLight& light, double far) {
    const Vec3d from = light.vertex < 0 ? sample.origin : sample.vertices[size_t(light.vertex)].p;
    const auto distance = double(light.found->distance);
    return from + Vec3d(light.found->d) * (std::isfinite(distance) ? distance : far);
}

json light_of(const SamplePaths& sample, const PathLight& l) {
    json j{{"vertex", l.vertex}};
    j["found"] = l.what.empty() ? "light sampled, in shadow" : l.what;
    j["light"] = l.light;
    if (!l.what.empty()) {
        j["group"] = l.group;
        j["bounce"] = l.bounce;
    }
    if (l.found) {
        j["direction"] = triple(l.found->d);
        if (std::isfinite(l.found->distance)) j["position"] = triple(end_of(sample, l, 0.0));
        j["light_pdf"] = l.found->light_pdf;
        j["scatter_pdf"] = l.found->scatter_pdf;
        j["mis_weight"] = l.found->weight;
        j["unshadowed"] = triple(l.found->radiance);
    }
    j["contribution"] = triple(l.contribution);
    json layers = json::object();
    for (const PathLight::Layer& layer : l.layers) layers[layer.name] = layer.share;
    j["layers"] = std::move(layers);
    return j;
}

/// Polylines of a BasisCurves prim.
struct Lines {
    std::vector<int> counts, samples;
    std::vector<Vec3d> points;
    std::vector<Rgb> contributions;

    void add(uint64_t sample, const std::vector<Vec3d>& line, const Rgb& contribution) {
        counts.push_back(int(line.size()));
        samples.push_back(int(sample));
        points.insert(points.end(), line.begin(), line.end());
        contributions.push_back(contribution);
    }
};

/// One line for every end of a path, with what came by the vertices that no line before has.
void add_paths(const SamplePaths& sample, double reach, Lines& lines) {
    const auto& vertices = sample.vertices;
    std::vector<bool> is_drawn(vertices.size(), false);
    bool has_camera = false;
    for (const PathEnd& end : sample.ends) {
        std::vector<Vec3d> line;
        std::vector<int> own;
        for (int v = end.vertex; v >= 0; v = vertices[size_t(v)].from) {
            line.push_back(vertices[size_t(v)].p);
            if (!is_drawn[size_t(v)]) own.push_back(v);
            is_drawn[size_t(v)] = true;
        }
        if (!std::exchange(has_camera, true)) own.push_back(PathVertex::camera);
        line.push_back(sample.origin);
        std::reverse(line.begin(), line.end());
        Rgb sum(0.0f);
        for (const PathLight& light : sample.lights)
            if (std::find(own.begin(), own.end(), light.vertex) != own.end())
                sum += light.contribution;
        if (end.escape) line.push_back(line.back() + Vec3d(*end.escape) * reach);
        // A curve has two points
        if (line.size() == 1) line.push_back(line[0]);
        lines.add(sample.sample, line, sum);
    }
}

std::string point_list(const std::vector<Vec3d>& points) {
    std::string out;
    for (const Vec3d& p : points)
        out += fmt::format("{}({:.9g}, {:.9g}, {:.9g})", out.empty() ? "" : ", ", p.x, p.y, p.z);
    return out;
}

std::string color_list(const std::vector<Rgb>& colors, const std::function<Rgb(const Rgb&)>& map) {
    std::string out;
    for (const Rgb& color : colors) {
        const Rgb c = map(color);
        out += fmt::format("{}({:.9g}, {:.9g}, {:.9g})", out.empty() ? "" : ", ", c.x, c.y, c.z);
    }
    return out;
}

std::string curves_prim(const char* name, const Lines& lines, double width, float brightest) {
    // The third root: faint paths are to be seen beside bright ones
    const auto shown = [brightest](const Rgb& c) {
        Rgb out(0.03f, 0.03f, 0.06f);
        for (int i = 0; i < 3; ++i)
            if (brightest > 0.0f && std::isfinite(c[i]) && c[i] > 0.0f)
                out[i] = std::max(out[i], std::cbrt(c[i] / brightest));
        return out;
    };
    const auto same = [](const Rgb& c) { return c; };
    std::string out = fmt::format("    def BasisCurves \"{}\"\n    {{\n", name);
    out += "        uniform token type = \"linear\"\n";
    out += fmt::format("        int[] curveVertexCounts = [{}]\n", fmt::join(lines.counts, ", "));
    out += fmt::format("        point3f[] points = [{}]\n", point_list(lines.points));
    out += fmt::format(
        "        float[] widths = [{:.6g}] (\n            interpolation = \"constant\"\n        "
        ")\n",
        width);
    const auto primvar = [&](const char* type, const char* of, const std::string& values) {
        out += fmt::format(
            "        {}[] primvars:{} = [{}] (\n            interpolation = \"uniform\"\n        "
            ")\n",
            type, of, values);
    };
    primvar("color3f", "displayColor", color_list(lines.contributions, shown));
    primvar("color3f", "velatura:contribution", color_list(lines.contributions, same));
    primvar("int", "velatura:sample", fmt::format("{}", fmt::join(lines.samples, ", ")));
    return out + "    }\n";
}

float brightest_of(const Lines& lines) {
    float max = 0;
    for (const Rgb& c : lines.contributions)
        if (is_finite(c)) max = std::max(max, max_component(c));
    return max;
}

}  // namespace

std::string paths_as_json(const PixelPaths& paths, const PathsFileInfo& info) {
    json j{{"format", "velatura light paths 1"},
           {"scene", info.scene_name},
           {"frame", info.frame},
           {"pixel", {paths.x, paths.y}},
           {"samples", {paths.first, paths.end}},
           {"seed", info.seed},
           {"value", triple(paths.value)}};
    // A path is one line
    std::string text = utf8_text(j, 1);
    text.resize(text.size() - 2);  // the bracket at the end
    text += ",\n \"paths\": [";
    for (const SamplePaths& sample : paths.samples) {
        json s{{"sample", sample.sample},
               {"weight", sample.weight},
               {"radiance", triple(sample.radiance)}};
        if (!sample.skipped.empty()) s["skipped"] = sample.skipped;
        s["camera"] = {{"position", triple(sample.origin)},
                       {"direction", triple(sample.direction)},
                       {"time", sample.time}};
        json vertices = json::array(), lights = json::array();
        for (const PathVertex& v : sample.vertices) vertices.push_back(vertex_of(v));
        for (const PathLight& l : sample.lights) lights.push_back(light_of(sample, l));
        s["vertices"] = std::move(vertices);
        s["lights"] = std::move(lights);
        s["ends"] = json::array();
        for (const PathEnd& end : sample.ends)
            s["ends"].push_back({{"vertex", end.vertex}, {"why", end.why}});
        text += (&sample == &paths.samples.front() ? "\n" : ",\n") + utf8_text(s);
    }
    return text + "\n ]\n}\n";
}

std::string paths_as_usda(const PixelPaths& paths, const PathsFileInfo& info) {
    Lines all, lit, shadowed;
    for (const SamplePaths& sample : paths.samples) {
        add_paths(sample, info.reach, all);
        for (const PathLight& light : sample.lights) {
            if (!light.found) continue;
            const Vec3d from =
                light.vertex < 0 ? sample.origin : sample.vertices[size_t(light.vertex)].p;
            (light.what.empty() ? shadowed : lit)
                .add(sample.sample, {from, end_of(sample, light, info.reach)}, light.contribution);
        }
    }
    const double width = 1e-3 * info.reach;
    std::string out = fmt::format(
        "#usda 1.0\n(\n    defaultPrim = \"LightPaths\"\n    doc = \"Light paths of pixel ({}, "
        "{}), samples {} to {}\"\n    metersPerUnit = {}\n    upAxis = \"{}\"\n)\n\n",
        paths.x, paths.y, paths.first, paths.end, info.meters_per_unit, info.up_axis);
    out += "def Xform \"LightPaths\"\n{\n";
    out += fmt::format("    custom color3f velatura:value = ({:.9g}, {:.9g}, {:.9g})\n",
                       paths.value.x, paths.value.y, paths.value.z);
    const float brightest = std::max(brightest_of(all), brightest_of(lit));
    if (!all.counts.empty()) out += curves_prim("Paths", all, width, brightest);
    if (!lit.counts.empty()) out += curves_prim("Lights", lit, 0.5 * width, brightest);
    if (!shadowed.counts.empty()) out += curves_prim("Shadowed", shadowed, 0.25 * width, brightest);
    return out + "}\n";
}

}  // namespace velatura::app
