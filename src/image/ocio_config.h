// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/primaries.h"

#include <OpenColorIO/OpenColorIO.h>

#include <optional>
#include <string>
#include <vector>

namespace velatura::image {

/// Row-major 4×4 matrix of a 3×3 one.
OCIO_NAMESPACE::MatrixTransformRcPtr matrix_transform(const ColorMatrix& m);

struct ActiveConfig {
    OCIO_NAMESPACE::ConstConfigRcPtr config;
    bool is_built_in = false;
};

/// That of $OCIO, read once, else the built-in one. Thread-safe. Errors: "ocio-config".
Result<ActiveConfig> active_config();

/// Names of its color spaces, in its order.
std::vector<std::string> space_names(const OCIO_NAMESPACE::Config& config);

/// A space of a config whose colors are known: what others are computed into.
struct ReferenceSpace {
    std::string space;
    ColorMatrix aces_from_space{};
};

/// By role (aces_interchange, cie_xyz_d65_interchange), by the name of a known space, or because
/// the matrix from some space to scene_linear is that between two known spaces.
std::optional<ReferenceSpace> anchor_of(const OCIO_NAMESPACE::ConstConfigRcPtr& config);

/// None where the space is not linear, or has no known way to ACES2065-1.
std::optional<ColorMatrix> aces_from_space(const OCIO_NAMESPACE::ConstConfigRcPtr& config,
                                           const std::string& space);

}  // namespace velatura::image
