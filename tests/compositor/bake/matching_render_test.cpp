// SPDX-License-Identifier: Apache-2.0
#include "compositor/bake/matching_render.h"

#include "compositor/test_stack.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace velatura::compositor::bake {
namespace {

using Values = std::vector<std::string>;

LayerStack stack_of(const std::string& scene,
                    const std::string& stats,
                    const std::string& settings) {
    film::Film film({0, 0, 8, 8}, film::test_layer_set());
    film::render(film, 0, 4);
    film::FileInfo info;
    info.scene_json = scene;
    info.stats_json = stats;
    info.settings_json = settings;
    const std::string path = film::temporary_file("render_like.exr");
    EXPECT_TRUE(film.write(path, info).has_value());
    auto stack = LayerStack::load(path);
    EXPECT_TRUE(stack.has_value());
    return std::move(*stack);
}

/// The values of an option; none: it is not there.
std::optional<Values> values_of(const std::vector<RenderOption>& options, const std::string& name) {
    const auto count = std::count_if(options.begin(), options.end(),
                                     [&](const RenderOption& o) { return o.name == name; });
    EXPECT_LE(count, 1) << name;
    for (const RenderOption& o : options) {
        if (o.name == name) return o.values;
    }
    return std::nullopt;
}

TEST(MatchingRender, TakesWhatTheSettingsTell) {
    const LayerStack stack = stack_of(
        R"({"camera": "/Cam", "frame": 12.5})",
        R"({"estimator": {"integrator": "nee", "sampler": "sobol", "guiding": "auto",
            "adaptive": false}})",
        R"({"settings": {"--filter": "box", "--max-depth": "5", "--roulette": "constant from 3",
            "--integrator": "path", "--light-sampling": "light", "--sampler": "sobol in halves",
            "--effects": "-glossy,-bump", "purposes": "default,render,proxy",
            "dicing": "0.5 -1 2000000", "--adaptive": "on", "lens and shutter": "1 2 3",
            "--working-space": "lin_ap1_scene"}})");
    const auto options = matching_render_options(stack, std::nullopt);
    EXPECT_EQ(values_of(options, "--filter"), Values{"box"});
    EXPECT_EQ(values_of(options, "--max-depth"), Values{"5"});
    EXPECT_EQ(values_of(options, "--roulette"), Values{"constant"});
    EXPECT_EQ(values_of(options, "--light-sampling"), Values{"light"});
    EXPECT_EQ(values_of(options, "--effects"), Values{"-glossy,-bump"});
    EXPECT_EQ(values_of(options, "--purpose"), Values{"default,render,proxy"});
    EXPECT_EQ(values_of(options, "--working-space"), Values{"lin_ap1_scene"});
    EXPECT_EQ(values_of(options, "--dicing-rate"), Values{"0.5"});
    EXPECT_EQ(values_of(options, "--dicing-limit"), Values{"2"});
    EXPECT_FALSE(values_of(options, "--subdivision-level").has_value());
    // Words as they were typed are in the statistics
    EXPECT_EQ(values_of(options, "--integrator"), Values{"nee"});
    EXPECT_EQ(values_of(options, "--sampler"), Values{"sobol"});
    EXPECT_EQ(values_of(options, "--guiding"), Values{"auto"});
    EXPECT_EQ(values_of(options, "--adaptive"), Values{"off"});
    EXPECT_EQ(values_of(options, "--camera"), Values{"/Cam"});
    EXPECT_EQ(values_of(options, "--frames"), Values{"12.5"});
    EXPECT_EQ(values_of(options, "--spp"), Values{"4"});
    const auto arguments = arguments_of(options);
    EXPECT_NE(std::find(arguments.begin(), arguments.end(), "--effects=-glossy,-bump"),
              arguments.end());
}

TEST(MatchingRender, FilesFromBeforeSettingsTellByTheirLedger) {
    const LayerStack stack = stack_of("{}", R"({"ledger": [
        {"approximation": "max-depth", "value": 3},
        {"approximation": "effect-left-out", "value": "bump"},
        {"approximation": "effect-left-out", "value": "glossy"}]})",
                                      "{}");
    const auto options = matching_render_options(stack, {{0, 0.5, 0.25, 1}});
    EXPECT_EQ(values_of(options, "--max-depth"), Values{"3"});
    EXPECT_EQ(values_of(options, "--effects"), Values{"-bump,-glossy"});
    EXPECT_EQ(values_of(options, "--crop"), (Values{"0", "0.5", "0.25", "1"}));
    EXPECT_FALSE(values_of(options, "--filter").has_value());
}

TEST(MatchingRender, HeadersOfAnotherShapeAreNoOptions) {
    const LayerStack stack =
        stack_of(R"({"camera": 7, "frame": "x"})",
                 R"({"estimator": [1], "ledger": [7, {"approximation": 1, "value": {}}]})",
                 R"({"settings": {"--filter": 3, "purposes": [], "dicing": "none"}})");
    const auto options = matching_render_options(stack, std::nullopt);
    for (const char* name : {"--camera", "--frames", "--filter", "--purpose", "--dicing-rate"})
        EXPECT_FALSE(values_of(options, name).has_value()) << name;
    EXPECT_EQ(values_of(options, "--res"), (Values{"8", "8"}));
}

TEST(MatchingRender, TypedOptionsTakeThePlaceOfThoseOfTheFile) {
    std::vector<RenderOption> options = {
        {"--filter", {"box"}}, {"--frames", {"3"}}, {"--spp", {"4"}}};
    override_options(options, options_of("lost --filter gaussian -f 7 --effects=-bump "
                                         "--crop 0 -.5 1 1 --search-path a --search-path b"));
    EXPECT_EQ(options, (std::vector<RenderOption>{{"--spp", {"4"}},
                                                  {"--filter", {"gaussian"}},
                                                  {"--frames", {"7"}},
                                                  {"--effects", {"-bump"}},
                                                  {"--crop", {"0", "-.5", "1", "1"}},
                                                  {"--search-path", {"a"}},
                                                  {"--search-path", {"b"}}}));
    EXPECT_EQ(arguments_of({{"--halves", {}}, {"--effects", {"-bump"}}}),
              (Values{"--halves", "--effects=-bump"}));
}

}  // namespace
}  // namespace velatura::compositor::bake
