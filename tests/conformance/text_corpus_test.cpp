// SPDX-License-Identifier: Apache-2.0
// The parser corpora of OpenUSD (testSdfParsing), AOUSD and usd-wg against the text reader and
// writer.
#include "base/atomic_file.h"
#include "test_assets.h"
#include "text_layer.h"
#include "usd/text/reader.h"
#include "usd/text/writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace velatura::usd::text {
namespace {

namespace fs = std::filesystem;

/// Files whose name says the opposite of what Pixar's testSdfParsing.py expects of them, and why.
const std::map<std::string, const char*> bad_by_name_but_good = {
    {"17_bad_attributeaccess.sdf", "unknown metadata is kept as opaque text"},
    {"18_bad_primaccess.sdf", "unknown metadata is kept as opaque text"},
};
const std::map<std::string, const char*> good_by_name_but_bad = {
    {"07_end.sdf", "__END__ is not in the grammar"},
    {"124_badwrite_marker_names.sdf", "connection markers are not in the grammar"},
};
/// Files the standard itself forbids.
const std::map<std::string, const char*> aousd_exceptions = {
    {"SubrootReferenceAndVariants_root/usda/root.usd",
     "variant selection in a reference: museum file for old rules"},
    {"BasicInherits_root/usda/root.usd",
     "variant selection in an inherit: museum file for old rules"},
};

struct Outcome {
    bool is_accepted = false;
    bool has_line = false;
    std::string written;
    std::string problem;
};

Outcome read(const fs::path& path, const char* header) {
    Outcome outcome;
    const auto bytes = read_file(path.string());
    if (!bytes) {
        outcome.problem = bytes.error().message;
        return outcome;
    }
    Diagnostics diagnostics;
    const auto layer = read_text_layer(*bytes, path.string(), diagnostics);
    outcome.is_accepted = layer.has_value();
    if (layer) outcome.written = write_text_layer(**layer, header);
    for (const Diagnostic& d : diagnostics.all()) {
        if (d.severity != Severity::Error) continue;
        outcome.has_line = d.loc.line > 0;
        outcome.problem = diagnostics.format(d);
        break;
    }
    return outcome;
}

std::vector<fs::path> files_below(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        if (entry.is_regular_file()) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

bool is_text_file(const fs::path& path) {
    if (path.extension() != ".usda" && path.extension() != ".usd") return false;
    const auto bytes = read_file(path.string());
    return bytes && is_text_layer(*bytes);
}

TEST(OpenUsdParsing, AcceptsRejectsAndPrintsLikePixar) {
    const fs::path folder = test_assets() / "openusd/sdf_parsing";
    if (!fs::exists(folder)) GTEST_SKIP() << "no test assets at " << folder;
    int good = 0, accepted = 0, bad = 0, rejected = 0, baselines = 0, printed = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (entry.path().extension() != ".sdf") continue;
        const bool is_bad =
            (name.find("_bad_") != std::string::npos && !bad_by_name_but_good.count(name)) ||
            good_by_name_but_bad.count(name);
        const Outcome outcome = read(entry.path(), "#sdf 1.4.32");
        if (is_bad) {
            ++bad;
            rejected += !outcome.is_accepted && outcome.has_line;
            EXPECT_FALSE(outcome.is_accepted) << name;
            EXPECT_TRUE(outcome.has_line) << name << ": " << outcome.problem;
            continue;
        }
        ++good;
        accepted += outcome.is_accepted;
        EXPECT_TRUE(outcome.is_accepted) << outcome.problem;
        const auto baseline = read_file((folder / "baseline" / name).string());
        if (!baseline) continue;
        ++baselines;
        printed += outcome.written == *baseline;
        EXPECT_EQ(outcome.written == *baseline, true) << name << " is written differently";
    }
    std::printf("OpenUSD sdf_parsing: accepted %d/%d, rejected %d/%d, printed %d/%d\n", accepted,
                good, rejected, bad, printed, baselines);
    EXPECT_GE(good, 48);
    EXPECT_GE(bad, 75);
    EXPECT_GE(baselines, 46);
}

/// Reads every text file below a folder; also writes it, reads that and writes it again.
void expect_all_read(const char* label, const fs::path& folder) {
    if (!fs::exists(folder)) GTEST_SKIP() << "no test assets at " << folder;
    int total = 0, accepted = 0, round_trips = 0, exceptions = 0;
    for (const fs::path& path : files_below(folder)) {
        if (!is_text_file(path)) continue;
        const Outcome outcome = read(path, "#usda 1.0");
        bool is_exception = false;
        for (const auto& [name, reason] : aousd_exceptions) {
            const std::string text = path.generic_string();
            is_exception =
                is_exception || (text.size() >= name.size() + 1 && text.ends_with('/' + name));
        }
        if (is_exception) {
            ++exceptions;
            EXPECT_FALSE(outcome.is_accepted) << path << " is listed as an exception";
            continue;
        }
        ++total;
        accepted += outcome.is_accepted;
        EXPECT_TRUE(outcome.is_accepted) << outcome.problem;
        if (!outcome.is_accepted) continue;
        Diagnostics diagnostics;
        const auto again = read_text_layer(outcome.written, "written.usda", diagnostics);
        const bool is_same = again && write_text_layer(**again) == outcome.written;
        round_trips += is_same;
        EXPECT_TRUE(is_same) << path << " does not survive writing and reading"
                             << (again || diagnostics.all().empty()
                                     ? ""
                                     : diagnostics.format(diagnostics.all()[0]));
    }
    std::printf("%s: accepted %d/%d, written and read back %d/%d, exceptions %d\n", label, accepted,
                total, round_trips, total, exceptions);
    EXPECT_GT(total, 0);
}

TEST(AousdText, ReadsEveryFileFormatFile) {
    expect_all_read("AOUSD file_formats", test_assets() / "aousd/file_formats");
}

TEST(AousdText, ReadsEveryCompositionLayer) {
    expect_all_read("AOUSD composition", test_assets() / "aousd/composition");
}

TEST(AousdText, ReadsEveryValueResolutionLayer) {
    expect_all_read("AOUSD value_resolution", test_assets() / "aousd/value_resolution");
}

TEST(UsdWg, ReadsEveryTextLayer) {
    expect_all_read("usd-wg", test_assets() / "usd-wg");
}

TEST(OpenUsdImaging, ReadsEveryTextLayer) {
    expect_all_read("OpenUSD imaging", test_assets() / "openusd/imaging");
}

TEST(LuxtestLayers, AreRead) {
    expect_all_read("luxtest", test_assets() / "luxtest");
}

}  // namespace
}  // namespace velatura::usd::text
