// SPDX-License-Identifier: Apache-2.0
// `render --cryptomatte-through` against the scene without what mattes pass.
#include "command.h"
#include "film/cryptomatte_decoder.h"
#include "image/exr.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

const std::string head = R"usda(#usda 1.0
def Camera "Cam"
{
    float focalLength = 50
    float horizontalAperture = 20
    float verticalAperture = 20
    double3 xformOp:translate = (0, 0, 10)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "Sky"
{
}
)usda";

std::string material(const std::string& name, const std::string& inputs) {
    return fmt::format(R"usda(def Material "{0}"
{{
    token outputs:surface.connect = </{0}/S.outputs:surface>
    def Shader "S"
    {{
        uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness = 0
{1}
        token outputs:surface
    }}
}}
)usda",
                       name, inputs);
}

std::string glass(const std::string& name, double ior) {
    return material(name, fmt::format("float inputs:opacity = 0\nfloat inputs:ior = {}\n", ior));
}

std::string placed(const std::string& type,
                   const std::string& name,
                   const std::string& inside,
                   const std::string& at,
                   const std::string& bound = "") {
    const std::string binding = bound.empty() ? "" : "rel material:binding = </" + bound + ">\n";
    return "def " + type + " \"" + name +
           "\" (\n prepend apiSchemas = [\"MaterialBindingAPI\"]\n)\n{\n" + binding + inside +
           "\n double3 xformOp:translate = " + at +
           "\n uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n";
}

const std::string toys = placed("Sphere", "Ball", "double radius = 0.7", "(-0.6, 0.5, 0)") +
                         placed("Cube", "Box", "double size = 1", "(0.7, -0.4, -1)") +
                         placed("Cube", "Floor", "double size = 4", "(0, -3, -1)");

std::string pane(const std::string& name, double z, const std::string& bound) {
    return placed("Mesh", name,
                  "int[] faceVertexCounts = [4]\n int[] faceVertexIndices = [0, 1, 2, 3]\n "
                  "point3f[] points = [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)]\n uniform "
                  "token subdivisionScheme = \"none\"",
                  fmt::format("(0, 0, {})", z), bound);
}

class CryptomatteThrough : public testing::Test {
  protected:
    CryptomatteDecoder mattes(const std::string& scene,
                              const std::string& through,
                              const std::string& more = "") {
        w.write("s.usda", head + scene);
        const CommandResult r = w.velatura(
            "render s.usda -o out.exr --res 40 40 --spp 8 --max-depth 3 --progress none -q "
            "--adaptive off --cryptomatte object,material" +
            (through.empty() ? "" : " --cryptomatte-through " + through) + more);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        Result<image::Image> image = image::read_exr(w.path("out.exr"));
        if (!image) throw std::runtime_error(image.error().message);
        return {*image, "CryptoObject"};
    }

    Workplace w;
};

double coverage_of(const CryptomatteDecoder& mattes, const std::string& name) {
    double sum = 0;
    for (const float v : mattes.matte(name)) sum += double(v);
    return sum;
}

/// Rays go on from the surfaces that they pass: a sample at a silhouette can meet the other side.
void expect_same(const CryptomatteDecoder& found,
                 const CryptomatteDecoder& expected,
                 const std::string& what) {
    double difference = 0, all = 0;
    for (const auto& [name, id] : expected.manifest) {
        const std::vector<float> a = found.of_id(id), b = expected.of_id(id);
        for (size_t i = 0; i < a.size(); ++i) {
            difference += std::abs(double(a[i]) - double(b[i]));
            all += double(b[i]);
        }
    }
    EXPECT_GT(all, 100.0);
    // Of 12800 samples
    EXPECT_LE(difference, 2 * 2.0 / 8) << what;
    EXPECT_EQ(found.manifest, expected.manifest) << what;
}

}  // namespace

