// SPDX-License-Identifier: Apache-2.0
// Shadows by who casts them: they are parts of the shadow, what blocks light gets it and nobody
// else, and what is lifted is what a render without that shadow shows.
#include "image_sums.h"
#include "layers/resolve.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdio>

namespace velatura::test {

namespace {

constexpr int width = 16, height = 12;

film::Film render(const scene::Scene& scene, uint64_t samples, uint64_t seed = 1) {
    integrator::RenderOptions options;
    options.end_sample = samples;
    options.seed = seed;
    return render_scene(scene, options,
                        RenderSetup{.light_selection = lights::SelectionKind::Uniform,
                                    .sampler = sampling::SamplerKind::SobolHalves});
}

ImageLight taken_by(const film::Film& film, int group, const std::string& caster) {
    const auto& casters = film.layer_set().casters;
    for (uint32_t c = 0; c < casters.size(); ++c)
        if (casters[c].name == caster) return light_of(film, film.sums().table().taken(group, c));
    ADD_FAILURE() << "no caster " << caster;
    return light_of(film, film.sums().table().unoccluded(group));
}

/// What no caster is told to have taken.
ImageLight rest_of(const film::Film& film, int group) {
    const accumulate::AccumulatorTable& table = film.sums().table();
    ImageLight rest =
        light_of(film, table.unoccluded(group)) - light_of(film, table.matrix(1, group));
    for (uint32_t c = 0; c < film.layer_set().casters.size(); ++c)
        rest = rest - light_of(film, table.taken(group, c));
    return rest;
}

/// A floor under lights of every kind, and what stands on it.
std::string stage(const std::string& things, const std::string& links = "") {
    const auto light = [&](const std::string& type, const std::string& name,
                           const std::string& rest) {
        return fmt::format("def {} \"{}\" {{\n{}\n{}\n}}\n", type, name, rest, links);
    };
    return R"usda(#usda 1.0
( upAxis = "Y" )
def Camera "Cam" {
    float focalLength = 24
    double3 xformOp:translate = (0, 3, 5)
    float xformOp:rotateX = -30
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
}
def Mesh "Floor" {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-4, 0, 4), (4, 0, 4), (4, 0, -4), (-4, 0, -4)]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(0.6, 0.5, 0.4)]
}
)usda" +
           light("RectLight", "Key",
                 "float inputs:intensity = 3\nfloat inputs:width = 2\nfloat inputs:height = "
                 "2\ndouble3 xformOp:translate = (1, 3, 0)\n"
                 "float xformOp:rotateX = -90\nuniform token[] xformOpOrder = "
                 "[\"xformOp:translate\", \"xformOp:rotateX\"]") +
           light("SphereLight", "Lamp",
                 "float inputs:intensity = 4\nfloat inputs:radius = 0.5\ndouble3 xformOp:translate "
                 "= (-1.5, 2.5, 1)\nuniform token[] xformOpOrder = [\"xformOp:translate\"]") +
           light("DistantLight", "Sun",
                 "float inputs:intensity = 4\nfloat inputs:angle = 40\nfloat xformOp:rotateX = "
                 "-60\nuniform token[] xformOpOrder = [\"xformOp:rotateX\"]") +
           light("DomeLight", "Sky", "float inputs:intensity = 0.5") + things;
}

std::string cube(const std::string& name, const std::string& where, const std::string& more = "") {
    return "def Cube \"" + name + "\" {\n double size = 0.8\n double3 xformOp:translate = (" +
           where + ")\n uniform token[] xformOpOrder = [\"xformOp:translate\"]\n" + more + "\n}\n";
}

/// Links that leave what is at the path out of shadows.
std::string without(const std::string& path) {
    return "prepend rel collection:shadowLink:excludes = <" + path + ">";
}

