// SPDX-License-Identifier: Apache-2.0
#include "compositor/denoise/denoise.h"

#include "base/tasks.h"
#include "compositor/noise/noise.h"
#include "compositor/test_stack.h"
#include "image/digest.h"
#include "layers/layer_check.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <random>

namespace velatura::compositor::denoise {
namespace {

using enum Control::Kind;
using image::Channel;
using image::ChannelType;

constexpr image::Window window{3, 5, 75, 61};  // no multiple of a tile, not at the origin

/// A wall and a floor of two colors with a shadow's edge, lit by two lights in two bounces.
struct Truth {
    static bool is_floor(int y) { return y > 40; }

    static float albedo(int x, int y) {
        return is_floor(y) && (x / 6 + y / 6) % 2 == 0 ? 0.2f : 0.7f;
    }

    /// A lamp of a few pixels before the wall, seen directly, 100 times as bright as it.
    static bool is_lamp(int x, int y) { return x >= 60 && x < 62 && y >= 20 && y < 23; }

    static float light(const std::string& layer, int x, int y) {
        if (layer == "b0_key") return is_lamp(x, y) ? 100.0f : 0.0f;
        const float a = albedo(x, y), u = float(x) / 80;
        if (layer == "b1_key") return a * (x > 30 && x < 45 && is_floor(y) ? 0.05f : 1.0f + u);
        if (layer == "b1_fill") return a * (0.4f - 0.2f * u);
        if (layer == "b2_key") return a * (0.2f + 0.1f * u);
        return a * 0.1f;  // b2_fill
    }
};

constexpr const char* finest[] = {"b0_key", "b1_key", "b1_fill", "b2_key", "b2_fill"};

accumulate::LayerEntry entry(const std::string& name,
                             const std::string& family,
                             const std::string& bounce = {},
                             const std::string& group = {},
                             const std::string& of = {}) {
    accumulate::LayerEntry e;
    e.name = name;
    e.family = family;
    e.bounce = bounce;
    e.group = group;
    e.of = of;
    e.in_sum = family == "matrix" || family == "groups";
    return e;
}

void set(image::Image& image,
         layers::ResolvedLayers& resolved,
         accumulate::LayerEntry e,
         const std::string& part,
         ChannelType type,
         const std::vector<std::string>& suffixes,
         const std::function<float(size_t c, int x, int y)>& f) {
    // The test adds channels part by part
    if (image.parts.empty() || image.parts.back().name != part) {
        image.parts.emplace_back();
        image.parts.back().name = part;
    }
    auto& channels = image.parts.back().channels;
    for (size_t c = 0; c < suffixes.size(); ++c) {
        channels.push_back(Channel::make(e.name == "rgba" ? suffixes[c] : e.name + suffixes[c],
                                         type, window.pixel_count()));
        for (int y = window.y0; y < window.y1; ++y) {
            for (int x = window.x0; x < window.x1; ++x) {
                const size_t i = window.index(x, y);
                if (type == ChannelType::Half)
                    std::get<std::vector<Imath::half>>(channels.back().data)[i] =
                        Imath::half(f(c, x, y));
                else
                    std::get<std::vector<float>>(channels.back().data)[i] = f(c, x, y);
            }
        }
    }
    e.part = part;
    e.type = type == ChannelType::Half ? "half" : "float";
    resolved.layers.push_back(std::move(e));
}

struct Made {
    unsigned seed = 1;
    float noise = 1;  ///< standard deviation over the mean, of one half
    bool halves = true, data = true;
    bool has_lamp = false;
    ChannelType type = ChannelType::Float;
};

/// A file of the truth with noise like that of light that is rarely found: exponential.
LayerStack make_stack(const Made& made) {
    const size_t pixels = window.pixel_count();
    std::map<std::string, std::array<std::vector<float>, 2>> halves;  // gray
    std::mt19937 random(made.seed);
    for (const std::string layer : finest) {
        for (auto& half : halves[layer]) half.resize(pixels);
        for (size_t i = 0; i < pixels; ++i) {
            const int x = window.x0 + int(i % size_t(window.width())),
                      y = window.y0 + int(i / size_t(window.width()));
            for (auto& half : halves[layer]) {
                const float u = (float(random() >> 8) + 0.5f) * 0x1p-24f;
                // A lamp is met by every path of its pixels, but for their edges
                const float noise = layer == "b0_key" ? 0.2f * made.noise : made.noise;
                const bool is_there = made.has_lamp || layer != "b0_key";
                half[i] =
                    is_there ? Truth::light(layer, x, y) * (1 + noise * (-std::log(u) - 1)) : 0.0f;
            }
        }
    }
    const auto value = [&](const std::string& layer, int half, int x, int y) {
        const auto& h = halves.at(layer);
        const size_t i = window.index(x, y);
        return half < 2 ? h[size_t(half)][i] : 0.5f * (h[0][i] + h[1][i]);
    };
    const auto tint = [](size_t c) { return 1.0f - 0.25f * float(c); };
    const std::vector<std::string> rgb = {".R", ".G", ".B"};
    image::Image image;
    image.data = image.display = window;
    layers::ResolvedLayers resolved;
    set(image, resolved, entry("rgba", "beauty"), "rgba", ChannelType::Float, {"R", "G", "B", "A"},
        [](size_t, int, int) { return 1.0f; });
    std::vector<std::pair<std::string, std::function<float(int, size_t, int, int)>>> layers;
    for (const std::string name : finest) {
        layers.emplace_back(
            name, [=](int h, size_t c, int x, int y) { return tint(c) * value(name, h, x, y); });
        set(image, resolved, entry(name, "matrix", name.substr(0, 2), name.substr(3)), "matrix",
            made.type, rgb,
            [&](size_t c, int x, int y) { return layers.back().second(2, c, x, y); });
    }
    for (const char* light : {"key", "fill"}) {
        const std::string group = light;
        layers.emplace_back("C_" + group, [=](int h, size_t c, int x, int y) {
            const float lamp = group == "key" ? value("b0_key", h, x, y) : 0.0f;
            return tint(c) * (lamp + value("b1_" + group, h, x, y) + value("b2_" + group, h, x, y));
        });
        set(image, resolved, entry("C_" + group, "groups", "", group), "groups", made.type, rgb,
            [&](size_t c, int x, int y) { return layers.back().second(2, c, x, y); });
    }
    // Out of the sum: four times another layer, and the same everywhere
    layers.emplace_back("U_key", [=](int h, size_t c, int x, int y) {
        return 4 * tint(c) * value("b1_key", h, x, y);
    });
    layers.emplace_back("S_key", [](int, size_t, int, int) { return 0.7f; });
    for (size_t k = layers.size() - 2; k < layers.size(); ++k)
        set(image, resolved,
            entry(layers[k].first, k + 1 == layers.size() ? "shadow" : "unoccluded", "b1", "key"),
            "other", made.type, rgb,
            [&](size_t c, int x, int y) { return layers[k].second(2, c, x, y); });
    if (made.data) {
        set(image, resolved, entry("albedo", "data"), "data", ChannelType::Float, rgb,
            [](size_t, int x, int y) { return Truth::albedo(x, y); });
        set(image, resolved, entry("N", "data"), "data", ChannelType::Float, {".X", ".Y", ".Z"},
            [](size_t c, int, int y) { return c == (Truth::is_floor(y) ? 1 : 2) ? 1.0f : 0.0f; });
        set(image, resolved, entry("Z", "data"), "data", ChannelType::Float, {""},
            [](size_t, int, int y) {
                return Truth::is_floor(y) ? 10.0f - 0.1f * float(y - 40) : 10.0f;
            });
        set(image, resolved, entry("variance", "data"), "data", ChannelType::Float, {""},
            [&](size_t, int x, int y) {
                float d = 0;
                for (const char* layer : finest) d += value(layer, 0, x, y) - value(layer, 1, x, y);
                return d * d / 4;
            });
    }
    if (made.halves) {
        layers.emplace_back("beauty", [=](int h, size_t c, int x, int y) {
            float sum = 0;
            for (const char* layer : finest) sum += value(layer, h, x, y);
            return tint(c) * sum;
        });
        for (const auto& [name, f] : layers) {
            for (int h = 0; h < 2; ++h)
                set(image, resolved,
                    entry(name + (h == 0 ? "_hA" : "_hB"), "halves", "", "",
                          name == "beauty" ? "rgba" : name),
                    "halves", made.type, rgb,
                    [&](size_t c, int x, int y) { return f(h, c, x, y); });
        }
    }
    for (const char* family : {"matrix", "groups"}) {
        layers::FamilyClosure closure;
        closure.family = family;
        for (const accumulate::LayerEntry& e : resolved.layers) {
            if (e.family == family) closure.order.push_back(e.name);
        }
        closure.is_exact = resolved.closure.empty();
        layers::set_bound(closure, closure.order.size(), made.type == ChannelType::Half);
        resolved.closure.push_back(std::move(closure));
    }
    for (size_t c = 0; c < 3; ++c) {
        auto& beauty = std::get<std::vector<float>>(image.parts[0].channels[c].data);
        std::fill(beauty.begin(), beauty.end(), 0.0f);
        for (const std::string layer : finest)
            image::for_each_value(*image.find(layer + rgb[c]),
                                  [&](size_t i, float v) { beauty[i] += v; });
    }
    const auto channels = layers::channels_by_layer(image);
    for (accumulate::LayerEntry& e : resolved.layers)
        e.digest = image::digest_of(window, channels.at(e.name));
    accumulate::LayerSet layer_set;
    layer_set.groups = {{"key", {"/key"}, false}, {"fill", {"/fill"}, false}};
    layers::write_layer_header(image, resolved, layer_set, {}, {});
    auto stack = LayerStack::from_image(std::move(image));
    EXPECT_TRUE(stack.has_value());
    EXPECT_TRUE(layers::check_layers(stack->image(), stack->header()).is_good());
    return std::move(*stack);
}

LayerStack denoised(const LayerStack& stack, DenoiseReport& report) {
    auto image = denoise(stack, report);
    EXPECT_TRUE(image.has_value()) << image.error().message;
    auto out = LayerStack::from_image(std::move(*image));
    EXPECT_TRUE(out.has_value());
    return std::move(*out);
}

LayerStack denoised(const LayerStack& stack) {
    DenoiseReport report;
    return denoised(stack, report);
}

/// relMSE of a mix against the truth.
double error_of_mix(const LayerStack& stack, const Look& look) {
    const auto plan = mix::plan_mix(stack, look);
    EXPECT_TRUE(plan.has_value());
    const image::Image mixed = mix::apply_mix(stack, *plan, look, false);
    double sum = 0;
    for (size_t i = 0; i < window.pixel_count(); ++i) {
        const int x = window.x0 + int(i % size_t(window.width())),
                  y = window.y0 + int(i / size_t(window.width()));
        if (Truth::is_lamp(x, y)) continue;
        float truth = 0;
        for (const mix::MixPlan::Term& term : plan->terms)
            truth += term.gain[0] * Truth::light(term.layer, x, y);
        const double d = double(mixed.parts[0].channels[0].value(i)) - double(truth);
        sum += d * d / (double(truth) * double(truth) + 0.01);
    }
    return sum / double(window.pixel_count());
}

TEST(Denoise, LayersAddUpToTheBeautyByteForByte) {
    for (const ChannelType type : {ChannelType::Float, ChannelType::Half}) {
        const LayerStack out = denoised(make_stack({.type = type}));
        EXPECT_TRUE(layers::check_layers(out.image(), out.header()).problems.empty());
        for (size_t c = 0; c < 3; ++c) {
            for (size_t i = 0; i < window.pixel_count(); ++i) {
                float fold = 0;
                for (const char* layer : finest) fold += out.channel(layer, c)->value(i);
                ASSERT_EQ(std::bit_cast<uint32_t>(fold),
                          std::bit_cast<uint32_t>(out.channel("rgba", c)->value(i)));
            }
        }
        EXPECT_EQ(out.channel("b1_key", 0)->type(), type);
    }
}

TEST(Denoise, AGainOfALayerIsAGainOfItsResult) {
    // U_key is four times b1_key and is no guide
    const LayerStack out = denoised(make_stack({}));
    for (const char* half : {"", "_hA", "_hB"}) {
        for (size_t c = 0; c < 3; ++c) {
            const Channel& once = *out.channel(std::string("b1_key") + half, c);
            const Channel& fourfold = *out.channel(std::string("U_key") + half, c);
            for (size_t i = 0; i < once.size(); ++i)
                ASSERT_EQ(fourfold.value(i), 4 * once.value(i));
        }
    }
}

TEST(Denoise, KeepsWhatIsTheSameEverywhereUpToTheEdge) {
    const LayerStack out = denoised(make_stack({}));
    for (size_t c = 0; c < 3; ++c)
        image::for_each_value(*out.channel("S_key", c),
                              [](size_t, float v) { ASSERT_NEAR(v, 0.7f, 2e-6f); });
}

TEST(Denoise, LeavesAnImageWithoutNoiseAsItIs) {
    const LayerStack in = make_stack({.noise = 0});
    const LayerStack out = denoised(in);
    for (const char* layer : finest) {
        for (size_t i = 0; i < window.pixel_count(); ++i) {
            const float truth = in.channel(layer, 0)->value(i);
            ASSERT_NEAR(out.channel(layer, 0)->value(i), truth, 0.01f * truth) << layer << " " << i;
        }
    }
}

TEST(Denoise, HasNoBiasWhereLightIsSmooth) {
    // The upper wall: the mean over it and over independent noises
    constexpr unsigned seeds = 6;
    double difference = 0, square = 0, count = 0;
    for (unsigned seed = 1; seed <= seeds; ++seed) {
        const LayerStack in = make_stack({.seed = seed});
        const LayerStack out = denoised(in);
        for (int y = window.y0; y < 34; ++y) {
            for (int x = window.x0; x < window.x1; ++x) {
                if (Truth::is_lamp(x, y)) continue;
                const size_t i = window.index(x, y);
                double truth = 0;
                for (const char* layer : finest) truth += double(Truth::light(layer, x, y));
                difference += double(out.channel("rgba", 0)->value(i)) - truth;
                const double noisy = double(in.channel("rgba", 0)->value(i)) - truth;
                square += noisy * noisy;
                ++count;
            }
        }
    }
    const double standard_error = std::sqrt(square) / count;
    EXPECT_LT(std::abs(difference / count), 3 * standard_error);
}

TEST(Denoise, GainedMixesHaveAThirdOfTheErrorAtMost) {
    const LayerStack in = make_stack({});
    const LayerStack out = denoised(in);
    for (const Look& look :
         {Look{}, look_of({{Gain, "indirect=+2st"}}), look_of({{Mute, "key"}}),
          look_of({{Gain, "b1=-2st"}}), look_of({{Gain, "fill=+3st"}, {Mute, "b2"}})})
        EXPECT_LT(3 * error_of_mix(out, look), error_of_mix(in, look));
}

TEST(Denoise, ALampDoesNotSpillOnTheWall) {
    Made made;
    made.has_lamp = true;
    const LayerStack in = make_stack(made);
    const LayerStack out = denoised(in);
    double before = 0, after = 0;
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
            if (Truth::is_lamp(x, y)) continue;
            double truth = 0;
            for (const char* layer : finest) truth += double(Truth::light(layer, x, y));
            const size_t i = window.index(x, y);
            before += std::pow(double(in.channel("rgba", 0)->value(i)) - truth, 2);
            after += std::pow(double(out.channel("rgba", 0)->value(i)) - truth, 2);
        }
    }
    EXPECT_LT(3 * after, before);
}

