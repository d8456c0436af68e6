// SPDX-License-Identifier: Apache-2.0
// The rules of the house, applied to the source tree as it stands.
#include "meta/classes.h"
#include "meta/house.h"
#include "meta/rules.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <set>
#include <sstream>

namespace velatura::meta {

namespace {

const std::vector<SourceFile>& tree() {
    static const std::vector<SourceFile> files = read_tree(VELATURA_SOURCE_DIR);
    return files;
}

std::string report(const std::vector<std::string>& violations) {
    std::string text;
    for (const std::string& v : violations) text += v + "\n";
    return text;
}

std::string report_all(const std::function<std::vector<std::string>(const SourceFile&)>& rule) {
    std::string text;
    for (const SourceFile& file : tree()) text += report(rule(file));
    return text;
}

void expect_none(const std::string& violations) {
    EXPECT_TRUE(violations.empty()) << violations;
}

TEST(Tree, IsRead) {
    // Every rule below would pass on an empty list
    EXPECT_GT(tree().size(), 50u);
}

TEST(Tree, TableOfTiersHasNoCycle) {
    // Each tier must be removable once everything it includes is: otherwise it includes itself in
    // the end
    std::map<std::string, std::set<std::string>> open = tier_table();
    for (bool changed = true; changed;) {
        changed = false;
        for (auto it = open.begin(); it != open.end();) {
            bool is_free = true;
            for (const std::string& other : it->second) is_free = is_free && !open.contains(other);
            changed = changed || is_free;
            it = is_free ? open.erase(it) : std::next(it);
        }
    }
    EXPECT_TRUE(open.empty()) << "cycle at " << (open.empty() ? "" : open.begin()->first);
}

TEST(Tree, FilesIncludeOnlyTiersAtTheirRight) {
    expect_none(report_all(check_tier_includes));
}

TEST(Tree, LibrariesStayBehindTheirTiers) {
    expect_none(report_all(check_libraries));
}

TEST(Tree, FilesAreShort) {
    expect_none(report_all(check_file_size));
}

TEST(Tree, ClassesHaveFewPrivateMethods) {
    expect_none(report_all(check_private_methods));
}

TEST(Tree, SizesOfTiers) {
    // Shown by ctest -V: where a tier grows
    const std::vector<TierSize> sizes = tier_sizes(tree());
    std::cout << tier_size_table(sizes);
    const auto integrator = std::find_if(
        sizes.begin(), sizes.end(), [](const TierSize& size) { return size.tier == "integrator"; });
    ASSERT_NE(integrator, sizes.end());
    EXPECT_GT(integrator->files, 50u);
    EXPECT_GT(integrator->lines, integrator->files * integrator->median_lines / 2);
    EXPECT_GT(integrator->largest_class.private_methods, 0u);
    for (const TierSize& size : sizes) EXPECT_EQ(size.upward_includes, 0u) << size.tier;
}

TEST(Tree, FilesBeginWithTheSpdxLine) {
    expect_none(report_all(check_spdx));
}

TEST(Tree, NamespacesMatchFolders) {
    expect_none(report_all(check_namespace));
}

TEST(Tree, HeadersHavePragmaOnce) {
    expect_none(report_all(check_pragma_once));
}

TEST(Tree, HeadersIncludeTheStandardHeadersThatTheyUse) {
    expect_none(report_all(check_standard_includes));
}

TEST(Tree, LinesAreWithinTheColumnLimit) {
    expect_none(report_all(check_line_length));
}

TEST(Tree, NoPathOfOneMachine) {
    expect_none(report_all(check_machine_paths));
}

TEST(Tree, NoBannedWords) {
    expect_none(report_all(check_banned_words));
}

TEST(Tree, TextForPeopleIsInPlainWords) {
    expect_none(report_all(check_plain_words));
}

TEST(Tree, LibrariesNeverPrint) {
    expect_none(report_all(check_silence));
}

TEST(Tree, RenderersArePutTogetherInOnePlace) {
    expect_none(report_all(check_one_renderer));
}

TEST(Tree, TestsCanFail) {
    expect_none(report_all(check_test_is_real));
}

TEST(Tree, HardCasesDoNotForgetWhatIsNoNumber) {
    expect_none(report_all(check_worst_of_numbers));
}

TEST(Tree, OneHeaderFindsTheTestAssets) {
    expect_none(report_all(check_test_assets));
}

TEST(Tree, PagesThatAreNamedExist) {
    expect_none(report_all([](const SourceFile& f) { return check_pages(f, tree()); }));
}

TEST(Tree, SourcesThatPagesNameExist) {
    expect_none(report_all([](const SourceFile& f) { return check_named_sources(f, tree()); }));
}

TEST(Tree, SourcesIncludeTheirOwnHeaderFirst) {
    expect_none(report_all([](const SourceFile& f) { return check_own_header_first(f, tree()); }));
}

TEST(Tree, EveryTierHasAShortReadme) {
    expect_none(report(check_tier_readmes(tree())));
}

TEST(Tree, EverySourceIsListedInCMake) {
    expect_none(report(check_listed_in_cmake(tree())));
}

TEST(Tree, ReadmeInstallsWhatSetupInstalls) {
    const auto packages_between = [](const char* file, const std::string& from,
                                     const std::string& to) {
        std::ifstream in(std::filesystem::path(VELATURA_SOURCE_DIR) / file);
        std::stringstream text;
        text << in.rdbuf();
        const std::string all = text.str();
        const size_t begin = all.find(from);
        EXPECT_NE(begin, std::string::npos) << file;
        const size_t first = begin + from.size();
        std::istringstream words(all.substr(first, all.find(to, first) - first));
        std::set<std::string> packages;
        // A line of the list may go on below
        for (std::string word; words >> word;) {
            if (word != "\\") packages.insert(word);
        }
        return packages;
    };
    EXPECT_EQ(packages_between("README.md", "apt-get install --no-install-recommends", "\ncmake "),
              packages_between("dev", "\npackages=(", "\n)"));
}

TEST(Tree, RootHoldsOnlyTheHouse) {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(VELATURA_SOURCE_DIR)) {
        names.push_back(entry.path().filename().string());
    }
    expect_none(report(check_root_entries(names)));
}

}  // namespace

}  // namespace velatura::meta
