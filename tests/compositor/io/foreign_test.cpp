// SPDX-License-Identifier: Apache-2.0
// Files that are not what the mixer hopes for: of other renderers, damaged, with NaN.
#include "compositor/inspect/info.h"
#include "compositor/made_layers.h"
#include "compositor/mix/mix.h"
#include "compositor/mix/mix_job.h"
#include "compositor/test_stack.h"
#include "image/exr.h"
#include "layers/layer_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace velatura::compositor {
namespace {

using enum Control::Kind;

image::Image mixed(const LayerStack& stack, const Look& look) {
    const auto plan = mix::plan_mix(stack, look);
    EXPECT_TRUE(plan.has_value()) << plan.error().message;
    return mix::apply_mix(stack, *plan, look, false);
}

LayerStack plain(const std::vector<std::pair<std::string, std::vector<std::string>>>& parts) {
    auto stack = LayerStack::from_image(made_foreign(parts), ForeignFiles::Plain);
    EXPECT_TRUE(stack.has_value()) << stack.error().message;
    return std::move(*stack);
}

TEST(Foreign, LayersAreRowsAndRestIsWhatTheyLeave) {
    // As Cycles names them
    const LayerStack stack =
        plain({{"",
                {"ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B",
                 "ViewLayer.Combined.A", "ViewLayer.key.R", "ViewLayer.key.G", "ViewLayer.key.B",
                 "ViewLayer.DiffCol.R", "ViewLayer.DiffCol.G", "ViewLayer.DiffCol.B",
                 "ViewLayer.Depth.Z"}}});
    EXPECT_TRUE(stack.is_plain());
    EXPECT_EQ(stack.group_names(), (std::vector<std::string>{"key", "rest"}));
    const auto beauty = [](size_t i) { return made_value("ViewLayer.Combined.R", i); };
    const auto key = [](size_t i) { return made_value("ViewLayer.key.R", i); };
    const auto unit = mixed(stack, {}), gained = mixed(stack, look_of({{Gain, "key=3"}})),
               solo = mixed(stack, look_of({{Solo, "key"}})),
               rest = mixed(stack, look_of({{Mute, "rest"}, {Gain, "key=2"}}));
    for (size_t i = 0; i < stack.image().data.pixel_count(); ++i) {
        ASSERT_EQ(unit.find("R")->value(i), beauty(i));
        ASSERT_EQ(gained.find("R")->value(i), beauty(i) + 2.0f * key(i));
        ASSERT_EQ(solo.find("R")->value(i), key(i));
        ASSERT_EQ(rest.find("R")->value(i), 2.0f * key(i));
        ASSERT_EQ(unit.find("A")->value(i), made_value("ViewLayer.Combined.A", i));
    }
    // The result is a file of Velatura
    const auto again = LayerStack::from_image(mixed(stack, {}));
    ASSERT_TRUE(again.has_value());
    EXPECT_TRUE(layers::check_layers(again->image(), again->header()).is_good());
}

TEST(Foreign, PartsWithBareChannelsAreLayersByTheirNames) {
    // As Arnold and Nuke write parts
    const LayerStack arnold = plain({{"RGBA", {"R", "G", "B", "A"}},
                                     {"RGBA_key", {"R", "G", "B"}},
                                     {"N", {"R", "G", "B"}},
                                     {"specular", {"specular.R", "specular.G", "specular.B"}}});
    EXPECT_EQ(arnold.group_names(), (std::vector<std::string>{"RGBA_key", "specular", "rest"}));
    // Names that rows have in common, and that of what they leave, get numbers
    const LayerStack twins = plain({{"RGBA", {"R", "G", "B"}},
                                    {"key", {"R", "G", "B"}},
                                    {"other", {"key.R", "key.G", "key.B"}},
                                    {"rest", {"R", "G", "B"}}});
    EXPECT_EQ(twins.group_names(), (std::vector<std::string>{"key", "key_2", "rest", "rest_2"}));
    // As pbrt's film has them
    const LayerStack pbrt =
        plain({{"", {"R", "G", "B", "Albedo.R", "Albedo.G", "Albedo.B", "P.X", "P.Y", "P.Z"}}});
    EXPECT_EQ(pbrt.group_names(), (std::vector<std::string>{"rest"}));
    EXPECT_EQ(mix::plan_mix(pbrt, look_of({{Gain, "all=2"}}))->terms.size(), 1u);
    const auto none =
        LayerStack::from_image(made_foreign({{"", {"Z", "N.X"}}}), ForeignFiles::Plain);
    EXPECT_EQ(none.error().code, "not-layers");
    EXPECT_EQ(LayerStack::from_image(made_foreign({{"", {"R", "G", "B"}}})).error().code,
              "not-layers");
}

/// Within a matte, a row is gained and taken from the rest: two terms of one channel.
TEST(Foreign, AMattedRowIsReadOnceFromItsFile) {
    image::Image image = made_foreign({{"", {"R", "G", "B", "key.R", "key.G", "key.B", "mask.M"}}});
    const size_t bad_pixel = 40;
    for (image::Channel& c : image.parts[0].channels) {
        if (c.name == "key.R")
            std::get<std::vector<float>>(c.data)[bad_pixel] =
                std::numeric_limits<float>::quiet_NaN();
    }
    const std::string path = film::temporary_file("matted_row.exr");
    ASSERT_TRUE(image::write_exr(path, image).has_value());
    const auto file = layers::StripReader::open(path);
    ASSERT_TRUE(file.has_value());
    const auto layout = LayerStack::describe(*file, path, ForeignFiles::Plain);
    Look look = look_of({{Gain, "key=3"}});
    look.controls[0].matte = path + ":mask.M";
    const auto plan = mix::plan_mix(*layout, look, &*file);
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    ASSERT_EQ(plan->terms.size(), 3u);
    std::vector<mix::NotFiniteLayer> not_finite;
    const auto result = mix::mix_file(*file, *layout, *plan, look, false, &not_finite);
    ASSERT_TRUE(result.has_value());
    for (size_t i = 0; i < image.data.pixel_count(); ++i) {
        const float key = i == bad_pixel ? 0.0f : made_value("key.R", i);
        const float factor = 1.0f + made_value("mask.M", i) * 2.0f;
        ASSERT_EQ(result->find("R")->value(i), made_value("R", i) + key * factor - key) << i;
    }
    ASSERT_EQ(not_finite.size(), 1u);
    EXPECT_EQ(not_finite[0].values, 1u);
}

TEST(Foreign, InfoListsRowsAndWarnsOfVeryManyChannels) {
    const std::string few =
        inspect::info_text(plain({{"", {"R", "G", "B", "key.R", "key.G", "key.B"}}}));
    EXPECT_NE(few.find("no Velatura header"), std::string::npos) << few;
    EXPECT_NE(few.find("key"), std::string::npos);
    // Of nothing but its colors
    EXPECT_EQ(few.find("warning"), few.rfind("warning"));
    EXPECT_NE(few.find("warning  the file has no color space"), std::string::npos) << few;
    EXPECT_NE(few.find("color      linear Rec.709 (no color space in the header)"),
              std::string::npos)
        << few;
    std::vector<std::string> channels = {"R", "G", "B"};
    for (int i = 0; i < 300; ++i) {
        for (const char* c : {".R", ".G", ".B"}) channels.push_back("row" + std::to_string(i) + c);
    }
    EXPECT_NE(inspect::info_text(plain({{"", channels}})).find("more than 900 channels"),
              std::string::npos);
}

TEST(Damaged, ALayerThatWasTakenOutIsNamed) {
    image::Image image = made_layers();
    auto& channels = image.parts[1].channels;
    std::erase_if(channels, [](const image::Channel& c) { return c.name == "tail_key.G"; });
    const auto stack = LayerStack::from_image(std::move(image));
    ASSERT_TRUE(stack.has_value());
    const auto plan = mix::plan_mix(*stack, {});
    ASSERT_FALSE(plan.has_value());
    EXPECT_EQ(plan.error().code, "layer-missing");
    EXPECT_NE(plan.error().message.find("tail_key"), std::string::npos);
}

TEST(Damaged, ALayerFileOfAnotherSizeIsRefused) {
    film::Film film({0, 0, 20, 17}, film::test_layer_set());
    film::render(film, 0, 2);
    const std::string path = film::temporary_file("sizes.exr");
    film::FileInfo info;
    info.layout = layers::Layout::Split;
    ASSERT_TRUE(film.write(path, info).has_value());
    ASSERT_TRUE(LayerStack::load(path).has_value());
    const image::Image other = made_foreign({{"", {"C_key.R", "C_key.G", "C_key.B"}}});
    ASSERT_TRUE(image::write_exr(film::temporary_file("sizes.C_key.exr"), other).has_value());
    const auto refused = layers::StripReader::open(path);
    ASSERT_FALSE(refused.has_value());
    EXPECT_NE(refused.error().message.find("sizes.C_key.exr"), std::string::npos);
}

/// The made file with a NaN and two infinities in one layer.
std::string file_with_nan(const std::string& name) {
    image::Image image = made_layers();
    auto& values = std::get<std::vector<float>>(image.parts[1].channels[4].data);
    values[40] = std::numeric_limits<float>::quiet_NaN();
    values[90] = -std::numeric_limits<float>::infinity();
    values[91] = std::numeric_limits<float>::infinity();
    const std::string path = film::temporary_file(name);
    EXPECT_TRUE(image::write_exr(path, image).has_value());
    return path;
}

TEST(Damaged, NanCountsAsNothingAndIsTold) {
    const std::string path = file_with_nan("nan.exr");
    const auto stack = LayerStack::load(path);
    ASSERT_TRUE(stack.has_value());
    std::vector<mix::NotFiniteLayer> found;
    const auto result = mix::apply_mix(*stack, *mix::plan_mix(*stack, {}), {}, false, &found);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].layer, "b1_key");
    EXPECT_EQ(found[0].values, 3u);
    EXPECT_EQ(found[0].x, 40 - 37);
    EXPECT_EQ(found[0].y, 1);
    for (const char* c : {"R", "G", "B"}) {
        for (size_t i = 0; i < result.find(c)->size(); ++i)
            ASSERT_TRUE(std::isfinite(result.find(c)->value(i)));
    }
    float fold = 0.0f;
    for (const std::string layer : {"b0_key", "tail_key", "b1_fill", "tail_fill"})
        fold += made_value(layer + ".G", 40);
    EXPECT_EQ(result.find("G")->value(40), fold);
    // A muted layer is not even looked at
    found.clear();
    const Look mute = look_of({{Mute, "key:b1"}});
    mix::apply_mix(*stack, *mix::plan_mix(*stack, mute), mute, false, &found);
    EXPECT_TRUE(found.empty());
}

