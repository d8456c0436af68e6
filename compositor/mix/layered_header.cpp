// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/layered_header.h"

#include "base/tasks.h"
#include "compositor/io/file_attributes.h"
#include "image/digest.h"
#include "layers/layer_check.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <string_view>
#include <vector>

namespace velatura::compositor::mix {

namespace {

using accumulate::LayerEntry;
using image::Channel;
using image::ChannelType;

constexpr std::array<std::string_view, 3> whole_layers = {"XYZ", "RGBA", "UV"};

const char* type_of(const std::vector<const Channel*>& channels) {
    constexpr std::array<const char*, 3> names = {"half", "float", "uint"};
    const ChannelType first = channels[0]->type();
    const bool is_one = std::all_of(channels.begin(), channels.end(),
                                    [first](const Channel* c) { return c->type() == first; });
    return is_one ? names[size_t(first)] : "mixed";
}

/// Vectors and colors without one of their channels: no digest of the whole holds for the rest.
bool has_lost_channels(const std::vector<const Channel*>& channels, bool is_of_ids) {
    std::string suffixes;
    for (const Channel* c : channels) {
        const size_t dot = c->name.rfind('.');
        if (dot == std::string::npos) return false;
        suffixes += c->name.substr(dot + 1);
    }
    std::sort(suffixes.begin(), suffixes.end());
    if (suffixes == "BGR" && !is_of_ids) return false;
    return std::any_of(whole_layers.begin(), whole_layers.end(), [&](std::string_view whole) {
        return suffixes.size() < whole.size() &&
               suffixes.find_first_not_of(whole) == std::string::npos;
    });
}

/// The largest share of its bound between a coarser family and the beauty.
layers::FamilyClosure measured(layers::FamilyClosure closure, LayeredImage& image) {
    std::erase_if(closure.order, [&](const std::string& l) { return !image.has({l, "", 0}); });
    for (size_t c = 0; c < 3; ++c)
        if (!image.channel({"rgba", "", c})) return closure;
    bool has_half = false;
    for (const std::string& layer : closure.order)
        has_half = has_half || image.channel({layer, "", 0})->type() == ChannelType::Half;
    layers::set_bound(closure, closure.order.size(), has_half);
    closure.measured = closure.measured_absolute = 0;
    for (size_t c = 0; c < 3; ++c) {
        Values sum(image.image().data.pixel_count(), 0.0f);
        std::vector<double> bound(sum.size(), closure.absolute);
        for (const std::string& layer : closure.order) {
            image::for_each_value(*image.channel({layer, "", c}), [&](size_t i, float v) {
                sum[i] += v;
                bound[i] += closure.relative * std::abs(double(v));
            });
        }
        image::for_each_value(*image.channel({"rgba", "", c}), [&](size_t i, float v) {
            const double difference = std::abs(double(sum[i]) - double(v));
            closure.measured_absolute = std::max(closure.measured_absolute, difference);
            closure.measured = std::max(closure.measured, difference / bound[i]);
        });
    }
    return closure;
}

}  // namespace

void write_layered_header(LayeredImage& image) {
    const LayeredPlan& plan = image.plan();
    image::Image& out = image.image();
    const layers::LayerHeader& header = plan.layout.header();
    layers::ResolvedLayers resolved;
    const auto channels = layers::channels_by_layer(out);
    std::map<const Channel*, const image::Part*> part_of;
    for (const image::Part& part : out.parts)
        for (const Channel& c : part.channels) part_of[&c] = &part;
    for (LayerEntry entry : header.layers) {
        const LayerOutcome outcome = plan.outcomes.at(entry.name);
        if (outcome == LayerOutcome::NotStored) continue;
        const auto at = channels.find(entry.name);
        if (at != channels.end()) {
            entry.is_empty = false;
            entry.part = part_of.at(at->second[0])->name;
            // What is as it was keeps its digest, right or wrong
            if (outcome != LayerOutcome::Same) entry.type = type_of(at->second);
            if (outcome != LayerOutcome::Same) entry.digest.clear();
        }
        // A header that names data which are not there
        if (at == channels.end() && !entry.is_empty) continue;
        const bool is_of_ids =
            entry.family == "cryptomatte" && std::isdigit(uint8_t(entry.name.back())) != 0;
        if (outcome == LayerOutcome::Same && at != channels.end() &&
            has_lost_channels(at->second, is_of_ids))
            entry.digest.clear();
        resolved.layers.push_back(std::move(entry));
    }
    if (const auto at = channels.find("rgba"); !header.find("rgba") && at != channels.end()) {
        LayerEntry entry;
        entry.name = "rgba";
        entry.family = "beauty";
        entry.part = part_of.at(at->second[0])->name;
        entry.type = type_of(at->second);
        resolved.layers.push_back(std::move(entry));
    }
    parallel_for(resolved.layers.size(), [&](size_t i) {
        LayerEntry& e = resolved.layers[i];
        const auto at = channels.find(e.name);
        if (at != channels.end() && e.digest.empty())
            e.digest = image::digest_of(out.data, at->second);
    });
    for (const layers::FamilyClosure& of_file : header.closure) {
        layers::FamilyClosure family = of_file;
        family.is_exact = family.family == plan.mix.family;
        if (family.is_exact) {
            family.order.clear();
            for (const MixPlan::Term& term : plan.terms) family.order.push_back(term.layer);
            resolved.closure.insert(resolved.closure.begin(), measured(std::move(family), image));
            continue;
        }
        const auto first =
            std::find_if(header.layers.begin(), header.layers.end(),
                         [&](const LayerEntry& e) { return e.family == family.family; });
        const LayerOutcome outcome =
            first == header.layers.end() ? LayerOutcome::NotStored : plan.outcomes.at(first->name);
        if (outcome == LayerOutcome::Sum) {
            family.order.clear();
            for (const LayerEntry& e : header.layers)
                if (e.family == family.family) family.order.push_back(e.name);
        }
        // The rest of a family that has lost layers is no beauty
        const bool is_whole =
            std::all_of(family.order.begin(), family.order.end(), [&](const std::string& l) {
                const LayerEntry* e = header.find(l);
                return !e || e->is_empty || image.has({l, "", 0});
            });
        if (outcome != LayerOutcome::NotStored && is_whole)
            resolved.closure.push_back(measured(std::move(family), image));
    }
    accumulate::LayerSet set;
    set.groups = header.lights;
    layers::write_layer_header(out, resolved, set, header.samples,
                               layers::file_info_of(plan.layout.image(), header));
    for (const char* kept : {layers::casters_attribute, denoise_attribute}) {
        const auto at = plan.layout.image().attributes.find(kept);
        if (at != plan.layout.image().attributes.end()) out.attributes[kept] = at->second;
    }
}

}  // namespace velatura::compositor::mix
