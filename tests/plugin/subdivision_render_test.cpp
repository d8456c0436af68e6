// SPDX-License-Identifier: Apache-2.0
// Subdivision from the outside: who opens OpenSubdiv, and what is drawn with it and without.
#include "command.h"
#include "opened_files.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace velatura::test {

namespace {

constexpr const char* quick = " --res 24 18 --spp 4 --guiding off --splitting off --progress none ";

/// A cube that may be a ball.
std::string cube_scene(const std::string& extra) {
    return R"usda(#usda 1.0
def Camera "Cam"
{
    double3 xformOp:translate = (0, 0, 9)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "sky"
{
}
def Mesh "Cube"
{
    point3f[] points = [(-1,-1,-1), (1,-1,-1), (-1,1,-1), (1,1,-1), (-1,-1,1), (1,-1,1), (-1,1,1),
        (1,1,1)]
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,2,3,1, 4,5,7,6, 0,1,5,4, 2,6,7,3, 0,4,6,2, 1,3,7,5]
)usda" + extra +
           "\n}\n";
}

class SubdivisionRender : public testing::Test {
  protected:
    void SetUp() override {
        w.write("none.usda", cube_scene("uniform token subdivisionScheme = \"none\""));
        w.write("smooth.usda", cube_scene(""));
        w.write("bilinear.usda", cube_scene("uniform token subdivisionScheme = \"bilinear\""));
    }

    std::string hash_of(const std::string& scene, const std::string& options = "") const {
        const CommandResult r = w.velatura("render " + scene + quick + options + " -o x.exr");
        EXPECT_EQ(r.exit_code, 0) << r.output;
        EXPECT_EQ(r.output.find("subdivision]"), std::string::npos) << r.output;
        return w.hash("x.exr");
    }

    Workplace w;
};

}  // namespace

TEST_F(SubdivisionRender, IsNotOpenedWithoutSubdividedMeshes) {
    const std::string line = std::string("render none.usda -q -o x.exr") + quick;
    expect_nothing_heavy(opened_files(w, "velatura", line), line);
}

TEST_F(SubdivisionRender, IsOpenedForTheFallbackOfMeshes) {
#ifndef VELATURA_HAVE_SUBDIVISION_PLUGIN
    GTEST_SKIP() << "built without the plugin subdivision";
#endif
    const std::string opened =
        opened_files(w, "velatura", std::string("render smooth.usda -q -o x.exr") + quick);
    EXPECT_NE(opened.find("velatura_subdivision.so"), std::string::npos);
    EXPECT_NE(opened.find("libosdCPU"), std::string::npos);
    EXPECT_EQ(opened.find("libOpenImageIO"), std::string::npos);
}

TEST_F(SubdivisionRender, DrawsTheLimitSurfaceWhateverTheThreads) {
#ifndef VELATURA_HAVE_SUBDIVISION_PLUGIN
    GTEST_SKIP() << "built without the plugin subdivision";
#endif
    const std::string smooth = hash_of("smooth.usda");
    EXPECT_EQ(hash_of("smooth.usda", "--threads 1"), smooth);
    EXPECT_EQ(hash_of("smooth.usda", "--threads 5"), smooth);
    EXPECT_NE(hash_of("none.usda"), smooth);
    EXPECT_NE(hash_of("smooth.usda", "--subdivision-level 1"), smooth);
    // Left out, the polygons are left
    const std::string polygons = hash_of("smooth.usda", "--effects -subdivision");
    EXPECT_NE(polygons, smooth);
    EXPECT_EQ(
        opened_files(w, "velatura",
                     std::string("render smooth.usda -q -o x.exr --effects -subdivision") + quick)
            .find("libosd"),
        std::string::npos);
    const CommandResult limited = w.velatura(
        std::string("render smooth.usda --dicing-limit 0.001 --dicing-rate 0.2 -o y.exr") + quick);
    EXPECT_NE(limited.output.find("[dicing-limit]"), std::string::npos) << limited.output;
}

TEST_F(SubdivisionRender, DrawsPolygonsWithAWarningWhereItIsMissing) {
    w.write("empty/readme.txt", "");
    const std::string copy = w.path("lone/bin");
    const CommandResult made =
        w.velatura("--version >/dev/null && mkdir -p '" + copy + "' && cp '" + VELATURA_BIN_DIR +
                   "/velatura' '" + copy + "'");
    ASSERT_EQ(made.exit_code, 0) << made.output;
    const CommandResult r = w.velatura("--version >/dev/null && '" + copy +
                                       "/velatura' render smooth.usda -o x.exr" + quick);
    EXPECT_EQ(r.exit_code, 1) << r.output;
    EXPECT_NE(r.output.find("smooth.usda:10:"), std::string::npos) << r.output;
    EXPECT_NE(r.output.find("plugin subdivision is missing: no plugin provides subdivider"),
              std::string::npos)
        << r.output;
    EXPECT_NE(r.output.find("are rendered unsubdivided"), std::string::npos);
}

}  // namespace velatura::test