TEST(Damaged, HalvesAreReadToTheLastBit) {
    image::Image image = made_foreign({{"", {"R", "G", "B"}}});
    auto halves = image::Channel::make("R", image::ChannelType::Half, image.data.pixel_count());
    auto& values = std::get<std::vector<Imath::half>>(halves.data);
    const auto bits_of = [](size_t i) { return uint16_t(i * 85 + 7); };
    for (size_t i = 0; i < values.size(); ++i) values[i].setBits(bits_of(i));
    image.parts[0].channels[0] = halves;
    const auto stack = LayerStack::from_image(image, ForeignFiles::Plain);
    const auto result = mix::apply_mix(*stack, *mix::plan_mix(*stack, {}), {}, false);
    for (size_t i = 0; i < values.size(); ++i) {
        const float value = float(values[i]);
        ASSERT_EQ(result.find("R")->value(i), std::isfinite(value) ? value : 0.0f) << bits_of(i);
    }
}

TEST(MixJob, RefusesNanWhenStrict) {
    mix::MixJob job;
    const std::string input = file_with_nan("strict.exr"), output = film::temporary_file("o.exr");
    const auto lax = mix::mix_one(job, {input}, output, {}, size_t(1) << 20);
    ASSERT_TRUE(lax.has_value()) << lax.error().message;
    ASSERT_EQ(lax->size(), 1u);
    EXPECT_NE((*lax)[0].find("3 values of b1_key are not finite (the first at pixel 3,1)"),
              std::string::npos)
        << (*lax)[0];
    job.is_strict = true;
    EXPECT_EQ(mix::mix_one(job, {input}, output, {}, size_t(1) << 20).error().code, "not-finite");
}

