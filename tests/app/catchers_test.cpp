// SPDX-License-Identifier: Apache-2.0
// Catchers: what stands for a plate leaves the image and comes back as layers. Oracles: the same
// scene rendered without catchers, and without everything that is none.
#include "image/exr.h"
#include "rendered_image.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

constexpr const char* catcher = "bool primvars:velatura:catcher = 1";

/// A floor below a dome and a lamp, seen from above its edge.
std::string set_with(const std::string& floor, const std::string& props) {
    return R"usda(#usda 1.0
def Xform "W"
{
    def Camera "Cam"
    {
        float focalLength = 30
        float horizontalAperture = 36
        float verticalAperture = 24
        float2 clippingRange = (0.01, 1000)
        double3 xformOp:translate = (0, 2.5, 5)
        float xformOp:rotateX = -25
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
    }
    def DomeLight "sky"
    {
        float inputs:intensity = 0.4
        color3f inputs:color = (0.6, 0.8, 1)
    }
    def SphereLight "key"
    {
        float inputs:radius = 0.3
        float inputs:intensity = 40
        double3 xformOp:translate = (2, 3, 1)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
)usda" + floor +
           props + "}\n";
}

std::string floor_with(const std::string& lines) {
    return R"usda(    def Mesh "Floor"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)]
        uniform token subdivisionScheme = "none"
        color3f[] primvars:displayColor = [(0.5, 0.4, 0.3)]
        )usda" +
           lines + "\n    }\n";
}

const std::string red_ball = R"usda(    def Sphere "Ball"
    {
        double radius = 0.8
        color3f[] primvars:displayColor = [(0.9, 0.1, 0.1)]
        double3 xformOp:translate = (0, 0.8, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
)usda";

/// Paths as they are without anything that is learned of a whole scene.
const std::string plain =
    "--adaptive off --roulette throughput --guiding off --splitting off "
    "--caustics path --res 48 32 --progress none --float-layers ";

class Catchers : public testing::Test {
  protected:
    image::Image render(const std::string& name,
                        const std::string& scene,
                        const std::string& arguments = plain + "--spp 16") {
        w.write(name + ".usda", scene);
        const CommandResult r =
            w.velatura(fmt::format("render {}.usda -o {}.exr {}", name, name, arguments));
        EXPECT_EQ(r.exit_code, 0) << r.output;
        output = r.output;
        return read_image(w, name + ".exr");
    }

    Workplace w;
    std::string output;
};

constexpr const char* channels[] = {"R", "G", "B"};

/// What is left of the image and the light of the catchers give the image without catchers, sample
/// by sample: the same paths, deposited elsewhere.
void expect_sum(const image::Image& caught, const image::Image& whole) {
    double light = 0;
    for (const char* c : channels) {
        for (size_t i = 0; i < whole.data.pixel_count(); ++i) {
            const double sum = value(caught, c, i) + value(caught, fmt::format("catcher.{}", c), i);
            ASSERT_NEAR(sum, value(whole, c, i), 1e-5 * (1 + sum)) << c << " of pixel " << i;
            light += value(caught, fmt::format("catcher.{}", c), i);
        }
    }
    EXPECT_GT(light, 0);
}

/// Where nothing but catchers is seen, plate_ layers are the image of a scene of them alone.
void expect_plate(const image::Image& caught,
                  const image::Image& plate,
                  const image::Image& whole) {
    size_t seen = 0;
    for (size_t i = 0; i < whole.data.pixel_count(); ++i) {
        if (value(caught, "A", i) != 0.0 || value(whole, "A", i) != 1.0) continue;
        ++seen;
        for (const char* c : channels)
            ASSERT_NEAR(value(caught, fmt::format("plate.{}", c), i), value(plate, c, i),
                        1e-5 * (1 + value(plate, c, i)))
                << c << " of pixel " << i;
    }
    EXPECT_GT(seen, whole.data.pixel_count() / 4);
}

}  // namespace

