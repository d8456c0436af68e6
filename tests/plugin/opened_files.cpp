// SPDX-License-Identifier: Apache-2.0
#include "opened_files.h"

#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>

namespace velatura::test {

std::string opened_files(const Workplace& w,
                         const std::string& program,
                         const std::string& arguments) {
    const std::string line = fmt::format(
        "cd '{}' && LD_DEBUG=files LD_DEBUG_OUTPUT=linker '{}/{}' {} >&2 && cat linker.* && "
        "rm linker.*",
        w.path("."), VELATURA_BIN_DIR, program, arguments);
    FILE* pipe = ::popen(line.c_str(), "r");
    std::string output;
    std::array<char, 4096> buffer{};
    while (const size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe))
        output.append(buffer.data(), n);
    EXPECT_EQ(::pclose(pipe), 0) << program << " " << arguments;
    // Or whoever looks for something would find nothing whatever was opened
    EXPECT_NE(output.find("libOpenEXR"), std::string::npos);
    return output;
}

void expect_nothing_heavy(const std::string& opened, const std::string& what) {
    for (const char* name : {"libOpenImageIO", "libopenvdb", "libosd", "libembree", "libavcodec",
                             "libopencv", "plugins/"}) {
        EXPECT_EQ(opened.find(name), std::string::npos) << what << " opens " << name;
    }
}

}  // namespace velatura::test
