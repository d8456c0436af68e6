// SPDX-License-Identifier: Apache-2.0
#include "compositor/denoise/denoise_file.h"

#include "compositor/io/file_attributes.h"
#include "image/digest.h"
#include "layers/layer_check.h"
#include "layers/layer_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace velatura::compositor::denoise {

namespace {

using image::Channel;
using image::ChannelType;
using Json = nlohmann::ordered_json;
constexpr const char* names[] = {"R", "G", "B"};

Channel* find(image::Image& image, const std::string& name) {
    for (image::Part& part : image.parts) {
        for (Channel& channel : part.channels) {
            if (channel.name == name) return &channel;
        }
    }
    return nullptr;
}

std::vector<float>& floats_of(Channel& channel) {
    return std::get<std::vector<float>>(channel.data);
}

/// The fold that defines a layer: in float, from +0, of the stored layers in the family's order.
std::vector<float> fold_of(const image::Image& image,
                           const layers::FamilyClosure& family,
                           size_t c) {
    std::vector<float> fold(image.data.pixel_count(), 0.0f);
    for (const std::string& layer : family.order) {
        if (const Channel* channel = image.find(layer + "." + names[c]))
            image::for_each_value(*channel, [&](size_t i, float v) { fold[i] += v; });
    }
    return fold;
}

/// What is stored by caster adds up to S_<group>, which is their fold.
void fold_casters(image::Image& image, const layers::LayerHeader& header, size_t c) {
    for (const accumulate::LayerEntry& shadow : header.layers) {
        if (shadow.family != "shadow" || shadow.is_empty) continue;
        layers::FamilyClosure casters;
        for (const accumulate::LayerEntry& e : header.layers) {
            if (e.family == "caster" && !e.is_empty && e.group == shadow.group)
                casters.order.push_back(e.name);
        }
        Channel* sum = find(image, shadow.name + "." + names[c]);
        if (sum && !casters.order.empty()) sum->data = fold_of(image, casters, c);
    }
}

/// A coarser family was rounded on its own before it was filtered: gives what that left between the
/// two to the layer that is largest there, so that it closes like that of a render.
void settle_family(image::Image& image, const layers::FamilyClosure& family, size_t c) {
    const std::vector<float>& beauty = floats_of(*find(image, names[c]));
    std::vector<Channel*> layers;
    for (const std::string& layer : family.order) {
        if (Channel* channel = find(image, layer + "." + names[c])) layers.push_back(channel);
    }
    if (layers.empty()) return;
    const std::vector<float> fold = fold_of(image, family, c);
    for (size_t i = 0; i < fold.size(); ++i) {
        const float rest = beauty[i] - fold[i];
        if (rest == 0.0f) continue;
        Channel* largest = layers[0];
        for (Channel* layer : layers) {
            if (std::abs(layer->value(i)) > std::abs(largest->value(i))) largest = layer;
        }
        const float settled = largest->value(i) + rest;
        if (auto* half = std::get_if<std::vector<Imath::half>>(&largest->data))
            (*half)[i] = Imath::half(settled);
        else
            floats_of(*largest)[i] = settled;
    }
}

/// Variance of the mean from the half images, or none known.
void set_variance(image::Image& image) {
    Channel* variance = find(image, "variance");
    if (!variance) return;
    variance->data = std::vector<float>(variance->size(), 0.0f);
    std::vector<float>& out = floats_of(*variance);
    for (size_t c = 0; c < 3; ++c) {
        const Channel* a = find(image, std::string("beauty_hA.") + names[c]);
        const Channel* b = find(image, std::string("beauty_hB.") + names[c]);
        if (!a || !b) return;
        for (size_t i = 0; i < out.size(); ++i) {
            const float d = a->value(i) - b->value(i);
            out[i] += d * d / 12.0f;
        }
    }
}

double luminance_of(const image::Image& image) {
    constexpr double weights[] = {0.2126, 0.7152, 0.0722};
    double sum = 0;
    for (size_t c = 0; c < 3; ++c) {
        if (const Channel* channel = image.find(names[c]))
            image::for_each_value(*channel,
                                  [&](size_t, float v) { sum += weights[c] * double(v); });
    }
    return sum;
}

Json denoise_json(const DenoiseGuides& guides,
                  const FilterChoice& choice,
                  const DenoiseReport& report) {
    Json j;
    j["schema"] = "velatura.denoise/1";
    j["method"] =
        "one linear combination of neighbors per pixel, the same for all layers: regression on "
        "albedo, N, Z and b0 weighted by non-local means, dual buffers";
    j["window"] = 2 * DenoiseKernel::radius + 1;
    j["patch"] = 2 * DenoiseKernel::patch_radius + 1;
    j["filters"] = Json::array();
    for (size_t f = 0; f < choice.shares.size(); ++f) {
        double share = 0;
        for (const float s : choice.shares[f]) share += double(s);
        share /= double(std::max<size_t>(choice.shares[f].size(), 1));
        Json filter;
        if (f < choice.filters.size()) {
            filter["colourWidth"] = choice.filters[f].color_width;
            filter["featureWidth"] = choice.filters[f].feature_width;
            filter["order"] = choice.filters[f].is_first_order ? 1 : 0;
        } else {
            filter["as"] = "rendered";
        }
        filter["share"] = share;
        j["filters"].push_back(std::move(filter));
    }
    j["halves"] = guides.has_halves ? "each filtered with the other's weights: their difference is "
                                      "remaining noise, not blur"
                                    : "none";
    j["energyRatio"] = report.energy_ratio;
    j["notes"] = report.notes;
    return j;
}

/// The render's statistics with one more line in the ledger of approximations.
std::string with_ledger(const std::string& stats_json, const DenoiseReport& report) {
    Json stats = Json::parse(stats_json, nullptr, false);
    if (!stats.is_object()) stats = Json::object();
    if (!stats["ledger"].is_array()) stats["ledger"] = Json::array();
    stats["ledger"].push_back(
        {{"approximation", "denoised"},
         {"value", "shared weights for all layers"},
         {"kind", "bias"},
         {"effect", fmt::format("mean luminance of the beauty times {:.5f}; blur is not measured",
                                report.energy_ratio)}});
    return stats.dump();
}

void write_header(const LayerStack& stack, image::Image& out, const DenoiseReport& report) {
    const auto channels = layers::channels_by_layer(out);
    layers::ResolvedLayers resolved;
    resolved.closure = stack.header().closure;
    for (accumulate::LayerEntry entry : stack.header().layers) {
        const auto at = channels.find(entry.name);
        // What is as it was keeps its digest: the check at the end tells if that is true
        const bool is_new =
            is_filtered(entry) || entry.family == "halves" || entry.name == "variance";
        if (at != channels.end() && is_new) {
            entry.digest = image::digest_of(out.data, at->second);
            entry.type = at->second[0]->type() == ChannelType::Half ? "half" : "float";
        }
        resolved.layers.push_back(std::move(entry));
    }
    accumulate::LayerSet set;
    set.groups = stack.header().lights;
    layers::FileInfo info = layers::file_info_of(stack.image(), stack.header());
    info.stats_json = with_ledger(info.stats_json, report);
    layers::write_layer_header(out, resolved, set, stack.header().samples, info);
}

}  // namespace

