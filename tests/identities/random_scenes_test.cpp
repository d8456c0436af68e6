// SPDX-License-Identifier: Apache-2.0
// Stages that nobody thought of: whatever is in them, what the plan has off does not run, what runs
// without being called for changes no bit of any layer, neither do threads, and every pixel is a
// number. VELATURA_RANDOM_SCENES=10000 tries more of them, VELATURA_RANDOM_SEED=N others; the seed
// in a message is the stage.
#include "effect_plans.h"
#include "random_scene.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

namespace velatura::test {
namespace {

uint64_t from_environment(const char* name, uint64_t otherwise) {
    const char* text = std::getenv(name);
    return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

bool is_finite(const film::Film& film) {
    const accumulate::AccumulatorTable& table = film.sums().table();
    for (int y = film.window().y0; y < film.window().y1; ++y) {
        for (int x = film.window().x0; x < film.window().x1; ++x) {
            for (uint32_t a = 0; a < table.total_count(); ++a) {
                const accumulate::Triple t = film.sums().total(x, y, a);
                if (!std::isfinite(t.x) || !std::isfinite(t.y) || !std::isfinite(t.z)) return false;
            }
        }
    }
    return true;
}

void check(uint64_t seed) {
    const scene::Scene scene = scene_from_usda(random_scene_usda(seed), 12, 9);
    const integrator::RenderOptions few = {.seed = seed, .end_sample = 2};
    // How paths are traced is drawn as well
    RenderSetup setup{.threads = 1,
                      .caustics = seed % 3 == 0   ? integrator::Caustics::SmallLights
                                  : seed % 3 == 1 ? integrator::Caustics::Light
                                                  : integrator::Caustics::Path,
                      .branches = 1 + uint32_t(seed % 2)};
    integrator::RayCounts counts;
    setup.counts = &counts;
    const film::Film film = render_scene(scene, few, setup);
    EXPECT_TRUE(is_finite(film));
    integrator::PlanOptions options = plan_of_test();
    options.caustics = setup.caustics;
    options.splits = setup.branches > 1;
    EXPECT_EQ(names_of(integrator::broken_promises(integrator::make_plan(scene, options),
                                                   counts.effects)),
              "");

    setup.counts = nullptr;
    setup.threads = 2;
    EXPECT_EQ(fingerprint(film), fingerprint(render_scene(scene, few, setup))) << "two threads";
    setup.threads = 1;
    options.force_all = true;
    setup.forced = integrator::make_plan(scene, options).forced();
    EXPECT_EQ(fingerprint(film), fingerprint(render_scene(scene, few, setup))) << "all effects";
}

TEST(RandomScenes, HoldWhatThePlanPromises) {
    const uint64_t first = from_environment("VELATURA_RANDOM_SEED", 1),
                   count = from_environment("VELATURA_RANDOM_SCENES", 24);
    for (uint64_t seed = first; seed < first + count; ++seed) {
        SCOPED_TRACE(fmt::format("VELATURA_RANDOM_SEED={} VELATURA_RANDOM_SCENES=1", seed));
        check(seed);
    }
}

/// What `./dev fuzz scenes` runs by the thousand: more pixels and samples than above, once.
TEST(RandomScenes, GiveNumbersInEveryPixel) {
    const uint64_t first = from_environment("VELATURA_RANDOM_SEED", 1),
                   count = from_environment("VELATURA_RANDOM_SCENES", 24);
    for (uint64_t seed = first; seed < first + count; ++seed) {
        SCOPED_TRACE(fmt::format("VELATURA_RANDOM_SEED={} VELATURA_RANDOM_SCENES=1", seed));
        const scene::Scene scene = scene_from_usda(random_scene_usda(seed), 16, 16);
        EXPECT_TRUE(is_finite(
            render_scene(scene, {.seed = seed, .end_sample = 4}, RenderSetup{.threads = 1})));
    }
}

/// The same stage for the same seed, another for another.
TEST(RandomScenes, AreWhatTheirSeedSays) {
    EXPECT_EQ(random_scene_usda(5), random_scene_usda(5));
    EXPECT_NE(random_scene_usda(5), random_scene_usda(6));
}

}  // namespace
}  // namespace velatura::test
