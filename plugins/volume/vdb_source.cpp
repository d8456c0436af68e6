// SPDX-License-Identifier: Apache-2.0
#include "plugins/volume/vdb_source.h"

#include "base/isolated.h"
#include "base/process/process_limits.h"
#include "plugins/volume/grid_bytes.h"
#include "plugins/volume/grid_conversion.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <vector>

namespace velatura::plugins::volume {

namespace {

using openvdb::io::GridDescriptor;

/// Name within the file, of which it is the only one, of the grid that is wanted.
Result<std::string> unique_name(openvdb::io::File& file, const media::GridRequest& request) {
    std::vector<std::string> found, all;
    for (auto name = file.beginName(); name != file.endName(); ++name) {
        const std::string unique = name.gridName();
        const std::string plain =
            GridDescriptor::stripSuffix(GridDescriptor::stringAsUniqueName(unique));
        all.push_back(unique);
        if (request.grid.empty() || plain == request.grid) found.push_back(unique);
    }
    if (request.grid.empty() && found.size() > 1)
        return Error{"volume-grid", fmt::format("fieldName is empty; choose one of the grids {}",
                                                fmt::join(all, ", "))};
    if (request.index >= 0 && size_t(request.index) < found.size())
        return found[size_t(request.index)];
    const std::string wanted =
        request.index > 0 ? fmt::format("{}[{}]", request.grid, request.index) : request.grid;
    return Error{"volume-grid",
                 fmt::format("grid {} not found; the file has {}", wanted,
                             all.empty() ? "none" : fmt::format("{}", fmt::join(all, ", ")))};
}

/// Seconds of CPU time for a tree: a hundred megabytes of a file take less than ten. Where counts
/// are wrong OpenVDB reads on behind its end, billions of times.
size_t tree_seconds(const media::GridRequest& request) {
    std::error_code error;
    const uintmax_t size = std::filesystem::file_size(request.file, error);
    return 3 + (error ? 0 : size_t(size >> 20));
}

/// For voxels, which are brought in when they are asked for: those of a hundred megabytes of tiles
/// take less than a second.
constexpr size_t voxel_seconds = 120;

/// What the tree takes too long for is over by now.
void allow_voxels(const media::GridRequest& request) {
    rlimit limit = {};
    if (getrlimit(RLIMIT_CPU, &limit) != 0) return;
    limit.rlim_cur = std::min<rlim_t>(2 * tree_seconds(request) + voxel_seconds, limit.rlim_max);
    setrlimit(RLIMIT_CPU, &limit);
}

Result<scene::VoxelGrid> read_grid(const media::GridRequest& request) {
    openvdb::initialize();
    openvdb::io::File file(request.file);
    // No copy of the file elsewhere while voxels are brought in
    file.setCopyMaxBytes(0);
    file.open();
    const Result<std::string> name = unique_name(file, request);
    if (!name) return name.error();

    // Reject by what is known without the voxels
    const openvdb::GridBase::ConstPtr head = file.readGridMetadata(*name);
    const bool is_stored_so = head->getGridClass() == openvdb::GRID_LEVEL_SET;
    if (is_stored_so && request.kind == scene::GridKind::Densities)
        return Error{"volume-grid",
                     fmt::format("grid {} is a level set, expected densities", *name)};
    const bool is_level_set = request.kind == scene::GridKind::LevelSet ||
                              (request.kind == scene::GridKind::AsStored && is_stored_so);
    if (!head->transform().isLinear())
        return Error{"volume-grid",
                     fmt::format("grid {} has a frustum transform, which is not supported", *name)};
    const openvdb::GridBase::ConstPtr grid = file.readGrid(*name);
    allow_voxels(request);
    return convert(*grid, {.is_color = request.is_color,
                           .is_level_set = is_level_set,
                           .max_bytes = request.max_bytes});
}

Result<scene::VoxelGrid> read_or_say(const media::GridRequest& request) {
    try {
        return read_grid(request);
    } catch (const std::bad_alloc&) {
        return Error{"volume-memory", "out of memory while reading the grid"};
    } catch (const std::exception& e) {
        return Error{"volume-file", fmt::format("not a .vdb file that can be read: {}", e.what())};
    } catch (...) {
        return Error{"volume-file", "not a .vdb file that can be read"};
    }
}

/// For reading, above what the grid may take: the library's own tree, and the way back.
constexpr size_t spare_bytes = size_t(256) << 20;

IsolationLimits limits_for(const media::GridRequest& request) {
    constexpr size_t max = size_t(1) << 46;
    const size_t grid = std::min(request.max_bytes, max);
    const size_t seconds = tree_seconds(request);
    return {.cpu_seconds = seconds,
            .wall_seconds = 10 * (2 * seconds + voxel_seconds),
            .address_bytes = address_bytes() + 3 * grid + spare_bytes};
}

}  // namespace

Result<scene::VoxelGrid> VdbSource::read(const media::GridRequest& request) const {
    std::error_code status;
    if (!std::filesystem::is_regular_file(request.file, status))
        return Error{"volume-file", request.file.empty() ? "file not found" : "cannot be opened"};
    // OpenVDB trusts what it reads: one wrong byte may cost all memory, or the process
    const Result<std::string> bytes = run_isolated(limits_for(request), [&] {
        const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
        for (const int printed : {STDOUT_FILENO, STDERR_FILENO})
            if (nowhere >= 0) dup2(nowhere, printed);
        return to_bytes(read_or_say(request));
    });
    if (!bytes)
        return Error{"volume-file",
                     fmt::format("not a .vdb file that can be read: {}", bytes.error().message)};
    return from_bytes(*bytes);
}

}  // namespace velatura::plugins::volume
