// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/textures.h"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>

namespace velatura::compositor::window {

namespace {

ImTextureID id_of(unsigned texture) {
    return reinterpret_cast<ImTextureID>(static_cast<uintptr_t>(texture));
}

size_t tile_at(const TileGrid& grid, int x, int y) {
    const int column = std::min(x / TileGrid::tile_size, grid.columns() - 1);
    const int row = std::min(y / TileGrid::tile_size, grid.rows() - 1);
    return size_t(row) * size_t(grid.columns()) + size_t(column);
}

}  // namespace

Textures::~Textures() {
    clear(now_);
    clear(before_);
}

void Textures::clear(Tiles& tiles) {
    for (auto& of_look : tiles.by_look) {
        for (auto& of_level : of_look) {
            for (Tile& tile : of_level) {
                if (tile.texture) glDeleteTextures(1, &tile.texture);
            }
        }
    }
    tiles = {};
}

Textures::Tiles Textures::empty_tiles(std::shared_ptr<const Levels> levels) {
    Tiles tiles;
    tiles.levels = std::move(levels);
    for (size_t k = 0; tiles.levels && k < tiles.levels->count(); ++k)
        tiles.grids.push_back({tiles.levels->frame(k)});
    for (auto& of_look : tiles.by_look) {
        for (const TileGrid& grid : tiles.grids) of_look.emplace_back(grid.count());
    }
    return tiles;
}

void Textures::show(std::shared_ptr<const Levels> levels) {
    if (levels == now_.levels) return;
    clear(now_);
    clear(before_);
    now_ = empty_tiles(std::move(levels));
}

void Textures::renew(std::shared_ptr<const Levels> levels, bool is_same_image) {
    if (!is_same_image) return show(std::move(levels));
    bool has_same_tiles = now_.levels && levels->count() == now_.levels->count();
    for (size_t k = 0; has_same_tiles && k < levels->count(); ++k)
        has_same_tiles = levels->frame(k) == now_.levels->frame(k);
    if (has_same_tiles) {
        now_.levels = std::move(levels);
        return;
    }
    // Of a draft that no tile was made of, what is below it is shown still
    const auto has_tile = [](const std::vector<std::vector<Tile>>& of_look) {
        return std::any_of(of_look.begin(), of_look.end(), [](const std::vector<Tile>& tiles) {
            return std::any_of(tiles.begin(), tiles.end(),
                               [](const Tile& t) { return t.texture != 0; });
        });
    };
    if (has_tile(now_.by_look[0]) || has_tile(now_.by_look[1])) {
        clear(before_);
        before_ = std::move(now_);
    } else {
        clear(now_);
    }
    now_ = empty_tiles(std::move(levels));
}

void Textures::take(const FinishedTile& finished) {
    if (finished.levels != now_.levels) return;
    const TileGrid& grid = now_.grids[finished.level];
    const image::Window& w = finished.window;
    Tile& tile = now_.by_look[finished.look][finished.level][tile_at(grid, w.x0, w.y0)];
    if (tile.texture == 0) {
        glGenTextures(1, &tile.texture);
        glBindTexture(GL_TEXTURE_2D, tile.texture);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
        // Pixels of the image stay squares; stand-ins for them are smooth
        const bool is_image = finished.level == 0 && now_.levels->reduction() == 1;
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, is_image ? GL_NEAREST : GL_LINEAR);
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, w.width(), w.height(), 0, GL_RGBA,
                     GL_UNSIGNED_BYTE, finished.rgba.data());
    } else {
        glBindTexture(GL_TEXTURE_2D, tile.texture);
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, w.width(), w.height(), GL_RGBA, GL_UNSIGNED_BYTE,
                        finished.rgba.data());
    }
    tile.look_version = finished.look_version;
}

/// The tile itself or the one of a coarser level around it, whichever shows the newer look.
const Textures::Tile* Textures::newest_over(
    const Tiles& tiles, size_t look, size_t level, size_t tile, size_t& found_level) {
    const std::vector<TileGrid>& grids = tiles.grids;
    const image::Window w = grids[level].window(tile);
    const Tile* newest = nullptr;
    for (size_t k = level; k < grids.size(); ++k) {
        const auto shift = int(k - level);
        const Tile& candidate =
            tiles.by_look[look][k][tile_at(grids[k], w.x0 >> shift, w.y0 >> shift)];
        if (candidate.look_version > (newest ? newest->look_version : 0)) {
            newest = &candidate;
            found_level = k;
        }
    }
    return newest;
}

/// A part of level `level` by a tile of it.
void Textures::draw_part(ImDrawList& list,
                         const Tiles& tiles,
                         const Tile& tile,
                         size_t level,
                         const image::Window& tile_window,
                         const image::Window& part,
                         const ImVec2& origin,
                         double scale) {
    const image::Window& full = tiles.grids[0].frame;
    const double size = std::ldexp(scale, int(level));
    // The last pixel of a coarse level may reach over the edge of the image
    const auto x_of = [&](int x) {
        return float(double(origin.x) + std::min(x * size, full.width() * scale));
    };
    const auto y_of = [&](int y) {
        return float(double(origin.y) + std::min(y * size, full.height() * scale));
    };
    const auto share = [](double at, int from, int length) { return float((at - from) / length); };
    const double x1 = std::min(double(part.x1), full.width() / std::ldexp(1.0, int(level)));
    const double y1 = std::min(double(part.y1), full.height() / std::ldexp(1.0, int(level)));
    list.AddImage(id_of(tile.texture), {x_of(part.x0), y_of(part.y0)},
                  {x_of(part.x1), y_of(part.y1)},
                  {share(part.x0, tile_window.x0, tile_window.width()),
                   share(part.y0, tile_window.y0, tile_window.height())},
                  {share(x1, tile_window.x0, tile_window.width()),
                   share(y1, tile_window.y0, tile_window.height())});
}

/// scale: per pixel of the tiles' level 0.
void Textures::draw_tiles(ImDrawList& list,
                          const Tiles& tiles,
                          size_t look,
                          size_t level,
                          const ImVec2& origin,
                          double scale) {
    const std::vector<TileGrid>& grids = tiles.grids;
    for (size_t t = 0; t < grids[level].count(); ++t) {
        size_t found_level = level;
        const Tile* tile = newest_over(tiles, look, level, t, found_level);
        if (!tile) continue;
        const auto shift = int(found_level - level);
        const image::Window w = grids[level].window(t);
        const int round_up = (1 << shift) - 1;
        const image::Window part = {w.x0 >> shift, w.y0 >> shift, (w.x1 + round_up) >> shift,
                                    (w.y1 + round_up) >> shift};
        const TileGrid& grid = grids[found_level];
        draw_part(list, tiles, *tile, found_level, grid.window(tile_at(grid, part.x0, part.y0)),
                  part, origin, scale);
    }
}

void Textures::draw(
    ImDrawList& list, size_t look, size_t level, const ImVec2& origin, double scale) {
    if (before_.levels)
        draw_tiles(list, before_, look, before_.levels->level_for(scale), origin,
                   scale * before_.levels->reduction());
    if (now_.levels) draw_tiles(list, now_, look, level, origin, scale * now_.levels->reduction());
}

}  // namespace velatura::compositor::window
