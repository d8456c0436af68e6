// SPDX-License-Identifier: Apache-2.0
// Motion vectors against points that are projected in closed form. With one sample per pixel the
// layer P holds the very point whose vector the pixel has.
#include "image/exr.h"
#include "rendered_image.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

struct Point {
    double x = 0, y = 0, z = 0;
};

Point operator+(const Point& a, const Point& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}

constexpr int width = 64, height = 36;
constexpr double focal = 35, aperture = 36;

/// Where the camera stands, and how far it is turned about its vertical axis.
struct View {
    Point at;
    double turn_deg = 0;
};

/// Pixels, y up.
Point film_direction(const Point& d, const View& view) {
    const double a = -view.turn_deg * std::numbers::pi / 180;
    const double x = d.x * std::cos(a) + d.z * std::sin(a);
    const double z = -d.x * std::sin(a) + d.z * std::cos(a);
    const double scale = focal / aperture * width;
    return {x / -z * scale, d.y / -z * scale, 0};
}

Point film(const Point& p, const View& view) {
    return film_direction({p.x - view.at.x, p.y - view.at.y, p.z - view.at.z}, view);
}

constexpr View still = {{0, 0, 5}, 0};
constexpr View later = {{0.2, -0.1, 4.8}, 3};

std::string stage(const std::string& prims,
                  const std::string& camera_attributes,
                  bool camera_moves,
                  bool at_previous = false) {
    const std::string other = at_previous ? "0" : "2";
    const std::string move =
        camera_moves ? fmt::format(
                           "double3 xformOp:translate.timeSamples = {{ 1: (0, 0, 5), {0}: "
                           "(0.2, -0.1, 4.8) }}\n"
                           "        float xformOp:rotateY.timeSamples = {{ 1: 0, {0}: 3 }}",
                           other)
                     : std::string(
                           "double3 xformOp:translate = (0, 0, 5)\n"
                           "        float xformOp:rotateY = 0");
    return fmt::format(R"usda(#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 2
    timeCodesPerSecond = 24
)
def Xform "W"
{{
    def Camera "Cam"
    {{
        float focalLength = {}
        float horizontalAperture = {}
        float verticalAperture = {}
        float2 clippingRange = (0.01, 1000)
        {}
        {}
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]
    }}
    def DomeLight "sky" {{}}
{}
}}
)usda",
                       focal, aperture, aperture * height / width, move, camera_attributes, prims);
}

/// A square of two units in the plane z = 0, or with these attributes.
std::string square(const std::string& attributes,
                   const std::string& points =
                       "point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, "
                       "1, 0), (-1, 1, 0)]",
                   const std::string& scheme = "none",
                   const std::string& name = "Square") {
    return fmt::format(R"usda(    def Mesh "{}"
    {{
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        {}
        uniform token subdivisionScheme = "{}"
        {}
    }}
)usda",
                       name, points, scheme, attributes);
}

const std::string slides =
    "double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 2: (0.3, 0.2, -0.5) }\n"
    "        uniform token[] xformOpOrder = [\"xformOp:translate\"]";

Point slid(const Point& p) {
    return p + Point{0.3, 0.2, -0.5};
}

Point turned(const Point& p) {
    const double a = 10 * std::numbers::pi / 180;
    return {p.x * std::cos(a) - p.y * std::sin(a), p.x * std::sin(a) + p.y * std::cos(a), p.z};
}

Point sheared(const Point& p) {
    return {1.2 * p.x, p.y + 0.3 * p.x, p.z - 0.4 * p.x};
}

/// The points of `square`, and where sheared() takes them.
const std::string shears =
    "point3f[] points.timeSamples = { 1: [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], "
    "2: [(-1.2, -1.3, 0.4), (1.2, -0.7, -0.4), (1.2, 1.3, -0.4), (-1.2, 0.7, 0.4)] }";

struct Case {
    const char* name;
    std::string prims;
    std::function<Point(const Point&)> move;
};

