// SPDX-License-Identifier: Apache-2.0
#include "base/sibling_program.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace velatura {

namespace fs = std::filesystem;

Error run_sibling(const std::string& name,
                  const std::vector<std::string>& arguments,
                  const std::string& missing) {
    std::error_code failed;
    const fs::path self = fs::read_symlink("/proc/self/exe", failed);
    std::string program = (self.parent_path() / name).string();
    if (failed || !fs::exists(program, failed))
        return {"no-window",
                fmt::format("{} not found beside {}; {}", name, self.filename().string(), missing)};
    std::vector<std::string> words = arguments;
    std::vector<char*> pointers = {program.data()};
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    execv(program.c_str(), pointers.data());
    return {"no-window", fmt::format("cannot run {}: {}", program, std::strerror(errno))};
}

}  // namespace velatura
