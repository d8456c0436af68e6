// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/levels.h"
#include "compositor/window/worker.h"

#include <imgui.h>

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

namespace velatura::compositor::window {

/// What the worker has mixed, in the memory of OpenGL: a texture for each tile of each level of
/// both looks. Uses the current context.
class Textures {
  public:
    Textures() = default;
    ~Textures();
    Textures(const Textures&) = delete;
    Textures& operator=(const Textures&) = delete;

    /// Tiles of another file than the newest are dropped.
    void show(std::shared_ptr<const Levels> levels);
    /// The same, but what the tiles of the file before show stays until those of the new one are
    /// there. is_same_image: of an image of the same size.
    void renew(std::shared_ptr<const Levels> levels, bool is_same_image);
    void take(const FinishedTile& tile);

    /// Draws a look with the image's top left corner at `origin`, `scale` pixels of the screen
    /// per pixel of the image: for each tile of the level the one of the newest look there is, in
    /// the level itself or in a coarser one, else what was there before.
    void draw(ImDrawList& list, size_t look, size_t level, const ImVec2& origin, double scale);

  private:
    struct Tile {
        unsigned texture = 0;
        uint64_t look_version = 0;
    };

    /// The tiles of one file.
    struct Tiles {
        std::shared_ptr<const Levels> levels;
        std::vector<TileGrid> grids;
        std::array<std::vector<std::vector<Tile>>, 2> by_look;  ///< [look][level][tile]
    };

    static Tiles empty_tiles(std::shared_ptr<const Levels> levels);
    static const Tile* newest_over(
        const Tiles& tiles, size_t look, size_t level, size_t tile, size_t& found_level);
    static void draw_part(ImDrawList& list,
                          const Tiles& tiles,
                          const Tile& tile,
                          size_t level,
                          const image::Window& tile_window,
                          const image::Window& part,
                          const ImVec2& origin,
                          double scale);
    static void draw_tiles(ImDrawList& list,
                           const Tiles& tiles,
                           size_t look,
                           size_t level,
                           const ImVec2& origin,
                           double scale);
    static void clear(Tiles& tiles);

    Tiles now_;
    Tiles before_;  ///< below those: of the draft, or the image, that these replace
};

}  // namespace velatura::compositor::window
