// SPDX-License-Identifier: Apache-2.0
// `render --deep`: the deep image against the flat one and the scene.
#include "command.h"
#include "image/exr.h"
#include "layers/deep_file.h"
#include "still_life.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace velatura::test {

namespace {

constexpr int size = 40;

class DeepCommand : public testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", still_life()); }

    layers::DeepImage render(const std::string& arguments, const std::string& name = "out") {
        const CommandResult r = w.velatura(fmt::format(
            "render s.usda --res {0} {0} --progress none -q --max-depth 3 --deep -o {1}.exr {2}",
            size, name, arguments));
        EXPECT_EQ(r.exit_code, 0) << r.output;
        const auto deep = layers::read_deep_file(w.path(name + ".deep.exr"));
        if (!deep) throw std::runtime_error(deep.error().message);
        return *deep;
    }

    Workplace w;
};

/// Of each pixel, row by row.
std::vector<std::vector<layers::DeepSample>> by_pixel(const layers::DeepImage& deep) {
    std::vector<std::vector<layers::DeepSample>> pixels;
    auto next = deep.samples.begin();
    for (const uint32_t count : deep.counts) {
        pixels.emplace_back(next, next + count);
        next += count;
    }
    return pixels;
}

}  // namespace

TEST_F(DeepCommand, FlattensToTheBeautyWithItsBackground) {
    for (const std::string how :
         {"", "--layers none", "--exr-layout single --layers matrix", "--exr-layout split",
          "--crop 0.2 0.9 0.1 0.8 --deep-samples 2", "--filter box --integrator whitted"}) {
        const layers::DeepImage deep = render("--spp 24 " + how);
        const auto flat = image::read_exr(w.path("out.exr"));
        ASSERT_TRUE(flat.has_value());
        EXPECT_EQ(deep.data, flat->data);
        EXPECT_EQ(deep.display, flat->display);
        const auto pixels = by_pixel(deep);
        const std::array<const char*, 4> names = {"R", "G", "B", "A"};
        for (size_t i = 0; i < pixels.size(); ++i) {
            std::array<float, 4> sum{};
            for (const layers::DeepSample& s : pixels[i]) {
                const float left = 1.0f - sum[3];
                const std::array<float, 4> add = {s.r, s.g, s.b, s.a};
                for (size_t c = 0; c < 4; ++c) sum[c] += left * add[c];
            }
            for (size_t c = 0; c < 4; ++c) {
                const float expected = flat->find(names[c])->value(i);
                ASSERT_NEAR(sum[c], expected, expected * float(pixels[i].size() + 3) * 0x1p-23f)
                    << how << ": " << names[c] << " of pixel " << i;
            }
        }
    }
}

TEST_F(DeepCommand, DepthsAreThoseOfTheScene) {
    const auto pixels = by_pixel(render("--spp 64 --filter box"));
    const auto at = [&](int x, int y) { return pixels[size_t(y) * size + size_t(x)]; };
    // The square alone, the square behind the veil, the sky
    const auto square = at(10, 12), both = at(10, 20), sky = at(36, 20);
    ASSERT_EQ(square.size(), 1u);
    EXPECT_NEAR(square[0].z, 10.0f, 1e-4f);
    EXPECT_EQ(square[0].a, 1.0f);
    ASSERT_EQ(both.size(), 2u);
    EXPECT_NEAR(both[0].z, 8.0f, 1e-4f);
    EXPECT_NEAR(both[0].a, 0.25f, 0.1f);
    EXPECT_NEAR(both[1].z, 10.0f, 1e-4f);
    ASSERT_EQ(sky.size(), 1u);
    EXPECT_EQ(sky[0].a, 0.0f);
    EXPECT_NEAR(sky[0].r, 1.0f, 1e-3f);
    EXPECT_GT(sky[0].z, 1e20f);
}