/// Lifting the caster's shadows by 1 gives the direct light of the stage in which it casts none.
void expect_lifted(const std::string& things, const std::string& caster, const std::string& path) {
    SCOPED_TRACE(caster);
    const film::Film film = render(scene_from_usda(stage(things), width, height, true), 256);
    // The same samples, so that nothing but the shadow tells them apart
    const film::Film hidden =
        render(scene_from_usda(stage(things, without(path)), width, height), 256);
    double worst = 0, worst_square = 0, max = 0;
    for (int g = 0; g < 4; ++g) {
        const uint32_t direct = film.sums().table().matrix(1, g);
        const ImageLight taken = taken_by(film, g, caster),
                         bare = light_of(hidden, hidden.sums().table().matrix(1, g));
        const ImageLight difference = light_of(film, direct) + taken - bare;
        EXPECT_LT(distance(difference), 4.0) << film.layer_set().groups[size_t(g)].name;
        EXPECT_LT(mean_square_of_quarters(difference), 5.0)
            << film.layer_set().groups[size_t(g)].name;
        worst = std::max(worst, distance(difference));
        worst_square = std::max(worst_square, mean_square_of_quarters(difference));
        max = std::max(max, 4.28 * std::sqrt(whole(difference).variance) / whole(taken).value);
        EXPECT_GT(whole(taken).value, 0.0);
    }
    std::printf(
        "%s: worst |z| %.2f, worst mean square %.2f; 90 %% power from %.1f %% of its shadow\n",
        caster.c_str(), worst, worst_square, 100 * max);
}

std::string cutout() {
    return R"usda(
def Material "Net" {
    token outputs:surface.connect = </Net/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:opacity = 0.4
        token inputs:opacityMode = "presence"
        token outputs:surface
    }
}
def Material "Thin" {
    token outputs:surface.connect = </Thin/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:opacity = 0.3
        float inputs:ior = 1
        token outputs:surface
    }
}
)usda" + cube("Veil", "-0.6, 0.6, 0", "rel material:binding = </Net>") +
           cube("Pane", "0.7, 0.6, 0", "rel material:binding = </Thin>") +
           cube("Block", "0, 0.6, -1");
}

std::string smoke() {
    return cube("Block", "0.8, 0.6, 0") + R"usda(
def Volume "Smoke" {
    rel field:density = </Smoke/D>
    float velatura:volume:densityScale = 0.7
    double3 xformOp:translate = (-1.5, 0.2, -1)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def OpenVDBAsset "D" {
        token fieldName = "waves"
    }
}
)usda";
}

}  // namespace

TEST(Casters, AddUpToTheShadowBitForBit) {
    const scene::Scene scene = scene_from_usda(soft_room(), width, height, true);
    const film::Film film = render(scene, 16);
    const layers::ResolvedLayers layers = layers::resolve_layers(film.sums());
    ASSERT_EQ(layers.first_failure, "");
    int shadows = 0;
    for (const accumulate::LayerEntry& e : layers.layers) {
        if (e.family != "shadow" || e.is_empty) continue;
        EXPECT_EQ(e.type, "float");
        ++shadows;
        for (const char* c : {".R", ".G", ".B"}) {
            const image::Channel& shadow = *layers.image.find(e.name + c);
            std::vector<float> fold(shadow.size(), 0.0f);
            std::vector<double> size(shadow.size(), 0.0);
            for (const accumulate::LayerEntry& part : layers.layers) {
                if (part.family != "caster" || part.group != e.group || part.is_empty) continue;
                const image::Channel& channel = *layers.image.find(part.name + c);
                for (size_t i = 0; i < fold.size(); ++i) {
                    fold[i] += channel.value(i);
                    size[i] += std::abs(double(channel.value(i)));
                }
            }
            const image::Channel &u = *layers.image.find("U_" + e.group + c),
                                 &b1 = *layers.image.find("b1_" + e.group + c);
            for (size_t i = 0; i < fold.size(); ++i) {
                ASSERT_EQ(std::bit_cast<uint32_t>(fold[i]),
                          std::bit_cast<uint32_t>(shadow.value(i)))
                    << e.name;
                // All of it, to the rounding of half
                const double bound =
                    0x1p-10 * (size[i] + double(u.value(i)) + double(b1.value(i))) + 1e-6;
                ASSERT_NEAR(fold[i], double(u.value(i)) - double(b1.value(i)), bound) << e.name;
            }
        }
    }
    EXPECT_GE(shadows, 4);
}

// Who asks changes nothing of what arrives
TEST(Casters, ChangeNoOtherLayer) {
    for (const std::string& text : {soft_room(), stage(cutout()), stage(smoke()),
                                    stage(cube("Block", "0, 0.6, 0"), without("/Floor"))}) {
        const film::Film with = render(scene_from_usda(text, width, height, true), 8),
                         without_casters = render(scene_from_usda(text, width, height), 8);
        const uint32_t count = without_casters.sums().table().count();
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                for (uint32_t a = 0; a < count; ++a)
                    ASSERT_EQ(with.sums().total(x, y, a), without_casters.sums().total(x, y, a))
                        << a;
            }
        }
    }
}

