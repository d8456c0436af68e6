// SPDX-License-Identifier: Apache-2.0
// Prims that cannot be rendered as they are, and plugins that cannot be used: a message with the
// file, the line and the prim; that prim is lost, or what is wrong of it, and the frame is not.
#include "command.h"

#include <gtest/gtest.h>

namespace velatura::test {

namespace {

constexpr const char* quick = " --res 16 12 --spp 1 --guiding off --progress none";

/// A camera, a dome and a box, then `prim` at line 14.
std::string stage_with(const std::string& prim) {
    return R"usda(#usda 1.0
( startTimeCode = 0; endTimeCode = 1 )
def Camera "Cam"
{
    double shutter:open = 0
    double shutter:close = 1
    double3 xformOp:translate = (0, 0, 9)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "sky" {
}
def Cube "Box" {
}
)usda" + prim;
}

std::string mesh(const std::string& what) {
    return "def Mesh \"Wrong\" {\n" + what + "\n}\n";
}

const std::string quad_faces =
    "int[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2, 3]\n";
const std::string quad_points = "point3f[] points = [(2, 0, 0), (3, 0, 0), (3, 1, 0), (2, 1, 0)]\n";
const std::string polygons = "uniform token subdivisionScheme = \"none\"\n";

struct Case {
    const char* what;
    std::string prim;
    const char* message;  ///< with its place
    std::string left;     ///< what is rendered instead
};

class BadPrims : public testing::Test {
  protected:
    std::string hash_of(const std::string& prim) {
        w.write("good.usda", stage_with(prim));
        EXPECT_EQ(w.velatura(std::string("render good.usda -q -o good.exr") + quick).exit_code, 0);
        return w.hash("good.exr");
    }

    /// Renders the prim among the others. Args: program: a command instead of the program of this
    /// build; exit_code: of the render, which writes the image in any case.
    void expect_loss(const Case& c, const std::string& program = "", int exit_code = 0) {
        SCOPED_TRACE(c.what);
        w.write("bad.usda", stage_with(c.prim));
        const CommandResult r = w.velatura(program + "render bad.usda -o x.exr" + quick);
        EXPECT_EQ(r.exit_code, exit_code) << r.output;
        EXPECT_NE(r.output.find(c.message), std::string::npos) << r.output;
        EXPECT_NE(r.output.find("</Wrong"), std::string::npos) << r.output;
        EXPECT_EQ(w.hash("x.exr"), hash_of(c.left));
    }

