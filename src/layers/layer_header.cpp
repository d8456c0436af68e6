// SPDX-License-Identifier: Apache-2.0
#include "layers/layer_header.h"

#include "base/json_numbers.h"
#include "layers/cryptomatte.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <utility>

namespace velatura::layers {

namespace {

using Json = nlohmann::ordered_json;

Json closure_json(const std::vector<FamilyClosure>& closure) {
    Json j;
    j["schema"] = "velatura.closure/1";
    j["rule"] =
        "R, G, B of the beauty = fold in float, in this order, of the stored layers of the exact "
        "family";
    j["bound"] =
        "|fold - independent beauty| <= relative * sum |layer| + absolute, per pixel and channel";
    j["families"] = Json::array();
    for (const FamilyClosure& c : closure) {
        Json f;
        f["family"] = c.family;
        f["exact"] = c.is_exact;
        f["relative"] = c.relative;
        f["absolute"] = c.absolute;
        f["measured"] = c.measured;
        f["measuredAbsolute"] = c.measured_absolute;
        f["order"] = c.order;
        j["families"].push_back(std::move(f));
    }
    return j;
}

Json layers_json(const std::vector<accumulate::LayerEntry>& layers) {
    Json j = Json::array();
    for (const accumulate::LayerEntry& e : layers) {
        Json l;
        l["name"] = e.name;
        l["family"] = e.family;
        l["part"] = e.part;
        if (!e.lpe.empty()) l["lpe"] = e.lpe;
        if (!e.bounce.empty()) l["bounce"] = e.bounce;
        if (!e.group.empty()) l["group"] = e.group;
        if (!e.lobe.empty()) l["lobe"] = e.lobe;
        if (!e.caster.empty()) l["caster"] = e.caster;
        if (!e.of.empty()) l["of"] = e.of;
        if (!e.source.empty()) l["source"] = e.source;
        if (!e.filter.empty()) l["filter"] = e.filter;
        l["type"] = e.type;
        l["inSum"] = e.in_sum;
        if (e.is_empty) l["empty"] = true;
        if (!e.digest.empty()) l["sha256"] = e.digest;
        j.push_back(std::move(l));
    }
    return j;
}

Json casters_json(const accumulate::LayerSet& set) {
    Json j = Json::object();
    for (const accumulate::ShadowCaster& c : set.casters) j[c.name] = {{"prim", c.prim}};
    return j;
}

Json values_json(const LightValues& v) {
    Json j;
    j["type"] = v.type;
    j["intensity"] = v.intensity;
    j["exposure"] = v.exposure;
    j["color"] = v.color;
    j["enableColorTemperature"] = v.uses_color_temperature;
    j["colorTemperature"] = v.color_temperature;
    if (!v.varying.empty()) j["varying"] = v.varying;
    if (!v.connected.empty()) j["connected"] = v.connected;
    if (v.has_color_space) j["hasColorSpace"] = true;
    if (v.is_in_instance) j["inInstance"] = true;
    if (v.shows_material) j["showsMaterial"] = true;
    return j;
}

void parse_values(const Json& j, const std::string& path, std::vector<LightValues>& values) {
    LightValues v;
    v.path = path;
    v.type = j.at("type").get<std::string>();
    v.intensity = j.at("intensity").get<double>();
    v.exposure = j.at("exposure").get<double>();
    v.color = j.at("color").get<std::array<double, 3>>();
    v.uses_color_temperature = j.at("enableColorTemperature").get<bool>();
    v.color_temperature = j.at("colorTemperature").get<double>();
    v.varying = j.value("varying", std::vector<std::string>());
    v.connected = j.value("connected", std::vector<std::string>());
    v.has_color_space = j.value("hasColorSpace", false);
    v.is_in_instance = j.value("inInstance", false);
    v.shows_material = j.value("showsMaterial", false);
    values.push_back(std::move(v));
}

Json lights_json(const accumulate::LayerSet& set, const std::vector<LightValues>& values) {
    Json j = Json::object();
    for (const accumulate::LightGroup& g : set.groups) {
        Json light;
        light["prims"] = g.prims;
        light["dome"] = g.is_dome;
        for (const LightValues& v : values) {
            if (std::find(g.prims.begin(), g.prims.end(), v.path) != g.prims.end())
                light["values"][v.path] = values_json(v);
        }
        j[g.name] = std::move(light);
    }
    return j;
}

Json samples_json(const SampleInfo& s) {
    Json j;
    j["schema"] = "velatura.samples/1";
    // As text: JSON numbers lose bits above 2^53 in many readers
    j["seed"] = std::to_string(s.seed);
    j["ranges"] = Json::array({Json::array({s.first, s.end})});
    j["uniform"] = s.is_uniform;
    j["invalid"] = s.invalid;
    j["sceneHash"] = s.scene_hash;
    j["settingsHash"] = s.settings_hash;
    j["bad"] = Json::array();
    for (const BadSample& b : s.bad) {
        Json bad;
        bad["x"] = b.x;
        bad["y"] = b.y;
        bad["sample"] = b.sample;
        bad["reason"] = b.reason;
        j["bad"].push_back(std::move(bad));
    }
    return j;
}

void parse_layers(const Json& j, LayerHeader& header) {
    for (const Json& l : j) {
        accumulate::LayerEntry e;
        e.name = l.at("name").get<std::string>();
        e.family = l.at("family").get<std::string>();
        e.part = l.at("part").get<std::string>();
        e.lpe = l.value("lpe", "");
        e.bounce = l.value("bounce", "");
        e.group = l.value("group", "");
        e.lobe = l.value("lobe", "");
        e.caster = l.value("caster", "");
        e.of = l.value("of", "");
        e.source = l.value("source", "");
        e.filter = l.value("filter", "");
        e.type = l.at("type").get<std::string>();
        e.in_sum = l.at("inSum").get<bool>();
        e.is_empty = l.value("empty", false);
        e.digest = l.value("sha256", "");
        header.layers.push_back(std::move(e));
    }
}

void parse_closure(const Json& j, LayerHeader& header) {
    for (const Json& f : j.at("families")) {
        FamilyClosure c;
        c.family = f.at("family").get<std::string>();
        c.is_exact = f.at("exact").get<bool>();
        c.relative = f.at("relative").get<double>();
        c.absolute = f.at("absolute").get<double>();
        c.measured = f.at("measured").get<double>();
        c.measured_absolute = f.at("measuredAbsolute").get<double>();
        c.order = f.at("order").get<std::vector<std::string>>();
        header.closure.push_back(std::move(c));
    }
}

void parse_samples(const Json& j, SampleInfo& s) {
    s.seed = std::stoull(j.at("seed").get<std::string>());
    s.first = whole_number<uint64_t>(j.at("ranges").at(0).at(0));
    s.end = whole_number<uint64_t>(j.at("ranges").at(0).at(1));
    s.is_uniform = j.at("uniform").get<bool>();
    s.invalid = whole_number<uint64_t>(j.at("invalid"));
    s.scene_hash = j.at("sceneHash").get<std::string>();
    s.settings_hash = j.at("settingsHash").get<std::string>();
    for (const Json& b : j.at("bad")) {
        s.bad.push_back({whole_number<int>(b.at("x")), whole_number<int>(b.at("y")),
                         whole_number<uint64_t>(b.at("sample")),
                         b.at("reason").get<std::string>()});
    }
}

/// Names of other programs' files may be no UTF-8.
std::string text_of(const Json& j) {
    return j.dump(-1, ' ', false, Json::error_handler_t::replace);
}

template <class T>
T attribute_or(const image::Image& image, const char* name, const T& fallback) {
    const auto at = image.attributes.find(name);
    const T* value = at == image.attributes.end() ? nullptr : std::get_if<T>(&at->second);
    return value ? *value : fallback;
}

}  // namespace

const accumulate::LayerEntry* LayerHeader::find(const std::string& name) const {
    const auto at = std::find_if(layers.begin(), layers.end(),
                                 [&](const accumulate::LayerEntry& e) { return e.name == name; });
    return at == layers.end() ? nullptr : &*at;
}

const FamilyClosure* LayerHeader::find_family(const std::string& name) const {
    const auto at = std::find_if(closure.begin(), closure.end(),
                                 [&](const FamilyClosure& c) { return c.family == name; });
    return at == closure.end() ? nullptr : &*at;
}

SampleInfo sample_info(const accumulate::SampleSums& sums, const FileInfo& info) {
    SampleInfo s;
    s.seed = info.seed;
    s.scene_hash = info.scene_hash;
    s.settings_hash = info.settings_hash;
    s.bad = info.bad_samples;
    const image::Window& w = sums.window();
    const accumulate::PixelRecord& corner = sums.record(w.x0, w.y0);
    s.first = corner.first;
    s.end = corner.end;
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const accumulate::PixelRecord& r = sums.record(x, y);
            s.invalid += r.invalid;
            if (r.first != corner.first || r.end != corner.end) s.is_uniform = false;
            s.first = std::min(s.first, r.first);
            s.end = std::max(s.end, r.end);
        }
    }
    return s;
}

