// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"
#include "image/primaries.h"

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace velatura::image {

/// What the numbers of a file mean.
struct FileColor {
    std::string space;  ///< a color space of the OpenColorIO config; empty: see what follows
    const StandardSpace* known = nullptr;
    std::optional<ColorMatrix> aces_from_file;  ///< where they are linear and their primaries known
    std::string label;                          ///< for people: `ACEScg`
    std::string reason;  ///< `chromaticities`, `colorInteropID`, `--input-space`, `nothing said`
    std::vector<std::string> warnings;  ///< what is not known, and what it is taken for
};

/// The one place that decides it. The first of these that says something: `input_space` (a color
/// space, alias or role of the config, or the name of a known space), `colorInteropID`,
/// `chromaticities`; else scene_linear of the config of $OCIO, without one linear Rec.709. `part`
/// is the one that holds the colors, whose attributes come before those of the file.
/// Errors: "unknown-space" (no space is called `input_space`; lists those there are),
/// "ocio-config".
Result<FileColor> color_of(const Image& image,
                           const std::string& input_space = "",
                           size_t part = 0);

/// What a color in linear Rec.709 is in the file's numbers: the identity where those are not known
/// to be linear.
ColorMatrix file_from_rec709(const FileColor& color);

/// The color spaces of the config, for a choice. Errors: "ocio-config".
Result<std::vector<std::string>> color_spaces();

}  // namespace velatura::image
