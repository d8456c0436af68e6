// SPDX-License-Identifier: Apache-2.0
#include "compositor/inspect/info.h"

#include "compositor/io/row_values.h"
#include "compositor/look/stack_color.h"
#include "image/digest.h"
#include "layers/cryptomatte.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace velatura::compositor::inspect {

namespace {

/// Sum of the luminance (linear Rec.709) of a layer, and of what it is made from; values that are
/// not finite count as 0.
struct Energy {
    double sum = 0, absolute = 0;
};

Energy energy(const LayerStack& stack, const std::string& layer) {
    constexpr double weights[] = {0.2126, 0.7152, 0.0722};
    Energy energy;
    for (size_t c = 0; c < 3; ++c) {
        const image::Channel* channel = stack.channel(layer, c);
        if (!channel) continue;
        Energy of_channel;
        image::for_each_value(*channel, [&](size_t, float v) {
            if (!std::isfinite(v)) return;
            of_channel.sum += double(v);
            of_channel.absolute += std::abs(double(v));
        });
        energy.sum += weights[c] * of_channel.sum;
        energy.absolute += weights[c] * of_channel.absolute;
    }
    return energy;
}

/// Of the beauty, or of the rows whose sum it is.
Energy whole_energy(const LayerStack& stack) {
    if (stack.has_beauty()) return energy(stack, "rgba");
    Energy whole;
    for (const accumulate::LayerEntry& e : stack.header().layers) {
        if (e.family != "plain") continue;
        const Energy row = energy(stack, e.name);
        whole.sum += row.sum;
        whole.absolute += row.absolute;
    }
    return whole;
}

using Json = nlohmann::ordered_json;

/// None where the whole is nothing, or what is left where light and its negative cancel.
std::optional<double> share_of(const LayerStack& stack,
                               const std::string& layer,
                               const Energy& whole) {
    constexpr double rounding = 1e-6;
    const Energy part = energy(stack, layer);
    if (std::abs(whole.sum) <= rounding * std::max(whole.absolute, part.absolute))
        return std::nullopt;
    return part.sum / whole.sum;
}

/// Values of a layer that are not finite.
size_t not_finite_of(const LayerStack& stack, const accumulate::LayerEntry& layer) {
    std::vector<const image::Channel*> channels;
    for (size_t c = 0; c < 4 && layer.family != "data"; ++c) {
        if (const image::Channel* channel = stack.channel(layer.name, c))
            channels.push_back(channel);
    }
    if (layer.family == "data") {
        for (const layers::ChannelRef& at : stack.data_channels(layer.name))
            channels.push_back(&stack.image().parts[at.part].channels[at.channel]);
    }
    size_t count = 0;
    for (const image::Channel* channel : channels)
        count += find_not_finite({channel->type(), channel->bytes()}, 0, channel->size()).count;
    return count;
}

std::string color_text(const LayerStack& stack) {
    const auto color = color_of_stack(stack, {});
    if (!color) return fmt::format("color      unknown: {}\n", color.error().message);
    std::string text = fmt::format("color      {} ({})\n", color->label, color->reason);
    for (const std::string& warning : color->warnings)
        text += fmt::format("  warning  {}\n", warning);
    return text;
}

/// Cryptomattes with their names.
std::string mattes_text(const LayerStack& stack) {
    std::string text;
    for (const layers::Cryptomatte& m : layers::cryptomattes_of(stack.image(), stack.path())) {
        text += fmt::format("matte      {} {} names\n", m.layer, m.names.size());
        if (!m.fault.empty()) text += fmt::format("  warning  its manifest: {}\n", m.fault);
        for (const layers::MatteName& n : m.names)
            text += fmt::format("  {:08x} {}\n", n.id, n.name);
    }
    return text;
}

bool has_share(const accumulate::LayerEntry& e) {
    constexpr std::array families = {"lobe-matrix", "matrix", "bounces", "groups",
                                     "shadow",      "caster", "clamp",   "plain"};
    return std::find(families.begin(), families.end(), e.family) != families.end();
}

/// Programs that stop working (Nuke has 1023 channels per script) are near.
constexpr size_t many_channels = 900;

struct Stored {
    size_t channels = 0, bytes = 0;  ///< without compression
};

Stored stored(const image::Image& image) {
    Stored sum;
    for (const image::Part& part : image.parts) {
        sum.channels += part.channels.size();
        for (const image::Channel& c : part.channels) sum.bytes += c.byte_count();
    }
    return sum;
}

/// Null where there is none, or none that can be read: files of others.
Json json_of(const image::Image& image, const char* attribute) {
    Json j = Json::parse(image.text(attribute), nullptr, false);
    return j.is_discarded() ? Json() : j;
}

Json parsed(const image::Image& image, const char* attribute) {
    const Json j = Json::parse(image.text(attribute), nullptr, false);
    return j.is_object() ? j : Json::object();
}

/// A value of JSON without quotes.
std::string text_of(const Json& value) {
    return value.is_string() ? value.get<std::string>() : value.dump();
}

/// Effects of the plan that were on.
std::vector<std::string> effects_of(const Json& plan) {
    std::vector<std::string> names;
    for (const Json& effect : plan.value("effects", Json::array())) {
        if (effect.is_object() && effect.value("state", "") == "on")
            names.push_back(effect.value("name", "?"));
    }
    return names;
}

/// "indirect 2, direct 10": a value of a setting, which can be several.
std::string setting_value(const Json& value) {
    if (!value.is_object()) return text_of(value);
    std::string text;
    for (const auto& [key, part] : value.items())
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", key, text_of(part));
    return text;
}

/// An entry of the statistics' ledger: "max-depth 4: about 2 % of all light is missing".
std::string setting_text(const Json& entry) {
    if (!entry.is_object()) return text_of(entry);
    std::string text = text_of(entry.value("approximation", Json("?")));
    if (entry.contains("value")) text += " " + setting_value(entry["value"]);
    if (entry.value("kind", Json()) == "consistent") text += " (consistent)";
    if (entry.contains("effect")) return text + ": " + text_of(entry["effect"]);
    for (const auto& [key, value] : entry.items())
        if (key != "approximation" && key != "value" && key != "kind")
            text += fmt::format("; {} {}", key, text_of(value));
    return text;
}

/// Who rendered what with what: program, scene, estimator, effects, and every approximation.
std::string origin_text(const image::Image& image) {
    std::string text;
    if (const std::string software = image.text("software"); !software.empty())
        text += fmt::format("software   {}\n", software);
    const Json scene = parsed(image, layers::scene_attribute);
    if (!scene.empty()) {
        text += "scene     ";
        for (const char* key : {"name", "frame", "camera", "hash"}) {
            if (scene.contains(key)) text += fmt::format(" {}", text_of(scene[key]));
        }
        text += "\n";
    }
    const Json stats = parsed(image, layers::stats_attribute);
    const Json estimator = stats.value("estimator", Json::object());
    if (!estimator.empty()) {
        text += "estimator ";
        for (const auto& [key, value] : estimator.items())
            text += fmt::format(" {}={}", key, text_of(value));
        text += "\n";
    }
    if (const auto effects = effects_of(parsed(image, layers::plan_attribute)); !effects.empty())
        text += fmt::format("effects    {}\n", fmt::join(effects, " "));
    if (!stats.contains("ledger")) return text;
    if (stats["ledger"].empty()) text += "biased settings: none\n";
    for (const Json& entry : stats["ledger"])
        text += fmt::format("biased setting: {}\n", setting_text(entry));
    return text;
}

}  // namespace

