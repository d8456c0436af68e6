// SPDX-License-Identifier: Apache-2.0
// Which time is rendered when none is asked for: usdrecord's rule, the stage's startTimeCode, which
// is 0 where none is authored. The first sample holds before it, so that a stage with time samples
// only is there.
#include "command.h"

#include <gtest/gtest.h>

namespace velatura::test {

namespace {

constexpr const char* quick = " -q --res 24 18 --spp 4 --layers none --guiding off --progress none";

/// A ball and a square before an orthographic camera.
std::string stage(const std::string& metadata,
                  const std::string& ball_place,
                  const std::string& square_points) {
    return "#usda 1.0\n(" + metadata + R"usda()
def Camera "cam"
{
    token projection = "orthographic"
    float horizontalAperture = 80
    float verticalAperture = 60
    double3 xformOp:translate = (0, 0, 20)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Sphere "ball"
{
    color3f[] primvars:displayColor = [(0.5, 0, 0)]
    double3 xformOp:translate)usda" +
           ball_place + R"usda(
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Mesh "square"
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points)usda" +
           square_points + R"usda(
    uniform token subdivisionScheme = "none"
}
)usda";
}

constexpr const char* left = "[(-3, -1, 0), (-1, -1, 0), (-1, 1, 0), (-3, 1, 0)]";
constexpr const char* right = "[(-2, -1, 0), (0, -1, 0), (0, 1, 0), (-2, 1, 0)]";

std::string animated(const std::string& metadata) {
    return stage(metadata, ".timeSamples = { 1: (2, 0, 0), 10: (3, 0, 0) }",
                 std::string(".timeSamples = { 1: ") + left + ", 10: " + right + " }");
}

/// What stands still where the samples of times 1 and 10 put it.
std::string still(bool is_late) {
    return stage("", is_late ? " = (3, 0, 0)" : " = (2, 0, 0)",
                 std::string(" = ") + (is_late ? right : left));
}

class DefaultTime : public testing::Test {
  protected:
    std::string hash_of(const std::string& usda, const std::string& options = "") {
        w.write("s.usda", usda);
        const CommandResult r = w.velatura("render s.usda -o s.exr" + options + quick);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        return w.hash("s.exr");
    }

    Workplace w;
};

}  // namespace

TEST_F(DefaultTime, IsTheStartOfTheStageElseZero) {
    const std::string first = hash_of(still(false)), last = hash_of(still(true));
    ASSERT_NE(first, last);
    // No start: time 0, before the first sample
    EXPECT_EQ(hash_of(animated("")), first);
    EXPECT_EQ(hash_of(animated("startTimeCode = 10")), last);
    EXPECT_EQ(hash_of(animated("startTimeCode = 10\n endTimeCode = 20")), last);
    // An end alone, and rates, are no start
    EXPECT_EQ(hash_of(animated("endTimeCode = 20\n timeCodesPerSecond = 30")), first);
    // Asked for
    EXPECT_EQ(hash_of(animated("startTimeCode = 10"), " -f 0"), first);
    EXPECT_EQ(hash_of(animated(""), " -f 10"), last);
}

TEST_F(DefaultTime, DefaultsAreThereAtEveryTime) {
    const std::string expected = hash_of(still(false));
    EXPECT_EQ(hash_of(still(false), " -f 17"), expected);
    EXPECT_EQ(hash_of(still(false), " -f default"), expected);
    // Where both are authored samples win at a time, and defaults at the default time
    const std::string both = stage(
        "", " = (3, 0, 0)\n    double3 xformOp:translate.timeSamples = { 1: (2, 0, 0) }",
        std::string(" = ") + right + "\n    point3f[] points.timeSamples = { 1: " + left + " }");
    EXPECT_EQ(hash_of(both), expected);
    EXPECT_EQ(hash_of(both, " -f default"), hash_of(still(true)));
}

TEST_F(DefaultTime, ClipsCountFromTheirFirst) {
    w.write("clip.usda",
            "#usda 1.0\ndef \"ball\" { double3 xformOp:translate.timeSamples = { 1: (2, 0, 0), 10: "
            "(3, 0, 0) }\n}\n");
    std::string usda = stage("", "", std::string(" = ") + left);
    const std::string with_clips =
        "def Sphere \"ball\" (\n    clips = { dictionary default = { asset[] assetPaths = "
        "[@clip.usda@]\n asset manifestAssetPath = @clip.usda@\n string primPath = \"/ball\"\n "
        "double2[] active = [(0, 0)]\n double2[] times = [(0, 0), (100, 100)] } }\n)";
    const std::string plain = "def Sphere \"ball\"";
    usda.replace(usda.find(plain), plain.size(), with_clips);
    EXPECT_EQ(hash_of(usda), hash_of(still(false)));
    EXPECT_EQ(hash_of(usda, " -f 10"),
              hash_of(stage("", " = (3, 0, 0)", std::string(" = ") + left)));
}

/// What is missing is named, with what comes of it.
TEST_F(DefaultTime, SamplesAloneAreMissedAtTheDefaultTime) {
    w.write("s.usda", animated(""));
    const std::string quiet_off = " --res 8 6 --spp 1 --layers none --progress none";
    const CommandResult r = w.velatura("render s.usda -o s.exr -f default" + quiet_off);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_NE(r.output.find("points has time samples only, and no value at the default time; the "
                            "Mesh is skipped [empty-mesh]"),
              std::string::npos)
        << r.output;
    EXPECT_EQ(r.output.find("vertex index outside"), std::string::npos) << r.output;
}

}  // namespace velatura::test
