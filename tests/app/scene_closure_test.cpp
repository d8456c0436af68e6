// SPDX-License-Identifier: Apache-2.0
// The layers of every scene of the project add up to its beauty, and a mix with gains of 1 is that
// beauty, bit for bit: through files and programs, with every family that there is.
#include "command.h"
#include "image/exr.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdio>
#include <filesystem>
#include <vector>

namespace velatura::test {

namespace {

namespace fs = std::filesystem;

constexpr const char* all_sets = "bounce,light,matrix,shadow,caster,lobe,data";

/// Renders, verifies and mixes with gains of 1.
void expect_closure(const Workplace& w,
                    const std::string& scene,
                    const std::string& options,
                    const std::string& layers = all_sets) {
    SCOPED_TRACE(scene + " " + layers);
    const CommandResult rendered = w.velatura(fmt::format(
        "render {} {} --layers {} -q --progress none -o s.exr", scene, options, layers));
    ASSERT_EQ(rendered.exit_code, 0) << rendered.output;
    const CommandResult verified = w.comp("verify s.exr");
    EXPECT_EQ(verified.exit_code, 0) << verified.output;
    const CommandResult mixed =
        w.comp("mix s.exr -o m.exr --gain all=1 --gain indirect=+0st --gain direct=1");
    ASSERT_EQ(mixed.exit_code, 0) << mixed.output;
    const auto before = image::read_exr(w.path("s.exr")), after = image::read_exr(w.path("m.exr"));
    ASSERT_TRUE(before && after);
    double sum = 0;
    for (const char* name : {"R", "G", "B", "A"}) {
        const image::Channel *a = before->find(name), *b = after->find(name);
        ASSERT_TRUE(a && b) << name;
        for (size_t i = 0; i < a->size(); ++i) {
            ASSERT_EQ(std::bit_cast<uint32_t>(a->value(i)), std::bit_cast<uint32_t>(b->value(i)))
                << name << " of pixel " << i;
            sum += double(a->value(i));
        }
    }
    EXPECT_GT(sum, 0.0) << "the picture is black";
}

/// <folder>/<folder>.usda, or every scene of a folder without one.
std::vector<std::string> scenes_in(const fs::path& folder) {
    const std::string own = folder.filename().string() + ".usda";
    if (fs::exists(folder / own)) return {own};
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".usda") names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

std::string thousand_lights() {
    std::string text = R"usda(#usda 1.0
( upAxis = "Y" )
def Camera "Cam" {
    float focalLength = 24
    double3 xformOp:translate = (0, 3, 12)
    float xformOp:rotateX = -12
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
}
def Mesh "Floor" {
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 3, 2, 5, 4]
    point3f[] points = [(-12, 0, 12), (12, 0, 12), (12, 0, -12), (-12, 0, -12), (-12, 9, -12),
        (12, 9, -12)]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(0.6, 0.5, 0.4)]
}
def Sphere "Ball" {
    double3 xformOp:translate = (0, 1, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)usda";
    for (int i = 0; i < 1000; ++i) {
        text += fmt::format(
            "def SphereLight \"L{}\" {{\n float inputs:intensity = {}\n float inputs:radius = "
            "0.05\n color3f inputs:color = ({:.2f}, 0.7, {:.2f})\n"
            " double3 xformOp:translate = ({:.3f}, {:.3f}, {:.3f})\n uniform token[] xformOpOrder "
            "= [\"xformOp:translate\"]\n}}\n",
            i, 5 + i % 7, 0.5 + 0.05 * (i % 10), 1.0 - 0.05 * (i % 10), -9.5 + i % 20,
            0.5 + 1.3 * (i / 20 % 5), -9.5 + 2.0 * (i / 100));
    }
    return text;
}

class SceneClosure : public testing::TestWithParam<std::string> {};

TEST_P(SceneClosure, HoldsBitForBit) {
    const Workplace w;
    const std::string name = GetParam();
    if (!copy_made_scene(w, name)) GTEST_SKIP() << "scenes/" << name << " needs python3-openvdb";
    for (const std::string& file : scenes_in(fs::path(w.path("scenes")) / name))
        for (const char* layers : {all_sets, "lobe-matrix,bounce,light,matrix,shadow"})
            expect_closure(w, fmt::format("scenes/{}/{}", name, file),
                           "--res 24 16 --spp 3 --bounces 3", layers);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes,
    SceneClosure,
    testing::Values("atelier", "bonfire", "cornell", "sky", "transport", "tuft"),
    [](const auto& scene) { return scene.param; });

/// A hero scene: everything below one model. Its shadows are those of its objects.
TEST(LoneRoot, ClosesBitForBitWithAShadowForEachObject) {
    const Workplace w;
    std::string scene = small_scene();
    scene.replace(scene.find("def Xform \"W\""), 13, "def Xform \"W\" (kind = \"assembly\")");
    w.write("hero.usda", scene);
    const auto casters = [&](const std::string& file) {
        const auto image = image::read_exr(w.path(file));
        std::string names;
        if (image)
            for (const image::Part& part : image->parts)
                for (const image::Channel& c : part.channels)
                    if (c.name.starts_with("S_key_") && c.name.ends_with(".R"))
                        names += c.name.substr(6, c.name.size() - 8) + " ";
        return names;
    };
    expect_closure(w, "hero.usda", "--res 24 16 --spp 3 --bounces 2");
    // What takes no light has no layer
    EXPECT_EQ(casters("s.exr"), "Ball ");
    expect_closure(w, "hero.usda", "--res 24 16 --spp 3 --bounces 2 --halves --casters //Corner");
    EXPECT_EQ(casters("s.exr").find("Ball"), std::string::npos) << casters("s.exr");
    // Of other casters no render goes on
    EXPECT_EQ(w.velatura("render hero.usda -q --progress none --res 12 9 --spp 1 --resumable "
                         "--layers caster --casters //Ball -o k.exr")
                  .exit_code,
              0);
    EXPECT_EQ(w.velatura("render hero.usda -q --progress none --res 12 9 --spp 2 --resume --layers "
                         "caster -o k.exr")
                  .exit_code,
              5);
}

TEST(ThousandLights, CloseBitForBit) {
    const Workplace w;
    w.write("many.usda", thousand_lights());
    expect_closure(w, "many.usda", "--res 24 16 --spp 4 --bounces 2");
    expect_closure(w, "many.usda", "--res 24 16 --spp 4 --bounces 2", "lobe-matrix");
}

}  // namespace

}  // namespace velatura::test