void write_layer_header(image::Image& image,
                        const ResolvedLayers& resolved,
                        const accumulate::LayerSet& set,
                        const SampleInfo& samples,
                        const FileInfo& info) {
    if (!info.display.is_empty()) image.display = info.display;
    image.pixel_aspect_ratio = float(info.pixel_aspect_ratio);
    image::Attributes& a = image.attributes;
    if (info.carried) {
        for (const auto& [name, attribute] : *info.carried) a[name] = attribute;
    } else {
        a["software"] = info.software;
        a["framesPerSecond"] = info.frames_per_second;
        a["chromaticities"] = info.chromaticities;
        a["colorInteropID"] = info.color_space;
        a["worldToCamera"] = info.world_to_camera;
        a["worldToNDC"] = info.world_to_ndc;
    }
    a[closure_attribute] = text_of(closure_json(resolved.closure));
    a[layers_attribute] = text_of(layers_json(resolved.layers));
    a[lights_attribute] = text_of(lights_json(set, info.light_values));
    if (set.caster_layers) a[casters_attribute] = text_of(casters_json(set));
    a[samples_attribute] = text_of(samples_json(samples));
    for (const auto& [name, text] : {std::pair{scene_attribute, &info.scene_json},
                                     {stats_attribute, &info.stats_json},
                                     {plan_attribute, &info.plan_json},
                                     {settings_attribute, &info.settings_json}}) {
        if (!text->empty()) a[name] = *text;
    }
}

