// SPDX-License-Identifier: Apache-2.0
// Composition against the baselines of the AOUSD suite (`pcp.txt`, made with OpenUSD 25.08 in USD
// mode): per prim the prim stack, time offsets, variants, names of children and properties,
// property stacks, targets and the kinds of errors.
#include "pcp_baseline.h"
#include "test_assets.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace velatura::usd::compose {
namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// Cases whose root layer the reference refused to read: nothing to compare with.
const std::map<std::string, const char*> rejected_by_reference = {
    {"BasicInherits_root", "an inherit path with a variant selection"},
    {"SubrootReferenceAndVariants_root", "a reference path with a variant selection"},
};

/// Cases that differ, with the reason.
const std::map<std::string, const char*> known_differences = {};

std::vector<std::string> differences_of(const fs::path& folder, const Baseline& baseline) {
    ComposeOptions options;
    options.variant_fallbacks["standin"] = {"render"};
    Diagnostics diagnostics;
    Composer composer(options, diagnostics);
    const fs::path layers = fs::canonical(folder / "usda");
    const auto opened = composer.open((layers / baseline.root_file).string(), {});
    if (!opened) return {"does not open: " + opened.error().message};
    return differences(baseline.prims, composed_facts(composer, layers.string()));
}

TEST(PcpConformance, AousdBaselines) {
    const fs::path cases = test_assets() / "aousd" / "composition" / "tests" / "assets";
    if (!fs::exists(cases)) GTEST_SKIP() << "no assets at " << cases;
    const char* only = std::getenv("VELATURA_PCP_CASE");
    int passed = 0;
    int total = 0;
    int prims = 0;
    for (const auto& entry : fs::directory_iterator(cases)) {
        const std::string name = entry.path().filename().string();
        if (!fs::exists(entry.path() / "pcp.txt") || (only && name != only)) continue;
        const Baseline baseline = parse_baseline(read(entry.path() / "pcp.txt"));
        const bool is_rejected = rejected_by_reference.count(name) != 0;
        EXPECT_EQ(baseline.is_rejected, is_rejected) << name;
        if (is_rejected) continue;
        ++total;
        prims += int(baseline.prims.size()) - 1;
        const std::vector<std::string> found = differences_of(entry.path(), baseline);
        passed += found.empty() ? 1 : 0;
        const auto known = known_differences.find(name);
        if (known != known_differences.end()) {
            EXPECT_FALSE(found.empty()) << name << " passes: take it off the list";
            std::printf("differs: %s (%s)\n", name.c_str(), known->second);
            continue;
        }
        std::string text;
        for (const std::string& line : found) text += "\n    " + line;
        EXPECT_TRUE(found.empty()) << name << text;
    }
    std::printf(
        "AOUSD composition: %d of %d cases equal, %d prims; %zu more are not readable for "
        "the reference\n",
        passed, total, prims, rejected_by_reference.size());
}

}  // namespace
}  // namespace velatura::usd::compose
