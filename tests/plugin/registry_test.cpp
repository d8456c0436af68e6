// SPDX-License-Identifier: Apache-2.0
#include "plugin/registry.h"

#include "accel/accelerator_factory.h"
#include "folder_test.h"
#include "plugin/plugin_api.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

namespace velatura::plugin {
namespace {

namespace fs = std::filesystem;

class RegistryTest : public FolderTest {
  protected:
    // A plugin of the tests, with a manifest that nothing is wrong with but what is asked for.
    void place(const std::string& name, const std::string& abi = "1", bool has_library = true) {
        const fs::path folder = folder_ / name;
        fs::create_directories(folder);
        std::ofstream(folder / "plugin.txt")
            << "name: " << name << "\nabi: " << abi
            << "\nprovides: accelerator\ntrigger: option accel=" << name << "\n";
        const std::string library = "velatura_" + name + ".so";
        const fs::path built = fs::path(VELATURA_TEST_PLUGINS) / name / library;
        if (has_library && fs::exists(built)) fs::copy_file(built, folder / library);
    }

    const void* open(const std::string& name) {
        const Registry registry({{folder_.string()}}, diagnostics_);
        const Manifest* manifest = registry.find("accelerator", {"option", "accel=" + name});
        EXPECT_NE(manifest, nullptr) << name << "\n" << errors();
        if (!manifest) return nullptr;
        return open_interface(*manifest, "accelerator", accel::accelerator_interface_version,
                              diagnostics_);
    }

    std::string errors() const {
        std::string out;
        for (const Diagnostic& d : diagnostics_.all()) out += diagnostics_.format(d) + "\n";
        return out;
    }

    void expect_refused(const std::string& name, const std::string& code, const std::string& text) {
        EXPECT_EQ(open(name), nullptr) << name;
        ASSERT_EQ(diagnostics_.error_count(), 1u) << errors();
        EXPECT_EQ(diagnostics_.all().back().code, code) << errors();
        EXPECT_NE(errors().find(text), std::string::npos) << errors();
        // At a place in the manifest
        EXPECT_NE(errors().find("plugin.txt:"), std::string::npos) << errors();
    }

