// SPDX-License-Identifier: Apache-2.0
// Features of instances and of open glass, each alone in its stage: nothing else names what they
// need. A twin that spells the same out has the same image to the bit, and a white dome (the
// stages have no light: a dome of radiance 1) shows closed forms.
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

constexpr int width = 16, height = 8;

const std::string head = R"(#usda 1.0
def Camera "Cam" {
    double3 xformOp:translate = (0, 0, 20)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)";

/// A material with one input by the primvar `name`, which reads it as `type`.
std::string reads(const char* input, const char* name, const char* type) {
    return fmt::format(R"(
def Material "M" {{
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        int inputs:useSpecularWorkflow = 1
        color3f inputs:{}.connect = </M/R.outputs:result>
        token outputs:surface
    }}
    def Shader "R" {{
        uniform token info:id = "UsdPrimvarReader_{}"
        string inputs:varname = "{}"
        {} outputs:result
    }}
}}
)",
                       input, type, name, std::string(type) == "float" ? "float" : "float3");
}

const std::string bound = "rel material:binding = </M>\n";

/// Two cubes beside each other, as instances with these primvars.
std::string instanced(const std::string& primvars, const std::string& of_cube) {
    return R"(
def PointInstancer "P" {
    point3f[] positions = [(-2, 0, 0), (2, 0, 0)]
    int[] protoIndices = [0, 0]
    rel prototypes = </P/C>
)" + primvars +
           "def Cube \"C\" {\ndouble size = 3\n" + of_cube + "}\n}\n";
}

/// The same as instances of two cubes that have their primvars by themselves.
std::string spelled_out(const std::string& left,
                        const std::string& right,
                        const std::string& both) {
    const auto cube = [&](const char* name, const std::string& own) {
        return fmt::format("def Cube \"{}\" {{\ndouble size = 3\n{}{}}}\n", name, own, both);
    };
    return R"(
def PointInstancer "P" {
    point3f[] positions = [(-2, 0, 0), (2, 0, 0)]
    int[] protoIndices = [0, 1]
    rel prototypes = [</P/C>, </P/D>]
)" + cube("C", left) +
           cube("D", right) + "}\n";
}

film::Film render(const std::string& text, uint64_t samples = 16, int w = width, int h = height) {
    integrator::RenderOptions options;
    options.end_sample = samples;
    return render_scene(scene_from_usda(text, w, h), options);
}

/// The mean over columns [from, to) of the rows in the middle, by channel, of one sample.
std::vector<double> mean_of(const film::Film& film, uint64_t samples, int from, int to) {
    const std::vector<double> sums = beauty(film);
    const int w = film.window().x1 - film.window().x0, h = film.window().y1 - film.window().y0;
    std::vector<double> mean(3);
    for (int y = h / 2 - 1; y <= h / 2; ++y)
        for (int x = from; x < to; ++x)
            for (size_t c = 0; c < 3; ++c)
                mean[c] += sums[3 * size_t(y * w + x) + c] / double(samples);
    for (double& m : mean) m /= double(2 * (to - from));
    return mean;
}

struct Twin {
    const char* what;
    std::string alone, twin;
};

}  // namespace

TEST(Alone, PrimvarsOfInstancesAreThoseOfTheirPrototypes) {
    const std::string red = "[(0.7, 0.1, 0.1)]\n", blue = "[(0.1, 0.1, 0.7)]\n";
    const std::string both = "[(0.7, 0.1, 0.1), (0.1, 0.1, 0.7)]";
    const std::string by_instance = " (interpolation = \"vertex\")\n";
    const auto color = [](const std::string& name, const std::string& value) {
        return "color3f[] primvars:" + name + " = " + value;
    };
    const std::string tint = reads("diffuseColor", "tint", "float3");
    const std::string glow = reads("emissiveColor", "glow", "float3");
    const std::string seen = "float[] primvars:displayOpacity = ";
    const Twin twins[] = {
        {"displayColor", instanced(color("displayColor", both) + by_instance, ""),
         spelled_out(color("displayColor", red), color("displayColor", blue), "")},
        {"displayColor for all", instanced(color("displayColor", red), ""),
         spelled_out(color("displayColor", red), color("displayColor", red), "")},
        {"displayOpacity", instanced(seen + "[0.25, 0.75]" + by_instance, ""),
         spelled_out(seen + "[0.25]\n", seen + "[0.75]\n", "")},
        {"a primvar that the material reads",
         tint + instanced(color("tint", both) + by_instance, bound),
         tint + spelled_out(color("tint", red), color("tint", blue), bound)},
        {"with indices",
         tint + instanced(color("tint", "[(0.1, 0.1, 0.7), (0.7, 0.1, 0.1)]") + by_instance +
                              "int[] primvars:tint:indices = [1, 0]\n",
                          bound),
         tint + spelled_out(color("tint", red), color("tint", blue), bound)},
        {"light that is given off", glow + instanced(color("glow", both) + by_instance, bound),
         glow + spelled_out(color("glow", red), color("glow", blue), bound)},
    };
    for (const Twin& t : twins) {
        SCOPED_TRACE(t.what);
        if (std::string(t.what) == "light that is given off") {
            // Other lists of lights: other random choices, the same mean
            const auto a = mean_of(render(head + t.alone, 64), 64, 2, 14);
            const auto b = mean_of(render(head + t.twin, 64), 64, 2, 14);
            for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 0.05 * b[c]);
            continue;
        }
        EXPECT_EQ(beauty(render(head + t.alone)), beauty(render(head + t.twin)));
    }
}

