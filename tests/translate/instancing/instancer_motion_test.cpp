// SPDX-License-Identifier: Apache-2.0
// Instances of point instancers that move while the shutter is open, against closed forms.
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace velatura::translate::instancing {

namespace {

/// Seconds are 32 time codes: times of the tests below are exact in binary.
constexpr double codes_per_second = 32;

/// A stage whose camera has its shutter open from the frame on for so many time codes.
std::string stage_text(double close, const std::string& text) {
    return fmt::format("#usda 1.0\n(\n timeCodesPerSecond = {}\n framesPerSecond = {}\n)\n",
                       codes_per_second, codes_per_second) +
           camera(fmt::format("double shutter:open = 0\ndouble shutter:close = {}\n", close)) +
           "def DomeLight \"Sky\" {}\n" + text;
}

std::string instancer(const std::string& rows, const std::string& prototype = quad("Q")) {
    return "def PointInstancer \"P\" {\n rel prototypes = </P/Q>\n" + rows + prototype + "}\n";
}

/// Keys in which two scenes' instances differ; both have as many.
size_t different_keys(const scene::Scene& a, const scene::Scene& b) {
    size_t different = a.instances.size() != b.instances.size();
    for (size_t i = 0; i < std::min(a.instances.size(), b.instances.size()); ++i) {
        const scene::Instance &p = a.instances[i], &q = b.instances[i];
        different += p.render_from_prototype != q.render_from_prototype ||
                     p.later_render_from_prototype != q.later_render_from_prototype;
    }
    return different;
}

}  // namespace

TEST(InstancerMotion, FollowsVelocitiesAndAccelerations) {
    // The sample is half a time code before the frame
    Translated t;
    translate_at(1.5, stage_text(16, instancer(R"(
    int[] protoIndices = [0, 0, 0]
    point3f[] positions.timeSamples = { 1: [(1, 2, -9), (5, 0, -9), (7, 0, -9)] }
    vector3f[] velocities.timeSamples = { 1: [(4, 0, 0), (0, -8, 2), (0, 0, 0)] }
    vector3f[] accelerations.timeSamples = { 1: [(0, 16, 0), (0, 0, 0), (0, 0, 0)] }
)")),
                 t);
    ASSERT_EQ(t.scene.instances.size(), 3u);
    const Vec3d from[] = {{1, 2, -9}, {5, 0, -9}, {7, 0, -9}};
    const Vec3d velocity[] = {{4, 0, 0}, {0, -8, 2}, {0, 0, 0}};
    const Vec3d acceleration[] = {{0, 16, 0}, {0, 0, 0}, {0, 0, 0}};
    const size_t segments[] = {16, 1, 0};
    for (size_t i = 0; i < 3; ++i) {
        const scene::Instance& instance = t.scene.instances[i];
        ASSERT_EQ(instance.later_render_from_prototype.size(), segments[i]) << i;
        for (size_t k = 0; k <= segments[i]; ++k) {
            const double way = segments[i] == 0 ? 0.0 : double(k) / double(segments[i]);
            const double s = (0.5 + 16 * way) / codes_per_second;
            const Vec3d expected = from[i] + velocity[i] * s + acceleration[i] * (0.5 * s * s);
            EXPECT_EQ(position(key(instance, k)), to_float(expected)) << i << " at " << way;
        }
    }
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
}

TEST(InstancerMotion, IsTheSameByVelocitiesAndBySamples) {
    const std::string head =
        "int[] protoIndices = [0, 0]\nfloat3[] scales = [(1, 2, 1), (3, 1, 1)]\n";
    Translated by_velocities, by_samples, by_many;
    translate_at(1, stage_text(0.5, instancer(head + R"(
    point3f[] positions.timeSamples = { 1: [(1, 2, -9), (5, 0, -9)] }
    vector3f[] velocities.timeSamples = { 1: [(32, 8, -16), (0, -64, 0)] }
)")),
                 by_velocities);
    translate_at(1, stage_text(0.5, instancer(head + R"(
    point3f[] positions.timeSamples = { 1: [(1, 2, -9), (5, 0, -9)], 2: [(2, 2.25, -9.5), (5, -2,
        -9)] }
)")),
                 by_samples);
    ASSERT_EQ(by_velocities.scene.instances.size(), 2u);
    EXPECT_EQ(position(key(by_velocities.scene.instances[0], 1)), Vec3(1.5f, 2.125f, -9.25f));
    EXPECT_EQ(different_keys(by_velocities.scene, by_samples.scene), 0u);
    // A sample in between on the same line adds keys and nothing else
    translate_at(1, stage_text(0.5, instancer(head + R"(
    point3f[] positions.timeSamples = { 1: [(1, 2, -9), (5, 0, -9)], 1.25: [(1.25, 2.0625,
        -9.125), (5, -0.5, -9)], 2: [(2, 2.25, -9.5), (5, -2, -9)] }
)")),
                 by_many);
    for (const scene::Instance& instance : by_many.scene.instances) {
        ASSERT_EQ(instance.later_render_from_prototype.size(), 2u);
        const Vec3 half = (position(key(instance, 0)) + position(key(instance, 2))) * 0.5f;
        EXPECT_EQ(position(key(instance, 1)), half);
    }
}

TEST(InstancerMotion, TurnsByAngularVelocitiesAsByOrientations) {
    // A quarter turn about Z in half a time code, from a start that is turned about X
    const std::string head =
        "int[] protoIndices = [0]\nfloat3[] scales = [(1, 2, 1)]\npoint3f[] positions = [(0, 0, "
        "-9)]\n";
    const std::string start = "(0.8, 0.6, 0, 0)";
    Translated by_velocity, by_samples;
    translate_at(
        1,
        stage_text(0.5, instancer(head + "quatf[] orientationsf.timeSamples = { 1: [" + start +
                                  "] }\nvector3f[] angularVelocities.timeSamples = { "
                                  "1: [(0, 0, 5760)] }\n")),
        by_velocity);
    // The same half a turn later in a whole time code: i·k-turned, (0,0,0,1)·start
    translate_at(1,
                 stage_text(0.5, instancer(head + "quatf[] orientationsf.timeSamples = { 1: [" +
                                           start + "], 2: [(0, 0, 0.6, 0.8)] }\n")),
                 by_samples);
    ASSERT_EQ(by_velocity.scene.instances.size(), 1u);
    const scene::Instance& a = by_velocity.scene.instances[0];
    const scene::Instance& b = by_samples.scene.instances[0];
    ASSERT_EQ(a.later_render_from_prototype.size(), 16u);
    ASSERT_EQ(b.later_render_from_prototype.size(), 16u);
    for (size_t k = 0; k <= 16; ++k) {
        const double angle = pi_d / 2 * double(k) / 16, c = std::cos(angle), s = std::sin(angle);
        // Rows: where the axes go. Turned about X by 2·atan(0.75), then about Z
        const double cx = 0.28, sx = 0.96;
        const Vec3d rows[3] = {{c, s, 0}, Vec3d(-s * cx, c * cx, sx) * 2.0, {s * sx, -c * sx, cx}};
        for (int r = 0; r < 3; ++r) {
            for (int i = 0; i < 3; ++i) {
                EXPECT_NEAR(key(a, k)[r][i], rows[r][i], 2e-7) << k;
                EXPECT_NEAR(key(a, k)[r][i], key(b, k)[r][i], 2e-7) << k;
            }
        }
    }
}

TEST(InstancerMotion, OfWholeTurnsIsNoRest) {
    for (const int turns : {1, 2, 5, 8}) {
        Translated t;
        translate_at(
            0,
            stage_text(1, instancer(fmt::format(
                              "int[] protoIndices = [0]\npoint3f[] positions = [(0, 0, -9)]\n"
                              "quatf[] orientationsf.timeSamples = {{ 0: [(1, 0, 0, 0)] }}\n"
                              "vector3f[] angularVelocities.timeSamples = {{ 0: [(0, {}, 0)] }}\n",
                              360 * 32 * turns))),
            t);
        ASSERT_EQ(t.scene.instances.size(), 1u);
        EXPECT_EQ(t.scene.instances[0].later_render_from_prototype.size(), 16u) << turns;
    }
}

// Their topology may change from sample to sample, velocities go on from the one before the frame.
TEST(InstancerMotion, ByVelocitiesDoesNotMindOtherNumbersOfInstances) {
    const std::string rows = R"(
    int[] protoIndices.timeSamples = { 1: [0, 0], 2: [0, 0, 0] }
    int64[] ids.timeSamples = { 1: [4, 5], 2: [5, 6, 7] }
    point3f[] positions.timeSamples = { 1: [(0, 0, -9), (4, 0, -9)], 2: [(9, 0, -9), (9, 1, -9),
        (9, 2, -9)] }
)";
    const std::string velocities =
        "vector3f[] velocities.timeSamples = { 1: [(32, 0, 0), (0, 32, 0)], 2: [(0, 0, 0), (0, 0, "
        "0), (0, 0, 0)] }\n";
    Translated t, without;
    translate_at(1.5, stage_text(1, instancer(rows + velocities)), t);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    EXPECT_EQ(position(key(t.scene.instances[0], 0)), Vec3(0.5f, 0, -9));
    EXPECT_EQ(position(key(t.scene.instances[0], 1)), Vec3(1.5f, 0, -9));
    EXPECT_EQ(position(key(t.scene.instances[1], 1)), Vec3(4, 1.5f, -9));
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
    translate_at(1.5, stage_text(1, instancer(rows)), without);
    EXPECT_EQ(without.count("unsupported-motion-blur"), 1u);
    for (const scene::Instance& instance : without.scene.instances)
        EXPECT_TRUE(instance.later_render_from_prototype.empty());
}

TEST(InstancerMotion, IsNoneFromOneInstanceToAnother) {
    const std::string moves =
        "int[] protoIndices = [0, 0]\npoint3f[] positions.timeSamples = { 1: [(0, 0, -9), (4, 0, "
        "-9)], 2: [(4, 0, -9), (8, 0, -9)] }\n";
    Translated same, other;
    translate_at(1,
                 stage_text(0.5, instancer(moves + "int64[] ids.timeSamples = { 1: [4, 5], 2: "
                                                   "[4, 5], 3: [5, 4] }\n")),
                 same);
    EXPECT_EQ(same.count("unsupported-motion-blur"), 0u);
    EXPECT_EQ(position(key(same.scene.instances[1], 1)), Vec3(6, 0, -9));
    // Born and gone between the samples
    translate_at(1,
                 stage_text(0.5, instancer(moves + "int64[] ids.timeSamples = { 1: [4, 5], 2: "
                                                   "[5, 6] }\n")),
                 other);
    EXPECT_EQ(other.count("unsupported-motion-blur"), 1u);
    EXPECT_EQ(position(key(other.scene.instances[1], 0)), Vec3(4, 0, -9));
    EXPECT_TRUE(other.scene.instances[1].later_render_from_prototype.empty());
}

TEST(InstancerMotion, LeavesOutVelocitiesThatDoNotFit) {
    const std::string samples = "{ 1: [(0, 0, -9)], 2: [(4, 0, -9)] }\n";

    const struct {
        const char* what;
        std::string positions, velocities;
        bool moves_by_samples;
    } cases[] = {
        {"too many", ".timeSamples = " + samples,
         ".timeSamples = { 1: [(9, 9, 9), (9, 9, 9)], 2: [] }\n", true},
        {"at other times", ".timeSamples = " + samples,
         ".timeSamples = { 1: [(9, 9, 9)], 1.5: [(9, 9, 9)] }\n", true},
        {"of the next sample only", ".timeSamples = " + samples,
         ".timeSamples = { 2: [(9, 9, 9)] }\n", true},
        {"without samples", ".timeSamples = " + samples, " = [(9, 9, 9)]\n", true},
        {"of what has no samples", " = [(0, 0, -9)]\n", ".timeSamples = { 1: [(9, 9, 9)] }\n",
         false},
    };

    for (const auto& c : cases) {
        Translated t;
        translate_at(
            1,
            stage_text(0.5, instancer("int[] protoIndices = [0]\npoint3f[] positions" +
                                      c.positions + "vector3f[] velocities" + c.velocities)),
            t);
        EXPECT_EQ(t.count("unused-velocities"), 1u) << c.what;
        ASSERT_EQ(t.scene.instances.size(), 1u);
        const scene::Instance& instance = t.scene.instances[0];
        EXPECT_EQ(position(key(instance, 0)), Vec3(0, 0, -9)) << c.what;
        ASSERT_EQ(instance.later_render_from_prototype.size(), c.moves_by_samples ? 1u : 0u)
            << c.what;
        if (c.moves_by_samples) {
            EXPECT_EQ(position(key(instance, 1)), Vec3(2, 0, -9)) << c.what;
        }
    }
    // Accelerations need velocities at their times
    Translated t;
    translate_at(1,
                 stage_text(0.5, instancer("int[] protoIndices = [0]\npoint3f[] "
                                           "positions.timeSamples = { 1: [(0, 0, -9)] }\n"
                                           "vector3f[] velocities.timeSamples = { 1: [(64, 0, "
                                           "0)] }\nvector3f[] accelerations.timeSamples = { 0: "
                                           "[(9, 9, 9)] }\n")),
                 t);
    EXPECT_EQ(t.count("unused-velocities"), 1u);
    EXPECT_EQ(position(key(t.scene.instances[0], 1)), Vec3(1, 0, -9));
}

TEST(InstancerMotion, IsNoneWhileTheShutterIsClosed) {
    const std::string head =
        "int[] protoIndices = [0, 0]\nint64[] ids = [3, 7]\nint64[] "
        "invisibleIds = [3]\n";
    const std::string rest =
        "point3f[] positions.timeSamples = { 1: [(0, 0, -9), (0.1, 0.3, -9)] }\nvector3f[] "
        "velocities.timeSamples = { 1: [(1, 1, 1), (0, 0, 0)] }\nquatf[] "
        "orientationsf.timeSamples = { 1: [(1, 0, 0, 0), (0.6, 0.7, 0.1, 0.3)] }\nvector3f[] "
        "angularVelocities.timeSamples = { 1: [(1, 1, 1), (0, 0, 0)] }\n";
    Translated open, closed, without;
    translate_at(1.375, stage_text(0.5, instancer(head + rest)), open);
    translate_at(1.375, stage_text(0, instancer(head + rest)), closed);
    translate_at(1.375, stage_text(0, instancer(head + R"(
    point3f[] positions = [(0, 0, -9), (0.1, 0.3, -9)]
    quatf[] orientationsf = [(1, 0, 0, 0), (0.6, 0.7, 0.1, 0.3)]
)")),
                 without);
    // The one that is seen stays, whatever the other does
    ASSERT_EQ(open.scene.instances.size(), 1u);
    EXPECT_TRUE(open.scene.instances[0].later_render_from_prototype.empty());
    EXPECT_EQ(different_keys(open.scene, closed.scene), 0u);
    EXPECT_EQ(different_keys(open.scene, without.scene), 0u);
    // Without a time there is nothing to go on from
    Translated timeless;
    translate_text(stage_text(0.5, instancer(head + rest)), timeless);
    EXPECT_EQ(timeless.count("unused-velocities"), 0u);
}

TEST(InstancerMotion, IsThatOfAllThatStandsInEachOther) {
    // A wheel that turns, on a cart that an instancer drives, which drifts as a whole
    const std::string text = "class Xform \"Wheel\" {\n" + quad("Q") + R"(}
def Xform "Drift" {
    double3 xformOp:translate.timeSamples = { 1: (0, 0, -5), 2: (0, 4, -5) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def PointInstancer "P" {
        rel prototypes = </Drift/P/Cart>
        int[] protoIndices = [0]
        point3f[] positions.timeSamples = { 1: [(0, 0, 0)] }
        vector3f[] velocities.timeSamples = { 1: [(256, 0, 0)] }
        def Xform "Cart" {
            def "W" (instanceable = true; prepend references = </Wheel>) {
                float xformOp:rotateZ.timeSamples = { 1: 0, 2: 180 }
                uniform token[] xformOpOrder = ["xformOp:rotateZ"]
            }
        }
    }
}
)";
    Translated t;
    translate_at(1, stage_text(0.5, text), t);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
    ASSERT_EQ(t.scene.instances.size(), 1u);
    const scene::Instance& wheel = t.scene.instances[0];
    ASSERT_EQ(wheel.later_render_from_prototype.size(), 16u);
    for (size_t k = 0; k <= 16; ++k) {
        const double way = double(k) / 16, angle = way * pi_d / 2;
        EXPECT_NEAR(key(wheel, k)[0][0], std::cos(angle), 1e-6);
        EXPECT_NEAR(key(wheel, k)[0][1], std::sin(angle), 1e-6);
        EXPECT_NEAR(key(wheel, k)[3][0] - key(wheel, 0)[3][0], 4 * way, 1e-5);
        EXPECT_NEAR(key(wheel, k)[3][1] - key(wheel, 0)[3][1], 2 * way, 1e-5);
    }
    // An instancer among the prototypes of another: 8 units of the one after 4 of the other
    const std::string nested = R"(
def PointInstancer "P" {
    rel prototypes = </P/Inner>
    int[] protoIndices = [0]
    point3f[] positions.timeSamples = { 1: [(0, 0, -9)], 2: [(8, 0, -9)] }
    def PointInstancer "Inner" {
        rel prototypes = </P/Inner/Q>
        int[] protoIndices = [0, 0]
        point3f[] positions.timeSamples = { 1: [(0, 0, 0), (0, 1, 0)], 2: [(0, 16, 0), (0, 1, 0)] }
)" + quad("Q") + "}\n}\n";
    Translated both;
    translate_at(1, stage_text(0.5, nested), both);
    ASSERT_EQ(both.scene.instances.size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
        const scene::Instance& instance = both.scene.instances[i];
        ASSERT_EQ(instance.later_render_from_prototype.size(), 1u);
        EXPECT_EQ(position(key(instance, 1)) - position(key(instance, 0)),
                  Vec3(4, i == 0 ? 8 : 0, 0));
    }
}

TEST(InstancerMotion, TakesLightsAlong) {
    const std::string moves =
        "int[] protoIndices = [0, 0]\npoint3f[] positions.timeSamples = { 1: [(0, 0, -9), (2, 0, "
        "-9)], 2: [(4, 0, -9), (2, 0, -9)] }\n";
    Translated t;
    translate_at(1,
                 stage_text(0.5, instancer(moves, "def Xform \"Q\" {\n def SphereLight \"L\" {}\n" +
                                                      quad("R") + "}\n")),
                 t);
    EXPECT_EQ(t.count("unsupported-motion-blur"), 0u);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    EXPECT_EQ(t.scene.instances[0].later_render_from_prototype.size(), 1u);
    EXPECT_EQ(position(key(t.scene.instances[0], 0)), Vec3(0, 0, -9));
    // Beside the light of the stage
    ASSERT_EQ(t.scene.lights.size(), 3u);
    size_t moving = 0;
    for (const scene::Light& light : t.scene.lights) {
        if (light.later_render_from_light.empty()) continue;
        ++moving;
        EXPECT_EQ(light.render_from_light[3][0], 0);
        EXPECT_EQ(light.later_render_from_light.back()[3][0], 2);
    }
    EXPECT_EQ(moving, 1u);
}

TEST(InstancerMotion, OutOfReachIsNamed) {
    const struct {
        const char *number, *code;
        size_t warnings;
    } cases[] = {{"inf", "bad-velocities", 2},
                 {"nan", "bad-velocities", 2},
                 {"3e38", "unsupported-motion-blur", 1}};

    for (const auto& c : cases) {
        const std::string rows = fmt::format(R"(
    int[] protoIndices = [0, 0]
    point3f[] positions.timeSamples = {{ 1: [(0, 0, -9), (0, 0, -8)] }}
    vector3f[] velocities.timeSamples = {{ 1: [({0}, 0, 0), (1, 0, 0)] }}
    vector3f[] accelerations.timeSamples = {{ 1: [({0}, 0, 0), (0, 0, 0)] }}
)",
                                             c.number);
        Translated t;
        translate_at(1, stage_text(64, instancer(rows)), t);
        EXPECT_EQ(t.count(c.code), c.warnings) << c.number;
        ASSERT_EQ(t.scene.instances.size(), 2u) << c.number;
        EXPECT_TRUE(t.scene.instances[0].later_render_from_prototype.empty()) << c.number;
        EXPECT_EQ(position(key(t.scene.instances[1], 1)), Vec3(2, 0, -8)) << c.number;
    }
}

}  // namespace velatura::translate::instancing