TEST_F(Catchers, ShowTheSceneAndThePlate) {
    const image::Image whole = render("whole", set_with(floor_with(""), red_ball)),
                       plate = render("plate", set_with(floor_with(""), "")),
                       caught = render("caught", set_with(floor_with(catcher), red_ball));
    expect_sum(caught, whole);
    expect_plate(caught, plate, whole);
    // The catcher is neither in the image nor in its alpha, and in a shadow it is darker
    size_t shadows = 0;
    for (size_t i = 0; i < whole.data.pixel_count(); ++i) {
        if (value(caught, "A", i) != 0.0 || value(whole, "A", i) != 1.0) continue;
        EXPECT_EQ(value(caught, "R", i), 0.0);
        EXPECT_EQ(value(caught, "b1.G", i), 0.0);
        shadows += size_t(value(caught, "catcher.G", i) < 0.7 * value(caught, "plate.G", i));
    }
    EXPECT_GT(shadows, 10u);
    // By lights they are the same
    for (const char* layer : {"catcher", "plate"}) {
        for (size_t i = 0; i < whole.data.pixel_count(); ++i) {
            const auto of = [&](const std::string& group) {
                return value(caught, fmt::format("{}{}.G", layer, group), i);
            };
            EXPECT_NEAR(of("_sky") + of("_key") + of("_emissive"), of(""), 1e-5 * (1 + of("")));
        }
    }
}

/// The photo is a render without the prop: with gains, too, the comp is a mix of the whole render,
/// but for edges.
TEST_F(Catchers, AMixOverAPlateIsTheRenderOfAll) {
    const image::Image whole = render("whole", set_with(floor_with(""), red_ball)),
                       caught = render("caught", set_with(floor_with(catcher), red_ball));
    render("photo", set_with(floor_with(""), ""));
    for (const char* gains : {"", "--gain key=2 --exposure 1"}) {
        const CommandResult over =
            w.comp(fmt::format("mix caught.exr --plate photo.exr -o comp.exr {} -q", gains));
        ASSERT_EQ(over.exit_code, 0) << over.output;
        EXPECT_NE(over.output.find("pixels without alpha have light"), std::string::npos)
            << over.output;
        const CommandResult mixed = w.comp(fmt::format("mix whole.exr -o mixed.exr {} -q", gains));
        ASSERT_EQ(mixed.exit_code, 0) << mixed.output;
        const image::Image comp = read_image(w, "comp.exr"), expected = read_image(w, "mixed.exr");
        size_t compared = 0;
        for (size_t i = 0; i < comp.data.pixel_count(); ++i) {
            EXPECT_EQ(value(comp, "A", i), 1.0);
            const bool is_prop = value(caught, "A", i) == 1.0,
                       is_floor = value(caught, "A", i) == 0.0 && value(whole, "A", i) == 1.0;
            if (!is_prop && !is_floor) continue;
            ++compared;
            for (const char* c : channels)
                ASSERT_NEAR(value(comp, c, i), value(expected, c, i),
                            1e-3 * (0.1 + value(expected, c, i)))
                    << gains << " " << c << " of pixel " << i;
        }
        EXPECT_GT(compared, comp.data.pixel_count() / 4);
    }
    // What cannot be laid under it
    EXPECT_EQ(w.comp("mix caught.exr --plate missing.exr -o no.exr -q").exit_code, 1);
    render("small", set_with(floor_with(""), ""), "--res 24 16 --spp 1 --progress none");
    const CommandResult small = w.comp("mix caught.exr --plate small.exr -o no.exr -q");
    EXPECT_EQ(small.exit_code, 1);
    EXPECT_NE(small.output.find("small.exr is 24 x 16, the image 48 x 32"), std::string::npos)
        << small.output;
    EXPECT_NE(w.comp("mix caught.exr --plate photo.exr --with-layers -o no.exr -q").exit_code, 0);
    EXPECT_NE(w.comp("mix caught.exr --plate photo.exr -o photo.exr -q").exit_code, 0);
}