bool is_filtered(const accumulate::LayerEntry& entry) {
    return entry.family != "data" && entry.family != "cryptomatte" && entry.family != "halves";
}

Result<void> check_denoisable(const LayerStack& stack) {
    const layers::LayerHeader& header = stack.header();
    const auto channels = layers::channels_by_layer(stack.image());
    for (const accumulate::LayerEntry& entry : header.layers) {
        if (entry.is_empty) continue;
        if (channels.count(entry.name) == 0) return layer_missing(entry.name);
        if (!is_filtered(entry) && entry.family != "halves") continue;
        if (auto is_there = stack.check_stored(entry.name); !is_there) return is_there;
        for (size_t c = 0; c < 3; ++c) {
            const ChannelType type = stack.channel(entry.name, c)->type();
            const bool is_light =
                type == ChannelType::Float || (type == ChannelType::Half && entry.name != "rgba");
            if (!is_light)
                return Error{
                    "layers-damaged",
                    fmt::format("{} of layer {} is not stored as light; run `velatura-comp verify`",
                                names[c], entry.name)};
        }
        if (entry.family == "halves") continue;
        const std::string stem = entry.name == "rgba" ? "beauty" : entry.name;
        if ((header.find(stem + "_hA") != nullptr) != (header.find(stem + "_hB") != nullptr))
            return Error{"denoise-inputs",
                         fmt::format("layer {} has one half image without the other; was it taken "
                                     "out of the file?",
                                     entry.name)};
    }
    if (auto has_beauty = stack.check_stored("rgba"); !has_beauty) return has_beauty;
    for (const char* guide : {"albedo", "N"}) {
        const auto at = channels.find(guide);
        if (at != channels.end() && at->second.size() < 3) return layer_missing(guide);
    }
    return {};
}

