// SPDX-License-Identifier: Apache-2.0
#include "accumulate/matte_sums.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace velatura::accumulate {

namespace {}  // namespace

int64_t matte_weight(double weight) {
    return std::llround(weight / MatteWeight::unit);
}

void join_matte_weights(std::vector<MatteWeight>& list) {
    std::sort(list.begin(), list.end(), [](const MatteWeight& a, const MatteWeight& b) {
        return std::tie(a.kind, a.id) < std::tie(b.kind, b.id);
    });
    size_t used = 0;
    for (size_t i = 0; i < list.size();) {
        MatteWeight sum = list[i];
        for (++i; i < list.size() && list[i].kind == sum.kind && list[i].id == sum.id; ++i)
            sum.weight += list[i].weight;
        if (sum.weight != 0) list[used++] = sum;
    }
    list.resize(used);
}

MatteSums::MatteSums(const image::Window& window) : grid_(window), tiles_(grid_.count()) {}

void MatteSums::add(int x, int y, std::span<const MatteWeight> list) {
    if (list.empty()) return;
    const auto pixel = uint16_t(grid_.pixel_of(x, y));
    std::vector<Entry>& tile = tiles_[grid_.tile_of(x, y)];
    const auto comes_before = [](const Entry& e, uint16_t p) { return e.pixel < p; };
    const auto begin = std::lower_bound(tile.begin(), tile.end(), pixel, comes_before);
    const auto end =
        std::find_if(begin, tile.end(), [=](const Entry& e) { return e.pixel != pixel; });

    std::vector<MatteWeight> joined(list.begin(), list.end());
    for (auto e = begin; e != end; ++e) joined.push_back({e->kind, e->id, e->weight});
    join_matte_weights(joined);

    // Replace the pixel's entries by the joined ones, and move what follows once
    const auto old_count = size_t(end - begin);
    const size_t first = size_t(begin - tile.begin());
    if (joined.size() > old_count)
        tile.insert(end, joined.size() - old_count, Entry{});
    else
        tile.erase(end - std::ptrdiff_t(old_count - joined.size()), end);
    for (size_t i = 0; i < joined.size(); ++i)
        tile[first + i] = {joined[i].weight, joined[i].id, pixel, joined[i].kind};
}

void MatteSums::add(const MatteSums& other) {
    for (int y = grid_.window.y0; y < grid_.window.y1; ++y) {
        for (int x = grid_.window.x0; x < grid_.window.x1; ++x) add(x, y, other.at(x, y));
    }
}

std::vector<MatteWeight> MatteSums::at(int x, int y) const {
    const auto pixel = uint16_t(grid_.pixel_of(x, y));
    const std::vector<Entry>& tile = tiles_[grid_.tile_of(x, y)];
    std::vector<MatteWeight> list;
    auto e = std::lower_bound(tile.begin(), tile.end(), pixel,
                              [](const Entry& a, uint16_t p) { return a.pixel < p; });
    for (; e != tile.end() && e->pixel == pixel; ++e) list.push_back({e->kind, e->id, e->weight});
    return list;
}

std::vector<uint32_t> MatteSums::used_ids(uint8_t kind) const {
    std::vector<uint32_t> ids;
    for (const auto& tile : tiles_) {
        std::vector<uint32_t> here;
        for (const Entry& e : tile) {
            if (e.kind == kind) here.push_back(e.id);
        }
        std::sort(here.begin(), here.end());
        here.erase(std::unique(here.begin(), here.end()), here.end());
        ids.insert(ids.end(), here.begin(), here.end());
    }
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    return ids;
}

size_t MatteSums::memory_bytes() const {
    size_t bytes = tiles_.size() * sizeof(tiles_[0]);
    for (const auto& tile : tiles_) bytes += tile.capacity() * sizeof(Entry);
    return bytes;
}

}  // namespace velatura::accumulate
