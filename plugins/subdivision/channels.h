// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/triangle_mesh.h"
#include "plugins/subdivision/cage.h"
#include "scene/mesh.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::plugins::subdivision {

/// Numbers of a mesh that are refined together, by one rule: rows of doubles.
struct Channel {
    /// Where some of the columns go.
    struct Part {
        size_t primvar = 0;  ///< of the mesh, and of what is made
        size_t first = 0;    ///< column
        size_t width = 0;
    };

    size_t width = 0;
    std::vector<double> rows;  ///< [vertex or value][width]
    std::vector<Part> parts;
};

/// All that is refined of a mesh.
struct Channels {
    size_t keys = 1;                    ///< points as the shutter opens, and at later keys
    Channel vertex;                     ///< columns 3 k …: points at key k; then primvars
    Channel varying;                    ///< empty: no such primvar
    std::vector<Channel> face_varying;  ///< as Cage::face_varying

    /// Primvars as they come out, without values where there is one for each of `points` vertices.
    std::vector<scene::Primvar> primvars(const scene::Mesh& mesh, size_t points) const;
};

Channels make_channels(const scene::Mesh& mesh, const Cage& cage, bool stays);

}  // namespace velatura::plugins::subdivision