/// A Lambert surface in a white dome shows its albedo: irradiance π times albedo / π. The front
/// faces of the cubes see nothing but the dome (and none of each other).
TEST(Alone, InstancesShowTheirColorInAWhiteDome) {
    constexpr uint64_t samples = 256;
    const film::Film film = render(
        head + instanced("color3f[] primvars:displayColor = [(0.7, 0.1, 0.1), (0.1, 0.1, 0.7)] "
                         "(interpolation = \"vertex\")\n",
                         ""),
        samples);
    const auto left = mean_of(film, samples, 4, 6), right = mean_of(film, samples, 10, 12);
    const double expected[2][3] = {{0.7, 0.1, 0.1}, {0.1, 0.1, 0.7}};
    for (size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(left[c], expected[0][c], 0.01);
        EXPECT_NEAR(right[c], expected[1][c], 0.01);
    }
}

/// What absorbs nothing cannot be seen in a white dome: R + T = 1 for every ray, be it a sheet, a
/// solid, rough or smooth, part or all clear (the base is white, a Lambert reflection of what is
/// not transmitted).
TEST(Alone, ClearGlassCannotBeSeenInAWhiteDome) {
    const auto glass = [](const char* lines) {
        return fmt::format(R"(
def Material "M" {{
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        {}
        token outputs:surface
    }}
}}
)",
                           lines);
    };
    const std::string sheet = R"(
def Mesh "Window" {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-5, -3, 0), (5, -3, 0), (5, 3, 0), (-5, 3, 0)]
    uniform token subdivisionScheme = "none"
)" + bound + "}\n";
    const std::string pane = R"(
def Mesh "Window" {
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 7, 6, 5, 4, 0, 4, 5, 1,
        1, 5, 6, 2, 2, 6, 7, 3, 3, 7, 4, 0]
    point3f[] points = [(-5, -3, 0), (5, -3, 0), (5, 3, 0), (-5, 3, 0), (-5, -3, -0.01),
        (5, -3, -0.01), (5, 3, -0.01), (-5, 3, -0.01)]
    uniform token subdivisionScheme = "none"
)" + bound + "}\n";

    const struct {
        const char* what;
        std::string prims;
        double tolerance;
    } cases[] = {
        {"a sheet", glass("float inputs:opacity = 0\nfloat inputs:roughness = 0") + sheet, 1e-3},
        {"a rough sheet", glass("float inputs:opacity = 0\nfloat inputs:roughness = 0.5") + sheet,
         0.01},
        {"a sheet of part opacity",
         glass("float inputs:opacity = 0.5\nfloat inputs:roughness = 0\n"
               "color3f inputs:diffuseColor = (1, 1, 1)") +
             sheet,
         0.02},
        {"a closed pane", glass("float inputs:opacity = 0\nfloat inputs:roughness = 0") + pane,
         0.01},
        {"a Plane",
         glass("float inputs:opacity = 0\nfloat inputs:roughness = 0") +
             "def Plane \"Window\" {\ndouble width = 10\ndouble length = 6\n" + bound + "}\n",
         1e-3},
    };

    for (const auto& c : cases) {
        constexpr uint64_t samples = 64;
        const auto mean = mean_of(render(head + c.prims, samples), samples, 6, 10);
        std::printf("%s: %.5f\n", c.what, mean[1]);
        EXPECT_NEAR(mean[1], 1.0, c.tolerance) << c.what;
    }
}

}  // namespace velatura::test