std::vector<Case> cases() {
    const auto stays = [](const Point& p) { return p; };
    const std::string holder = "    class Xform \"Proto\"\n    {\n" + square("") + "    }\n";
    return {
        {"Static", square(""), stays},
        {"Transform", square(slides), slid},
        {"Rotation",
         square("float xformOp:rotateZ.timeSamples = { 1: 0, 2: 10 }\n"
                "        uniform token[] xformOpOrder = [\"xformOp:rotateZ\"]"),
         turned},
        {"Points", square("", shears), sheared},
        {"Subdivided", square("", shears, "catmullClark"), sheared},
        {"Velocities",
         square("vector3f[] velocities.timeSamples = { 1: [(2.4, 0, 0), (2.4, 0, 0), (2.4, 0, 0), "
                "(2.4, 0, 0)] }",
                "point3f[] points.timeSamples = { 1: [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, "
                "0)] }"),
         [](const Point& p) {
             return p + Point{0.1, 0, 0};
         }},
        {"Sphere", "    def Sphere \"Ball\"\n    {\n        " + slides + "\n    }\n", slid},
        {"Instance",
         holder +
             "    def Xform \"I\" (\n        inherits = </W/Proto>\n        instanceable = "
             "true\n    )\n    {\n        " +
             slides + "\n    }\n",
         slid},
        {"PointInstancer",
         "    def PointInstancer \"PI\"\n    {\n        rel prototypes = [</W/PI/Square>]\n"
         "        int[] protoIndices = [0]\n"
         "        point3f[] positions.timeSamples = { 1: [(0, 0, 0)], 2: [(0.3, 0.2, -0.5)] }\n" +
             square("") + "    }\n",
         slid},
        {"Cloud",
         "    def Points \"Cloud\"\n    {\n        point3f[] points.timeSamples = { 1: [(0, 0, 0), "
         "(1, 0, 0)], 2: [(0.3, 0.2, -0.5), (1.3, 0.2, -0.5)] }\n"
         "        float[] widths = [1, 1]\n    }\n",
         slid},
        {"Curves",
         "    def BasisCurves \"Strand\"\n    {\n        uniform token type = \"linear\"\n        "
         "int[] curveVertexCounts = [2]\n        point3f[] points.timeSamples = { 1: [(-1, 0, 0), "
         "(1, 0, 0)], 2: [(-0.7, 0.2, -0.5), (1.3, 0.2, -0.5)] }\n        float[] widths = [0.6] "
         "(interpolation = \"constant\")\n    }\n",
         slid},
    };
}

class MotionVectors : public testing::Test {
  protected:
    image::Image render(const std::string& scene, const std::string& arguments) {
        w.write("s.usda", scene);
        const CommandResult r = w.velatura(
            fmt::format("render s.usda --res {} {} --progress none -o out.exr --spp 1 --filter "
                        "box --adaptive off --bounces 0 {}",
                        width, height, arguments));
        EXPECT_EQ(r.exit_code, 0) << r.output;
        output = r.output;
        return read_image(w, "out.exr");
    }

    /// Largest difference [pixels] of a layer from what the points do; pixels of the surface.
    double largest_error(const image::Image& image,
                         const std::string& layer,
                         const std::function<Point(const Point&)>& move,
                         const View& now,
                         const View& then,
                         size_t& pixels) {
        double largest = 0;
        pixels = 0;
        for (size_t i = 0; i < image.data.pixel_count(); ++i) {
            if (value(image, "A", i) == 0.0) continue;
            const Point p = {value(image, "P.X", i), value(image, "P.Y", i),
                             value(image, "P.Z", i)};
            const Point a = film(p, now), b = film(move(p), then);
            largest = std::max({largest, std::abs(value(image, layer + ".u", i) - (b.x - a.x)),
                                std::abs(value(image, layer + ".v", i) - (b.y - a.y))});
            ++pixels;
        }
        return largest;
    }

    Workplace w;
    std::string output;
};

}  // namespace

TEST_F(MotionVectors, AreThoseOfProjectedPoints) {
    for (const Case& c : cases()) {
        for (const bool camera_moves : {false, true}) {
            SCOPED_TRACE(fmt::format("{}, camera {}", c.name, camera_moves));
            const image::Image image =
                render(stage(c.prims, "", camera_moves), "--frames 1 --layers data,motion");
            size_t pixels = 0;
            const double error = largest_error(image, "forward", c.move, still,
                                               camera_moves ? later : still, pixels);
            EXPECT_GT(pixels, 50u);
            EXPECT_LE(error, 0.01);
            EXPECT_EQ(output.find("motion-vectors"), std::string::npos) << output;
        }
    }
}

TEST_F(MotionVectors, OfWhatStaysAreZero) {
    const image::Image image = render(stage(square(""), "", false),
                                      "--frames 1 --layers data,motion,backward,shutterMotion");
    for (const std::string layer : {"forward", "backward", "shutterMotion"})
        for (size_t i = 0; i < image.data.pixel_count(); ++i) {
            ASSERT_EQ(value(image, layer + ".u", i), 0.0) << layer;
            ASSERT_EQ(value(image, layer + ".v", i), 0.0) << layer;
        }
    EXPECT_NE(output.find("the shutter of the camera is closed"), std::string::npos) << output;
}

TEST_F(MotionVectors, BackwardOnesLeadToThePreviousFrame) {
    const std::string moved =
        "double3 xformOp:translate.timeSamples = { 0: (0.3, 0.2, -0.5), 1: (0, 0, 0) }\n"
        "        uniform token[] xformOpOrder = [\"xformOp:translate\"]";
    const image::Image image =
        render(stage(square(moved), "", true, true), "--frames 1 --layers data,backward");
    size_t pixels = 0;
    EXPECT_LE(largest_error(image, "backward", slid, still, later, pixels), 0.01);
    EXPECT_GT(pixels, 50u);
}

