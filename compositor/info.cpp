// SPDX-License-Identifier: Apache-2.0
#include "compositor/info.h"

#include "image/digest.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace velatura::compositor {

namespace {

/// Sum of the luminance (linear Rec.709) of a layer.
double energy(const LayerStack& stack, const std::string& layer) {
    constexpr double weights[] = {0.2126, 0.7152, 0.0722};
    double sum = 0;
    for (size_t c = 0; c < 3; ++c) {
        const image::Channel* channel = stack.channel(layer, c);
        if (!channel) continue;
        double channel_sum = 0;
        for (size_t i = 0; i < channel->size(); ++i) channel_sum += double(channel->value(i));
        sum += weights[c] * channel_sum;
    }
    return sum;
}

double share_of(const LayerStack& stack, const std::string& layer, double whole) {
    return whole == 0.0 ? 0.0 : energy(stack, layer) / whole;
}

bool has_share(const image::LayerEntry& e) {
    return e.family == "matrix" || e.family == "bounces" || e.family == "groups" ||
           e.family == "shadow";
}

}  // namespace

std::string info_text(const LayerStack& stack) {
    const image::Image& image = stack.image();
    const image::LayerHeader& header = stack.header();
    const image::SampleInfo& s = header.samples;
    std::string text =
        fmt::format("picture    {}×{}", image.display.width(), image.display.height());
    if (image.data != image.display) {
        text += fmt::format(", pixels {}:{} × {}:{}", image.data.x0, image.data.x1, image.data.y0,
                            image.data.y1);
    }
    text += fmt::format("\nsamples    {}:{}{}, seed {}, {} invalid\n", s.first, s.end,
                        s.is_uniform ? "" : " (not the same in every pixel)", s.seed, s.invalid);
    for (const auto& b : s.bad)
        text += fmt::format("  bad      --replay {},{},{} ({})\n", b.x, b.y, b.sample, b.reason);
    for (const image::FamilyClosure& c : header.closure) {
        text += fmt::format(
            "closure    {}: {} layers, {}; {:.3f} of the bound to the unrounded sums\n", c.family,
            c.order.size(), c.is_exact ? "beauty is their fold bit for bit" : "within rounding",
            c.measured);
    }
    if (header.closure.empty()) text += "closure    no light layers stored\n";
    if (const auto columns = stack.column_names(); !columns.empty()) {
        text += fmt::format("bounces    {}\n", fmt::join(columns, " "));
    }
    for (const image::LightGroup& g : header.lights) {
        text += fmt::format("group      {:<21} {}{}\n", g.name, g.is_dome ? "dome " : "",
                            fmt::join(g.prims, " "));
    }
    const double whole = energy(stack, "rgba");
    for (const image::LayerEntry& e : header.layers) {
        text += fmt::format("layer      {:<24} {:<11} {:<6}", e.name, e.family,
                            e.is_empty ? "black" : e.type);
        if (has_share(e)) text += fmt::format(" {:6.2f} %", 100.0 * share_of(stack, e.name, whole));
        if (!e.lpe.empty()) text += "  " + e.lpe;
        text += "\n";
    }
    return text;
}

std::string info_json(const LayerStack& stack) {
    const image::Image& image = stack.image();
    const image::LayerHeader& header = stack.header();
    nlohmann::ordered_json j;
    j["schema"] = "velatura.info/1";
    j["resolution"] = {image.display.width(), image.display.height()};
    j["dataWindow"] = {image.data.x0, image.data.x1, image.data.y0, image.data.y1};
    j["sha256"] = image::digest_of(image);
    j["samples"] =
        nlohmann::ordered_json::parse(image.text(image::samples_attribute), nullptr, false);
    j["closure"] =
        nlohmann::ordered_json::parse(image.text(image::closure_attribute), nullptr, false);
    j["lights"] =
        nlohmann::ordered_json::parse(image.text(image::lights_attribute), nullptr, false);
    j["bounces"] = stack.column_names();
    j["layers"] = nlohmann::ordered_json::array();
    const double whole = energy(stack, "rgba");
    for (const image::LayerEntry& e : header.layers) {
        nlohmann::ordered_json l;
        l["name"] = e.name;
        l["family"] = e.family;
        l["type"] = e.type;
        l["empty"] = e.is_empty;
        l["inSum"] = e.in_sum;
        if (has_share(e)) l["energyShare"] = share_of(stack, e.name, whole);
        j["layers"].push_back(std::move(l));
    }
    return j.dump(2) + "\n";
}

}  // namespace velatura::compositor
