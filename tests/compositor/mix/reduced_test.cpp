// SPDX-License-Identifier: Apache-2.0
// Files of light layers that parts, layers or single channels were taken out of.
#include "compositor/denoise/denoise.h"
#include "compositor/exports/export.h"
#include "compositor/inspect/contact_sheet.h"
#include "compositor/inspect/info.h"
#include "compositor/mix/mix.h"
#include "compositor/noise/error_map.h"
#include "compositor/noise/noise.h"
#include "compositor/test_stack.h"
#include "layers/layer_check.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>

namespace velatura::compositor::mix {
namespace {

using enum Control::Kind;

/// A small render with everything that a file may hold.
const image::Image& whole_image() {
    static const image::Image image = [] {
        film::LayerSet set = film::test_layer_set();
        set.matrix_layers = set.shadow_layers = set.halves = true;
        film::Film film({0, 0, 9, 7}, set);
        film::render(film, 0, 4);
        return through_file(film).image();
    }();
    return image;
}

LayerStack without(const std::function<bool(const std::string&)>& is_gone) {
    image::Image image = whole_image();
    for (image::Part& part : image.parts)
        std::erase_if(part.channels, [&](const image::Channel& c) { return is_gone(c.name); });
    auto stack = LayerStack::from_image(std::move(image));
    EXPECT_TRUE(stack.has_value());
    return std::move(*stack);
}

std::set<std::string> channel_names() {
    std::set<std::string> names;
    for (const image::Part& part : whole_image().parts) {
        for (const image::Channel& c : part.channels) names.insert(c.name);
    }
    return names;
}

std::string layer_of(const std::string& channel) {
    const size_t dot = channel.rfind('.');
    return dot != std::string::npos                ? channel.substr(0, dot)
           : channel.size() == 1 && channel != "Z" ? "rgba"
                                                   : channel;
}

TEST(Reduced, DenoisingNamesWhatIsGone) {
    for (const std::string& gone : channel_names()) {
        const LayerStack stack = without([&](const std::string& name) { return name == gone; });
        denoise::DenoiseReport report;
        const auto denoised = denoise::denoise(stack, report);
        // The renderer's books are no image, and alpha is nothing to filter
        if (gone.starts_with("sums") || gone == "A") {
            EXPECT_TRUE(denoised.has_value()) << gone << ": " << denoised.error().message;
            continue;
        }
        ASSERT_FALSE(denoised.has_value()) << gone;
        // Denoising does not look into these, but does not vouch for them either
        const bool is_passed_on = layer_of(gone) == "P" || layer_of(gone) == "st";
        EXPECT_EQ(denoised.error().code, is_passed_on ? "closure-failed" : "layer-missing") << gone;
        EXPECT_NE(denoised.error().message.find("layer " + layer_of(gone)), std::string::npos)
            << denoised.error().message;
    }
}

/// As a render with fewer layers is: what the header does not name is not missed.
TEST(Reduced, DenoisingDoesWithLessWhereTheHeaderSaysSo) {
    const auto strip = [](const std::function<bool(const accumulate::LayerEntry&)>& is_gone) {
        const LayerStack whole = *LayerStack::from_image(whole_image());
        image::Image image = whole_image();
        layers::ResolvedLayers resolved;
        std::set<std::string> gone;
        for (const accumulate::LayerEntry& e : whole.header().layers) {
            if (is_gone(e))
                gone.insert(e.name);
            else
                resolved.layers.push_back(e);
        }
        for (const layers::FamilyClosure& family : whole.header().closure) {
            if (gone.count(family.order[0]) == 0) resolved.closure.push_back(family);
        }
        for (image::Part& part : image.parts)
            std::erase_if(part.channels, [&](const image::Channel& c) {
                return gone.count(layer_of(c.name)) != 0;
            });
        accumulate::LayerSet set;
        set.groups = whole.header().lights;
        layers::write_layer_header(image, resolved, set, whole.header().samples,
                                   layers::file_info_of(image, whole.header()));
        return *LayerStack::from_image(std::move(image));
    };
    const auto half = [](const accumulate::LayerEntry& e, const char* of, char which) {
        return e.family == "halves" && e.of == of && e.name.back() == which;
    };
    const std::vector<std::function<bool(const accumulate::LayerEntry&)>> cases = {
        [](const auto& e) { return e.name == "albedo" || e.name == "N" || e.name == "Z"; },
        [](const auto& e) { return e.family == "halves"; },
        [](const auto& e) { return e.family == "shadow" || e.of.starts_with("S_"); },
        [&](const auto& e) { return half(e, "b1_key", 'B'); },
        [&](const auto& e) { return half(e, "b1_key", 'A') || half(e, "b1_key", 'B'); },
        [&](const auto& e) { return half(e, "rgba", 'B'); },
    };
    for (size_t i = 0; i < cases.size(); ++i) {
        const LayerStack stack = strip(cases[i]);
        denoise::DenoiseReport report;
        const auto denoised = denoise::denoise(stack, report);
        const bool is_single_half = i == 3 || i == 5;
        if (is_single_half) {
            ASSERT_FALSE(denoised.has_value()) << i;
            EXPECT_EQ(denoised.error().code, "denoise-inputs");
            EXPECT_NE(denoised.error().message.find("half image"), std::string::npos);
            continue;
        }
        ASSERT_TRUE(denoised.has_value()) << i << ": " << denoised.error().message;
        const auto again = LayerStack::from_image(*denoised);
        EXPECT_TRUE(layers::check_layers(again->image(), again->header()).is_good()) << i;
        if (i == 4) {
            ASSERT_EQ(report.notes.size(), 1u);
            EXPECT_NE(report.notes[0].find("b1_key"), std::string::npos);
        }
    }
    const LayerStack nothing =
        strip([](const auto& e) { return e.family == "halves" || e.name == "variance"; });
    denoise::DenoiseReport report;
    EXPECT_EQ(denoise::denoise(nothing, report).error().code, "denoise-inputs");
}

/// Everything else that reads such a file: an error, or a result, and no crash.
TEST(Reduced, NothingElseReadsWhatIsNotThere) {
    const Look look = look_of({{Gain, "key:b1=2"}, {Shadow, "key=0.5"}});
    std::set<std::string> gone_layers;
    for (const std::string& gone : channel_names()) {
        const LayerStack stack = without([&](const std::string& name) { return name == gone; });
        const auto plan = plan_mix(stack, look);
        if (plan) {
            const auto mixed = LayerStack::from_image(apply_mix(stack, *plan, look, true));
            EXPECT_TRUE(mixed.has_value());
            EXPECT_TRUE(layers::check_layers(mixed->image(), mixed->header()).is_good()) << gone;
            EXPECT_TRUE(exports::mix_recipe(stack, *plan, look, "x.exr").has_value());
        } else {
            EXPECT_EQ(plan.error().code, "layer-missing") << plan.error().message;
            gone_layers.insert(layer_of(gone));
        }
        const auto forecast = noise::forecast_noise(stack, look, 0.01);
        if (forecast) noise::error_image(stack, forecast->error);
        inspect::info_text(stack);
        inspect::info_json(stack);
        layers::check_layers(stack.image(), stack.header());
        inspect::SheetOptions options;
        options.halves = options.fit = true;
        options.cell_width = 32;
        options.view = "Raw";
        EXPECT_TRUE(inspect::contact_sheet(stack.image(), options).has_value()) << gone;
    }
    EXPECT_EQ(gone_layers.count("b1_key"), 1u);
    EXPECT_EQ(gone_layers.count("S_key"), 1u);
}

/// A header without an entry for the beauty.
TEST(Reduced, AMixNeedsNoEntryOfTheBeauty) {
    const LayerStack whole = *LayerStack::from_image(whole_image());
    image::Image image = whole_image();
    layers::ResolvedLayers resolved;
    resolved.layers = whole.header().layers;
    resolved.closure = whole.header().closure;
    std::erase_if(resolved.layers,
                  [](const accumulate::LayerEntry& e) { return e.name == "rgba"; });
    accumulate::LayerSet set;
    set.groups = whole.header().lights;
    layers::write_layer_header(image, resolved, set, whole.header().samples,
                               layers::file_info_of(image, whole.header()));
    const auto stack = LayerStack::from_image(std::move(image));
    const Look look = look_of({{Gain, "key=2"}});
    const auto plan = plan_mix(*stack, look);
    ASSERT_TRUE(plan.has_value());
    const auto mixed = LayerStack::from_image(apply_mix(*stack, *plan, look, true));
    ASSERT_TRUE(mixed.has_value());
    EXPECT_TRUE(layers::check_layers(mixed->image(), mixed->header()).is_good());
}

}  // namespace
}  // namespace velatura::compositor::mix