    Workplace w;
};

}  // namespace

TEST_F(BadPrims, CostThemselvesAndNotTheFrame) {
    const std::string good_quad = mesh(polygons + quad_faces + quad_points);
    const std::string fewer_points =
        "point3f[] points.timeSamples = { 0: [(2, 0, 0), (3, 0, 0), (3, 1, 0), (2, 1, 0)], 1: [(2, "
        "0, 0), (3, 0, 0), (3, 1, 0)] }\n";
    const std::string moving_points =
        "point3f[] points.timeSamples = { 0: [(2, 0, 0), (3, 0, 0), (3, 1, 0), (2, 1, 0)], 1: [(2, "
        "0, 0), (4, 0, 0), (3, 1, 0), (2, 1, 0)] }\n";
    const Case cases[] = {
        {"a point that is no number",
         mesh(polygons + quad_faces +
              "point3f[] points = [(2, 0, 0), (nan, 0, 0), (3, 1, 0), (2, 1, 0)]"),
         "bad.usda:16:26: warning: 1 of 1 faces are skipped: point that is not a finite number "
         "[bad-topology]",
         ""},
        {"a point that is not there",
         mesh(polygons + "int[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2, 9]\n" +
              quad_points),
         "bad.usda:16:26: warning: 1 of 1 faces are skipped: vertex index outside the points "
         "[bad-topology]",
         ""},
        {"no points", mesh(polygons + quad_faces),
         "bad.usda:14:1: warning: points is not authored; the Mesh is skipped [empty-mesh]", ""},
        {"a topology that changes",
         mesh(polygons +
              "int[] faceVertexCounts.timeSamples = { 0: [4], 1: [3] }\nint[] "
              "faceVertexIndices.timeSamples = { 0: [0, 1, 2, 3], 1: [0, 1, 2] }\n" +
              moving_points),
         "bad.usda:14:1: warning: its topology changes while the shutter is open: the mesh is "
         "rendered without motion blur, at the frame time [unsupported-motion-blur]",
         good_quad},
        {"points that get fewer", mesh(polygons + quad_faces + fewer_points),
         "bad.usda:14:1: warning: the number of its points changes while the shutter is open: the "
         "mesh is rendered without motion blur, at the frame time [unsupported-motion-blur]",
         good_quad},
        {"a transform without room",
         mesh(polygons + quad_faces + quad_points +
              "float3 xformOp:scale = (0, 0, 1)\nuniform token[] xformOpOrder = "
              "[\"xformOp:scale\"]"),
         "bad.usda:14:1: warning: transform is infinite or flattens everything", ""},
        {"curves of too few points",
         "def BasisCurves \"Wrong\" {\nint[] curveVertexCounts = [4]\npoint3f[] points = [(2, 0, "
         "0), (3, 0, 0)]\nfloat[] widths = [0.1]\n}\n",
         "bad.usda:15:27: warning: 1 of 1 curves are skipped: curveVertexCounts add up to more "
         "than "
         "there are points [bad-curves]",
         ""},
        {"a sphere of no size", "def Sphere \"Wrong\" {\ndouble radius = -1\n}\n",
         "bad.usda:14:1: warning: sizes are not positive numbers, the prim is skipped "
         "[bad-gprim-size]",
         ""},
    };
    for (const Case& c : cases) expect_loss(c);
}

/// Three faces at one edge, and two that touch in a point, have a limit surface all the same.
TEST_F(BadPrims, NonManifoldMeshesAreRendered) {
    const std::string fins = mesh(
        "int[] faceVertexCounts = [4, 4, 4, 3]\nint[] faceVertexIndices = [0, 1, 2, 3, 0, 1, 5, 4, "
        "0, 1, 7, 6, 2, 8, 9]\n"
        "point3f[] points = [(2, 0, 0), (2, 1, 0), (3, 1, 0), (3, 0, 0), (1, 0, 0), (1, 1, 0), (2, "
        "0, 1), (2, 1, 1), (3, 2, 0), (4, 2, 0)]\n");
    w.write("fins.usda", stage_with(fins));
    const CommandResult r = w.velatura(std::string("render fins.usda --strict -o x.exr") + quick);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_EQ(r.output.find("warning"), std::string::npos) << r.output;
    EXPECT_NE(w.hash("x.exr"), hash_of(""));
}

/// A plugin of another ABI is as good as none: what it was for is done without, or lost.
TEST_F(BadPrims, OfPluginsThatCannotBeUsedAreNamedWithThem) {
    const std::string copy = w.path("lone/bin"), plugins = w.path("lone/plugins");
    ASSERT_EQ(w.velatura("--version >/dev/null && mkdir -p '" + copy + "' '" + plugins +
                         "/subdivision' '" + plugins + "/volume' && cp '" + VELATURA_BIN_DIR +
                         "/velatura' '" + copy + "'")
                  .exit_code,
              0);
    w.write("lone/plugins/subdivision/plugin.txt",
            "name: subdivision\nabi: 99\nprovides: subdivider\ntrigger: effect subdivision\n");
    w.write("lone/plugins/volume/plugin.txt",
            "name: volume\nabi: 99\nprovides: volume_source\ntrigger: effect volumes\n");
    const std::string alone = "--version >/dev/null && '" + copy + "/velatura' ";
    const std::string volume =
        "def Volume \"Wrong\" {\nrel field:density = </Wrong/D>\ndef OpenVDBAsset \"D\" {\nasset "
        "filePath = @x.vdb@\ntoken fieldName = \"density\"\n}\n}\n";
    expect_loss({"no subdivider", mesh(quad_faces + quad_points),
                 "plugin subdivision: expected ABI 1, found 99: subdivision meshes are rendered "
                 "unsubdivided",
                 mesh(polygons + quad_faces + quad_points)},
                alone, 1);
    expect_loss({"nobody to read grids", volume, "plugin volume: expected ABI 1, found 99", ""},
                alone, 1);
}

}  // namespace velatura::test
