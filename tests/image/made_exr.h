// SPDX-License-Identifier: Apache-2.0
// EXR files that Velatura never writes: parts over different windows, any compression.
#pragma once

#include "image/window.h"

#include <OpenEXR/ImfCompression.h>

#include <string>
#include <vector>

namespace velatura::image {

struct MadePart {
    std::string name;
    Window window;
    std::vector<std::string> halves, floats, uints;  ///< channels of each type
    Imf::Compression compression = Imf::ZIP_COMPRESSION;
};

/// Every value is 1, as long as the compression keeps that.
void make_exr(const std::string& path, const std::vector<MadePart>& parts);

}  // namespace velatura::image