image::Attributes carried_attributes(const image::Attributes& attributes) {
    image::Attributes carried;
    for (const auto& [name, attribute] : attributes) {
        const auto* other = std::get_if<image::OtherAttribute>(&attribute);
        const bool is_of_pixels =
            other && (other->type == "preview" || other->type == "idmanifest");
        const bool is_of_views = name == "view" || name == "multiView";
        if (!name.starts_with("velatura/") && !name.starts_with("cryptomatte/") && !is_of_pixels &&
            !is_of_views)
            carried[name] = attribute;
    }
    return carried;
}

Result<LayerHeader> read_layer_header(const image::Image& image) {
    if (image.text(layers_attribute).empty() || image.text(closure_attribute).empty()) {
        return Error{"not-layers",
                     "the file has no light layers of Velatura (velatura/layers is missing)"};
    }
    LayerHeader header;
    const char* at = layers_attribute;
    try {
        parse_layers(Json::parse(image.text(at)), header);
        at = closure_attribute;
        parse_closure(Json::parse(image.text(at)), header);
        at = samples_attribute;
        parse_samples(Json::parse(image.text(at)), header.samples);
        at = lights_attribute;
        const Json lights = Json::parse(image.text(at));
        for (const auto& [name, light] : lights.items()) {
            header.lights.push_back({name, light.at("prims").get<std::vector<std::string>>(),
                                     light.at("dome").get<bool>()});
            if (!light.contains("values")) continue;
            for (const auto& [path, values] : light["values"].items())
                parse_values(values, path, header.light_values);
        }
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        return Error{"layers-damaged",
                     fmt::format("the header string {} is damaged: {}", at, e.what())};
    }
    return header;
}

DifferentLayers different_layers(const std::string& scene_json_a, const std::string& scene_json_b) {
    const auto names = [](const std::string& text) {
        std::vector<std::string> all;
        const auto j = nlohmann::json::parse(text, nullptr, false);
        if (!j.is_object() || !j.contains("layers") || !j["layers"].is_array()) return all;
        for (const auto& name : j["layers"])
            if (name.is_string()) all.push_back(name.get<std::string>());
        return all;
    };
    const std::vector<std::string> a = names(scene_json_a), b = names(scene_json_b);
    const auto only = [](const std::vector<std::string>& these, std::vector<std::string> others) {
        std::vector<std::string> found;
        for (const std::string& name : these) {
            const auto at = std::find(others.begin(), others.end(), name);
            if (at == others.end())
                found.push_back(name);
            else
                others.erase(at);
        }
        return fmt::format("{}", fmt::join(found, ", "));
    };
    DifferentLayers different{only(a, b), only(b, a)};
    if (different.a.empty() && different.b.empty()) return different;
    if (different.a.empty()) different.a = "nothing";
    if (different.b.empty()) different.b = "nothing";
    return different;
}

FileInfo file_info_of(const image::Image& image, const LayerHeader& header) {
    FileInfo info;
    info.display = image.display;
    info.seed = header.samples.seed;
    info.scene_hash = header.samples.scene_hash;
    info.settings_hash = header.samples.settings_hash;
    info.bad_samples = header.samples.bad;
    info.light_values = header.light_values;
    info.scene_json = image.text(scene_attribute);
    info.stats_json = image.text(stats_attribute);
    info.plan_json = image.text(plan_attribute);
    info.settings_json = image.text(settings_attribute);
    info.software = image.text("software");
    for (const Cryptomatte& matte : cryptomattes_of(image)) {
        for (const accumulate::MatteKind kind : accumulate::matte_kinds) {
            if (matte.layer != accumulate::matte_layer(kind)) continue;
            for (const MatteName& n : matte.names) info.matte_names[size_t(kind)].push_back(n.name);
        }
    }
    info.frames_per_second = attribute_or<double>(image, "framesPerSecond", info.frames_per_second);
    info.pixel_aspect_ratio = double(image.pixel_aspect_ratio);
    info.carried = carried_attributes(image.attributes);
    info.world_to_camera =
        attribute_or<image::Matrix44>(image, "worldToCamera", info.world_to_camera);
    info.world_to_ndc = attribute_or<image::Matrix44>(image, "worldToNDC", info.world_to_ndc);
    info.chromaticities =
        attribute_or<image::Chromaticities>(image, "chromaticities", info.chromaticities);
    return info;
}

}  // namespace velatura::layers
