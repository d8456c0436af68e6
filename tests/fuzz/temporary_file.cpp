// SPDX-License-Identifier: Apache-2.0
#include "temporary_file.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace velatura::fuzz {

namespace {

struct Folder {
    std::string path = "/dev/shm/velatura_fuzz_" + std::to_string(::getpid());

    Folder() { std::filesystem::create_directories(path); }

    ~Folder() {
        std::error_code error;
        std::filesystem::remove_all(path, error);
    }
};

}  // namespace

const std::string& memory_folder() {
    static const Folder folder;
    return folder.path;
}

std::string memory_file(const std::string& name, std::string_view bytes) {
    const std::string path = memory_folder() + "/" + name;
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    if (!file.write(bytes.data(), std::streamsize(bytes.size())).flush()) std::abort();
    return path;
}

}  // namespace velatura::fuzz
