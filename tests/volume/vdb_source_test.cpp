// SPDX-License-Identifier: Apache-2.0
// Grids of .vdb files as the plugin reads them, against OpenVDB's own lookups, and files that are
// wrong.
#include "../base/stored_zip.h"
#include "../base/test_assets.h"
#include "../sampling/chi_square.h"
#include "geometry/level_set.h"
#include "geometry/mapped_set.h"
#include "media/volume_source.h"
#include "media/voxel_lookup.h"
#include "plugin/registry.h"
#include "vdb_files.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

namespace velatura::test {
namespace {

using media::GridRequest;
using media::VolumeSource;
using sampling::testing::TestRandom;
using scene::VoxelGrid;

const VolumeSource& source() {
    static const VolumeSource* const found = [] {
        Diagnostics diagnostics;
        const plugin::Registry registry({{VELATURA_BUILT_PLUGINS, true}}, diagnostics);
        const plugin::Manifest* manifest =
            registry.find(media::volume_source_interface, {"effect", "volumes"});
        VELATURA_CHECK(manifest != nullptr, "the plugin was built");
        return static_cast<const VolumeSource*>(
            plugin::open_interface(*manifest, media::volume_source_interface,
                                   media::volume_source_interface_version, diagnostics));
    }();
    VELATURA_CHECK(found != nullptr, "the plugin opens");
    return *found;
}

/// Looks the grid up at random places of its box and around it, by both.
void expect_same_numbers(const VoxelGrid& grid, const openvdb::FloatGrid& truth, double reach) {
    const openvdb::tools::GridSampler<openvdb::FloatGrid, openvdb::tools::BoxSampler> sampler(
        truth);
    const Mat4d lattice_from_volume = grid.volume_from_lattice.inverse();
    TestRandom random(5);
    int inside = 0;
    for (int i = 0; i < 200000; ++i) {
        Vec3d p;
        for (int a = 0; a < 3; ++a) p[a] = (2.0 * double(random.uniform()) - 1.0) * reach;
        const float expected = sampler.wsSample(openvdb::Vec3d(p.x, p.y, p.z));
        inside += expected > 0.0f;
        ASSERT_NEAR(media::number_at(grid, to_float(transform_point(p, lattice_from_volume))),
                    std::max(expected, 0.0f), 2e-3f)
            << p.x << " " << p.y << " " << p.z;
    }
    EXPECT_GT(inside, 20);
}

std::string error_of(const GridRequest& request) {
    const Result<VoxelGrid> grid = source().read(request);
    return grid ? "" : grid.error().code + ": " + grid.error().message;
}

}  // namespace

TEST(VdbSource, GivesTheNumbersOfTheFile) {
    const VdbFolder folder;
    const auto grid = blobs("density");
    openvdb::math::Transform::Ptr transform = grid->transform().copy();
    transform->postRotate(0.4, openvdb::math::Y_AXIS);
    transform->postTranslate(openvdb::Vec3d(3.0, -2.0, 1.0));
    grid->setTransform(transform);
    const std::string file = folder.write("a.vdb", {grid, blobs("other", 1.0)});
    const Result<VoxelGrid> read = source().read({.file = file, .grid = "density"});
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->max(), 7.0f);
    expect_same_numbers(*read, *grid, 40.0);
    // Mostly empty space: of 20 x 13 x 18 bricks around the blobs a handful
    EXPECT_LT(read->bricks.size(), 150u);
}

TEST(VdbSource, TakesTilesAndHalves) {
    const VdbFolder folder;
    const auto grid = blobs("density", 0.5);
    grid->fill(openvdb::CoordBBox(openvdb::Coord(16, 16, 16), openvdb::Coord(47, 39, 31)), 3.0f);
    grid->pruneGrid();
    grid->setSaveFloatAsHalf(true);
    const Result<VoxelGrid> read = source().read({.file = folder.write("tiles.vdb", {grid})});
    ASSERT_TRUE(read) << read.error().message;
    expect_same_numbers(*read, *grid, 60.0);
}

TEST(VdbSource, FindsGridsByNameAndIndex) {
    const VdbFolder folder;
    const auto first = blobs("density"), second = blobs("density");
    second->getAccessor().setValue(openvdb::Coord(1, 1, 1), 100.0f);
    const std::string file = folder.write("two.vdb", {first, second});
    EXPECT_EQ(source().read({.file = file, .grid = "density"})->max(), 7.0f);
    EXPECT_EQ(source().read({.file = file, .grid = "density", .index = 1})->max(), 100.0f);
    EXPECT_EQ(error_of({.file = file, .grid = "density", .index = 2}),
              "volume-grid: grid density[2] not found; the file has density[0], density[1]");
    EXPECT_EQ(error_of({.file = file, .grid = "heat"}),
              "volume-grid: grid heat not found; the file has density[0], density[1]");
    EXPECT_EQ(error_of({.file = file}),
              "volume-grid: fieldName is empty; choose one of the grids density[0], density[1]");
}

