// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"
#include "base/result.h"
#include "image/compression.h"
#include "image/formats.h"
#include "image/image.h"

#include <string>

namespace velatura::compositor {
inline namespace io {

/// How a mixed image is stored.
struct ImageStorage {
    image::ChannelType type = image::ChannelType::Float;  ///< of an .exr: Half or Float
    image::Compression compression = image::Compression::Zip;
    image::DisplayStorage display;
    bool has_alpha = false;  ///< of a display image: the mix has one, as an .exr always does
};

/// What a command line says of it.
struct ImageStorageOptions {
    std::string depth, compression;
    bool has_alpha = false, has_dither = false;

    void add_to(Command& command);

    /// Of a file of that name. Errors: "bad-output" (an option that its format does not have; the
    /// message lists what it has).
    Result<ImageStorage> storage(const std::string& output) const;
};

}  // namespace io
}  // namespace velatura::compositor