Result<image::Image> denoised_file_like(const LayerStack& stack) {
    if (!stack.image().text(denoise_attribute).empty())
        return Error{"denoised-twice", "the file is already denoised; use the rendered file"};
    image::Image out = stack.image();
    std::erase_if(out.parts, [](const image::Part& part) {
        return !part.channels.empty() &&
               std::all_of(part.channels.begin(), part.channels.end(),
                           [](const Channel& c) { return image::is_bookkeeping(c.name); });
    });
    for (image::Part& part : out.parts)
        std::erase_if(part.channels,
                      [](const Channel& c) { return image::is_bookkeeping(c.name); });
    out.attributes.erase(layers::sums_attribute);
    out.attributes.erase(layers::split_attribute);
    // Regression may overshoot
    constexpr float largest = 8192.0f;
    const auto channels = layers::channels_by_layer(out);
    for (const accumulate::LayerEntry& entry : stack.header().layers) {
        const auto at = channels.find(entry.name);
        if (at == channels.end() || !(is_filtered(entry) || entry.family == "halves")) continue;
        float max = 0;
        for (const Channel* channel : at->second) {
            image::for_each_value(*channel, [&](size_t, float v) {
                max = std::max(max, std::isfinite(v) ? std::abs(v) : largest);
            });
        }
        if (!(max > largest)) continue;
        for (const Channel* channel : at->second) {
            Channel& wide = *find(out, channel->name);
            std::vector<float> values(wide.size());
            image::for_each_value(wide, [&](size_t i, float v) { values[i] = v; });
            wide.data = std::move(values);
        }
    }
    return out;
}

Result<void> finish_denoised_file(const LayerStack& stack,
                                  const DenoiseGuides& guides,
                                  const FilterChoice& choice,
                                  image::Image& out,
                                  DenoiseReport& report) {
    const auto& closure = stack.header().closure;
    for (size_t c = 0; c < 3; ++c) {
        for (const layers::FamilyClosure& family : closure) {
            if (&family == &closure.front())
                floats_of(*find(out, names[c])) = fold_of(out, family, c);
            else
                settle_family(out, family, c);
        }
        fold_casters(out, stack.header(), c);
    }
    set_variance(out);
    const double before = luminance_of(stack.image());
    if (before != 0) report.energy_ratio = luminance_of(out) / before;
    write_header(stack, out, report);
    out.attributes[denoise_attribute] = denoise_json(guides, choice, report).dump();
    const auto header = layers::read_layer_header(out);
    if (!header) return header.error();
    const layers::LayerCheck check = layers::check_layers(out, *header);
    if (!check.is_good())
        return Error{"closure-failed", "the denoised layers fail the check: " + check.problems[0]};
    return {};
}

}  // namespace velatura::compositor::denoise
