// SPDX-License-Identifier: Apache-2.0
// One image, in whatever order a file has the prims: exporters, and runs of the same one, differ
// in it.
#include "base/hash.h"
#include "hard_case.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

/// The text of a scene whose root prim has these children, in one of their orders; the first as
/// they are given.
std::string in_order(int order, std::vector<std::string> children) {
    std::mt19937 random(static_cast<unsigned>(order));
    if (order > 0) std::shuffle(children.begin(), children.end(), random);
    std::string text =
        "#usda 1.0\n(\n    defaultPrim = \"Root\"\n    upAxis = \"Y\"\n)\ndef Xform \"Root\"\n{\n";
    for (const std::string& child : children) text += child + "\n";
    return text + "}\n";
}

/// Of the room: what its root prim holds, prim by prim.
std::vector<std::string> prims_of_the_room() {
    const std::string text = room_usda(), begin = "\n    def ";
    std::vector<std::string> prims;
    for (size_t at = text.find(begin); at != std::string::npos;) {
        const size_t next = text.find(begin, at + 1);
        prims.push_back(
            text.substr(at, next == std::string::npos ? text.rfind('}') - at : next - at));
        at = next;
    }
    return prims;
}

/// Groups of things that are written once and stand in several places, with lights among them.
std::vector<std::string> prims_with_instances() {
    std::vector<std::string> prims = prims_of_the_room();
    prims.push_back(R"(
    class Xform "Pair"
    {
        def Sphere "Z" { double radius = 0.25; }
        def Cube "A" { double size = 0.5; double3 xformOp:translate = (0, 0.5, 0);
        uniform token[] xformOpOrder = ["xformOp:translate"]; }
        def SphereLight "Bulb" { float inputs:radius = 0.0625; double3 xformOp:translate = (0, 1,
            0); uniform token[] xformOpOrder = ["xformOp:translate"]; }
    }
)");
    for (int i = 0; i < 5; ++i) {
        prims.push_back(fmt::format(R"(
    def "Pair{}" (instanceable = true; references = </Root/Pair>)
    {{
        double3 xformOp:translate = ({}, 0.25, -1)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
)",
                                    (i * 7) % 5, i - 2));
    }
    return prims;
}

integrator::RenderOptions options_of(int order) {
    integrator::RenderOptions options;
    options.end_sample = 4;
    options.tile_size = order % 2 == 0 ? 16 : 8;
    return options;
}

RenderSetup setup_of(int order) {
    constexpr accel::BvhQuality qualities[] = {accel::BvhQuality::Balanced, accel::BvhQuality::Fast,
                                               accel::BvhQuality::High};
    return {.threads = 1 + order % 3, .bvh_quality = qualities[order / 3 % 3]};
}

/// Of the image and of what its layers say is seen where.
uint64_t fingerprint_with_ids(const film::Film& film) {
    uint64_t h = fingerprint(film);
    const film::Window& w = film.window();
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const accumulate::PixelRecord& record = film.sums().record(x, y);
            h = hash_combine(hash_combine(h, record.prim_id), record.instance_id);
        }
    }
    return h;
}

/// How many of the orders give another image than the first.
int count_different(int orders, const std::vector<std::string>& prims) {
    const auto image = [&](int order) {
        return fingerprint_with_ids(render_scene(scene_from_usda(in_order(order, prims), 24, 18),
                                                 options_of(order), setup_of(order)));
    };
    const uint64_t expected = image(0);
    int different = 0;
    for (int order = 1; order < orders; ++order) different += image(order) != expected;
    return different;
}

}  // namespace

TEST(H53LoadOrder, OfPrimsLeavesEveryBitAlone) {
    EXPECT_GT(prims_of_the_room().size(), 10u);
    hardcase::expect_within(
        {"of 10 orders of the prims of a room, those with another bit of the picture or its ids",
         double(count_different(10, prims_of_the_room())), 0, 0, "the first order"});
}

TEST(H53LoadOrder, OfInstancesLeavesEveryBitAlone) {
    hardcase::expect_within(
        {"of 10 orders with instances and lamps in them, those with another bit",
         double(count_different(10, prims_with_instances())), 0, 0, "the first order"});
}

TEST(H12LoadOrder, CoplanarPrimsAreWonByTheSameOne) {
    // Squares in one plane, each over several others, each of its own color
    std::vector<std::string> prims = {R"(
    def Camera "Cam"
    {
        float2 clippingRange = (0, 0)
        double3 xformOp:translate = (0, 0, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DomeLight "Dome" { float inputs:intensity = 1; }
)"};
    std::mt19937 random(12);
    const auto coordinate = [&] { return double(int(random() % 129) - 64) / 64; };
    for (int i = 0; i < 24; ++i) {
        const double x = coordinate(), y = coordinate(), size = 0.25 + double(i % 4) / 8;
        prims.push_back(fmt::format(R"(
    def Mesh "M{}"
    {{
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [({}, {}, 0), ({}, {}, 0), ({}, {}, 0), ({}, {}, 0)]
        uniform token subdivisionScheme = "none"
        color3f[] primvars:displayColor = [({}, {}, {})]
    }}
)",
                                    (i * 11) % 24, x - size, y - size, x + size, y - size, x + size,
                                    y + size, x - size, y + size, 0.1 + 0.03 * i, 0.9 - 0.03 * i,
                                    0.1 * (i % 8)));
    }
    constexpr int orders = 32;
    hardcase::expect_within(
        {"of 32 orders of squares in one plane, by threads and trees, those with another picture",
         double(count_different(orders, prims)), 0, 0, "the first order, bit for bit"});
}

}  // namespace velatura::test