TEST(Denoise, HalvesOfTheResultTellTheNoiseThatIsLeft) {
    const LayerStack in = make_stack({});
    const LayerStack out = denoised(in);
    const auto before = noise::forecast_noise(in, {}, std::nullopt),
               after = noise::forecast_noise(out, {}, std::nullopt);
    ASSERT_TRUE(before.has_value() && after.has_value());
    EXPECT_LT(2 * after->mix.value, before->mix.value);
    // It does not see blur, so it is no more than the true error, but of its order
    const double truth = std::sqrt(error_of_mix(out, {}));
    EXPECT_LT(after->mix.value, 1.2 * truth);
    EXPECT_GT(after->mix.value, 0.2 * truth);
}

TEST(Denoise, DoesWithLessAndSaysSo) {
    DenoiseReport report;
    const LayerStack whole = make_stack({.halves = false});
    EXPECT_LT(2 * error_of_mix(denoised(whole, report), {}), error_of_mix(whole, {}));
    ASSERT_EQ(report.notes.size(), 1u);
    EXPECT_NE(report.notes[0].find("--halves"), std::string::npos);
    const LayerStack bare = make_stack({.data = false});
    EXPECT_LT(error_of_mix(denoised(bare, report), {}), error_of_mix(bare, {}));
    ASSERT_EQ(report.notes.size(), 1u);
    EXPECT_NE(report.notes[0].find("albedo"), std::string::npos);
    const auto refused = denoise(make_stack({.halves = false, .data = false}), report);
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, "denoise-inputs");
}

TEST(Denoise, IsToldInTheFileAndDoneOnce) {
    DenoiseReport report;
    const LayerStack out = denoised(make_stack({}), report);
    EXPECT_NE(out.image().text("velatura/denoise").find("velatura.denoise/1"), std::string::npos);
    EXPECT_NE(out.image().text(layers::stats_attribute).find("denoised"), std::string::npos);
    EXPECT_NEAR(report.energy_ratio, 1, 0.02);
    const auto twice = denoise(out, report);
    ASSERT_FALSE(twice.has_value());
    EXPECT_EQ(twice.error().code, "denoised-twice");
}

TEST(Denoise, DoesNotDependOnThreads) {
    const LayerStack in = make_stack({});
    std::vector<std::string> digests;
    for (const int threads : {1, 3}) {
        const ThreadLimit limit(threads);
        digests.push_back(image::digest_of(denoised(in).image()));
    }
    EXPECT_EQ(digests[0], digests[1]);
}

}  // namespace
}  // namespace velatura::compositor::denoise
