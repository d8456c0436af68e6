// SPDX-License-Identifier: Apache-2.0
// What fuzzers begin with (seeds/), what they found (regressions/) and what led them to new code
// (corpus/), format by format, in every build, and mutants of the first two:
// VELATURA_FUZZ_CORPUS=FOLDER replays the files of FOLDER/FORMAT as well,
// VELATURA_FUZZ_MUTANTS=100000 tries more of them, VELATURA_FUZZ_FIRST=N others. What a program
// that died was at stays in /dev/shm/velatura_fuzz_*/mutant.
#include "base/asset_bytes.h"
#include "base/atomic_file.h"
#include "base/zip_archive.h"
#include "fuzz_targets.h"
#include "mutant.h"
#include "temporary_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace velatura::fuzz {
namespace {

struct Target {
    const char* name;
    void (*run)(std::string_view);
};

constexpr Target targets[] = {{"usda", usda},
                              {"usdc", usdc},
                              {"usdz", usdz},
                              {"mtlx", mtlx},
                              {"plugin", plugin},
                              {"preset", preset},
                              {"topup", topup},
                              {"layers", layers},
                              {"exr", exr},
                              {"lpe", lpe},
                              {"report", report},
                              {"tally", tally},
                              {"ies", ies},
                              {"gltf", gltf},
                              {"obj", obj},
                              {"texture", texture},
                              {"answer", answer},
                              {"volume", volume},
                              {"subdivision", subdivision}};

const std::filesystem::path here = std::filesystem::path(VELATURA_SOURCE_DIR) / "tests/fuzz";

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    if (!std::filesystem::is_directory(folder)) return files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

/// What was kept of the runs of a format (run.py keep).
std::vector<std::string> kept_files(const char* format) {
    const std::filesystem::path file = here / "corpus" / (std::string(format) + ".zip");
    if (!std::filesystem::exists(file)) return {};
    const Result<std::string> bytes = read_file(file.string());
    const auto archive =
        ZipArchive::open(make_asset_bytes(bytes ? *bytes : std::string()), file.string());
    EXPECT_TRUE(archive.has_value()) << file;
    std::vector<std::string> files;
    if (!archive) return files;
    for (const ZipMember& member : (*archive)->members()) {
        const Result<AssetBytesPtr> content = (*archive)->read(member);
        EXPECT_TRUE(content.has_value()) << file;
        if (content) files.emplace_back((*content)->bytes());
    }
    EXPECT_FALSE(files.empty()) << file;
    return files;
}

class Replay : public testing::TestWithParam<Target> {};

TEST_P(Replay, KeepsItWithWhatRunsOfFuzzersReached) {
    const Target& target = GetParam();
    for (const std::string& bytes : kept_files(target.name)) {
        memory_file("mutant", bytes);
        target.run(bytes);
    }
    const char* more = std::getenv("VELATURA_FUZZ_CORPUS");
    if (!more) return;
    for (const std::filesystem::path& file : files_in(std::filesystem::path(more) / target.name))
        target.run(*read_file(file.string()));
}

TEST_P(Replay, KeepsWhatReadersPromise) {
    const Target& target = GetParam();
    target.run("");
    for (const char* kind : {"seeds", "regressions"}) {
        for (const std::filesystem::path& file : files_in(here / kind / target.name)) {
            SCOPED_TRACE(file.string());
            const Result<std::string> bytes = read_file(file.string());
            ASSERT_TRUE(bytes.has_value());
            target.run(*bytes);
            // Most of a file, and a file with a wrong byte, are read or refused as well
            for (size_t part = 1; part < 8; ++part) {
                const size_t at = bytes->size() * part / 8;
                target.run(std::string_view(*bytes).substr(0, at));
                std::string wrong = *bytes;
                if (at < wrong.size()) wrong[at] = char(~wrong[at]);
                target.run(wrong);
            }
        }
    }
}

uint64_t from_environment(const char* name, uint64_t otherwise) {
    const char* text = std::getenv(name);
    return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// CPU time of this process and of its children that ended.
double cpu_seconds() {
    double sum = 0;
    for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
        rusage used = {};
        getrusage(who, &used);
        for (const timeval& time : {used.ru_utime, used.ru_stime})
            sum += double(time.tv_sec) + 1e-6 * double(time.tv_usec);
    }
    return sum;
}

TEST_P(Replay, MutantsAreReadOrRefused) {
    const Target& target = GetParam();
    std::vector<std::string> files;
    for (const char* kind : {"seeds", "regressions"})
        for (const std::filesystem::path& file : files_in(here / kind / target.name))
            files.push_back(*read_file(file.string()));
    ASSERT_FALSE(files.empty());
    const uint64_t first = from_environment("VELATURA_FUZZ_FIRST", 1),
                   count = from_environment("VELATURA_FUZZ_MUTANTS", 50);
    double slowest = 0;
    uint64_t slowest_seed = 0;
    for (uint64_t seed = first; seed < first + count; ++seed) {
        const std::string bytes = mutant(files, seed);
        memory_file("mutant", bytes);
        const double begin = cpu_seconds();
        target.run(bytes);
        const double taken = cpu_seconds() - begin;
        if (taken > slowest) slowest = taken, slowest_seed = seed;
    }
    std::printf(
        "%s: %llu mutants, the slowest took %.3f s of CPU time: VELATURA_FUZZ_FIRST=%llu "
        "VELATURA_FUZZ_MUTANTS=1\n",
        target.name, static_cast<unsigned long long>(count), slowest,
        static_cast<unsigned long long>(slowest_seed));
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Replay, testing::ValuesIn(targets), [](const auto& instance) {
    return std::string(instance.param.name);
});

/// A folder of another name would never be looked into.
TEST(Replay, KnowsEveryFolder) {
    std::set<std::string> known;
    for (const Target& target : targets) known.insert(target.name);
    for (const char* kind : {"seeds", "regressions"})
        for (const std::filesystem::path& folder : files_in(here / kind))
            EXPECT_TRUE(known.contains(folder.filename().string())) << folder;
    for (const std::filesystem::path& archive : files_in(here / "corpus"))
        EXPECT_TRUE(archive.extension() == ".zip" && known.contains(archive.stem().string()))
            << archive;
}

}  // namespace
}  // namespace velatura::fuzz
