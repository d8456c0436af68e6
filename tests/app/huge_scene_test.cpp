// SPDX-License-Identifier: Apache-2.0
// A few lines that ask for more than any machine holds: refused with the number, before it is made.
#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstdint>

namespace velatura::test {

namespace {

constexpr const char* quick = " --res 8 8 --spp 1 --progress none --threads 1";

struct Nesting {
    std::string metadata = "", leaf = "def Sphere \"s\" {}";
    bool is_apart = true;        ///< children beside each other, not in one place
    bool is_each_shown = false;  ///< every level by itself too, not the first alone
};

/// Prims a … each of which has `width` children that refer to the next, `depth` of them; the last
/// holds the leaf.
std::string nested(int width, int depth, const Nesting& n = {}) {
    const auto name = [](int level) {
        return fmt::format("{}{}", char('a' + level % 26), level / 26);
    };
    std::string text = "#usda 1.0\n";
    for (int level = 0; level < depth; ++level) {
        text += fmt::format("{} \"{}\" {{\n", level == 0 || n.is_each_shown ? "def" : "class",
                            name(level));
        for (int i = 0; i < width; ++i) {
            const std::string place = i == 0 || !n.is_apart
                                          ? ""
                                          : fmt::format(
                                                "double3 xformOp:translate = ({}, 0, 0)\nuniform "
                                                "token[] xformOpOrder = [\"xformOp:translate\"]\n",
                                                int64_t(i) << (4 * (level % 8)));
            text += fmt::format("def Xform \"{}\" ({}references = </{}>) {{\n{}}}\n",
                                i == 0 ? "x" : fmt::format("x{}", i), n.metadata, name(level + 1),
                                place);
        }
        text += "}\n";
    }
    return text + fmt::format("class \"{}\" {{\n{}\n}}\n", name(depth), n.leaf);
}

/// Point instancers within the prototypes of others.
std::string nested_instancers(int count, int depth) {
    std::string zeros, points;
    for (int i = 0; i < count; ++i) {
        zeros += i ? ", 0" : "0";
        points += fmt::format("{}({}, 0, 0)", i ? ", " : "", i);
    }
    std::string text = "#usda 1.0\n", ends;
    std::string path;
    for (int level = 0; level < depth; ++level) {
        path += fmt::format("/I{}", level);
        const std::string inner = level + 1 < depth ? fmt::format("I{}", level + 1) : "S";
        text += fmt::format(
            "def PointInstancer \"I{}\" {{\nrel prototypes = <{}/{}>\nint[] protoIndices = "
            "[{}]\npoint3f[] positions = [{}]\n",
            level, path, inner, zeros, points);
        ends += "}\n";
    }
    return text + "def Sphere \"S\" {\n}\n" + ends;
}

/// Renders in less than a gigabyte, saying what is left out.
void expect_small(const std::string& scene, const std::string& said) {
    const Workplace w;
    w.write("s.usda", scene + "def Sphere \"Rest\" {\n}\n");
    const CommandResult r = w.velatura(std::string("render s.usda -o x.exr") + quick);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_NE(r.output.find(said), std::string::npos) << r.output;
    EXPECT_TRUE(w.exists("x.exr"));
    rusage usage{};
    ASSERT_EQ(::getrusage(RUSAGE_CHILDREN, &usage), 0);
    EXPECT_LT(usage.ru_maxrss, 1 << 20) << "kB";
}

}  // namespace

TEST(HugeScene, APlainBillionOfPrims) {
    const std::string scene = nested(3, 19, {.is_apart = false});
    EXPECT_LT(scene.size(), 3500u);
    expect_small(scene, "usd-too-many-prims");
}

TEST(HugeScene, AnInstancedBillionOfPrims) {
    const std::string instanceable = "instanceable = true; ";
    expect_small(nested(10, 9, {.metadata = instanceable}), "111111111 instances here");
    expect_small(nested(2, 30, {.metadata = instanceable}), "too-many-instances");
    expect_small(nested(2, 100, {.metadata = instanceable}), "18446744073709551615 instances here");
    // Of what remains, millions would be allowed
    expect_small(nested(10, 9, {.metadata = instanceable, .is_each_shown = true}),
                 "11111111 instances here");
}

TEST(HugeScene, ABillionOfPrimsInOnePlace) {
    expect_small(
        nested(10, 9,
               {.metadata = "instanceable = true; ", .is_apart = false, .is_each_shown = true}),
        "duplicate-instances");
    expect_small(nested(2, 100, {.metadata = "instanceable = true; ", .is_apart = false}),
                 "duplicate-instances");
}

TEST(HugeScene, ABillionOfPointInstances) {
    expect_small(nested_instancers(1000, 3), "too-many-instances");
}

/// What instances of nothing would come to is nothing.
TEST(HugeScene, ABillionOfNothing) {
    const Workplace w;
    w.write("s.usda", nested(2, 60, {.metadata = "instanceable = true; ", .leaf = ""}) +
                          "def Sphere \"Rest\" {\n}\n");
    const CommandResult r = w.velatura(std::string("render s.usda -o x.exr") + quick);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_EQ(r.output.find("error"), std::string::npos) << r.output;
}

TEST(HugeScene, TheLimitIsTheUsersToSet) {
    const Workplace w;
    w.write("s.usda", nested(10, 3, {.metadata = "instanceable = true; "}));
    const auto is_refused = [&](const std::string& options) {
        return w.velatura("render s.usda -o x.exr" + options + quick)
                   .output.find("too-many-instances") != std::string::npos;
    };
    EXPECT_FALSE(is_refused(""));
    EXPECT_TRUE(is_refused(" --instance-limit 0.001109"));
    EXPECT_FALSE(is_refused(" --instance-limit 0.00111"));
}

/// Each limit of --limit: refused below what the scene takes, and read at it.
TEST(HugeScene, EveryLimitIsTheUsersToSet) {
    const Workplace w;
    w.write("prims.usda", nested(3, 3));
    w.write("sites.usda", nested(6, 7, {.leaf = ""}));
    w.write("layers.usda", "#usda 1.0\n(\n    subLayers = [@prims.usda@]\n)\n");
    w.write("textured.usda", "#usda 1.0\ndef DomeLight \"sky\"\n{\n}\n" + textured_ball("p.ppm"));
    w.write("p.ppm", "P6 8 4 255\n" + std::string(8 * 4 * 3, 'x'));
    w.write("wide.usda", "#usda 1.0\ndef DomeLight \"sky\"\n{\n}\n" + textured_ball("w.ppm"));
    w.write("w.ppm", "P6 400 4 255\n" + std::string(400 * 4 * 3, 'x'));
    const std::string render = std::string("render textured.usda -o x.exr") + quick;
    const std::string wide = std::string("render wide.usda -o x.exr") + quick;

    struct Case {
        std::string command, limit, too_little, enough, said;
    };

    // 3 + 9 + 27 prims and their spheres; 6^7 sites
    const Case cases[] = {
        {"info prims.usda", "prims", "40", "400",
         "limit of 40 prims reached; the rest is skipped; raise --limit prims"},
        {"info sites.usda", "prims-per-spec", "2000", "1e6", "raise --limit prims-per-spec"},
        {"info layers.usda", "layers", "1", "2", "limit reached (--limit layers)"},
        {render, "image-side", "7", "8", "expected at most 7 along a side (--limit image-side)"},
        // A former name
        {render, "picture-side", "7", "8", "--limit image-side"},
        {render + " --sandbox", "decode-memory", "1K", "1G", "texture-unreadable"},
        // Of 400 x 4 pixels of 3 bytes: what may take more has a decoder process
        {wide, "decode-memory", "4K", "5K", "texture-unreadable"},
    };
    for (const Case& c : cases) {
        const auto say = [&](const std::string& value) {
            return w.velatura(fmt::format("{} --limit {}={}", c.command, c.limit, value)).output;
        };
        EXPECT_NE(say(c.too_little).find(c.said), std::string::npos)
            << c.limit << ": " << say(c.too_little);
        EXPECT_EQ(say(c.enough).find("error"), std::string::npos)
            << c.limit << ": " << say(c.enough);
    }
    for (const std::string bad : {"nonsense=1", "prims", "prims=", "prims=-1", "prims=1.5",
                                  "prims=nan", "decode-time=x", "image-side=1e9"})
        EXPECT_EQ(w.velatura("info prims.usda --limit " + bad).exit_code, 2) << bad;
}

}  // namespace velatura::test
