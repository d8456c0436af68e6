// SPDX-License-Identifier: Apache-2.0
#include "layers/layer_check.h"

#include "accumulate/names.h"
#include "base/tasks.h"
#include "image/channel_index.h"
#include "image/digest.h"
#include "layers/sums_part.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <set>
#include <string_view>

namespace velatura::layers {

namespace {

using ChannelMap = std::map<std::string, std::vector<const image::Channel*>>;

class Checker {
  public:
    Checker(const image::Image& image, const LayerHeader& header)
        : image_(image), header_(header), channels_(channels_by_layer(image)), named_(image) {}

    LayerCheck run();

  private:
    std::string place(size_t pixel) const;
    void check_names();
    void check_presence();
    void check_finite();
    void check_digests();
    void check_closure(FamilyClosure& family);
    void check_casters();

    void problem(std::string text) { result_.problems.push_back(std::move(text)); }

    const image::Image& image_;
    const LayerHeader& header_;
    ChannelMap channels_;
    image::ChannelIndex named_;
    LayerCheck result_;
    /// Per channel: Σ|layer| bound of the finest family, needed by the coarser ones.
    std::array<std::vector<double>, 3> finest_bound_;
};

std::string Checker::place(size_t pixel) const {
    return fmt::format("pixel {},{}", image_.data.x0 + int(pixel % size_t(image_.data.width())),
                       image_.data.y0 + int(pixel / size_t(image_.data.width())));
}

void Checker::check_names() {
    std::set<std::string> seen;
    for (const image::Part& part : image_.parts) {
        for (const image::Channel& c : part.channels) {
            if (!accumulate::is_legal_channel_name(c.name))
                problem(fmt::format("channel name '{}' is not legal", c.name));
            if (!seen.insert(c.name).second)
                problem(fmt::format("channel {} is stored twice", c.name));
            if (!image::is_bookkeeping(c.name)) ++result_.channels;
        }
    }
}

void Checker::check_presence() {
    for (const accumulate::LayerEntry& e : header_.layers) {
        const bool is_stored = channels_.count(e.name) != 0;
        if (is_stored == e.is_empty) {
            problem(fmt::format("layer {} is {} but {} in the header", e.name,
                                is_stored ? "stored" : "missing", e.is_empty ? "empty" : "stored"));
        }
        if (is_stored) ++result_.layers;
    }
    std::set<std::string_view> listed;
    for (const accumulate::LayerEntry& e : header_.layers) listed.insert(e.name);
    for (const auto& [name, list] : channels_) {
        if (listed.count(name) == 0)
            problem(fmt::format("layer {} is stored but not in velatura/layers", name));
    }
}

void Checker::check_finite() {
    std::vector<const image::Channel*> channels;
    for (const auto& [name, list] : channels_)
        channels.insert(channels.end(), list.begin(), list.end());
    std::vector<size_t> first_fault(channels.size(), image_.data.pixel_count());
    parallel_for(channels.size(), [&](size_t c) {
        if (channels[c]->type() == image::ChannelType::Uint) return;
        image::for_each_value(*channels[c], [&first_fault, c](size_t i, float v) {
            if (!std::isfinite(v)) first_fault[c] = std::min(first_fault[c], i);
        });
    });
    for (size_t c = 0; c < channels.size(); ++c) {
        if (first_fault[c] == image_.data.pixel_count()) continue;
        problem(fmt::format("{}: {} is not finite", place(first_fault[c]), channels[c]->name));
    }
}

void Checker::check_digests() {
    std::vector<uint8_t> is_changed(header_.layers.size(), 0);
    parallel_for(header_.layers.size(), [&](size_t i) {
        const accumulate::LayerEntry& e = header_.layers[i];
        const auto at = channels_.find(e.name);
        if (at == channels_.end()) return;
        is_changed[i] = image::digest_of(image_.data, at->second) != e.digest;
    });
    for (size_t i = 0; i < is_changed.size(); ++i) {
        if (!is_changed[i]) continue;
        problem(fmt::format("layer {} was changed after it was written (SHA-256 differs)",
                            header_.layers[i].name));
    }
    if (!are_sums_intact(image_))
        problem(
            "the stored sums were changed after they were written, or are of another version of "
            "Velatura");
}

void Checker::check_closure(FamilyClosure& family) {
    const char* names[] = {"R", "G", "B"};
    bool has_half = false;
    for (const std::string& layer : family.order) {
        const image::Channel* c = named_.find(layer + ".R");
        has_half = has_half || (c && c->type() == image::ChannelType::Half);
    }
    set_bound(family, family.order.size(), has_half);
    family.measured = family.measured_absolute = 0;
    for (size_t c = 0; c < 3; ++c) {
        const image::Channel* beauty = named_.find(names[c]);
        if (!beauty || beauty->type() != image::ChannelType::Float) {
            problem(fmt::format("the beauty has no float channel {}", names[c]));
            return;
        }
        const size_t pixels = beauty->size();
        std::vector<float> fold(pixels, 0.0f);
        std::vector<double> bound(pixels, 0.0);
        for (const std::string& layer : family.order) {
            const image::Channel* channel = named_.find(layer + "." + names[c]);
            if (!channel) {
                problem(fmt::format("{} of layer {} is missing, closure cannot be checked",
                                    names[c], layer));
                return;
            }
            image::for_each_value(*channel, [&fold, &bound](size_t i, float v) {
                fold[i] += v;
                bound[i] += std::abs(double(v));
            });
            // What clamps took was rounded, too
            if (const image::Channel* taken = named_.find("clamp_" + channel->name))
                image::for_each_value(
                    *taken, [&bound](size_t i, float v) { bound[i] += std::abs(double(v)); });
        }
        for (double& b : bound) b = family.relative * b + family.absolute;
        size_t offenders = 0, first = 0;
        for (size_t i = 0; i < pixels; ++i) {
            const float stored = beauty->value(i);
            const double difference = std::abs(double(fold[i]) - double(stored));
            // A coarser family differs by its own rounding and by that of the family that made the
            // beauty
            const double allowed = family.is_exact ? 0.0 : bound[i] + finest_bound_[c][i];
            const bool is_good = family.is_exact ? std::bit_cast<uint32_t>(fold[i]) ==
                                                       std::bit_cast<uint32_t>(stored)
                                                 : difference <= allowed;
            if (!is_good && offenders++ == 0) first = i;
            family.measured_absolute = std::max(family.measured_absolute, difference);
            if (!family.is_exact) family.measured = std::max(family.measured, difference / allowed);
        }
        if (offenders > 0) {
            problem(fmt::format(
                "{}: {} of the beauty is {}, the {} layers add up to {} ({} pixels differ)",
                place(first), names[c], beauty->value(first), family.family, fold[first],
                offenders));
        }
        if (family.is_exact) finest_bound_[c] = std::move(bound);
    }
}

/// S_<group> must be the fold of S_<group>_<caster>, bit for bit.
void Checker::check_casters() {
    std::map<std::string, std::vector<std::string>> casters;  // by group
    for (const accumulate::LayerEntry& e : header_.layers)
        if (e.family == "caster" && !e.is_empty) casters[e.group].push_back(e.name);
    for (const accumulate::LayerEntry& e : header_.layers) {
        const auto order = casters.find(e.group);
        if (e.family != "shadow" || e.is_empty || order == casters.end()) continue;
        for (const char* c : {".R", ".G", ".B"}) {
            const image::Channel* shadow = named_.find(e.name + c);
            if (!shadow) break;  // check_presence() says so
            std::vector<float> fold(shadow->size(), 0.0f);
            for (const std::string& layer : order->second) {
                if (const image::Channel* channel = named_.find(layer + c))
                    image::for_each_value(*channel, [&fold](size_t i, float v) { fold[i] += v; });
            }
            for (size_t i = 0; i < fold.size(); ++i) {
                const float stored = shadow->value(i);
                if (std::bit_cast<uint32_t>(fold[i]) == std::bit_cast<uint32_t>(stored)) continue;
                problem(fmt::format("{}: {}{} is {}, its casters add up to {}", place(i), e.name, c,
                                    stored, fold[i]));
                break;
            }
        }
    }
}

LayerCheck Checker::run() {
    check_names();
    check_presence();
    check_finite();
    check_casters();
    for (size_t i = 0; i < header_.closure.size(); ++i) {
        FamilyClosure family = header_.closure[i];
        family.is_exact = i == 0;
        // Where a channel of the finest family is missing, which was told
        const bool is_bounded = std::none_of(finest_bound_.begin(), finest_bound_.end(),
                                             [](const auto& bound) { return bound.empty(); });
        if (i > 0 && !is_bounded) break;
        check_closure(family);
        result_.closure.push_back(std::move(family));
    }
    check_digests();
    return std::move(result_);
}

}  // namespace

std::map<std::string, std::vector<const image::Channel*>> channels_by_layer(
    const image::Image& image) {
    ChannelMap map;
    for (const image::Part& part : image.parts) {
        for (const image::Channel& c : part.channels) {
            if (image::is_bookkeeping(c.name)) continue;
            const bool is_beauty =
                c.name.size() == 1 && std::string("RGBA").find(c.name) != std::string::npos;
            map[is_beauty ? "rgba" : c.name.substr(0, c.name.find('.'))].push_back(&c);
        }
    }
    return map;
}

LayerCheck check_layers(const image::Image& image, const LayerHeader& header) {
    return Checker(image, header).run();
}

}  // namespace velatura::layers