    Diagnostics diagnostics_;
};

TEST_F(RegistryTest, OpensWhatIsCalledFor) {
    place("brute_force");
    const void* first = open("brute_force");
    EXPECT_NE(first, nullptr) << errors();
    EXPECT_EQ(open("brute_force"), first);
    EXPECT_TRUE(diagnostics_.all().empty()) << errors();
}

TEST_F(RegistryTest, KnowsWithoutLoading) {
    // A shared object that cannot be loaded harms nobody who does not ask for it
    place("broken");
    write("broken/velatura_broken.so", "this is no shared object");
    const Registry registry({{folder_.string()}}, diagnostics_);
    ASSERT_EQ(registry.manifests().size(), 1u);
    EXPECT_TRUE(diagnostics_.all().empty()) << errors();
    EXPECT_EQ(registry.find("accelerator", {"option", "accel=other"}), nullptr);
    EXPECT_EQ(registry.find("subdivider", {"option", "accel=broken"}), nullptr);
}

TEST_F(RegistryTest, RefusesAnotherAbiOfTheManifestBeforeLoading) {
    place("broken", "7");
    write("broken/velatura_broken.so", "this is no shared object");
    expect_refused("broken", "plugin-abi",
                   "plugin.txt:2:6: error: plugin broken: expected ABI 1, found 7");
}

TEST_F(RegistryTest, RefusesAnotherAbiOfTheObject) {
    place("wrong_abi");
    expect_refused("wrong_abi", "plugin-abi", "expected ABI 1, found 2 in ");
}

TEST_F(RegistryTest, RefusesAnObjectThatIsMissing) {
    place("absent");
    expect_refused("absent", "plugin-load", "plugin.txt:1:7: error: plugin absent: shared object ");
}

TEST_F(RegistryTest, RefusesWhatIsNoSharedObject) {
    place("broken");
    write("broken/velatura_broken.so", "this is no shared object");
    expect_refused("broken", "plugin-load", "cannot be loaded: ");
}

TEST_F(RegistryTest, RefusesAnObjectWithoutEntryPoint) {
    place("wrong_entry");
    expect_refused("wrong_entry", "plugin-load", "has no entry point velatura_plugin_v1");
}

TEST_F(RegistryTest, RefusesAnEntryPointThatReturnsNothing) {
    place("wrong_null");
    expect_refused("wrong_null", "plugin-load", "its entry point returns nothing");
}

TEST_F(RegistryTest, RefusesAnotherPluginsObject) {
    place("wrong_name");
    expect_refused("wrong_name", "plugin-load", "names itself \"somebody_else\"");
}

TEST_F(RegistryTest, RefusesAnotherVersionOfTheInterface) {
    place("wrong_version");
    expect_refused("wrong_version", "plugin-abi",
                   "expected version " + std::to_string(accel::accelerator_interface_version) +
                       " of accelerator, found 4711");
}

TEST_F(RegistryTest, RefusesAPromiseThatIsNotKept) {
    place("wrong_interface");
    expect_refused("wrong_interface", "plugin-abi", "does not provide accelerator");
}

TEST_F(RegistryTest, LeavesOutBrokenManifestsAndKeepsTheOthers) {
    place("brute_force");
    fs::create_directories(folder_ / "bad");
    write("bad/plugin.txt", "name: bad\nabi: one\n");
    const Registry registry({{folder_.string()}}, diagnostics_);
    ASSERT_EQ(registry.manifests().size(), 1u);
    EXPECT_EQ(registry.manifests()[0].name, "brute_force");
    EXPECT_NE(errors().find("bad/plugin.txt:2:6: error: "), std::string::npos) << errors();
}

TEST_F(RegistryTest, TakesTheFirstOfOneName) {
    const Registry registry(
        {{(folder_ / "b").string(), true}, {VELATURA_TEST_PLUGINS}, {VELATURA_TEST_PLUGINS}},
        diagnostics_);
    // There may be more plugins among those of the tests
    EXPECT_EQ(std::count_if(registry.manifests().begin(), registry.manifests().end(),
                            [](const Manifest& m) { return m.name == "brute_force"; }),
              1);
    EXPECT_EQ(diagnostics_.error_count(), 0u);
    EXPECT_NE(errors().find("/b is not a folder"), std::string::npos) << errors();
    EXPECT_NE(errors().find("plugin brute_force is loaded from "), std::string::npos) << errors();
}

TEST(OpenNeeded, SaysWhatIsMissingAndWhere) {
    ::setenv("VELATURA_PLUGIN_PATH", "/nowhere/plugins", 1);
    const Result<const void*> none = open_needed({"subdivider", 1, {"asset", "clay"}, "potter"});
    ::unsetenv("VELATURA_PLUGIN_PATH");
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, "plugin-missing");
    const std::string& said = none.error().message;
    EXPECT_TRUE(said.starts_with(
        "plugin potter is missing: no plugin provides subdivider in /nowhere/plugins, "))
        << said;
    EXPECT_NE(said.find(VELATURA_BUILT_PLUGINS), std::string::npos) << said;
    EXPECT_NE(said.find("/nowhere/plugins is not a folder"), std::string::npos) << said;
    // Who asked may have gone on without it: the program reports it at its end
    const std::vector<Error> reasons = unavailable_plugins();
    EXPECT_EQ(std::count_if(reasons.begin(), reasons.end(),
                            [&](const Error& why) { return why.message == said; }),
              1);
}

TEST(OpenNeeded, OpensWhatIsThereInTheVersionThatIsNeeded) {
    ::setenv("VELATURA_PLUGIN_PATH", VELATURA_TEST_PLUGINS, 1);
    const uint32_t version = accel::accelerator_interface_version;
    const Trigger trigger = {"option", "accel=brute_force"};
    const Result<const void*> found = open_needed({"accelerator", version, trigger, "any"});
    const Result<const void*> newer = open_needed({"accelerator", version + 1, trigger, "any"});
    ::unsetenv("VELATURA_PLUGIN_PATH");
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_NE(*found, nullptr);
    ASSERT_FALSE(newer);
    EXPECT_EQ(newer.error().code, "plugin-abi");
    EXPECT_NE(newer.error().message.find("plugin brute_force: expected version "),
              std::string::npos)
        << newer.error().message;
}

TEST(PluginFolders, AreThoseOfTheEnvironmentAndOfTheProgram) {
    const char* before = std::getenv("VELATURA_PLUGIN_PATH");
    const std::string saved = before ? before : "";
    ::setenv("VELATURA_PLUGIN_PATH", "one::two:", 1);
    const std::vector<PluginFolder> folders = plugin_folders();
    if (before) {
        ::setenv("VELATURA_PLUGIN_PATH", saved.c_str(), 1);
    } else {
        ::unsetenv("VELATURA_PLUGIN_PATH");
    }
    ASSERT_EQ(folders.size(), 5u);
    EXPECT_EQ(folders[0].path, "one");
    EXPECT_TRUE(folders[0].is_required);
    EXPECT_EQ(folders[1].path, "two");
    // This program lies in tests/ of the build, whose plugins are beside that
    EXPECT_EQ(folders[2].path, VELATURA_BUILT_PLUGINS);
    EXPECT_FALSE(folders[2].is_required);
    EXPECT_TRUE(folders[3].path.ends_with("/lib/velatura/plugins"));
    // That of the configured prefix
    EXPECT_TRUE(folders[4].path.ends_with("/lib/velatura/plugins"));
    EXPECT_NE(folders[4].path, folders[3].path);
}

}  // namespace
}  // namespace velatura::plugin
