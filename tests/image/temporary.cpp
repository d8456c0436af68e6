// SPDX-License-Identifier: Apache-2.0
#include "temporary.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

namespace velatura::image {
namespace {

struct TemporaryFolder {
    std::filesystem::path path = std::filesystem::path(testing::TempDir()) /
                                 ("velatura_image_test_" + std::to_string(getpid()));

    TemporaryFolder() { std::filesystem::create_directories(path); }

    ~TemporaryFolder() { std::filesystem::remove_all(path); }

    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
};

}  // namespace

std::string temporary(const std::string& name) {
    static const TemporaryFolder folder;
    return (folder.path / name).string();
}

}  // namespace velatura::image
