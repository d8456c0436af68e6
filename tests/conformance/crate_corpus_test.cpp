// SPDX-License-Identifier: Apache-2.0
// Every crate at hand against its text twin, and every text at hand through the crate writer.
#include "test_assets.h"
#include "text_layer.h"
#include "usd/crate/crate_format.h"
#include "usd/crate/reader.h"
#include "usd/crate/writer.h"
#include "usd/text/reader.h"
#include "usd/text/writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace velatura::usd::crate {
namespace {

namespace fs = std::filesystem;

using LayerPtr = std::shared_ptr<layer::Layer>;

/// Texts that cannot come back from a crate as they were, and why.
const std::map<std::string, const char*> unwritable = {
    {"183_time_samples.sdf", "crates have no type for paths, which a relationship is sampled with"},
    {"splines.usda", "crates have no place for the widths of a Hermite spline's tangents"},
};

/// Twins that differ, and why.
const std::map<std::string, const char*> different_twins = {
    {"value_resolution/tests/assets/clip_basic/ref.usd", "its text begins with a stray '4'"},
};

bool is_crate(const fs::path& file) {
    const auto bytes = open_asset_bytes(file.string());
    return bytes && (*bytes)->bytes().starts_with(crate_magic);
}

/// Files below a folder for which `wanted` holds, sorted.
template <class Wanted>
std::vector<fs::path> files_below(const fs::path& folder, const Wanted& wanted) {
    std::vector<fs::path> files;
    if (!fs::exists(folder)) return files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        if (entry.is_regular_file() && wanted(entry.path())) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

struct Read {
    LayerPtr layer;
    std::string problem;  ///< first error or warning
};

void note_problem(const Diagnostics& diagnostics, Read& read) {
    for (const Diagnostic& d : diagnostics.all()) {
        read.problem = diagnostics.format(d);
        break;
    }
}

Read read_crate(const AssetBytesPtr& bytes, const std::string& name) {
    Read result;
    Diagnostics diagnostics;
    auto layer = read_crate_layer(bytes, name, diagnostics);
    if (layer) {
        result.layer = *layer;
    } else {
        result.problem = layer.error().message;
    }
    note_problem(diagnostics, result);
    return result;
}

Read read_crate_file(const fs::path& file) {
    const auto bytes = open_asset_bytes(file.string());
    return bytes ? read_crate(*bytes, file.string()) : Read{};
}

LayerPtr read_text_file(const fs::path& file) {
    const auto bytes = open_asset_bytes(file.string());
    if (!bytes) return nullptr;
    Diagnostics diagnostics;
    text::TextOptions options;
    options.allow_variants_in_arc_paths = true;
    auto layer = text::read_text_layer((*bytes)->bytes(), file.string(), diagnostics, options);
    return layer ? *layer : nullptr;
}

/// Some crates of the suite were made from texts with the line ends of Windows.
std::string without_carriage_returns(std::string printed) {
    for (size_t at = 0; (at = printed.find("\\r\n", at)) != std::string::npos;)
        printed.erase(at, 2);
    return printed;
}

/// The text twin of a crate in AOUSD's suite: usda/NAME.usd, usda/NAME.usda, NAME.usda, and
/// "entry" is the twin of "root".
fs::path twin_of(const fs::path& file) {
    const fs::path folder = file.parent_path();
    const std::string stem = file.stem().string();
    for (const std::string& name : {stem, stem == "entry" ? std::string("root") : stem}) {
        for (const fs::path& below :
             {folder / "usda", folder, folder.parent_path() / "usda" / folder.filename()}) {
            for (const char* extension : {".usda", ".usd"}) {
                const fs::path twin = below / (name + extension);
                if (twin != file && fs::exists(twin) && !is_crate(twin)) return twin;
            }
        }
    }
    return {};
}

TEST(CrateTwins, PrintLikeTheirText) {
    const fs::path folder = test_assets() / "aousd";
    if (!fs::exists(folder)) GTEST_SKIP() << "no test assets at " << folder;
    int twins = 0;
    int equal = 0;
    int alone = 0;
    for (const fs::path& file : files_below(folder, is_crate)) {
        const fs::path twin = twin_of(file);
        if (twin.empty()) {
            ++alone;
            continue;
        }
        const std::string name = fs::relative(file, folder).string();
        ++twins;
        const Read binary = read_crate_file(file);
        const LayerPtr text = read_text_file(twin);
        const bool is_equal = binary.layer && text &&
                              without_carriage_returns(text::write_text_layer(*binary.layer)) ==
                                  text::write_text_layer(*text);
        equal += is_equal;
        EXPECT_TRUE(is_equal != (different_twins.count(name) != 0)) << name << binary.problem;
    }
    std::printf("AOUSD crates: %d of %d print like their text twins, %d have none\n", equal, twins,
                alone);
    EXPECT_GE(twins, 300);
}

TEST(CrateFiles, OpenWithoutAWordAndComeBackFromTextAndCrate) {
    if (!fs::exists(test_assets())) GTEST_SKIP() << "no test assets at " << test_assets();
    int total = 0;
    int good = 0;
    std::set<int> versions;
    for (const fs::path& file : files_below(test_assets(), is_crate)) {
        ++total;
        const Read read = read_crate_file(file);
        EXPECT_TRUE(read.problem.empty()) << read.problem;
        if (!read.layer) continue;
        const std::string printed = text::write_text_layer(*read.layer);
        versions.insert((*open_asset_bytes(file.string()))->bytes()[9]);
        // Text that is read again
        Diagnostics diagnostics;
        text::TextOptions options;
        options.allow_variants_in_arc_paths = true;
        const auto again = text::read_text_layer(printed, "printed", diagnostics, options);
        const bool is_fixed = again && text::write_text_layer(**again) == printed;
        EXPECT_TRUE(is_fixed) << file << " is not read back as printed";
        // A crate of our own
        const auto bytes = write_crate_layer(*read.layer, diagnostics);
        const bool comes_back = bytes && [&] {
            const Read second = read_crate(make_asset_bytes(*bytes), "written");
            return second.layer && text::write_text_layer(*second.layer) == printed;
        }();
        EXPECT_TRUE(comes_back) << file << " does not come back from a crate";
        good += read.problem.empty() && is_fixed && comes_back;
    }
    std::printf("crates that open without a word and come back: %d of %d, versions 0.", good,
                total);
    for (const int v : versions) std::printf("%d ", v);
    std::printf("\n");
    EXPECT_GE(total, 400);
}

TEST(CrateWriter, BringsEveryTextBack) {
    if (!fs::exists(test_assets())) GTEST_SKIP() << "no test assets at " << test_assets();
    const auto is_text = [](const fs::path& file) {
        const std::string extension = file.extension().string();
        if (extension != ".usda" && extension != ".usd" && extension != ".sdf") return false;
        if (file.parent_path().filename() == "baseline") return false;
        const auto bytes = open_asset_bytes(file.string());
        return bytes && is_text_layer((*bytes)->bytes());
    };
    for (const char* const corpus : {"openusd/sdf_parsing", "usd-wg", "aousd", "openusd/imaging"}) {
        int total = 0;
        int equal = 0;
        for (const fs::path& file : files_below(test_assets() / corpus, is_text)) {
            const LayerPtr layer = read_text_file(file);
            if (!layer) continue;
            ++total;
            Diagnostics diagnostics;
            const auto bytes = write_crate_layer(*layer, diagnostics);
            ASSERT_TRUE(bytes) << bytes.error().message;
            const Read back = read_crate(make_asset_bytes(*bytes), "written.usdc");
            const bool is_equal =
                back.layer && text::write_text_layer(*back.layer) == text::write_text_layer(*layer);
            equal += is_equal;
            const std::string name = file.filename().string();
            EXPECT_TRUE(is_equal != (unwritable.count(name) != 0)) << file << back.problem;
        }
        std::printf("%s: %d of %d texts come back from a crate\n", corpus, equal, total);
    }
}

}  // namespace
}  // namespace velatura::usd::crate
