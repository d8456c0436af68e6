// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace velatura::study {

/// Pixels that stand for the whole image: one from each cell of a grid laid over it.
struct Grid {
    int width = 0, height = 0;

    size_t pixels() const { return size_t(width) * size_t(height); }

    bool operator==(const Grid&) const = default;
};

/// A part of the image, pixels from its upper left corner.
struct Region {
    int x = 0, y = 0, width = 0, height = 0;
};

/// One render to be made.
struct RenderRequest {
    std::string options;  ///< beside those of the render that is studied, as typed
    uint64_t seed = 0;
    Grid grid;
    std::optional<Region> region = {};  ///< instead of the grid: all pixels of it, of the same size
    std::vector<uint64_t> spp;  ///< ascending; where to take readings. The last one is taken,
                                ///< others where it costs nothing.
    std::chrono::steady_clock::time_point deadline = std::chrono::steady_clock::time_point::max();
};

/// What the image was after some samples.
struct Reading {
    uint64_t spp = 0;
    std::vector<float> means;  ///< scene-linear, [height][width][3]
    double cpu_s = 0;          ///< of all threads, from the first sample on
    uint64_t rays = 0;
};

/// A part of the light of the last reading.
struct LayerReading {
    bool is_bounce = false;  ///< else a light
    std::string name;
    std::vector<float> means;  ///< [height][width][3]
};

struct RenderRun {
    std::vector<Reading> readings;  ///< ascending, at least one
    double setup_s = 0;  ///< CPU seconds before the first sample, whenever they were spent
    double outline_px =
        0;  ///< how far triangles are off the limits of subdivision surfaces; 0: there are none
    std::vector<float> pixel_s;  ///< seconds per pixel, [height][width]
    std::vector<LayerReading> layers;
};

/// Makes a render. Errors: "stopped" when the deadline or a signal came first; any other: these
/// options cannot be had.
using RenderFunction = std::function<Result<RenderRun>(const RenderRequest&)>;

}  // namespace velatura::study
