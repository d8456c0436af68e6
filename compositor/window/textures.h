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
    /// The same, but the tiles of the file before stay until those of the new one take their
    /// places; of an image of another size they cannot.
    void renew(std::shared_ptr<const Levels> levels);
    void take(const FinishedTile& tile);

    /// Draws a look with the image's top left corner at `origin`, `scale` pixels of the screen
    /// per pixel of the image: for each tile of the level the one of the newest look there is, in
    /// the level itself or in a coarser one.
    void draw(ImDrawList& list, size_t look, size_t level, const ImVec2& origin, double scale);

  private:
    struct Tile {
        unsigned texture = 0;
        uint64_t look_version = 0;
    };

    const Tile* newest_over(size_t look, size_t level, size_t tile, size_t& found_level) const;
    void draw_part(ImDrawList& list,
                   const Tile& tile,
                   size_t level,
                   const image::Window& tile_window,
                   const image::Window& part,
                   const ImVec2& origin,
                   double scale) const;
    void clear();

    std::shared_ptr<const Levels> levels_;
    std::vector<TileGrid> grids_;
    std::array<std::vector<std::vector<Tile>>, 2> tiles_;  ///< [look][level][tile]
};

}  // namespace velatura::compositor::window