TEST_F(DeepCommand, FogHasTheAlphaOfItsLaw) {
    // Fog from 8 to 12 units away, and in the left half a wall within it, 9.5 units away
    w.write("s.usda", R"usda(#usda 1.0
def Xform "W"
{
    def Camera "Cam"
    {
        float focalLength = 50
        float horizontalAperture = 20
        float verticalAperture = 20
        double3 xformOp:translate = (0, 0, 10)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DomeLight "sky"
    {
        float inputs:intensity = 1
    }
    def Material "Fog"
    {
        token outputs:mtlx:volume.connect = </W/Fog/V.outputs:out>
        def Shader "V"
        {
            uniform token info:id = "ND_anisotropic_vdf"
            float3 inputs:scattering = (0.25, 0.25, 0.25)
            token outputs:out
        }
    }
    def Cube "Box" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        rel material:binding = </W/Fog>
        double size = 4
    }
    def Mesh "Wall"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-5, -5, 0.5), (0, -5, 0.5), (0, 5, 0.5), (-5, 5, 0.5)]
        uniform token subdivisionScheme = "none"
    }
}
)usda");
    const auto pixels = by_pixel(render("--spp 64 --filter box --layers none"));
    double before_wall = 0, before_middle = 0, wall = 0;
    size_t left = 0, right = 0;
    for (size_t i = 0; i < pixels.size(); ++i) {
        // Away from the edges, rays go nearly along the depth
        const int x = int(i % size), y = int(i / size);
        if (y < 12 || y >= 28 || x < 12 || x >= 28 || std::abs(x - 19.5) < 2) continue;
        double covered = 0, middle = 0;
        for (const layers::DeepSample& s : pixels[i]) {
            const bool is_segment = s.z_back > s.z || (s.a < 1 && s.a > 0);
            if (is_segment && x < 20) {
                EXPECT_GE(s.z, 8.0f);
                EXPECT_LE(s.z_back, 9.5f);
            }
            if (s.a == 1.0f) {
                wall += 1;
                EXPECT_NEAR(s.z, 9.5f, 1e-3f);
                break;
            }
            covered += (1 - covered) * double(s.a);
            if (s.z_back < 9.6f) middle = covered;
        }
        (x < 20 ? before_wall : before_middle) += x < 20 ? covered : middle;
        ++(x < 20 ? left : right);
    }
    const double law = 1 - std::exp(-0.25 * 1.5);
    EXPECT_EQ(wall, double(left));
    EXPECT_NEAR(before_wall / double(left), law, 0.015);
    // Segments end where the depth has grown by an eighth: at 9.37 for one
    EXPECT_GT(before_middle / double(right), 1 - std::exp(-0.25 * 1.3));
    EXPECT_LT(before_middle / double(right), law + 0.03);
}

TEST_F(DeepCommand, IsOneHoweverItWasMade) {
    const layers::DeepImage expected = render("--spp 40");
    for (const char* how : {"--mode tile --tile 16", "--threads 1", "--snapshot 0.01s"}) {
        const layers::DeepImage other = render(fmt::format("--spp 40 {}", how), "other");
        EXPECT_EQ(other.counts, expected.counts) << how;
        EXPECT_EQ(other.samples, expected.samples) << how;
    }
}

TEST_F(DeepCommand, RefusesWhatHasNoDeepImage) {
    const CommandResult parts = w.velatura("render s.usda --deep --samples 0:4 -o x.exr");
    EXPECT_EQ(parts.exit_code, 2);
    EXPECT_NE(parts.output.find("do not merge"), std::string::npos) << parts.output;
    const CommandResult filter = w.velatura("render s.usda --deep --filter mitchell -o x.exr");
    EXPECT_EQ(filter.exit_code, 2);
    EXPECT_EQ(w.files_beside("s.usda"), "");
    render("--spp 1");
    EXPECT_NE(w.comp("mix out.deep.exr -o y.exr").exit_code, 0);
}

}  // namespace velatura::test
