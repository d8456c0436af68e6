// SPDX-License-Identifier: Apache-2.0
// Plugins from the outside: which shared objects a render maps, and what it draws with them.
#include "command.h"
#include "image/exr.h"
#include "opened_files.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <string>

namespace velatura::test {

namespace {

constexpr const char* render = "render s.usda --res 12 9 --spp 1 --guiding off --progress none -q ";

class PluginRender : public testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", small_scene()); }

    CommandResult with_test_plugins(const std::string& arguments) {
        ::setenv("VELATURA_PLUGIN_PATH", VELATURA_TEST_PLUGINS, 1);
        const CommandResult result = w.velatura(render + arguments);
        ::unsetenv("VELATURA_PLUGIN_PATH");
        return result;
    }

    Workplace w;
};

}  // namespace

TEST_F(PluginRender, OfAPlainSceneOpensNone) {
    for (const char* arguments : {"-o x.exr", "-o x.exr --accel bvh"})
        expect_nothing_heavy(opened_files(w, "velatura", render + std::string(arguments)),
                             arguments);
}

TEST_F(PluginRender, OpensTheOneThatIsNamed) {
#ifndef VELATURA_HAVE_EMBREE_PLUGIN
    GTEST_SKIP() << "built without the plugin embree";
#endif
    const std::string opened =
        opened_files(w, "velatura", std::string(render) + "-o x.exr --accel embree");
    EXPECT_NE(opened.find("libembree3"), std::string::npos);
    EXPECT_NE(opened.find("velatura_embree.so"), std::string::npos);
}

TEST_F(PluginRender, OfTheWorkedExampleIsTheSameImage) {
    const CommandResult plain = w.velatura(std::string(render) + "-o plain.exr");
    ASSERT_EQ(plain.exit_code, 0) << plain.output;
    const CommandResult brute = with_test_plugins("-o brute.exr --accel brute_force");
    ASSERT_EQ(brute.exit_code, 0) << brute.output;
    EXPECT_EQ(w.hash("brute.exr"), w.hash("plain.exr"));
}

TEST_F(PluginRender, GoesOnWithTheOwnTreeWhereThePluginCannotBuild) {
    const CommandResult plain = w.velatura(std::string(render) + "-o plain.exr");
    ASSERT_EQ(plain.exit_code, 0) << plain.output;
    const CommandResult refused = with_test_plugins("-o refused.exr --accel refusing");
    EXPECT_EQ(refused.exit_code, 0) << refused.output;
    EXPECT_NE(refused.output.find(
                  "error: no memory for the test; the built-in BVH is used instead [accelerator]"),
              std::string::npos)
        << refused.output;
    EXPECT_EQ(w.hash("refused.exr"), w.hash("plain.exr"));
    // Strict renders stop at any error
    EXPECT_EQ(with_test_plugins("-o strict.exr --strict --accel refusing").exit_code, 1);
    EXPECT_FALSE(w.exists("strict.exr"));
}

TEST_F(PluginRender, SaysWhatIsWrongAndWritesNothing) {
    const CommandResult unknown = w.velatura(std::string(render) + "-o x.exr --accel nonsense");
    EXPECT_EQ(unknown.exit_code, 1);
    EXPECT_NE(unknown.output.find("--accel nonsense: no plugin provides it; expected one of bvh"),
              std::string::npos)
        << unknown.output;
    const CommandResult misspelt = with_test_plugins("-o x.exr --accel brute_forc");
    EXPECT_EQ(misspelt.exit_code, 1);
    EXPECT_NE(misspelt.output.find("brute_force"), std::string::npos) << misspelt.output;
    EXPECT_FALSE(w.exists("x.exr"));
}

TEST_F(PluginRender, WithEmbreeAgreesPixelByPixel) {
#ifndef VELATURA_HAVE_EMBREE_PLUGIN
    GTEST_SKIP() << "built without the plugin embree";
#endif
    ASSERT_EQ(
        w.velatura("render s.usda --res 96 72 --spp 16 --progress none -q --guiding off -o own.exr")
            .exit_code,
        0);
    ASSERT_EQ(w.velatura("render s.usda --res 96 72 --spp 16 --progress none -q --guiding off -o "
                         "embree.exr --accel embree")
                  .exit_code,
              0);
    const Result<image::Image> own = image::read_exr(w.path("own.exr")),
                               embree = image::read_exr(w.path("embree.exr"));
    ASSERT_TRUE(own && embree);
    // The same samples: only paths that meet an edge, or lie within rounding of a shadow's border,
    // may go another way
    size_t pixels = 0, different = 0;
    double sum = 0, sum_of_differences = 0;
    for (const char* name : {"R", "G", "B"}) {
        const image::Channel *a = own->find(name), *b = embree->find(name);
        ASSERT_TRUE(a && b);
        ASSERT_EQ(a->size(), b->size());
        for (size_t i = 0; i < a->size(); ++i) {
            const double x = double(a->value(i)), y = double(b->value(i));
            ++pixels;
            different += std::abs(x - y) > 1e-4 * (x + y);
            sum += x;
            sum_of_differences += y - x;
        }
    }
    RecordProperty("different_values", int(different));
    EXPECT_LT(double(different), 0.01 * double(pixels)) << "of " << pixels;
    EXPECT_LT(std::abs(sum_of_differences), 1e-4 * sum);
    EXPECT_GT(sum, 0.1 * double(pixels));
}

}  // namespace velatura::test
