// SPDX-License-Identifier: Apache-2.0
// Layers in packages, search paths and parallel reading, as composition sees them.
#include "base/asset_roots.h"
#include "base/tasks.h"
#include "package_files.h"
#include "usd/compose/layer_registry.h"

#include <fmt/format.h>

namespace velatura::usd::compose {
namespace {

using velatura::testing::stored_zip;

class RegistryTest : public velatura::testing::PackageFiles {
  protected:
    Diagnostics diagnostics_;
};

TEST_F(RegistryTest, APackageAndItsRootLayerAreOneLayer) {
    const std::string file =
        write("p.usdz", stored_zip({{"sub/root.usd", "#usda 1.0\ndef \"A\" {}\n"},
                                    {"sub/other.usda", "#usda 1.0\ndef \"B\" {}\n"}}));
    LayerRegistry registry({}, 100, diagnostics_);
    const auto layer = registry.open(file);
    ASSERT_TRUE(layer.has_value());
    EXPECT_EQ((*layer)->identifier(), file + "[sub/root.usd]");
    EXPECT_EQ(*registry.open(file + "[sub/root.usd]"), *layer);
    EXPECT_EQ(registry.resolve("./other.usda", (*layer)->identifier()), file + "[sub/other.usda]");
    EXPECT_TRUE(registry.open(file + "[sub/other.usda]").has_value());
    EXPECT_EQ(registry.opened().size(), 2u);
    EXPECT_EQ(registry.open(file + "[none.usda]").error().code, "file-not-found");
}

TEST_F(RegistryTest, ErrorsInAPackagedLayerNameItsPlace) {
    const std::string file = write("p.usdz", stored_zip({{"r.usda", "#usda 1.0\n\nnonsense\n"}}));
    LayerRegistry registry({}, 100, diagnostics_);
    EXPECT_FALSE(registry.open(file).has_value());
    ASSERT_EQ(diagnostics_.all().size(), 1u);
    EXPECT_EQ(diagnostics_.format(diagnostics_.all()[0]).find(file + "[r.usda]:3:1: error:"), 0u);
}

TEST_F(RegistryTest, PathsAreLookedForBesideThePackageWhenItHasNoSuchFile) {
    const std::string file = write("d/p.usdz", stored_zip({{"sub/root.usda", "#usda 1.0"}}));
    const std::string layer = file + "[sub/root.usda]";
    write("d/tex/a.png", "");
    write("lib/tex/b.png", "");
    LayerRegistry registry({path("nowhere"), path("lib")}, 100, diagnostics_);
    EXPECT_EQ(registry.resolve("tex/a.png", layer), path("d/tex/a.png"));
    EXPECT_EQ(registry.resolve("tex/b.png", layer), path("lib/tex/b.png"));
    EXPECT_EQ(registry.resolve("./tex/a.png", layer), file + "[sub/tex/a.png]");
    EXPECT_EQ(registry.resolve("/abs/../a.png", layer), file + "[/a.png]");
}

TEST_F(RegistryTest, PathsIntoPackagesAreAnchoredByThePackage) {
    write("lib/p.usdz", stored_zip({{"a.usda", "#usda 1.0"}}));
    LayerRegistry registry({path("lib")}, 100, diagnostics_);
    EXPECT_EQ(registry.resolve("p.usdz[x/../a.usda]", path("d/root.usda")),
              path("lib/p.usdz[a.usda]"));
    EXPECT_EQ(registry.resolve("./p.usdz[a.usda]", path("d/root.usda")), path("d/p.usdz[a.usda]"));
}

TEST_F(RegistryTest, UdimPatternsExistWhereATileDoes) {
    write("lib/t.1007.png", "");
    const std::string file =
        write("p.usdz", stored_zip({{"root.usda", "#usda 1.0"}, {"t/u.1100.png", ""}}));
    LayerRegistry registry({path("lib")}, 100, diagnostics_);
    EXPECT_EQ(registry.resolve("t.<UDIM>.png", path("d/root.usda")), path("lib/t.<UDIM>.png"));
    EXPECT_EQ(registry.resolve("t/u.<UDIM>.png", file + "[root.usda]"), file + "[t/u.<UDIM>.png]");
    EXPECT_TRUE(LayerRegistry::exists(file + "[t/u.<UDIM>.png]"));
    EXPECT_FALSE(LayerRegistry::exists(file + "[t/v.<UDIM>.png]"));
}

TEST_F(RegistryTest, WhatIsNoFileStaysAsItIsAndDoesNotOpen) {
    write("in/a.usda", "#usda 1.0");
    write("out.usda", "#usda 1.0");
    LayerRegistry registry({}, 100, diagnostics_);
    for (const char* name : {"http://host/a.usda", "//host/a.usda", "\\\\host\\a.usda"}) {
        EXPECT_EQ(registry.resolve(name, path("in/root.usda")), name);
        EXPECT_EQ(registry.open(name).error().code, "asset-name");
    }
    EXPECT_EQ(registry.open("").error().code, "file-not-found");
    set_asset_roots(AssetRoots::beneath({path("in")}));
    EXPECT_TRUE(registry.open(registry.resolve("a.usda", path("in/root.usda"))).has_value());
    const std::string outside = registry.resolve("../out.usda", path("in/root.usda"));
    EXPECT_EQ(outside, path("out.usda"));
    EXPECT_EQ(registry.open(outside).error().code, "asset-outside-roots");
    set_asset_roots({});
}

TEST_F(RegistryTest, SearchPathsAreApartByColons) {
    EXPECT_EQ(split_search_path(":/a::b:"), (std::vector<std::string>{"/a", "b"}));
    EXPECT_TRUE(split_search_path("").empty());
}

TEST_F(RegistryTest, PrefetchChangesNothingButTheSpeed) {
    std::vector<std::string> files;
    for (int i = 0; i < 40; ++i) {
        const char* const content =
            i % 3 == 0 ? "#usda 1.0\nbroken\nbroken again\n" : "#usda 1.0\n";
        files.push_back(write(fmt::format("{}.usda", i), content));
    }
    files.push_back(path("none.usda"));
    const auto report = [&](bool is_parallel) {
        Diagnostics diagnostics;
        LayerRegistry registry({}, 30, diagnostics);
        if (is_parallel) registry.prefetch(files);
        EXPECT_TRUE(diagnostics.all().empty());
        std::string text;
        for (auto file = files.rbegin(); file != files.rend(); ++file) {
            const auto layer = registry.open(*file);
            text += layer ? (*layer)->identifier() : layer.error().code + layer.error().message;
            text += '\n';
        }
        for (const std::string& name : registry.opened()) text += name + '\n';
        for (const Diagnostic& d : diagnostics.all()) text += diagnostics.format(d) + '\n';
        return text;
    };
    const std::string serial = report(false);
    for (int i = 0; i < 5; ++i) EXPECT_EQ(report(true), serial);
}

TEST_F(RegistryTest, ManyThreadsGetTheSameLayer) {
    const std::string file = write("a.usda", "#usda 1.0\nbroken\n");
    const std::string good = write("b.usda", "#usda 1.0\n");
    LayerRegistry registry({}, 100, diagnostics_);
    std::vector<LayerPtr> layers(64);
    parallel_for(layers.size(), [&](size_t i) {
        EXPECT_FALSE(registry.open(file).has_value());
        layers[i] = *registry.open(good);
    });
    for (const LayerPtr& layer : layers) EXPECT_EQ(layer, layers[0]);
    EXPECT_EQ(diagnostics_.error_count(), 1u);
    EXPECT_EQ(registry.opened().size(), 1u);
}

}  // namespace
}  // namespace velatura::usd::compose