TEST(VdbSource, ReadsMembersOfPackages) {
    const VdbFolder folder;
    const auto grid = blobs("density");
    const std::string bytes = VdbFolder::bytes_of(folder.write("a.vdb", {grid}));
    const std::string package =
        folder.write_bytes("p.usdz", testing::stored_zip({{"smoke/a.vdb", bytes},
                                                          {"cut.vdb", bytes.substr(0, 900)},
                                                          {"text.vdb", "no volume"}}));
    const auto member = [&](const char* name) { return package + "[" + name + "]"; };
    const Result<VoxelGrid> read =
        source().read({.file = member("smoke/a.vdb"), .grid = "density"});
    ASSERT_TRUE(read) << read.error().message;
    expect_same_numbers(*read, *grid, 40.0);
    EXPECT_EQ(error_of({.file = member("smoke/a.vdb"), .grid = "heat"}),
              "volume-grid: grid heat not found; the file has density");
    EXPECT_NE(error_of({.file = member("none.vdb")}).find("volume-file: "), std::string::npos);
    EXPECT_NE(error_of({.file = member("cut.vdb")}).find("volume-file: "), std::string::npos);
    EXPECT_NE(error_of({.file = member("text.vdb")}).find("volume-file: "), std::string::npos);
    EXPECT_EQ(error_of({.file = member("smoke/a.vdb"), .max_bytes = bytes.size() - 1})
                  .find("volume-memory: "),
              0u);
}

TEST(VdbSource, ReadsColors) {
    const VdbFolder folder;
    const auto grid = openvdb::Vec3SGrid::create();
    grid->setName("Cd");
    grid->getAccessor().setValue(openvdb::Coord(2, 3, 4), openvdb::Vec3s(0.25f, 0.5f, 1.0f));
    const std::string file = folder.write("color.vdb", {grid});
    const Result<VoxelGrid> read = source().read({.file = file, .grid = "Cd", .is_color = true});
    ASSERT_TRUE(read) << read.error().message;
    const Vec3 p = to_float(transform_point(Vec3d(2, 3, 4), read->volume_from_lattice.inverse()));
    EXPECT_EQ(media::color_at(*read, p), Rgb(0.25f, 0.5f, 1.0f));
    EXPECT_EQ(media::color_at(*read, p + Vec3(0.5f, 0, 0)), Rgb(0.125f, 0.25f, 0.5f));
    EXPECT_EQ(error_of({.file = file, .grid = "Cd"}),
              "volume-grid: grid Cd is of type vec3s, expected numbers");
}

TEST(VdbSource, KeepsWhatIsInsideOfALevelSet) {
    const VdbFolder folder;
    const auto ball = level_set_ball("surface", 2.0, {1.0, -2.0, 0.5}, 0.125);
    const std::string file = folder.write("ball.vdb", {ball, blobs("density")});
    using scene::GridKind;
    for (const GridKind kind : {GridKind::AsStored, GridKind::LevelSet}) {
        const Result<VoxelGrid> read =
            source().read({.file = file, .grid = "surface", .kind = kind});
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_TRUE(read->is_level_set);
        const auto set = geometry::MappedSet::make(
            geometry::LevelSet::make(std::make_shared<const VoxelGrid>(*read)),
            read->volume_from_lattice);
        ASSERT_TRUE(set);
        // Along rays through the middle
        TestRandom random(3);
        const Vec3d middle(1.0, -2.0, 0.5);
        for (int i = 0; i < 200; ++i) {
            Vec3d d;
            for (int a = 0; a < 3; ++a) d[a] = 2.0 * double(random.uniform()) - 1.0;
            d = normalize(d);
            float first = 1e30f;
            for (uint32_t k = 0; k < set->size(); ++k)
                if (const auto hit = set->intersect(k, middle - d * 5.0, d, first))
                    first = float(hit->t);
            EXPECT_NEAR(first, 3.0f, 0.01f);
        }
    }
    EXPECT_FALSE(
        source().read({.file = file, .grid = "density", .kind = GridKind::AsStored})->is_level_set);
}

TEST(VdbSource, OfNothingIsNothing) {
    const VdbFolder folder;
    const auto grid = openvdb::FloatGrid::create(0.0f);
    grid->setName("density");
    const Result<VoxelGrid> read =
        source().read({.file = folder.write("empty.vdb", {grid}), .grid = "density"});
    ASSERT_TRUE(read);
    EXPECT_EQ(read->max(), 0.0f);
}

TEST(VdbSource, SaysWhatIsWrongWithAFile) {
    const VdbFolder folder;
    EXPECT_EQ(error_of({.file = folder.file("missing.vdb")}), "volume-file: cannot be opened");
    EXPECT_EQ(error_of({.file = ""}), "volume-file: file not found");
    EXPECT_TRUE(
        error_of({.file = folder.write_bytes("text.vdb", "no grid at all"), .grid = "density"})
            .starts_with("volume-file: not a .vdb file"));
    const auto level_set = blobs("surface");
    level_set->setGridClass(openvdb::GRID_LEVEL_SET);
    EXPECT_TRUE(error_of({.file = folder.write("level.vdb", {level_set})})
                    .starts_with("volume-grid: grid surface is a level set"));
    const auto flags = openvdb::BoolGrid::create();
    flags->setName("flags");
    EXPECT_EQ(error_of({.file = folder.write("flags.vdb", {flags})}),
              "volume-grid: grid flags is of type bool, expected numbers");
}

