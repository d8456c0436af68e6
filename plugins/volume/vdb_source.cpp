// SPDX-License-Identifier: Apache-2.0
#include "plugins/volume/vdb_source.h"

#include "base/asset_bytes.h"
#include "base/isolated.h"
#include "base/package_path.h"
#include "base/process/process_limits.h"
#include "plugins/volume/grid_bytes.h"
#include "plugins/volume/grid_conversion.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <string_view>
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

/// The file of a request: one of its own, or a member of a package.
struct VdbFile {
    AssetBytesPtr member;  ///< null: a file of its own
    uintmax_t size = 0;    ///< bytes
};

Result<VdbFile> find_file(const media::GridRequest& request) {
    if (is_package_path(request.file)) {
        Result<AssetBytesPtr> bytes = open_asset_bytes(request.file);
        if (!bytes) return Error{"volume-file", bytes.error().message};
        const size_t size = (*bytes)->bytes().size();
        if (size > request.max_bytes)
            return Error{"volume-memory",
                         fmt::format("the file has {} MB, and memory for volumes has {}",
                                     size >> 20, request.max_bytes >> 20)};
        return VdbFile{*std::move(bytes), size};
    }
    std::error_code error;
    if (!std::filesystem::is_regular_file(request.file, error))
        return Error{"volume-file", request.file.empty() ? "file not found" : "cannot be opened"};
    const uintmax_t size = std::filesystem::file_size(request.file, error);
    return VdbFile{nullptr, error ? 0 : size};
}

/// Copies a member to a file in memory, for OpenVDB opens files alone. Returns its name, which is
/// valid until this process ends.
Result<std::string> copy_to_memory(std::string_view bytes) {
    const Error error = {"volume-memory", "out of memory while copying the file of the package"};
    const int file = memfd_create("member.vdb", MFD_CLOEXEC);
    if (file < 0) return error;
    while (!bytes.empty()) {
        const ssize_t written = write(file, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) return error;
        bytes.remove_prefix(size_t(written));
    }
    return fmt::format("/proc/self/fd/{}", file);
}

/// Seconds of CPU time for a tree: a hundred megabytes of a file take less than ten. Where counts
/// are wrong OpenVDB reads on behind its end, billions of times.
size_t tree_seconds(const VdbFile& file) {
    return 3 + size_t(file.size >> 20);
}

/// For voxels, which are brought in when they are asked for: those of a hundred megabytes of tiles
/// take less than a second.
constexpr size_t voxel_seconds = 120;

/// What the tree takes too long for is over by now.
void allow_voxels(const VdbFile& from) {
    rlimit limit = {};
    if (getrlimit(RLIMIT_CPU, &limit) != 0) return;
    limit.rlim_cur = std::min<rlim_t>(2 * tree_seconds(from) + voxel_seconds, limit.rlim_max);
    setrlimit(RLIMIT_CPU, &limit);
}

Result<scene::VoxelGrid> read_grid(const media::GridRequest& request, const VdbFile& from) {
    const Result<std::string> path =
        from.member ? copy_to_memory(from.member->bytes()) : request.file;
    if (!path) return path.error();
    openvdb::initialize();
    openvdb::io::File file(*path);
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
    allow_voxels(from);
    return convert(*grid, {.is_color = request.is_color,
                           .is_level_set = is_level_set,
                           .max_bytes = request.max_bytes});
}

Result<scene::VoxelGrid> read_or_say(const media::GridRequest& request, const VdbFile& from) {
    try {
        return read_grid(request, from);
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

IsolationLimits limits_for(const media::GridRequest& request, const VdbFile& from) {
    constexpr size_t max = size_t(1) << 46;
    const size_t grid = std::min(request.max_bytes, max);
    const size_t seconds = tree_seconds(from);
    return {.cpu_seconds = seconds,
            .wall_seconds = 10 * (2 * seconds + voxel_seconds),
            .address_bytes = address_bytes() + 3 * grid + spare_bytes};
}

}  // namespace

Result<scene::VoxelGrid> VdbSource::read(const media::GridRequest& request) const {
    const Result<VdbFile> from = find_file(request);
    if (!from) return from.error();
    // OpenVDB trusts what it reads: one wrong byte may cost all memory, or the process
    const Result<std::string> bytes = run_isolated(limits_for(request, *from), [&] {
        const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
        for (const int printed : {STDOUT_FILENO, STDERR_FILENO})
            if (nowhere >= 0) dup2(nowhere, printed);
        return to_bytes(read_or_say(request, *from));
    });
    if (!bytes)
        return Error{"volume-file",
                     fmt::format("not a .vdb file that can be read: {}", bytes.error().message)};
    return from_bytes(*bytes);
}

}  // namespace velatura::plugins::volume