/// What is infinitely far moves with the camera's rotation, not with its place.
TEST_F(MotionVectors, BackgroundMovesWithTheCamera) {
    const image::Image image = render(stage("", "", true), "--frames 1 --layers data,motion");
    double largest = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            // Somewhere in the pixel: over it the vector changes by less
            const double scale = focal / aperture * width;
            const Point d = {(x + 0.5 - width / 2.0) / scale, (height / 2.0 - y - 0.5) / scale, -1};
            const Point a = film_direction(d, still), b = film_direction(d, later);
            const size_t i = size_t(y * width + x);
            const double change = 0.05;
            EXPECT_NEAR(value(image, "forward.u", i), b.x - a.x, change);
            EXPECT_NEAR(value(image, "forward.v", i), b.y - a.y, change);
            largest = std::max(largest, std::abs(b.x - a.x));
        }
    }
    EXPECT_GT(largest, 1.0);
}

/// With motion blur a sample is of another instant, and its vector still that of a whole frame: of
/// what slides in the image plane it depends on the depth alone.
TEST_F(MotionVectors, DoNotDependOnMotionBlur) {
    const std::string moves =
        "double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 2: (0.4, -0.2, 0) }\n"
        "        uniform token[] xformOpOrder = [\"xformOp:translate\"]";
    const std::string shutter = "double shutter:open = 0.25\n        double shutter:close = 0.75";
    // A mesh has keys of points then, a ball becomes an instance
    const std::string prims =
        square(moves) + "    def Sphere \"Ball\"\n    {\n        double radius = 0.5\n        " +
        moves + "\n    }\n";
    for (const std::string& extra : {shutter, std::string()}) {
        const image::Image image =
            render(stage(prims, extra, false), "--frames 1 --layers data,motion,shutterMotion");
        const double share = extra.empty() ? 0 : 0.5;
        size_t square_pixels = 0, ball_pixels = 0;
        for (size_t i = 0; i < image.data.pixel_count(); ++i) {
            if (value(image, "A", i) == 0.0) continue;
            const double z = value(image, "P.Z", i);
            (std::abs(z) < 1e-4 ? square_pixels : ball_pixels) += 1;
            const double scale = focal / aperture * width / (5 - z);
            EXPECT_NEAR(value(image, "forward.u", i), 0.4 * scale, 0.01);
            EXPECT_NEAR(value(image, "forward.v", i), -0.2 * scale, 0.01);
            EXPECT_NEAR(value(image, "shutterMotion.u", i), share * 0.4 * scale, 0.01);
            EXPECT_NEAR(value(image, "shutterMotion.v", i), share * -0.2 * scale, 0.01);
        }
        EXPECT_GT(square_pixels, 50u);
        EXPECT_GT(ball_pixels, 50u);
    }
}

/// The image is the same whether somebody asks for vectors or not.
TEST_F(MotionVectors, LeaveTheBeautyAsItIs) {
    const std::string scene = stage(square("", shears) + square(slides,
                                                                "point3f[] points = [(-2, "
                                                                "-2, -1), (2, -2, -1), (2, "
                                                                "2, -1), (-2, 2, -1)]",
                                                                "none", "Back"),
                                    "double shutter:close = 0.5", true);
    const image::Image with = render(scene, "--frames 1 --layers data,motion,backward");
    const image::Image without = render(scene, "--frames 1 --layers data");
    for (const char* channel : {"R", "G", "B", "A", "P.X", "Z"})
        for (size_t i = 0; i < with.data.pixel_count(); ++i)
            ASSERT_EQ(value(with, channel, i), value(without, channel, i)) << channel;
}

TEST_F(MotionVectors, ReportWhatHasNoPartner) {
    const std::string changes = R"usda(    def Mesh "Fluid"
    {
        int[] faceVertexCounts.timeSamples = { 1: [4], 2: [3] }
        int[] faceVertexIndices.timeSamples = { 1: [0, 1, 2, 3], 2: [0, 1, 2] }
        point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
        uniform token subdivisionScheme = "none"
    }
)usda";
    const image::Image image = render(stage(changes, "", true), "--frames 1 --layers data,motion");
    EXPECT_NE(output.find("have another topology"), std::string::npos) << output;
    EXPECT_NE(output.find("/W/Fluid"), std::string::npos) << output;
    size_t pixels = 0;
    EXPECT_LE(largest_error(
                  image, "forward", [](const Point& p) { return p; }, still, later, pixels),
              0.01);
}

}  // namespace velatura::test
