// SPDX-License-Identifier: Apache-2.0
// What a render and `velatura-comp noise` say of its error against what `diff` finds beside a
// render of many samples, on fifteen scenes made for that: lamps in view, textures, a map with a
// sun, gloss, glass, mirrors, indirect light, many lights, leaves. All agree within a tenth, or say
// that the figure is a lower bound; a lower bound is none if the error is less. Where the truth is
// met, few renders call it a bound.
#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

namespace velatura::test {

namespace {

using Json = nlohmann::json;

/// A map of 64 × 32: a sky, a dark ground, and a sun of four texels.
std::string sky() {
    std::string file = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n";
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 64; ++x) {
            // Ref: Ward 1991, "Real Pixels", Graphics Gems II
            const bool is_sun = (y == 8 || y == 9) && (x == 20 || x == 21);
            file += is_sun   ? "\xc8\xb4\x96\x89"
                    : y > 16 ? "\xcc\xb8\xa4\x7d"
                    : y < 8  ? "\x80\x9c\xb8\x7f"
                             : "\x90\xae\xcc\x80";
        }
    }
    return file;
}

std::string checker() {
    std::string file = "P6\n8 8\n255\n";
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) file += (x + y) % 2 ? "\xe6\xdc\xc8" : "\x1e\x28\x3c";
    return file;
}

struct Figure {
    double value = 0;
    bool is_lower = false;
};

class Truth {
  public:
    Truth(const std::string& scene, const std::string& resolution, int spp) {
        std::filesystem::copy_file(
            fmt::format("{}/tests/app/stated_error/{}.usda", VELATURA_SOURCE_DIR, scene),
            w_.path("s.usda"));
        w_.write("sky.hdr", sky());
        w_.write("checker.ppm", checker());
        options_ = " --progress none --layers none --res " + resolution;
        const CommandResult r = w_.velatura(
            fmt::format("render s.usda -q --seed 99 --spp {}{} -o r.exr", spp, options_));
        EXPECT_EQ(r.exit_code, 0) << r.output;
    }

    /// Adds what one more render says: of its own statistics, by noise, and what it is off.
    void render(int seed) {
        const CommandResult r = w_.velatura(fmt::format(
            "render s.usda --seed {} --spp 16 --halves --stats s.json{} -o a.exr", seed, options_));
        EXPECT_EQ(r.exit_code, 0) << r.output;
        std::ifstream stats(w_.path("s.json"));
        const Json error = Json::parse(stats).at("error");
        line = {error.at("mean"), error.at("is_lower")};
        EXPECT_EQ(r.output.find("a lower bound") != std::string::npos, line.is_lower) << r.output;
        const Json rendered = Json::parse(w_.comp("noise a.exr --json").output).at("rendered");
        noise = {rendered.at("value"), rendered.at("isLower")};
        const Json difference = Json::parse(w_.comp("diff --json a.exr r.exr").output);
        for (const Json& layer : difference.at("layers"))
            if (layer.at("name") == "rgba") found = layer.at("error");
    }

    Figure line, noise;
    double found = 0;

  private:
    Workplace w_;
    std::string options_;
};

/// Squares over renders, as errors are.
class Mean {
  public:
    void add(double value) {
        sum_ += value * value;
        ++count_;
    }

    double value() const { return std::sqrt(sum_ / count_); }

  private:
    double sum_ = 0;
    int count_ = 0;
};

void check(
    const std::string& scene, const std::string& resolution, int spp, int renders, int max_bounds) {
    Truth truth(scene, resolution, spp);
    Mean line, noise, found, sure_line, sure_noise, sure_found;
    int bounds = 0;
    for (int seed = 1; seed <= renders; ++seed) {
        truth.render(seed);
        // The file stores its halves as half floats
        EXPECT_NEAR(truth.noise.value, truth.line.value, 0.02 * truth.line.value) << seed;
        EXPECT_EQ(truth.noise.is_lower, truth.line.is_lower) << seed;
        line.add(truth.line.value);
        noise.add(truth.noise.value);
        found.add(truth.found);
        bounds += truth.line.is_lower;
        if (truth.line.is_lower) continue;
        sure_line.add(truth.line.value);
        sure_noise.add(truth.noise.value);
        sure_found.add(truth.found);
    }
    std::printf("%-13s render %5.2f %%  noise %5.2f %%  diff %6.2f %%  lower bound in %d of %d\n",
                scene.c_str(), 100 * line.value(), 100 * noise.value(), 100 * found.value(), bounds,
                renders);
    EXPECT_LT(line.value(), 1.1 * found.value()) << scene;
    EXPECT_LT(noise.value(), 1.1 * found.value()) << scene;
    EXPECT_LE(bounds, max_bounds) << scene;
    if (bounds == renders) return;
    EXPECT_NEAR(sure_line.value(), sure_found.value(), 0.1 * sure_found.value()) << scene;
    EXPECT_NEAR(sure_noise.value(), sure_found.value(), 0.1 * sure_found.value()) << scene;
}

struct Scene {
    const char* name;
    int max_bounds;  ///< of the renders
    int renders = 3;
};

class StatedError : public testing::TestWithParam<Scene> {};

}  // namespace

TEST_P(StatedError, IsThatOfTheImageOrALowerBound) {
    check(GetParam().name, "80 60", 1024, GetParam().renders, GetParam().max_bounds);
}

/// In emissive one render of three has a bright sample that holds a tenth of its error.
INSTANTIATE_TEST_SUITE_P(OfAScene,
                         StatedError,
                         testing::Values(Scene{"lamps", 3},
                                         Scene{"texture", 0},
                                         Scene{"hdr", 0},
                                         Scene{"glossy", 3},
                                         Scene{"studio", 3},
                                         Scene{"many", 3},
                                         Scene{"sun_glass", 0},
                                         Scene{"indirect", 0},
                                         Scene{"emissive", 4, 12},
                                         Scene{"mirror", 3},
                                         Scene{"doorway", 0},
                                         Scene{"metal", 3},
                                         Scene{"glass_caustic", 3},
                                         Scene{"leaves", 0},
                                         Scene{"night", 3}),
                         [](const auto& scene) { return std::string(scene.param.name); });

/// A small twin of two of these.
TEST(StatedErrorQuick, IsThatOfTheImageOrALowerBound) {
    check("indirect", "32 24", 256, 1, 0);
    check("lamps", "32 24", 256, 1, 1);
}

}  // namespace velatura::test
