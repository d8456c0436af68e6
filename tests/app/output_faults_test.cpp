// SPDX-License-Identifier: Apache-2.0
// What a render does where its output cannot be had. ./dev faults breaks many more.
#include "base/atomic_file.h"
#include "base/output_lock.h"
#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace velatura::test {

namespace {

class OutputFaults : public testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", small_scene()); }

    const std::string arguments =
        "render s.usda --res 16 12 --spp 2 --threads 1 --progress none -q -o out.exr";
    Workplace w;
};

}  // namespace

TEST_F(OutputFaults, ASecondRenderToTheSameFileIsRefused) {
    w.write("out.exr", "of the first");
    {
        const Result<OutputLock> first = OutputLock::take(w.path("out.exr"));
        ASSERT_TRUE(first.has_value());
        const CommandResult r = w.velatura(arguments);
        EXPECT_EQ(r.exit_code, 5) << r.output;
        EXPECT_NE(
            r.output.find(fmt::format("out.exr is being rendered by process {} on", ::getpid())),
            std::string::npos)
            << r.output;
        EXPECT_EQ(*read_file(w.path("out.exr")), "of the first");
    }
    const CommandResult r = w.velatura(arguments);
    EXPECT_EQ(r.exit_code, 0) << r.output;
}

TEST_F(OutputFaults, WhatAKilledRenderLeftIsRemoved) {
    w.write(".out.tmp.Ab0xYz.exr", "half a picture");
    w.write(".out.exr.lock", "process 1 on a machine that is no more");
    const CommandResult r = w.velatura(arguments);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_EQ(w.files_beside("s.usda out.exr"), "");
}

TEST_F(OutputFaults, ALimitOnFileSizesIsAnErrorThatNamesTheFile) {
    w.write("out.exr", "old");
    const int status =
        std::system(fmt::format("cd '{}' && ulimit -f 2 && '{}/velatura' {} > said.txt 2>&1",
                                w.path(""), VELATURA_BIN_DIR, arguments)
                        .c_str());
    const std::string said = *read_file(w.path("said.txt"));
    ASSERT_TRUE(WIFEXITED(status)) << said;
    EXPECT_EQ(WEXITSTATUS(status), 1) << said;
    EXPECT_NE(said.find("cannot write out.exr"), std::string::npos) << said;
    EXPECT_EQ(*read_file(w.path("out.exr")), "old");
    EXPECT_EQ(w.files_beside("s.usda out.exr said.txt"), "");
}

}  // namespace velatura::test
