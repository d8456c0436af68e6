// SPDX-License-Identifier: Apache-2.0
// Light and shadow linking from USD to the film: linking of everything is no linking, bit for bit;
// a scene with linking is one image however it is made; branches, guiding and solved caustics
// keep the mean of every layer; and what is linked away is as if it were not there.
#include "integrator/effect_plan.h"
#include "usd_render.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

namespace velatura::test {

namespace {

constexpr int width = 20, height = 16;

integrator::RenderOptions options_of(uint64_t samples, uint64_t seed = 3) {
    integrator::RenderOptions options;
    options.end_sample = samples;
    options.seed = seed;
    options.tile_size = 16;
    return options;
}

std::string placed(const std::string& type,
                   const std::string& name,
                   const char* where,
                   const std::string& body) {
    return "def " + type + " \"" + name + "\" {\n" + body + "\ndouble3 xformOp:translate = (" +
           where + ")\nuniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n";
}

std::string wall(const std::string& name, float z, float half, const std::string& extra = "") {
    const std::string h = std::to_string(half), at = std::to_string(z);
    return "def Mesh \"" + name +
           "\" {\nint[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2, 3]\n" +
           "point3f[] points = [(-" + h + ", -" + h + ", " + at + "), (" + h + ", -" + h + ", " +
           at + "), (" + h + ", " + h + ", " + at + "), (-" + h + ", " + h + ", " + at +
           ")]\nuniform token subdivisionScheme = \"none\"\n" + extra + "\n}\n";
}

std::string camera() {
    return "#usda 1.0\n( upAxis = \"Y\" )\ndef Camera \"Cam\" {\nfloat focalLength = 24\nfloat2 "
           "clippingRange = (0, 0)\n}\n";
}

/// The room of the other identities with links on its lights. `links` is put into each of them.
std::string linked_room(const std::string& links) {
    std::string text = room_usda();
    for (const char* light : {"def RectLight", "def SphereLight", "def DomeLight"}) {
        const size_t begin = text.find(light);
        EXPECT_NE(begin, std::string::npos) << light;
        text.insert(text.find('{', begin) + 1, "\n" + links + "\n");
    }
    return text;
}

struct Sums {
    std::vector<double> sum, squares;
};

Sums measure(const scene::Scene& scene, const RenderSetup& setup, uint64_t first_seed, int runs) {
    Sums sums;
    for (int run = 0; run < runs; ++run) {
        const film::Film film =
            render_scene(scene, options_of(16, first_seed + uint64_t(run)), setup);
        const uint32_t count = film.sums().table().total_count();
        sums.sum.resize(count);
        sums.squares.resize(count);
        for (uint32_t a = 0; a < count; ++a) {
            double total = 0;
            for (int y = 0; y < height; ++y) {
                for (int x = 0; x < width; ++x) {
                    const accumulate::Triple t = film.sums().total(x, y, a);
                    total += t.x + t.y + t.z;
                }
            }
            sums.sum[a] += total;
            sums.squares[a] += total * total;
        }
    }
    return sums;
}

/// Every accumulator of the film: bounces, groups, their cells, unoccluded light, halves.
void expect_same_means(const Sums& one, const Sums& other, int runs, const char* what) {
    double largest = 0, widest = 0, worst_z = 0;
    for (size_t a = 0; a < one.sum.size(); ++a) {
        const double mean_1 = one.sum[a] / runs, mean_2 = other.sum[a] / runs;
        const double variance =
            (one.squares[a] / runs - mean_1 * mean_1 + other.squares[a] / runs - mean_2 * mean_2) /
            (runs - 1);
        if (!(variance > 0)) {
            EXPECT_DOUBLE_EQ(mean_1, mean_2);
            continue;
        }
        const double z = (mean_2 - mean_1) / std::sqrt(variance);
        EXPECT_LT(std::abs(z), 5.0) << what << ", accumulator " << a;
        worst_z = std::max(worst_z, std::abs(z));
        largest = std::max(largest, mean_1);
        widest = std::max(widest, 5 * std::sqrt(variance));
    }
    std::printf("%s: %zu accumulators, worst |z| %.2f, detectable %.2f %% of the brightest\n", what,
                one.sum.size(), worst_z, 100 * widest / largest);
}

/// Some of the room's things, named in it.
std::string some_links() {
    const scene::Scene room = scene_from_usda(room_usda(), width, height);
    std::vector<std::string> paths;
    for (const scene::Shape& shape : room.shapes)
        paths.push_back(room.provenance[shape.provenance].prim_path);
    EXPECT_GE(paths.size(), 4u);
    return "rel collection:lightLink:excludes = <" + paths[1] +
           ">\nrel collection:shadowLink:excludes = [<" + paths[2] + ">, <" + paths.back() +
           ">]\ncolor3f inputs:shadow:color = (0.1, 0, 0)";
}

}  // namespace

TEST(Linking, OfEverythingChangesNoBit) {
    const scene::Scene plain = scene_from_usda(room_usda(), width, height);
    std::string all =
        "uniform bool collection:lightLink:includeRoot = 0\nuniform bool "
        "collection:shadowLink:includeRoot = 0\n";
    std::string paths;
    for (const scene::Shape& shape : plain.shapes)
        paths += "<" + plain.provenance[shape.provenance].prim_path + ">, ";
    for (const char* name : {"lightLink", "shadowLink"})
        all += std::string("rel collection:") + name + ":includes = [" + paths + "]\n";
    const scene::Scene linked = scene_from_usda(linked_room(all), width, height);
    const scene::Scene excluded = scene_from_usda(
        linked_room(
            "rel collection:lightLink:excludes = </Nowhere>\nbool inputs:shadow:enable = 1"),
        width, height);
    const uint64_t expected = fingerprint(render_scene(plain, options_of(16)));
    EXPECT_EQ(fingerprint(render_scene(linked, options_of(16))), expected);
    EXPECT_EQ(fingerprint(render_scene(excluded, options_of(16))), expected);
    EXPECT_NE(fingerprint(render_scene(scene_from_usda(linked_room(some_links()), width, height),
                                       options_of(16))),
              expected);
}

// The code that linking takes, in a scene where it says nothing: casters that are everything
TEST(Linking, ByWayOfItsOwnCodeKeepsTheMeanOfEveryLayer) {
    const scene::Scene plain = scene_from_usda(room_usda(), width, height);
    scene::Scene linked = plain;
    scene::LinkSet all(1);
    all.add(0);
    linked.linking.sets = {all};
    for (scene::Light& light : linked.lights) light.links = {.lit = 0, .casters = 0};
    constexpr int runs = 24;
    expect_same_means(measure(plain, {}, 100, runs), measure(linked, {}, 200, runs), runs,
                      "linked");
}

TEST(Linking, IsOneImageHoweverItIsMade) {
    const scene::Scene scene = scene_from_usda(linked_room(some_links()), width, height);
    RenderSetup setup{.threads = 1, .branches = 0};
    const uint64_t whole = fingerprint(render_scene(scene, options_of(24), setup));
    integrator::RenderOptions tiles = options_of(24);
    tiles.mode = integrator::RenderMode::Tile;
    setup.threads = 3;
    setup.sample_splits = {5, 16};
    setup.bvh_quality = accel::BvhQuality::Fast;
    EXPECT_EQ(fingerprint(render_scene(scene, tiles, setup)), whole);
}

TEST(Linking, KeepsTheMeanOfEveryLayerWhereverPathsGo) {
    const scene::Scene scene = scene_from_usda(linked_room(some_links()), width, height);
    constexpr int runs = 24;
    const Sums plain = measure(scene, {}, 100, runs);
    expect_same_means(plain, measure(scene, {.branches = 4}, 200, runs), runs, "four branches");
    expect_same_means(plain, measure(scene, {.guiding = integrator::Guiding::On}, 300, runs), runs,
                      "guided");
    expect_same_means(plain,
                      measure(scene, {.caustics = integrator::Caustics::Manifold}, 400, runs), runs,
                      "caustics solved for");
}

// Whether a black blocker casts no shadow or is not there: the samples are the same, one by one.
TEST(Linking, OfShadowsLeavesLightAsIfTheBlockerWereNotThere) {
    const std::string lamp =
        "float inputs:radius = 0.5\nfloat inputs:intensity = 5\nrel collection:shadowLink:excludes "
        "= </Ball>";
    const std::string scene =
        camera() + wall("Wall", -5, 4) + placed("SphereLight", "Lamp", "3, 3, -2", lamp);
    // Black, between lamp and wall, out of the camera's sight
    const std::string ball =
        placed("Sphere", "Ball", "2.2, 2.6, -3",
               "double radius = 0.5\ncolor3f[] primvars:displayColor = [(0, 0, 0)]");
    const integrator::RenderOptions options = options_of(16);
    const std::vector<double> without =
        beauty(render_scene(scene_from_usda(scene, width, height), options));
    const std::vector<double> with =
        beauty(render_scene(scene_from_usda(scene + ball, width, height), options));
    std::string shaded = scene + ball;
    shaded.replace(shaded.find("excludes = </Ball>"), 18, "excludes = </None>");
    const std::vector<double> shadow =
        beauty(render_scene(scene_from_usda(shaded, width, height), options));
    double taken = 0;
    for (size_t i = 0; i < without.size(); ++i) {
        EXPECT_EQ(with[i], without[i]) << i;
        taken += std::abs(shadow[i] - without[i]);
    }
    EXPECT_GT(taken, 0.01) << "the ball is in the way";
}

// A filter that is linked to some geometry makes of its light what two lights would be.
TEST(FilterLinking, IsThatOfTwoLightsBitForBit) {
    const std::string walls = camera() + wall("Back", -6.0f, 4.0f) + wall("Front", -4.0f, 0.5f);
    const auto linked = [](const std::string& collection) {
        return "uniform bool collection:" + collection +
               ":includeRoot = 0\nrel collection:" + collection + ":includes = </Front>\n";
    };
    const auto lamp = [](const std::string& name, const std::string& body) {
        return placed(
            "SphereLight", name, "0, 5, -1",
            "string velatura:light:group = \"key\"\nfloat inputs:intensity = 20\n" + body);
    };
    const auto gel = [](const std::string& links) {
        return "def PxrIntMultLightFilter \"F\" {\nfloat inputs:ri:lightFilter:intensity = 0.25\n" +
               links + "\n}\n";
    };
    const std::string filters = "rel light:filters = </F>\n";
    const auto image = [&](const std::string& text) {
        return render_scene(scene_from_usda(text, width, height), options_of(8));
    };
    const uint64_t by_filter =
        fingerprint(image(walls + lamp("L", filters) + gel(linked("filterLink"))));
    const uint64_t by_lights =
        fingerprint(image(walls + lamp("L", filters + linked("lightLink")) +
                          lamp("M", "rel collection:lightLink:excludes = </Front>") + gel("")));
    EXPECT_EQ(by_filter, by_lights);
    // Both parts matter
    EXPECT_NE(by_filter, fingerprint(image(walls + lamp("L", filters) + gel(""))));
    EXPECT_NE(by_filter, fingerprint(image(walls + lamp("L", ""))));
    // Without linking the filter acts on everything, once
    scene::Scene scene =
        scene_from_usda(walls + lamp("L", filters) + gel(linked("filterLink")), width, height);
    const uint64_t everywhere = fingerprint(image(walls + lamp("L", filters) + gel("")));
    integrator::omit(scene, scene::Effect::LightLinking);
    EXPECT_EQ(fingerprint(render_scene(scene, options_of(8))), everywhere);
}

}  // namespace velatura::test
