// SPDX-License-Identifier: Apache-2.0
// A few lines that ask for more than any machine holds: refused with the number, before it is made.
#include <sys/resource.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "command.h"

namespace velatura::test {

namespace {

constexpr const char* quick = " --res 8 8 --spp 1 --progress none --threads 1";

/// Prims a … each of which has `width` children that refer to the next, `depth` of them; the last holds `leaf`.
std::string nested(int width, int depth, const std::string& metadata, const std::string& leaf) {
    const auto name = [](int level) { return fmt::format("{}{}", char('a' + level % 26), level / 26); };
    std::string text = "#usda 1.0\n";
    for (int level = 0; level < depth; ++level) {
        text += fmt::format("{} \"{}\" {{\n", level == 0 ? "def" : "class", name(level));
        for (int i = 0; i < width; ++i) text += fmt::format("def \"{}\" ({}references = </{}>) {{}}\n", i == 0 ? "x" : fmt::format("x{}", i), metadata, name(level + 1));
        text += "}\n";
    }
    return text + fmt::format("class \"{}\" {{\n{}\n}}\n", name(depth), leaf);
}

/// Point instancers within the prototypes of others.
std::string nested_instancers(int count, int depth) {
    std::string zeros, points;
    for (int i = 0; i < count; ++i) {
        zeros += i ? ", 0" : "0";
        points += i ? ", (1, 0, 0)" : "(0, 0, 0)";
    }
    std::string text = "#usda 1.0\n", ends;
    std::string path;
    for (int level = 0; level < depth; ++level) {
        path += fmt::format("/I{}", level);
        const std::string inner = level + 1 < depth ? fmt::format("I{}", level + 1) : "S";
        text += fmt::format("def PointInstancer \"I{}\" {{\nrel prototypes = <{}/{}>\nint[] protoIndices = [{}]\npoint3f[] positions = [{}]\n", level, path, inner, zeros, points);
        ends += "}\n";
    }
    return text + "def Sphere \"S\" {\n}\n" + ends;
}

/// Renders the rest, and says that there is more, in less than a gigabyte.
void expect_refused(const std::string& scene, const std::string& code) {
    const Workplace w;
    w.write("s.usda", scene + "def Sphere \"Rest\" {\n}\n");
    const CommandResult r = w.velatura(std::string("render s.usda -o x.exr") + quick);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_NE(r.output.find(code), std::string::npos) << r.output;
    EXPECT_TRUE(w.exists("x.exr"));
    rusage usage{};
    ASSERT_EQ(::getrusage(RUSAGE_CHILDREN, &usage), 0);
    EXPECT_LT(usage.ru_maxrss, 1 << 20) << "kB";
}

}  // namespace

TEST(HugeScene, APlainBillionOfPrims) {
    const std::string scene = nested(3, 19, "", "def Sphere \"s\" {}");
    EXPECT_LT(scene.size(), 3000u);
    expect_refused(scene, "usd-too-many-prims");
}

TEST(HugeScene, AnInstancedBillionOfPrims) {
    const std::string leaf = "def Sphere \"s\" {}";
    expect_refused(nested(10, 9, "instanceable = true; ", leaf), "it comes to 111111111 instances");
    expect_refused(nested(2, 30, "instanceable = true; ", leaf), "too-many-instances");
    expect_refused(nested(2, 100, "instanceable = true; ", leaf), "it comes to 18446744073709551615 instances");
}

TEST(HugeScene, ABillionOfPointInstances) { expect_refused(nested_instancers(1000, 3), "too-many-instances"); }

/// What instances of nothing would come to is nothing.
TEST(HugeScene, ABillionOfNothing) {
    const Workplace w;
    w.write("s.usda", nested(2, 60, "instanceable = true; ", "") + "def Sphere \"Rest\" {\n}\n");
    const CommandResult r = w.velatura(std::string("render s.usda -o x.exr") + quick);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_EQ(r.output.find("error"), std::string::npos) << r.output;
}

TEST(HugeScene, TheLimitIsTheUsersToSet) {
    const Workplace w;
    w.write("s.usda", nested(10, 3, "instanceable = true; ", "def Sphere \"s\" {}"));
    const auto is_refused = [&](const std::string& options) { return w.velatura("render s.usda -o x.exr" + options + quick).output.find("too-many-instances") != std::string::npos; };
    EXPECT_FALSE(is_refused(""));
    EXPECT_TRUE(is_refused(" --instance-limit 0.001109"));
    EXPECT_FALSE(is_refused(" --instance-limit 0.00111"));
}

/// Each limit of --limit: refused below what the scene takes, and read at it.
TEST(HugeScene, EveryLimitIsTheUsersToSet) {
    const Workplace w;
    w.write("prims.usda", nested(3, 3, "", "def Sphere \"s\" {}"));
    w.write("sites.usda", nested(6, 7, "", ""));
    w.write("layers.usda", "#usda 1.0\n(\n    subLayers = [@prims.usda@]\n)\n");
    w.write("textured.usda", "#usda 1.0\ndef DomeLight \"sky\"\n{\n}\n" + textured_ball("p.ppm"));
    w.write("p.ppm", "P6 8 4 255\n" + std::string(8 * 4 * 3, 'x'));
    const std::string render = std::string("render textured.usda -o x.exr") + quick;
    struct Case {
        std::string command, limit, too_little, enough, said;
    };
    // 3 + 9 + 27 prims and their spheres; 6^7 sites
    const Case cases[] = {
        {"info prims.usda", "prims", "40", "400", "limit of 40 prims reached (--limit prims)"},
        {"info sites.usda", "prims-per-spec", "2000", "1e6", "(--limit prims-per-spec)"},
        {"info layers.usda", "layers", "1", "2", "limit reached (--limit layers)"},
        {render, "picture-side", "7", "8", "expected at most 7 along a side (--limit picture-side)"},
        {render, "decode-memory", "1K", "1G", "texture-unreadable"},
    };
    for (const Case& c : cases) {
        const auto say = [&](const std::string& value) { return w.velatura(fmt::format("{} --limit {}={}", c.command, c.limit, value)).output; };
        EXPECT_NE(say(c.too_little).find(c.said), std::string::npos) << c.limit << ": " << say(c.too_little);
        EXPECT_EQ(say(c.enough).find("error"), std::string::npos) << c.limit << ": " << say(c.enough);
    }
    for (const std::string bad : {"nonsense=1", "prims", "prims=", "prims=-1", "prims=1.5", "prims=nan", "decode-time=x", "picture-side=1e9"})
        EXPECT_EQ(w.velatura("info prims.usda --limit " + bad).exit_code, 2) << bad;
}

}  // namespace velatura::test
