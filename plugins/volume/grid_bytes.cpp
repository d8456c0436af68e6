// SPDX-License-Identifier: Apache-2.0
#include "plugins/volume/grid_bytes.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace velatura::plugins::volume {

namespace {

using scene::VoxelGrid;

constexpr char is_grid = 'g', is_error = 'e';

struct Head {
    std::array<double, 16> volume_from_lattice;
    std::array<int, 3> node_count;
    std::array<float, 3> box_min, box_max;
    int channels;
    int is_level_set;
};

Head head_of(const VoxelGrid& grid) {
    Head head = {};
    std::copy_n(&grid.volume_from_lattice[0][0], 16, head.volume_from_lattice.begin());
    for (int a = 0; a < 3; ++a) {
        head.node_count[size_t(a)] = grid.node_count[a];
        head.box_min[size_t(a)] = grid.box_min[a];
        head.box_max[size_t(a)] = grid.box_max[a];
    }
    head.channels = grid.channels;
    head.is_level_set = int(grid.is_level_set);
    return head;
}

void apply(const Head& head, VoxelGrid& grid) {
    std::copy_n(head.volume_from_lattice.begin(), 16, &grid.volume_from_lattice[0][0]);
    for (int a = 0; a < 3; ++a) {
        grid.node_count[a] = head.node_count[size_t(a)];
        grid.box_min[a] = head.box_min[size_t(a)];
        grid.box_max[a] = head.box_max[size_t(a)];
    }
    grid.channels = head.channels;
    grid.is_level_set = head.is_level_set != 0;
}

class Writer {
  public:
    template <class T>
    void put(const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    }

    template <class T>
    void put_all(const std::vector<T>& values) {
        static_assert(std::is_trivially_copyable_v<T>);
        put(values.size());
        bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    }

    std::string bytes;
};

class Reader {
  public:
    explicit Reader(std::span<const char> bytes) : rest_(bytes) {}

    template <class T>
    bool get(T& value) {
        if (rest_.size() < sizeof value) return false;
        std::memcpy(&value, rest_.data(), sizeof value);
        rest_ = rest_.subspan(sizeof value);
        return true;
    }

    template <class T>
    bool get_all(std::vector<T>& values) {
        size_t count = 0;
        if (!get(count) || count > rest_.size() / sizeof(T)) return false;
        values.resize(count);
        if (count > 0) std::memcpy(values.data(), rest_.data(), count * sizeof(T));
        rest_ = rest_.subspan(count * sizeof(T));
        return true;
    }

    bool is_at_end() const { return rest_.empty(); }

  private:
    std::span<const char> rest_;
};

/// Whether no lookup can leave the grid.
bool is_whole(const VoxelGrid& grid) {
    const scene::Vec3i& n = grid.node_count;
    constexpr int max = 1 << 20;
    if (grid.bricks.empty() || (grid.channels != 1 && grid.channels != 3)) return false;
    if (n.x < 1 || n.y < 1 || n.z < 1 || n.x > max || n.y > max || n.z > max) return false;
    if (double(n.x) * double(n.y) * double(n.z) != double(grid.nodes.size())) return false;
    const auto is_brick = [&](uint32_t id) { return id < grid.bricks.size(); };
    const auto is_node = [&](uint32_t id) {
        return (id & VoxelGrid::is_node) != 0
                   ? (id & ~VoxelGrid::is_node) < grid.node_entries.size()
                   : is_brick(id);
    };
    const size_t values = VoxelGrid::brick_values(grid.channels);
    const auto is_filled = [&](const VoxelGrid::Brick& b) {
        return b.is_constant() ||
               (grid.values.size() >= values && b.first_value <= grid.values.size() - values);
    };
    return is_finite(grid.volume_from_lattice) &&
           std::all_of(grid.nodes.begin(), grid.nodes.end(), is_node) &&
           std::all_of(
               grid.node_entries.begin(), grid.node_entries.end(),
               [&](const auto& node) { return std::all_of(node.begin(), node.end(), is_brick); }) &&
           std::all_of(grid.bricks.begin(), grid.bricks.end(), is_filled);
}

}  // namespace

std::string to_bytes(const Result<VoxelGrid>& grid) {
    Writer writer;
    if (!grid) return is_error + grid.error().code + '\0' + grid.error().message;
    writer.bytes.reserve(grid->bytes() + sizeof(Head) + 64);
    writer.put(is_grid);
    writer.put(head_of(*grid));
    writer.put_all(grid->nodes);
    writer.put_all(grid->node_entries);
    writer.put_all(grid->bricks);
    writer.put_all(grid->values);
    return std::move(writer.bytes);
}

Result<VoxelGrid> from_bytes(const std::string& bytes) {
    const Error damaged{"volume-file", "not a .vdb file that can be read"};
    Reader reader(bytes);
    char kind = 0;
    if (!reader.get(kind)) return damaged;
    if (kind == is_error) {
        const size_t end = bytes.find('\0');
        if (end == std::string::npos) return damaged;
        return Error{bytes.substr(1, end - 1), bytes.substr(end + 1)};
    }
    VoxelGrid grid;
    Head head;
    const bool is_read = kind == is_grid && reader.get(head) && reader.get_all(grid.nodes) &&
                         reader.get_all(grid.node_entries) && reader.get_all(grid.bricks) &&
                         reader.get_all(grid.values) && reader.is_at_end();
    if (!is_read) return damaged;
    apply(head, grid);
    if (!is_whole(grid)) return damaged;
    return grid;
}

}  // namespace velatura::plugins::volume