std::string info_text(const LayerStack& stack) {
    const image::Image& image = stack.image();
    const layers::LayerHeader& header = stack.header();
    const layers::SampleInfo& s = header.samples;
    std::string text =
        fmt::format("image      {}×{}", image.display.width(), image.display.height());
    if (image.data != image.display) {
        text += fmt::format(", pixels {}:{} × {}:{}", image.data.x0, image.data.x1, image.data.y0,
                            image.data.y1);
    }
    text += "\n";
    const Stored whole_file = stored(image);
    text += fmt::format("stored     {} channels, {:.1f} MB without compression\n",
                        whole_file.channels, double(whole_file.bytes) / 1e6);
    if (whole_file.channels > many_channels)
        text += fmt::format(
            "  warning  more than {} channels: above 1023, the maximum of Nuke and others\n",
            many_channels);
    text += color_text(stack);
    text += origin_text(image);
    if (stack.is_plain()) text += "plain      no Velatura header: color layers are rows\n";
    if (!stack.views().empty())
        text += fmt::format("views      {} (this is {})\n", fmt::join(stack.views(), " "),
                            stack.view());
    for (const std::string& note : stack.notes()) text += fmt::format("  warning  {}\n", note);
    if (!stack.is_plain()) {
        text +=
            fmt::format("samples    {}:{}{}, seed {}, {} invalid\n", s.first, s.end,
                        s.is_uniform ? "" : " (not the same in every pixel)", s.seed, s.invalid);
    }
    for (const auto& b : s.bad)
        text += fmt::format("  bad      --replay {},{},{} ({})\n", b.x, b.y, b.sample, b.reason);
    for (const layers::FamilyClosure& c : header.closure) {
        text += fmt::format(
            "closure    {}: {} AOVs sum to the beauty {}; {:.3f} of the rounding bound\n", c.family,
            c.order.size(), c.is_exact ? "bit for bit" : "within rounding", c.measured);
    }
    if (header.closure.empty() && !stack.is_plain()) text += "closure    no light layers stored\n";
    if (const auto columns = stack.column_names(); !columns.empty()) {
        text += fmt::format("bounces    {}\n", fmt::join(columns, " "));
    }
    for (const accumulate::LightGroup& g : header.lights) {
        text += fmt::format("group      {:<21} {}{}\n", g.name, g.is_dome ? "dome " : "",
                            fmt::join(g.prims, " "));
    }
    const Energy whole = whole_energy(stack);
    for (const accumulate::LayerEntry& e : header.layers) {
        text += fmt::format("layer      {:<24} {:<11} {:<6}", e.name, e.family,
                            e.is_empty ? "black" : e.type);
        if (has_share(e)) {
            const auto share = share_of(stack, e.name, whole);
            text += share ? fmt::format(" {:6.2f} %", 100.0 * *share) : std::string("      – %");
        }
        if (!e.lpe.empty()) text += "  " + e.lpe;
        text += "\n";
        if (const size_t bad = not_finite_of(stack, e); bad > 0)
            text += fmt::format("  warning  {} values of {} are not finite\n", bad, e.name);
    }
    return text + mattes_text(stack);
}

