// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>

namespace velatura {

/// Folder of the public test files: $VELATURA_TEST_ASSETS, else beside the sources. May be absent.
inline std::filesystem::path test_assets() {
    const char* folder = std::getenv("VELATURA_TEST_ASSETS");
    return folder ? std::filesystem::path(folder)
                  : std::filesystem::path(VELATURA_SOURCE_DIR) / "../shared/assets";
}

}  // namespace velatura