TEST(MixJob, AFileGivesTheBitsOfTheImageInMemory) {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = set.shadow_layers = true;
    film::Film film({0, 0, 50, 43}, set);
    film::render(film, 0, 4);
    const Look look = look_of(
        {{Gain, "indirect=+1.3st"}, {Shadow, "fill=0.3"}, {Tint, "key=1,.9,.8"}, {Mute, "sky"}});
    for (const layers::Layout layout :
         {layers::Layout::MultiPart, layers::Layout::SinglePart, layers::Layout::Split}) {
        const std::string path = film::temporary_file("laid_out.exr");
        film::FileInfo info;
        info.layout = layout;
        ASSERT_TRUE(film.write(path, info).has_value());
        const auto file = layers::StripReader::open(path);
        ASSERT_TRUE(file.has_value());
        const auto layers = LayerStack::describe(*file, path), stack = LayerStack::load(path);
        for (const bool with_layers : {false, true}) {
            const auto a =
                mix::mix_file(*file, *layers, *mix::plan_mix(*layers, look), look, with_layers);
            const auto b = mix::apply_mix(*stack, *mix::plan_mix(*stack, look), look, with_layers);
            ASSERT_TRUE(a.has_value());
            ASSERT_EQ(a->parts.size(), b.parts.size());
            for (size_t p = 0; p < b.parts.size(); ++p) {
                for (size_t c = 0; c < b.parts[p].channels.size(); ++c)
                    EXPECT_EQ(a->parts[p].channels[c].data, b.parts[p].channels[c].data);
            }
            EXPECT_EQ(a->attributes, b.attributes);
        }
    }
}

}  // namespace
}  // namespace velatura::compositor
