// SPDX-License-Identifier: Apache-2.0
// Renders within limits on their memory. ./dev faults --only memory renders 20 scenes.
#include "base/atomic_file.h"
#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <regex>

namespace velatura::test {

namespace {

using json = nlohmann::json;

class MemoryLimitCommand : public testing::Test {
  protected:
    void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
        GTEST_SKIP() << "sanitizers take memory by ways of their own";
#endif
        w.write("s.usda", small_scene());
    }

    /// What a render has resident at most, by its own statistics, bytes; 0: none was written.
    double peak() const {
        std::ifstream in(w.path("s.json"));
        const json stats = json::parse(in, nullptr, false);
        return stats.is_object() ? double(stats["memory_bytes"]["peak"]) : 0.0;
    }

    CommandResult render(const std::string& more) const {
        return w.velatura(
            "render s.usda -o x.exr --stats s.json --res 200 150 --spp 1 --threads 2 --progress "
            "none -q " +
            more);
    }

    Workplace w;
};

}  // namespace

TEST_F(MemoryLimitCommand, IsKept) {
    ASSERT_EQ(render("").exit_code, 0);
    const double free = peak();
    ASSERT_GT(free, 30e6);
    const std::string hash = w.hash("x.exr");
    for (const double part : {0.4, 0.7, 0.9, 1.0, 1.2, 1.5}) {
        for (const char* file : {"x.exr", "s.json"}) ::unlink(w.path(file).c_str());
        const double limit = part * free;
        const CommandResult r = render(fmt::format("--memory-limit {:.0f}K", limit / 1e3));
        EXPECT_TRUE(r.exit_code == 0 || r.exit_code == 3 || r.exit_code == 6) << part << r.output;
        EXPECT_EQ(w.exists("x.exr"), r.exit_code != 6) << part << r.output;
        EXPECT_EQ(r.output.find("memory-limit") == std::string::npos,
                  r.exit_code == 0 && r.output.empty())
            << part << r.output;
        EXPECT_EQ(w.files_beside("s.usda x.exr s.json .x.exr.lock"), "") << part;
        if (r.exit_code == 6) continue;
        EXPECT_LE(peak(), 1.02 * limit) << part << r.output;
        if (r.exit_code == 0) {
            EXPECT_EQ(w.hash("x.exr"), hash) << part;
        }
    }
    EXPECT_EQ(render(fmt::format("--memory-limit {:.0f}K", 1.5 * free / 1e3)).exit_code, 0)
        << "half as much more suffices";
}

/// The rest of the render is not thrown away with it, nor is the file that was there.
TEST_F(MemoryLimitCommand, TooLittleLeavesTheOldFile) {
    w.write("x.exr", "of yesterday");
    // A film of some 350 MB: far more than the limit, which is far more than the program itself
    const CommandResult r = render("--res 640 480 --memory-limit 60M");
    EXPECT_EQ(r.exit_code, 6) << r.output;
    EXPECT_NE(r.output.find("nothing is rendered [memory-limit]"), std::string::npos) << r.output;
    EXPECT_NE(r.output.find("MB film"), std::string::npos) << r.output;
    EXPECT_EQ(*read_file(w.path("x.exr")), "of yesterday");
}

TEST_F(MemoryLimitCommand, ReadersObeyIt) {
    std::string points = "#usda 1.0\ndef Points \"P\" {\npoint3f[] points = [(0, 0, 0)";
    for (int i = 0; i < 500'000; ++i) points += ", (1, 2, 3)";
    w.write("p.usda", points + "]\n}\n");
    for (const char* command : {"render p.usda -o p.exr -q --progress none --res 8 8",
                                "info p.usda", "flatten p.usda -o f.usda", "plan p.usda"}) {
        const CommandResult r = w.velatura(fmt::format("{} --memory-limit 26M", command));
        EXPECT_EQ(r.exit_code, 6) << command << r.output;
        // Half a million points of 12 bytes are an array of 6 MB; what is in use at the start may
        // leave too little for the program itself
        EXPECT_TRUE(std::regex_search(
            r.output,
            std::regex("--memory-limit: 26 MB is too low: [0-9.]+ MB in use and ([0-9.]+ [KM]?B "
                       ")?more requested [a-z ]+; at least [0-9.]+ MB needed")))
            << command << r.output;
    }
    EXPECT_EQ(w.files_beside("s.usda p.usda"), "");
}

TEST_F(MemoryLimitCommand, RefusesNonsense) {
    for (const char* size : {"8", "-1G", "0M", "8X", "G", "1e30T"}) {
        const CommandResult r = render(fmt::format("--memory-limit={}", size));
        EXPECT_EQ(r.exit_code, 2) << size << r.output;
        EXPECT_NE(r.output.find("[bad-size]"), std::string::npos) << size << r.output;
    }
}

}  // namespace velatura::test