TEST(VdbSource, RefusesWhatWouldTakeTooMuchMemory) {
    const VdbFolder folder;
    const std::string file = folder.write("big.vdb", {blobs("density")});
    EXPECT_EQ(error_of({.file = file, .max_bytes = 1 << 20}), "");
    EXPECT_TRUE(
        error_of({.file = file, .max_bytes = 20000}).starts_with("volume-memory: the grid needs"));
    // Few bytes that stand for a block of 2048³ voxels
    const auto block = openvdb::FloatGrid::create(0.0f);
    block->setName("density");
    block->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(4095)), 1.0f);
    EXPECT_TRUE(error_of({.file = folder.write("block.vdb", {block}), .max_bytes = size_t(1) << 28})
                    .starts_with("volume-memory: the grid needs"));
    // Two voxels so far apart that even the empty space between them would not fit
    const auto apart = openvdb::FloatGrid::create(0.0f);
    apart->setName("density");
    apart->getAccessor().setValue(openvdb::Coord(0), 1.0f);
    apart->getAccessor().setValue(openvdb::Coord(1 << 29), 1.0f);
    EXPECT_TRUE(error_of({.file = folder.write("apart.vdb", {apart}), .max_bytes = size_t(1) << 28})
                    .starts_with("volume-memory: the grid needs"));
}

TEST(VdbSource, SurvivesFilesThatAreCutOff) {
    const VdbFolder folder;
    const std::string whole = VdbFolder::bytes_of(folder.write("whole.vdb", {blobs("density")}));
    for (size_t size = 0; size + 1 < whole.size(); size += std::max<size_t>(whole.size() / 60, 1)) {
        const std::string file = folder.write_bytes("cut.vdb", whole.substr(0, size));
        EXPECT_TRUE(error_of({.file = file, .grid = "density", .max_bytes = size_t(1) << 28})
                        .starts_with("volume-"))
            << size;
    }
}

TEST(VdbSource, SurvivesFilesWithWrongBytes) {
    const VdbFolder folder;
    const std::string whole = VdbFolder::bytes_of(folder.write("whole.vdb", {blobs("density")}));
    TestRandom random(9);
    int refused = 0, count = 0;
    for (; count < 80; ++count) {
        std::string bytes = whole;
        const int flips = 1 + count % 4;
        for (int k = 0; k < flips; ++k)
            bytes[random.bits() % (count % 2 ? bytes.size() : 1200)] = char(random.bits());
        // Whatever comes of it: no crash, and no more memory than is given
        const Result<VoxelGrid> read =
            source().read({.file = folder.write_bytes("wrong.vdb", bytes),
                           .grid = "density",
                           .max_bytes = size_t(1) << 25});
        refused += !read;
    }
    std::printf("%d of %d refused\n", refused, count);
    EXPECT_GT(refused, 20);
}

TEST(VdbSource, DoesNotReadForMinutesBehindTheEndOfAFile) {
    // The tiles of the root, of which there are none, become as many as can be told
    const float background = 12345.5f;
    const auto grid = openvdb::FloatGrid::create(background);
    grid->setName("density");
    grid->getAccessor().setValue(openvdb::Coord(0), 1.0f);
    const VdbFolder folder;
    std::string bytes = VdbFolder::bytes_of(folder.write("few.vdb", {grid}));
    std::string root(12, '\0');
    std::memcpy(root.data(), &background, sizeof background);
    root[8] = 1;
    const size_t at = bytes.find(root);
    ASSERT_NE(at, std::string::npos);
    std::fill_n(bytes.begin() + std::ptrdiff_t(at) + 4, 4, '\xff');
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(error_of({.file = folder.write_bytes("many.vdb", bytes), .grid = "density"}),
              "volume-file: not a .vdb file that can be read: reading took more than 3 s");
    // Of wall time, of which a machine with others on it gives less
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

TEST(VdbSource, ReadsTheSmokeOfOpenUsd) {
    const std::filesystem::path file =
        test_assets() / "openusd/imaging/testUsdImagingGLVdbVolume/smoke_000002.vdb";
    if (!std::filesystem::exists(file)) GTEST_SKIP() << "no " << file;
    const Result<VoxelGrid> read = source().read({.file = file.string(), .grid = "density"});
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_GT(read->max(), 0.0f);
    std::printf("smoke: %zu bricks, %.1f MB\n", read->bricks.size(), double(read->bytes()) / 1e6);
    openvdb::initialize();
    openvdb::io::File vdb(file.string());
    vdb.open();
    expect_same_numbers(*read, *openvdb::gridPtrCast<openvdb::FloatGrid>(vdb.readGrid("density")),
                        12.0);
}

}  // namespace velatura::test
