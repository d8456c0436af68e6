// SPDX-License-Identifier: Apache-2.0
// Volumes from the outside: who opens OpenVDB, what is drawn, and what files that are wrong cost.
#include "../app/command.h"
#include "../base/stored_zip.h"
#include "../plugin/opened_files.h"
#include "image/exr.h"
#include "vdb_files.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <string>

namespace velatura::test {

namespace {

constexpr const char* quick = " --res 24 18 --spp 8 --guiding off --splitting off --progress none ";

/// A floor, a sun and what is given.
std::string stage(const std::string& volume) {
    return R"usda(#usda 1.0
def Camera "Cam"
{
    double3 xformOp:translate = (0, 1, 9)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DistantLight "Sun"
{
    float inputs:angle = 0
}
def Plane "Floor"
{
    uniform token axis = "Y"
    double width = 8
    double length = 8
    double3 xformOp:translate = (0, -2, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)usda" + volume;
}

std::string volume(const std::string& file, const std::string& field = "density") {
    return fmt::format(
        "def Volume \"Smoke\"\n{{\n    rel field:density = </Smoke/Field>\n    def OpenVDBAsset "
        "\"Field\"\n    {{\n        asset filePath{}\n"
        "        token fieldName = \"{}\"\n    }}\n}}\n",
        file, field);
}

class VolumeRender : public ::testing::Test {
  protected:
    void SetUp() override {
        openvdb::initialize();
        const auto write = [&](const char* name, const openvdb::FloatGrid::Ptr& grid) {
            openvdb::io::File(w.path(name)).write({grid});
        };
        write("smoke.vdb", blobs("density"));
        const auto other = blobs("density");
        other->getAccessor().setValue(openvdb::Coord(4, 4, 12), 50.0f);
        write("other.vdb", other);
        const auto zero = openvdb::FloatGrid::create(0.0f);
        zero->setName("density");
        zero->getAccessor().setValue(openvdb::Coord(1, 1, 1), 0.0f);
        write("zero.vdb", zero);
        const std::string bytes = VdbFolder::bytes_of(w.path("smoke.vdb"));
        w.write("cut.vdb", bytes.substr(0, bytes.size() / 2));
        w.write("none.usda", stage(""));
        w.write("smoke.usda", stage(volume(" = @smoke.vdb@")));
    }

    std::string hash_of(const std::string& scene, const std::string& options = "") const {
        const CommandResult r = w.velatura("render " + scene + quick + options + " -o x.exr");
        EXPECT_EQ(r.exit_code, 0) << r.output;
        return w.hash("x.exr");
    }

    Workplace w;
};

}  // namespace

TEST_F(VolumeRender, OpensOpenVdbForVolumesAlone) {
    const std::string line = std::string("render none.usda -q -o x.exr") + quick;
    expect_nothing_heavy(opened_files(w, "velatura", line), line);
    const std::string opened =
        opened_files(w, "velatura", std::string("render smoke.usda -q -o x.exr") + quick);
    EXPECT_NE(opened.find("velatura_volume.so"), std::string::npos);
    EXPECT_NE(opened.find("libopenvdb"), std::string::npos);
    const std::string omitted = opened_files(
        w, "velatura", std::string("render smoke.usda -q --effects -volumes -o x.exr") + quick);
    EXPECT_EQ(omitted.find("libopenvdb"), std::string::npos);
}

TEST_F(VolumeRender, DrawsThemWhateverTheThreads) {
    const std::string smoke = hash_of("smoke.usda");
    EXPECT_NE(smoke, hash_of("none.usda"));
    EXPECT_EQ(smoke, hash_of("smoke.usda", "--threads 1"));
    EXPECT_EQ(smoke, hash_of("smoke.usda", "--mode tile --threads 3"));
    EXPECT_EQ(smoke, hash_of("smoke.usda", "--effects all"));
    EXPECT_EQ(hash_of("none.usda"), hash_of("smoke.usda", "--effects -volumes"));
}

TEST_F(VolumeRender, HasOneMeanWhateverTheBounds) {
    EXPECT_NE(hash_of("smoke.usda"), hash_of("smoke.usda", "--volume-bounds one"));
    const std::string many =
        "render smoke.usda --res 24 18 --spp 256 --guiding off --splitting off --progress none "
        "--layers none";
    ASSERT_EQ(w.velatura(many + " -o bricks.exr").exit_code, 0);
    ASSERT_EQ(w.velatura(many + " -o one.exr --volume-bounds one").exit_code, 0);
    // Two renders by other seeds differ by as much
    ASSERT_EQ(w.velatura(many + " -o seed.exr --seed 5").exit_code, 0);
    const auto mean_and_error = [&](const char* name) {
        const auto image = image::read_exr(w.path(name)),
                   reference = image::read_exr(w.path("bricks.exr"));
        std::array<double, 3> sums{};
        for (size_t i = 0; i < image->data.pixel_count(); ++i) {
            const double a = double(image->find("G")->value(i)),
                         b = double(reference->find("G")->value(i));
            sums = {sums[0] + a, sums[1] + b, sums[2] + (a - b) * (a - b)};
        }
        return sums;
    };
    const auto one = mean_and_error("one.exr"), seed = mean_and_error("seed.exr");
    EXPECT_LT(one[2], 4 * seed[2]);
    EXPECT_NEAR(one[0] / one[1], 1.0, 4 * std::sqrt(seed[2]) / one[1]);
}

TEST_F(VolumeRender, OfZerosIsTheImageWithout) {
    w.write("zero.usda", stage(volume(" = @zero.vdb@")));
    EXPECT_EQ(hash_of("none.usda"), hash_of("zero.usda"));
    EXPECT_EQ(hash_of("none.usda"), hash_of("zero.usda", "--effects all"));
    const CommandResult plan = w.velatura("plan zero.usda");
    EXPECT_NE(plan.output.find("off  volumes              proven zero: </Smoke>"),
              std::string::npos)
        << plan.output;
    EXPECT_NE(w.velatura("plan smoke.usda")
                  .output.find("on   volumes              </Smoke>: scatters light within"),
              std::string::npos);
}

TEST_F(VolumeRender, DrawsLevelSetsAsSurfaces) {
    const auto ball = level_set_ball("density", 1.2, {0.0, 0.5, 0.0}, 0.1);
    openvdb::io::File(w.path("ball.vdb")).write({ball});
    const std::string bytes = VdbFolder::bytes_of(w.path("ball.vdb"));
    w.write("cut_ball.vdb", bytes.substr(0, bytes.size() / 2));
    w.write("ball.usda", stage(volume(" = @ball.vdb@")));
    const std::string drawn = hash_of("ball.usda");
    EXPECT_NE(drawn, hash_of("none.usda"));
    EXPECT_EQ(drawn, hash_of("ball.usda", "--effects all"));
    EXPECT_EQ(drawn, hash_of("ball.usda", "--threads 1"));
    const std::string plan = w.velatura("plan ball.usda").output;
    EXPECT_NE(plan.find("on   level-sets           </Smoke>"), std::string::npos) << plan;
    w.write("bad.usda", stage(volume(" = @cut_ball.vdb@")));
    const CommandResult r = w.velatura(std::string("render bad.usda -o x.exr") + quick);
    EXPECT_EQ(r.exit_code, 1) << r.output;
    EXPECT_NE(r.output.find("[volume-file]"), std::string::npos) << r.output;
    EXPECT_EQ(w.hash("x.exr"), hash_of("none.usda"));
}

TEST_F(VolumeRender, ReadsFilesOfThePackageOfItsLayer) {
    const std::string scene = stage(volume(" = @maps/smoke.vdb@"));
    w.write("s.usdz",
            testing::stored_zip(
                {{"s.usda", scene}, {"maps/smoke.vdb", VdbFolder::bytes_of(w.path("smoke.vdb"))}}));
    EXPECT_EQ(hash_of("s.usdz"), hash_of("smoke.usda"));
    // --confine admits the package, and so its members
    EXPECT_EQ(hash_of("s.usdz", "--confine"), hash_of("smoke.usda"));
}

TEST_F(VolumeRender, FollowsTheFileOfTheFrame) {
    w.write("animated.usda", stage(volume(".timeSamples = { 1: @smoke.vdb@, 2: @other.vdb@ }")));
    const std::string first = hash_of("animated.usda", "-f 1"),
                      second = hash_of("animated.usda", "-f 2");
    EXPECT_NE(first, second);
    EXPECT_EQ(first, hash_of("smoke.usda"));
}

TEST_F(VolumeRender, LosesAVolumeWithABadFileAndNoMore) {
    const struct {
        std::string volume, message;
    } cases[] = {
        {volume(" = @missing.vdb@"), "[volume-file]"},
        {volume(" = @cut.vdb@"), "[volume-file]"},
        {volume(" = @none.usda@"), "[volume-file]"},
        {volume(" = @smoke.vdb@", "heat"),
         "grid heat not found; the file has density; the volume is skipped [volume-grid]"},
    };

    const std::string none = hash_of("none.usda");
    for (const auto& c : cases) {
        w.write("bad.usda", stage(c.volume));
        const CommandResult r = w.velatura(std::string("render bad.usda -o x.exr") + quick);
        EXPECT_EQ(r.exit_code, 1) << r.output;
        EXPECT_NE(r.output.find("[missing-assets]"), std::string::npos) << r.output;
        EXPECT_EQ(
            w.velatura(std::string("render bad.usda --missing-assets ignore -o x.exr") + quick)
                .exit_code,
            0);
        EXPECT_NE(r.output.find(c.message), std::string::npos) << r.output;
        EXPECT_NE(r.output.find("bad.usda:22:"), std::string::npos) << r.output;
        EXPECT_NE(r.output.find("</Smoke/Field>"), std::string::npos) << r.output;
        EXPECT_EQ(w.hash("x.exr"), none);
        EXPECT_EQ(w.velatura(std::string("render bad.usda --strict -o y.exr") + quick).exit_code,
                  1);
    }
}

TEST_F(VolumeRender, RefusesWhatNeedsTooMuchMemory) {
    const auto large = openvdb::FloatGrid::create(0.0f);
    large->setName("density");
    large->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(255)), 1.0f);
    openvdb::io::File(w.path("large.vdb")).write({large});
    w.write("large.usda", stage(volume(" = @large.vdb@")));
    const CommandResult r =
        w.velatura(std::string("render large.usda --volume-memory 0.05 -o x.exr") + quick);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_NE(r.output.find("the grid needs 0."), std::string::npos) << r.output;
    EXPECT_NE(r.output.find("[volume-memory]"), std::string::npos) << r.output;
}

TEST_F(VolumeRender, IsAnErrorWithoutThePlugin) {
    const std::string copy = w.path("lone/bin");
    const CommandResult r = w.velatura("--version >/dev/null && mkdir -p '" + copy + "' && cp '" +
                                       VELATURA_BIN_DIR + "/velatura' '" + copy + "' && '" + copy +
                                       "/velatura' render smoke.usda -o x.exr" + quick);
    EXPECT_EQ(r.exit_code, 1) << r.output;
    EXPECT_NE(r.output.find("plugin volume is missing: no plugin provides volume_source"),
              std::string::npos)
        << r.output;
    EXPECT_NE(r.output.find("</Smoke>"), std::string::npos) << r.output;
    EXPECT_EQ(w.hash("x.exr"), hash_of("none.usda"));
}

}  // namespace velatura::test
