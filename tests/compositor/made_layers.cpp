// SPDX-License-Identifier: Apache-2.0
#include "compositor/made_layers.h"

#include <array>

namespace velatura::compositor {

namespace {

constexpr std::array<const char*, 3> rgb = {"R", "G", "B"};
constexpr image::Window window{0, 0, 37, 21};

void add_channel(image::Part& part, const std::string& name) {
    image::Channel channel =
        image::Channel::make(name, image::ChannelType::Float, window.pixel_count());
    auto& values = std::get<std::vector<float>>(channel.data);
    for (size_t i = 0; i < values.size(); ++i) values[i] = made_value(name, i);
    part.channels.push_back(std::move(channel));
}

}  // namespace

float made_value(const std::string& channel, size_t pixel) {
    uint64_t seed = pixel * 1000003u;
    for (const char c : channel) seed = seed * 131u + uint64_t(static_cast<unsigned char>(c));
    seed ^= seed >> 29;
    seed *= 0xbf58476d1ce4e5b9u;
    return float((seed >> 40) & 0xffffu) / 65536.0f;
}

image::Image made_layers() {
    image::Image image;
    image.data = image.display = window;
    layers::ResolvedLayers resolved;
    image::Part rgba, matrix, others;
    rgba.name = "rgba";
    matrix.name = "matrix";
    others.name = "others";
    const auto add = [&](image::Part& part, const std::string& name, const char* family,
                         const std::string& bounce, const std::string& group,
                         const std::string& of) {
        accumulate::LayerEntry& e = resolved.layers.emplace_back();
        e.name = name;
        e.family = family;
        e.part = part.name;
        e.bounce = bounce;
        e.group = group;
        e.of = of;
        e.type = "float";
        e.in_sum = e.family == "matrix";
        for (const char* c : rgb) add_channel(part, name + "." + c);
    };
    resolved.layers.emplace_back().name = "rgba";
    resolved.layers[0].family = "beauty";
    resolved.layers[0].part = "rgba";
    resolved.layers[0].type = "float";
    layers::FamilyClosure closure;
    closure.family = "matrix";
    closure.is_exact = true;
    accumulate::LayerSet set;
    for (const char* group : {"key", "fill"}) {
        set.groups.push_back({group, {}, false});
        for (const char* bounce : {"b0", "b1", "tail"}) {
            const std::string name = std::string(bounce) + "_" + group;
            // Black as rendered: the clamp took all of it
            if (name == "b0_fill") {
                accumulate::LayerEntry& e = resolved.layers.emplace_back();
                e.name = name;
                e.family = "matrix";
                e.bounce = bounce;
                e.group = group;
                e.type = "float";
                e.is_empty = true;
            } else {
                add(matrix, name, "matrix", bounce, group, "");
                closure.order.push_back(name);
            }
            const bool is_clamped = name == "b0_fill" || name == "tail_key" || name == "tail_fill";
            if (is_clamped) add(others, "clamp_" + name, "clamp", bounce, group, name);
        }
        const std::string shadow = std::string("S_") + group;
        add(others, shadow, "shadow", "", group, "");
        for (const char* caster : {"tree", "rest"}) {
            add(others, shadow + "_" + caster, "caster", "", group, "");
            resolved.layers.back().caster = caster;
        }
    }
    for (const char* c : rgb) {
        image::Channel beauty =
            image::Channel::make(c, image::ChannelType::Float, window.pixel_count());
        auto& values = std::get<std::vector<float>>(beauty.data);
        for (const std::string& layer : closure.order) {
            for (size_t i = 0; i < values.size(); ++i) values[i] += made_value(layer + "." + c, i);
        }
        rgba.channels.push_back(std::move(beauty));
    }
    add_channel(rgba, "A");
    resolved.closure.push_back(std::move(closure));
    image.parts = {std::move(rgba), std::move(matrix), std::move(others)};
    layers::FileInfo info;
    info.display = window;
    layers::write_layer_header(image, resolved, set, {}, info);
    return image;
}

void take_out(image::Image& image, const std::vector<std::string>& layers) {
    std::string header = image.text(layers::layers_attribute),
                closure = image.text(layers::closure_attribute);
    for (const std::string& layer : layers) {
        const std::string name = "\"name\":\"" + layer + "\",";
        header.insert(header.find(name) + name.size(), "\"empty\":true,");
        for (const std::string& in_order :
             {"\"" + layer + "\",", ",\"" + layer + "\"", "\"" + layer + "\""}) {
            const size_t at = closure.find(in_order);
            if (at == std::string::npos) continue;
            closure.erase(at, in_order.size());
            break;
        }
        for (image::Part& part : image.parts) {
            std::erase_if(part.channels,
                          [&](const image::Channel& c) { return c.name.starts_with(layer + "."); });
        }
    }
    image.attributes[layers::layers_attribute] = header;
    image.attributes[layers::closure_attribute] = closure;
    std::erase_if(image.parts, [](const image::Part& p) { return p.channels.empty(); });
}

image::Image made_foreign(
    const std::vector<std::pair<std::string, std::vector<std::string>>>& parts) {
    image::Image image;
    image.data = image.display = window;
    for (const auto& [name, channels] : parts) {
        image::Part& part = image.parts.emplace_back();
        part.name = name;
        for (const std::string& channel : channels) add_channel(part, channel);
    }
    return image;
}

}  // namespace velatura::compositor