std::string info_json(const LayerStack& stack) {
    const image::Image& image = stack.image();
    const layers::LayerHeader& header = stack.header();
    nlohmann::ordered_json j;
    j["schema"] = "velatura.info/1";
    j["resolution"] = {image.display.width(), image.display.height()};
    j["dataWindow"] = {image.data.x0, image.data.x1, image.data.y0, image.data.y1};
    j["sha256"] = image::digest_of(image);
    const Stored whole_file = stored(image);
    j["channels"] = whole_file.channels;
    j["bytes"] = whole_file.bytes;
    j["manyChannels"] = whole_file.channels > many_channels;
    j["plain"] = stack.is_plain();
    j["views"] = stack.views();
    j["view"] = stack.view();
    j["notes"] = stack.notes();
    j["software"] = image.text("software");
    j["scene"] = parsed(image, layers::scene_attribute);
    const Json stats = parsed(image, layers::stats_attribute);
    j["estimator"] = stats.value("estimator", Json::object());
    j["ledger"] = stats.value("ledger", Json::array());
    j["effects"] = effects_of(parsed(image, layers::plan_attribute));
    j["samples"] = json_of(image, layers::samples_attribute);
    j["closure"] = json_of(image, layers::closure_attribute);
    j["lights"] = json_of(image, layers::lights_attribute);
    j["bounces"] = stack.column_names();
    j["layers"] = nlohmann::ordered_json::array();
    if (const auto color = color_of_stack(stack, {})) {
        j["color"] = {
            {"space", color->label}, {"from", color->reason}, {"warnings", color->warnings}};
    }
    j["mattes"] = nlohmann::ordered_json::array();
    for (const layers::Cryptomatte& m : layers::cryptomattes_of(image, stack.path())) {
        nlohmann::ordered_json matte = {{"name", m.layer}, {"fault", m.fault}};
        matte["names"] = nlohmann::ordered_json::object();
        for (const layers::MatteName& n : m.names)
            matte["names"][n.name] = fmt::format("{:08x}", n.id);
        j["mattes"].push_back(std::move(matte));
    }
    const Energy whole = whole_energy(stack);
    for (const accumulate::LayerEntry& e : header.layers) {
        nlohmann::ordered_json l;
        l["name"] = e.name;
        l["family"] = e.family;
        l["type"] = e.type;
        l["empty"] = e.is_empty;
        l["inSum"] = e.in_sum;
        if (const auto share = has_share(e) ? share_of(stack, e.name, whole) : std::nullopt)
            l["energyShare"] = *share;
        if (const size_t bad = not_finite_of(stack, e); bad > 0) l["notFinite"] = bad;
        j["layers"].push_back(std::move(l));
    }
    return j.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

namespace {

/// Share of the image that each name of a Cryptomatte covers, and each id without a name, as 8
/// digits in base 16; of the largest first.
std::vector<std::pair<std::string, double>> shares_of(const image::Image& image,
                                                      const layers::Cryptomatte& matte) {
    std::map<uint32_t, double> covered;
    size_t pixels = 0;
    if (const auto ranks = layers::matte_ranks(image, matte.layer)) {
        for (const layers::MatteRank& rank : *ranks) {
            pixels = rank.ids->size();
            for (size_t i = 0; i < pixels; ++i)
                if (const float id = (*rank.ids)[i]; id != 0.0f && (*rank.coverage)[i] > 0.0f)
                    covered[std::bit_cast<uint32_t>(id)] += double((*rank.coverage)[i]);
        }
    }
    std::vector<std::pair<std::string, double>> shares;
    for (const layers::MatteName& name : matte.names) {
        const auto at = covered.find(name.id);
        shares.emplace_back(name.name, at == covered.end() ? 0.0 : at->second / double(pixels));
    }
    for (const layers::MatteName& name : matte.names) covered.erase(name.id);
    for (const auto& [id, sum] : covered)
        shares.emplace_back(fmt::format("{:08x}", id), sum / double(pixels));
    std::stable_sort(shares.begin(), shares.end(),
                     [](const auto& a, const auto& b) { return a.second > b.second; });
    return shares;
}

}  // namespace

bool has_mattes(const image::Image& image, const std::string& path) {
    const auto mattes = layers::cryptomattes_of(image, path);
    return std::any_of(mattes.begin(), mattes.end(), [&](const layers::Cryptomatte& m) {
        return layers::matte_ranks(image, m.layer).has_value();
    });
}

std::string mattes_info_text(const image::Image& image, const std::string& path) {
    const int width = image.data.width(), height = image.data.height();
    std::string text =
        fmt::format("{}: {} x {} pixels, Cryptomattes without light\n", path, width, height);
    for (const layers::Cryptomatte& m : layers::cryptomattes_of(image, path)) {
        text += fmt::format("matte      {} {} names\n", m.layer, m.names.size());
        if (!m.fault.empty()) text += fmt::format("  warning  its manifest: {}\n", m.fault);
        for (const auto& [name, share] : shares_of(image, m))
            text += fmt::format("  {:6.2f} %  {}\n", 100 * share, name);
    }
    return text;
}

std::string mattes_info_json(const image::Image& image, const std::string& path) {
    const int width = image.data.width(), height = image.data.height();
    Json j = {{"schema", "velatura.info.mattes/1"},
              {"file", path},
              {"size", {width, height}},
              {"hash", image::digest_of(image)}};
    j["mattes"] = Json::array();
    for (const layers::Cryptomatte& m : layers::cryptomattes_of(image, path)) {
        Json matte = {{"name", m.layer}, {"fault", m.fault}};
        matte["covered"] = Json::object();
        for (const auto& [name, share] : shares_of(image, m)) matte["covered"][name] = share;
        j["mattes"].push_back(std::move(matte));
    }
    return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace velatura::compositor::inspect
