// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace velatura::test {

/// A folder of this test that goes with it.
class VdbFolder {
  public:
    VdbFolder() {
        openvdb::initialize();
        std::string pattern =
            (std::filesystem::temp_directory_path() / "velatura_vdb_XXXXXX").string();
        path_ = mkdtemp(pattern.data());
    }

    ~VdbFolder() { std::filesystem::remove_all(path_); }

    VdbFolder(const VdbFolder&) = delete;
    VdbFolder& operator=(const VdbFolder&) = delete;

    std::string file(const std::string& name) const { return (path_ / name).string(); }

    std::string write(const std::string& name, const openvdb::GridCPtrVec& grids) const {
        openvdb::io::File(file(name)).write(grids);
        return file(name);
    }

    std::string write_bytes(const std::string& name, const std::string& bytes) const {
        std::ofstream(file(name), std::ios::binary) << bytes;
        return file(name);
    }

    static std::string bytes_of(const std::string& path) {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }

  private:
    std::filesystem::path path_;
};

/// Blobs of density around a few places, of voxels of this edge.
inline openvdb::FloatGrid::Ptr blobs(const std::string& name, double voxel = 0.25) {
    const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0.0f);
    grid->setName(name);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    auto accessor = grid->getAccessor();
    for (const openvdb::Coord& center :
         {openvdb::Coord(0, 0, 0), openvdb::Coord(-140, 3, 9), openvdb::Coord(40, -77, 130)})
        for (int z = -6; z <= 6; ++z)
            for (int y = -6; y <= 6; ++y)
                for (int x = -6; x <= 6; ++x) {
                    const int r2 = x * x + y * y + z * z;
                    if (r2 <= 36)
                        accessor.setValue(center.offsetBy(x, y, z),
                                          float(1 + (x + 2 * y + 3 * z + 40) % 7));
                }
    return grid;
}

/// A ball as a level set: distances to its surface up to three voxels away, as OpenVDB's
/// createLevelSetSphere writes them, whose templates take half a minute to compile.
inline openvdb::FloatGrid::Ptr level_set_ball(const std::string& name,
                                              double radius,
                                              const openvdb::Vec3d& center,
                                              double voxel) {
    const double band = 3.0 * voxel;
    const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(float(band));
    grid->setName(name);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    auto accessor = grid->getAccessor();
    const auto first = openvdb::Coord::floor((center - openvdb::Vec3d(radius + band)) / voxel);
    const auto last = openvdb::Coord::ceil((center + openvdb::Vec3d(radius + band)) / voxel);
    for (int z = first.z(); z <= last.z(); ++z)
        for (int y = first.y(); y <= last.y(); ++y)
            for (int x = first.x(); x <= last.x(); ++x) {
                const double distance =
                    (openvdb::Vec3d(x, y, z) * voxel - center).length() - radius;
                if (std::abs(distance) < band)
                    accessor.setValue({x, y, z}, float(distance));
                else if (distance < 0)
                    accessor.setValueOff({x, y, z}, float(-band));
            }
    return grid;
}

}  // namespace velatura::test
