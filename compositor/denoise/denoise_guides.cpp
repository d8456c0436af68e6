// SPDX-License-Identifier: Apache-2.0
#include "compositor/denoise/denoise_guides.h"

#include "image/box_mean.h"

#include <algorithm>
#include <cmath>

namespace velatura::compositor::denoise {

namespace {

using image::Channel;

/// More rows cost time and tell little: what is dim in every row is rarely what a mix brings up.
constexpr size_t max_judged_groups = 8;

Plane plane_of(const Channel& channel) {
    Plane plane(channel.size());
    image::for_each_value(channel, [&](size_t i, float v) { plane[i] = v; });
    return plane;
}

/// A half image's neighbors that differ by its rounding are the same.
float rounding_variance(const Channel& channel, float value) {
    const float spacing =
        std::abs(value) * (channel.type() == image::ChannelType::Half ? 0x1p-10f : 0x1p-22f);
    return spacing * spacing;
}

Plane smoothed(const Plane& squares, const image::Window& window) {
    constexpr int radius = 1;
    const std::vector<double> mean =
        image::box_mean({squares.begin(), squares.end()}, window.width(), window.height(), radius);
    return {mean.begin(), mean.end()};
}

/// Variance of a half image from two: (A − B)² / 2.
void set_halves(DenoiseGuides& guides, const LayerStack& stack) {
    for (size_t c = 0; c < 3; ++c) {
        const Channel& a = *stack.channel("beauty_hA", c);
        const Channel& b = *stack.channel("beauty_hB", c);
        BeautyHalves& color = guides.color;
        color.half[0][c] = plane_of(a);
        color.half[1][c] = plane_of(b);
        Plane variance(a.size());
        for (size_t i = 0; i < variance.size(); ++i) {
            const float u = color.half[0][c][i], v = color.half[1][c][i];
            variance[i] = 0.5f * (u - v) * (u - v) +
                          std::max(rounding_variance(a, u), rounding_variance(b, v));
        }
        color.variance[c] = smoothed(variance, guides.window);
    }
}

void set_whole(DenoiseGuides& guides, const LayerStack& stack, const Channel& variance) {
    for (size_t c = 0; c < 3; ++c) {
        const Channel& whole = *stack.channel("rgba", c);
        guides.color.half[0][c] = guides.color.half[1][c] = plane_of(whole);
        Plane squares = plane_of(variance);
        for (size_t i = 0; i < squares.size(); ++i)
            squares[i] += rounding_variance(whole, whole.value(i));
        guides.color.variance[c] = smoothed(squares, guides.window);
    }
}

/// Mean of R, G and B over the image and both halves.
double mean_of(const ReferenceMix& mix, size_t pixels) {
    double sum = 0;
    for (const auto& half : mix.layers) {
        for (const auto& channels : half) {
            for (const Channel* channel : channels)
                image::for_each_value(*channel, [&](size_t, float v) { sum += double(v); });
        }
    }
    return sum / (6.0 * double(std::max<size_t>(pixels, 1)));
}

void add_layer(ReferenceMix& mix, const LayerStack& stack, const std::string& layer) {
    for (size_t half = 0; half < 2; ++half) {
        for (size_t c = 0; c < 3; ++c) {
            if (const Channel* channel = stack.channel(layer + (half == 0 ? "_hA" : "_hB"), c))
                mix.layers[half][c].push_back(channel);
        }
    }
}

/// One sum per name that the layers of the finest family have.
template <class Name>
std::vector<ReferenceMix> sums_by(const LayerStack& stack, Name name_of) {
    std::vector<std::string> names;
    std::vector<ReferenceMix> mixes;
    if (stack.header().closure.empty()) return mixes;
    for (const std::string& layer : stack.header().closure[0].order) {
        const accumulate::LayerEntry* entry = stack.header().find(layer);
        const std::string name = entry ? name_of(*entry) : std::string();
        if (name.empty()) continue;
        const auto at = std::find(names.begin(), names.end(), name);
        const auto index = size_t(at - names.begin());
        if (at == names.end()) {
            names.push_back(name);
            mixes.emplace_back();
        }
        add_layer(mixes[index], stack, layer);
    }
    return mixes;
}

void set_judged(DenoiseGuides& guides, const LayerStack& stack) {
    const size_t pixels = guides.window.pixel_count();
    ReferenceMix beauty;
    add_layer(beauty, stack, "beauty");
    const double whole = mean_of(beauty, pixels);
    guides.references.push_back(std::move(beauty));
    std::vector<ReferenceMix> groups =
        sums_by(stack, [](const accumulate::LayerEntry& e) { return e.group; });
    std::vector<std::pair<double, size_t>> brightest;
    for (size_t g = 0; g < groups.size(); ++g)
        brightest.emplace_back(-mean_of(groups[g], pixels), g);
    std::sort(brightest.begin(), brightest.end());
    brightest.resize(std::min(brightest.size(), max_judged_groups));
    // A group that is all the light is the beauty once more
    if (groups.size() > 1) {
        for (const auto& [mean, g] : brightest) guides.references.push_back(std::move(groups[g]));
    }
    for (ReferenceMix& mix : sums_by(stack, [](const accumulate::LayerEntry& e) {
             return e.bounce.empty() || e.bounce == "b0" ? std::string()
                    : e.bounce == "b1"                   ? std::string("direct")
                                                         : std::string("indirect");
         }))
        guides.references.push_back(std::move(mix));
    std::erase_if(guides.references, [&](ReferenceMix& mix) {
        const double mean = mean_of(mix, pixels);
        if (mean > 0) mix.gain = float(whole / mean);
        return !(mean > 0) || !(whole > 0);
    });
}

/// Lamps and background, which no other feature shows: logarithm of what is seen directly, in units
/// of the beauty's mean. Nothing where it is black or not stored.
void add_emission(DenoiseGuides& guides, const LayerStack& stack) {
    std::vector<const Channel*> seen;
    for (const layers::FamilyClosure& family : stack.header().closure) {
        for (const std::string& layer : family.order) {
            const accumulate::LayerEntry* entry = stack.header().find(layer);
            if (!entry || entry->bounce != "b0") continue;
            for (size_t c = 0; c < 3; ++c) {
                if (const Channel* channel = stack.channel(layer, c)) seen.push_back(channel);
            }
        }
        if (!seen.empty()) break;
    }
    double mean = 0;
    for (size_t c = 0; c < 3; ++c)
        image::for_each_value(*stack.channel("rgba", c),
                              [&](size_t, float v) { mean += double(std::max(v, 0.0f)); });
    mean /= double(std::max<size_t>(guides.window.pixel_count(), 1));
    if (seen.empty() || !(mean > 0) || !std::isfinite(mean)) return;
    Plane plane(guides.window.pixel_count(), 0.0f);
    for (const Channel* channel : seen)
        image::for_each_value(*channel, [&](size_t i, float v) { plane[i] += v; });
    for (float& v : plane)
        v = std::isfinite(v) ? 4.0f * std::log1p(std::max(v, 0.0f) / float(mean)) : 0.0f;
    guides.features.push_back(std::move(plane));
}

/// `albedo` and `N` as they are, the logarithm of Z: what is far may lie further apart.
void set_features(DenoiseGuides& guides, const LayerStack& stack) {
    const auto add = [&](const char* name, float largest, float scale) {
        const Channel* channel = stack.image().find(name);
        if (!channel) return;
        Plane plane = plane_of(*channel);
        for (float& v : plane)
            v = std::isfinite(v) ? std::clamp(v, -largest, largest) * scale : 0.0f;
        guides.features.push_back(std::move(plane));
    };
    for (const char* name : {"albedo.R", "albedo.G", "albedo.B"}) add(name, 1.5f, 4.0f);
    for (const char* name : {"N.X", "N.Y", "N.Z"}) add(name, 1.0f, 2.0f);
    const Channel* depth = stack.image().find("Z");
    if (depth) {
        Plane plane = plane_of(*depth);
        float nearest = 0;
        for (const float z : plane) {
            if (std::isfinite(z) && z > 0 && (nearest == 0 || z < nearest)) nearest = z;
        }
        // A miss has depth 0: one unit nearer than everything
        for (float& z : plane) {
            const bool is_hit = std::isfinite(z) && z > 0;
            z = is_hit ? 4.0f * (1.0f + std::log(z / nearest)) : 0.0f;
        }
        guides.features.push_back(std::move(plane));
    }
    if (guides.features.size() < 7)
        guides.notes.push_back(
            "albedo, N and Z are not all stored (render with --layers ...,data): edges visible "
            "only in these are blurred");
    add_emission(guides, stack);
}

}  // namespace

float ReferenceMix::value(size_t half, size_t c, size_t pixel) const {
    float sum = 0;
    for (const Channel* channel : layers[half][c]) sum += channel->value(pixel);
    return gain * sum;
}

Result<DenoiseGuides> denoise_guides(const LayerStack& stack) {
    DenoiseGuides guides;
    guides.window = stack.image().data;
    guides.has_halves = stack.channel("beauty_hA", 0) && stack.channel("beauty_hB", 0);
    if (guides.has_halves) {
        set_halves(guides, stack);
        set_judged(guides, stack);
    } else {
        const Channel* variance = stack.image().find("variance");
        if (!variance)
            return Error{"denoise-inputs",
                         "no noise estimate: neither half images nor the layer variance are "
                         "stored; render with --halves --layers ...,data"};
        set_whole(guides, stack, *variance);
        guides.notes.push_back(
            "no half images (render with --halves): filter weights correlate with the noise, one "
            "filter is used for the whole image, and the result has no noise estimate");
    }
    set_features(guides, stack);
    return guides;
}

}  // namespace velatura::compositor::denoise