// Nothing is left over in the mean: what does not arrive was taken by somebody with a name
TEST(Casters, TakeAllThatDoesNotArrive) {
    struct Case {
        const char* name;
        std::string text;
    };

    const Case cases[] = {
        {"room", soft_room()},
        {"cut-outs and thin bodies", stage(cutout())},
        {"smoke", stage(smoke())},
        {"own shadows",
         stage(cutout(), without("/Block") +
                             "\nfloat inputs:shadow:distance = 1.5\nfloat inputs:shadow:falloff = "
                             "1\ncolor3f inputs:shadow:color = (0.1, 0.2, 0.3)")}};
    for (const Case& c : cases) {
        const film::Film film = render(scene_from_usda(c.text, width, height, true), 256);
        double worst = 0, max = 0;
        for (int g = 0; g < film.layer_set().group_count(); ++g) {
            const ImageLight rest = rest_of(film, g);
            const accumulate::AccumulatorTable& table = film.sums().table();
            const double shadow =
                whole(light_of(film, table.unoccluded(g)) - light_of(film, table.matrix(1, g)))
                    .value;
            EXPECT_LT(distance(rest), 4.0)
                << c.name << " " << film.layer_set().groups[size_t(g)].name << ": "
                << whole(rest).value << " of " << shadow;
            worst = std::max(worst, distance(rest));
            if (shadow > 1e-3) max = std::max(max, 5.28 * std::sqrt(whole(rest).variance) / shadow);
        }
        std::printf(
            "%s: rest within %.2f standard errors of none; 90 %% power from %.2f %% of a shadow\n",
            c.name, worst, 100 * max);
    }
}

TEST(Casters, LiftedAreAsIfTheyCastNoShadow) {
    expect_lifted(cube("Block", "0, 0.6, 0"), "Block", "/Block");
}

TEST(Casters, LiftedCutoutsAreAsIfTheyCastNoShadow) {
    // Flat: what goes on through the bottom of a cube meets the floor as well
    std::string things = cutout();
    things =
        things.substr(0, things.find("def Cube")) +
        "def Mesh \"Veil\" {\n int[] faceVertexCounts = [4]\n int[] faceVertexIndices = [0, 1, 2, "
        "3]\n point3f[] points = [(-1, 0.8, 1), (1, 0.8, 1), (1, 0.8, -1), (-1, 0.8, -1)]\n"
        " uniform token subdivisionScheme = \"none\"\n rel material:binding = </Net>\n}\n";
    expect_lifted(things, "Veil", "/Veil");
}

TEST(Casters, TellInstancesApart) {
    const std::string things = "class \"_Thing\" {\n" + cube("Block", "0, 0.6, 0") + "}\n" +
                               "def Xform \"One\" (instanceable = true\n inherits = </_Thing>\n "
                               "kind = \"component\") {}\n";
    expect_lifted(things, "One", "/One");
    // Two of them share a prototype and no shadow
    const std::string two = "class \"_Thing\" {\n" + cube("Block", "0, 0.6, 0") + "}\n" +
                            "def Xform \"Left\" (instanceable = true\n inherits = </_Thing>\n kind "
                            "= \"component\") {\n double3 xformOp:translate = (-1, 0, 0)\n uniform "
                            "token[] xformOpOrder = [\"xformOp:translate\"]\n}\n"
                            "def Xform \"Right\" (instanceable = true\n inherits = </_Thing>\n "
                            "kind = \"component\") {\n double3 xformOp:translate = (1, 0, 0)\n "
                            "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n";
    const film::Film film = render(scene_from_usda(stage(two), width, height, true), 64);
    const auto& groups = film.layer_set().groups;
    const auto sky =
        int(std::ranges::find(groups, "Sky", &accumulate::LightGroup::name) - groups.begin());
    const double left = whole(taken_by(film, sky, "Left")).value,
                 right = whole(taken_by(film, sky, "Right")).value;
    EXPECT_GT(left, 0.0);
    EXPECT_NEAR(left / right, 1.0, 0.15);
}

TEST(Casters, GoByTheirPointInstancer) {
    const std::string things =
        "def PointInstancer \"Swarm\" {\n int[] protoIndices = [0]\n point3f[] positions = [(-0.5, "
        "0, 0)]\n rel prototypes = </Swarm/Protos/Block>\n"
        " string velatura:shadow:caster = \"bees\"\n def Scope \"Protos\" {\n" +
        cube("Block", "0, 0.6, 0") + "}\n}\n";
    expect_lifted(things, "bees", "/Swarm");
}

}  // namespace velatura::test