/// A plate of an emissive and of a glowing object's scene does not know of them.
TEST_F(Catchers, LightThatPropsGiveIsNotInThePlate) {
    const std::string lamp = R"usda(    def Sphere "Lamp" (prepend apiSchemas = ["MeshLightAPI"])
    {
        double radius = 0.5
        float inputs:intensity = 3
        double3 xformOp:translate = (0, 0.8, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
)usda";
    const image::Image whole = render("whole", set_with(floor_with(""), lamp)),
                       plate = render("plate", set_with(floor_with(""), "")),
                       caught = render("caught", set_with(floor_with(catcher), lamp));
    expect_sum(caught, whole);
    double lit = 0, alone = 0, of_plate = 0;
    for (size_t i = 0; i < whole.data.pixel_count(); ++i) {
        if (value(caught, "A", i) != 0.0 || value(whole, "A", i) != 1.0) continue;
        lit += value(caught, "catcher.G", i);
        alone += value(caught, "plate.G", i);
        of_plate += value(plate, "G", i);
    }
    EXPECT_GT(lit, 1.1 * alone);
    EXPECT_NEAR(alone, of_plate, 0.02 * of_plate);
}

/// Catchers among the shapes of instances, which a plate places without the others.
TEST_F(Catchers, CanBePartsOfInstances) {
    const auto instances = [](const std::string& lines) {
        return "    class \"Tile\"\n    {\n" + red_ball + floor_with(lines) + "    }\n" + R"usda(
    def Xform "A" (instanceable = true
        inherits = </W/Tile>)
    {
    }
    def Xform "B" (instanceable = true
        inherits = </W/Tile>)
    {
        double3 xformOp:translate = (-6, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
)usda";
    };
    const image::Image whole = render("whole", set_with(instances(""), "")),
                       caught = render("caught", set_with(instances(catcher), ""));
    expect_sum(caught, whole);
    double brightest = 0;
    for (size_t i = 0; i < whole.data.pixel_count(); ++i)
        brightest = std::max(brightest, value(caught, "plate.R", i) - value(caught, "plate.B", i));
    // Nothing red is left but a warm floor
    EXPECT_LT(brightest, 2.0);
    EXPECT_GT(brightest, 0.0);
}

TEST_F(Catchers, GetAsManySamplesAsTheirNoiseAsksFor) {
    const std::string adaptive =
        "--roulette throughput --guiding off --splitting off --caustics "
        "path --res 48 32 --progress none --spp 64";
    const image::Image whole = render("whole", set_with(floor_with(""), red_ball), adaptive),
                       caught = render("caught", set_with(floor_with(catcher), red_ball), adaptive);
    const image::Channel* counts = caught.find("sampleCount");
    ASSERT_NE(counts, nullptr);
    double floor = 0, sky = 0;
    size_t floors = 0, skies = 0;
    for (size_t i = 0; i < caught.data.pixel_count(); ++i) {
        if (value(caught, "A", i) != 0.0) continue;
        const bool is_floor = value(whole, "A", i) == 1.0;
        (is_floor ? floor : sky) += double(counts->value(i));
        ++(is_floor ? floors : skies);
    }
    // Both are black in the image; the sky has no noise
    EXPECT_GT(floor / double(floors), 2 * sky / double(skies));
}

TEST_F(Catchers, TheAttributesOfOthersAreRead) {
    for (const char* lines : {"int primvars:ri:attributes:trace:holdout = 1",
                              "bool primvars:cycles:object:is_shadow_catcher = 1"}) {
        const image::Image image =
            render("s", set_with(floor_with(lines), red_ball), plain + "--spp 1");
        EXPECT_NE(image.find("catcher.R"), nullptr) << lines;
        EXPECT_EQ(output.find("warning: /W/Floor"), std::string::npos) << output;
    }
    const image::Image image =
        render("s", set_with(floor_with("bool primvars:velatura:catcher = 0"), red_ball),
               plain + "--spp 1");
    EXPECT_EQ(image.find("catcher.R"), nullptr);
}

}  // namespace velatura::test