TEST_F(CryptomatteThrough, APaneIsNotThere) {
    const CryptomatteDecoder bare = mattes(toys, "");
    EXPECT_GT(coverage_of(bare, "/Ball"), 100.0);

    struct Case {
        const char* name;
        std::string scene;
    };

    const Case cases[] = {
        {"thin pane", glass("G", 1.5) + pane("Pane", 5, "G")},
        {"two thin panes", glass("G", 1.5) + pane("Pane", 5, "G") + pane("Other", 4, "G")},
        {"solid of index 1",
         glass("G", 1.0) + placed("Cube", "Pane", "double size = 4", "(0, 0, 3.5)", "G")},
        {"solid of index 1 behind a pane",
         glass("G", 1.0) + glass("H", 1.4) +
             placed("Cube", "Slab", "double size = 4", "(0, 0, 3.5)", "G") + pane("Pane", 6, "H")}};
    for (const Case& c : cases) {
        expect_same(mattes(toys + c.scene, "refraction"), bare, c.name);
        const CryptomatteDecoder kept = mattes(toys + c.scene, "");
        EXPECT_EQ(coverage_of(kept, "/Ball"), 0.0) << c.name;
        EXPECT_EQ(coverage_of(mattes(toys + c.scene, "reflection"), "/Ball"), 0.0) << c.name;
    }
    // Of what is seen through a solid nothing is its own
    const CryptomatteDecoder ball = mattes(
        toys + glass("G", 1.5) + placed("Sphere", "Lens", "double radius = 1", "(0, 0, 4)", "G"),
        "refraction,reflection");
    EXPECT_EQ(coverage_of(ball, "/Lens"), 0.0);
    EXPECT_GT(coverage_of(ball, "/Ball"), 20.0);
    // What scatters light itself is seen itself
    EXPECT_EQ(coverage_of(mattes(toys + material("G", "float inputs:opacity = 0.4\n") +
                                     pane("Pane", 5, "G"),
                                 "refraction"),
                          "/Ball"),
              0.0);
}

// A mirror at 45 degrees shows what lies above it where its image would be
TEST_F(CryptomatteThrough, AMirrorShowsTheMirrorImage) {
    const std::string mirror =
        material("M",
                 "float inputs:metallic = 1\ncolor3f inputs:diffuseColor = (0.9, 0.9, 0.9)\n") +
        placed("Mesh", "Mirror",
               "int[] faceVertexCounts = [4]\n int[] faceVertexIndices = [0, 1, 2, 3]\n point3f[] "
               "points = [(-5, -5, 5), (5, -5, 5), (5, 5, -5), (-5, 5, -5)]\n uniform token "
               "subdivisionScheme = \"none\"",
               "(0, 0, 0)", "M");
    const auto balls = [](const char* first, const char* second) {
        return placed("Sphere", "A", "double radius = 0.6", first) +
               placed("Sphere", "B", "double radius = 0.8", second);
    };
    // (x, y, z) → (x, −z, −y)
    const CryptomatteDecoder direct = mattes(balls("(0.3, -0.1, -4)", "(-0.5, 0.4, -6)"), "");
    const std::string scene = mirror + balls("(0.3, 4, 0.1)", "(-0.5, 6, -0.4)");
    expect_same(mattes(scene, "reflection"), direct, "mirror");
    const CryptomatteDecoder kept = mattes(scene, "refraction");
    EXPECT_EQ(coverage_of(kept, "/A"), 0.0);
    EXPECT_NEAR(coverage_of(kept, "/Mirror"), 1600.0, 1.0);
}

TEST_F(CryptomatteThrough, LeavesTheImageAlone) {
    const std::string scene = toys + glass("G", 1.5) + pane("Pane", 5, "G");
    const std::string layers = " --layers bounce,data";
    mattes(scene, "", layers);
    const image::Image plain = *image::read_exr(w.path("out.exr"));
    mattes(scene, "refraction,reflection", layers);
    const image::Image with = *image::read_exr(w.path("out.exr"));
    for (const image::Part& part : plain.parts) {
        for (const image::Channel& c : part.channels) {
            if (c.name.starts_with("Crypto")) continue;
            const image::Channel* other = with.find(c.name);
            ASSERT_NE(other, nullptr) << c.name;
            EXPECT_EQ(c.data, other->data) << c.name;
        }
    }
    for (const auto& [arguments, text] :
         {std::pair{"--cryptomatte object --cryptomatte-through glass", "expected refraction"},
          std::pair{"--cryptomatte-through refraction", "needs --cryptomatte"}}) {
        const CommandResult wrong = w.velatura(std::string("render s.usda ") + arguments);
        EXPECT_EQ(wrong.exit_code, 2);
        EXPECT_NE(wrong.output.find(text), std::string::npos) << wrong.output;
    }
}

}  // namespace velatura::test
