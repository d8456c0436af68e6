// SPDX-License-Identifier: Apache-2.0
// What a clamp takes can be given back: layers and clamp_ layers of a file are those of a render
// without it.
#include "command.h"
#include "image/exr.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <bit>
#include <cstdio>
#include <vector>

namespace velatura::test {

namespace {

struct LayerImage {
    image::Image image;
    layers::LayerHeader header;
};

LayerImage render(const Workplace& w, const std::string& options) {
    const CommandResult r = w.velatura(
        "render s.usda --res 40 34 --spp 24 --bounces 3 -q --progress none -o x.exr " + options);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    const CommandResult verified = w.comp("verify x.exr");
    EXPECT_EQ(verified.exit_code, 0) << verified.output;
    auto image = image::read_exr(w.path("x.exr"));
    if (!image) throw std::runtime_error(image.error().message);
    auto header = layers::read_layer_header(*image);
    if (!header) throw std::runtime_error(header.error().message);
    return {std::move(*image), std::move(*header)};
}

}  // namespace

TEST(Clamp, GivesBackTheRenderWithoutIt) {
    const Workplace w;
    w.write("s.usda", small_scene());
    for (const char* storage : {"", "--float-layers", "--layers bounce,light,shadow,data"}) {
        SCOPED_TRACE(storage);
        const LayerImage clamped = render(
                             w,
                             fmt::format("--clamp-direct 0.4 --clamp-indirect 0.05 {}", storage)),
                         free = render(w, storage);
        int touched = 0;
        double taken = 0;
        for (const char* c : {"R", "G", "B"}) {
            std::vector<float> fold(clamped.image.data.pixel_count(), 0.0f);
            for (const accumulate::LayerEntry& e : free.header.layers) {
                const bool is_sum =
                    e.family == "matrix" || e.family == "bounces" || e.family == "groups";
                const image::Channel* whole = free.image.find(e.name + "." + c);
                if (!whole || (!is_sum && e.family != "unoccluded" && e.family != "shadow"))
                    continue;
                const image::Channel *kept = clamped.image.find(e.name + "." + c),
                                     *back = clamped.image.find("clamp_" + e.name + "." + c);
                ASSERT_TRUE(kept) << e.name;
                EXPECT_TRUE(is_sum || !back) << e.name;
                touched += back != nullptr;
                for (size_t i = 0; i < fold.size(); ++i) {
                    const float sum = back ? kept->value(i) + back->value(i) : kept->value(i);
                    ASSERT_EQ(std::bit_cast<uint32_t>(sum),
                              std::bit_cast<uint32_t>(whole->value(i)))
                        << e.name << " pixel " << i;
                    if (e.in_sum) fold[i] += sum;
                    if (e.in_sum && back) taken += double(back->value(i));
                }
            }
            for (size_t i = 0; i < fold.size(); ++i)
                ASSERT_EQ(std::bit_cast<uint32_t>(fold[i]),
                          std::bit_cast<uint32_t>(free.image.find(c)->value(i)));
        }
        EXPECT_GT(touched, 6);
        EXPECT_GT(taken, 0.0);
        for (const accumulate::LayerEntry& e : clamped.header.layers) {
            if (e.family != "clamp") continue;
            EXPECT_EQ("clamp_" + e.of, e.name);
            EXPECT_FALSE(e.in_sum);
            EXPECT_EQ(e.type, "float");
        }
    }
}

/// Half images of what was taken, so that the noise of a mix that gives it back is known.
TEST(Clamp, GivesBackItsNoiseAsWell) {
    const Workplace w;
    w.write("s.usda", small_scene());
    const auto noise = [&](const std::string& options, const std::string& look) {
        const CommandResult r = w.velatura(
            "render s.usda --res 40 34 --spp 24 --bounces 3 --halves --adaptive off -q --progress "
            "none -o n.exr " +
            options);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        EXPECT_EQ(w.comp("verify n.exr").exit_code, 0);
        const CommandResult forecast = w.comp("noise --json n.exr " + look);
        EXPECT_EQ(forecast.exit_code, 0) << forecast.output;
        return nlohmann::json::parse(forecast.output)["mix"]["value"].get<double>();
    };
    const std::string clamps = "--clamp-direct 0.4 --clamp-indirect 0.05";
    const double free = noise("", ""), back = noise(clamps, "--clamp all=1"),
                 clamped = noise(clamps, "");
    EXPECT_NEAR(back, free, 2e-3 * free);
    EXPECT_LT(clamped, 0.98 * free);
}

TEST(Clamp, StandsInTheLedger) {
    const Workplace w;
    w.write("s.usda", small_scene());
    const LayerImage clamped = render(w, "--clamp-indirect 0.05"), free = render(w, "");
    const auto find = [](const LayerImage& x) {
        const auto stats = nlohmann::json::parse(x.image.text(layers::stats_attribute));
        for (const auto& line : stats["ledger"])
            if (line["approximation"] == "clamp") return line["removed_share"].get<double>();
        return -1.0;
    };
    EXPECT_EQ(find(free), -1.0);
    double with = 0, without = 0;
    for (const char* c : {"R", "G", "B"}) {
        for (size_t i = 0; i < free.image.data.pixel_count(); ++i) {
            with += double(clamped.image.find(c)->value(i));
            without += double(free.image.find(c)->value(i));
        }
    }
    std::printf("removed %.2f %%\n", 100 * find(clamped));
    EXPECT_GT(find(clamped), 0.001);
    EXPECT_NEAR(find(clamped), 1.0 - with / without, 1e-3);
    // Only what came later than b1
    EXPECT_EQ(clamped.image.find("clamp_b1.R"), nullptr);
    EXPECT_NE(clamped.image.find("clamp_b2.R"), nullptr);
    EXPECT_EQ(w.velatura("render s.usda --clamp-direct 0 -o y.exr").exit_code, 2);
}

}  // namespace velatura::test
