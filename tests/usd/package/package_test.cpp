// SPDX-License-Identifier: Apache-2.0
#include "usd/package/package.h"

#include "package_files.h"

namespace velatura::usd::package {
namespace {

using velatura::testing::stored_zip;

class PackageTest : public velatura::testing::PackageFiles {
  protected:
    Result<RootLayer> root_of(const std::string& zip) {
        return open_root_layer(make_asset_bytes(zip), "x.usdz", diagnostics_);
    }

    Diagnostics diagnostics_;
};

TEST_F(PackageTest, TheFirstFileIsTheRootLayerWhateverItsName) {
    const auto root = root_of(stored_zip({{"sub/b.dat", "#usda 1.0"}, {"a.usda", "#usda 1.0 x"}}));
    ASSERT_TRUE(root.has_value());
    EXPECT_EQ(root->name, "x.usdz[sub/b.dat]");
    EXPECT_EQ(root->bytes->bytes(), "#usda 1.0");
    EXPECT_TRUE(diagnostics_.all().empty());
}

TEST_F(PackageTest, APackageMayBeginWithAPackage) {
    const std::string inner = stored_zip({{"c.usda", "#usda 1.0"}}, 1);
    const auto root = root_of(stored_zip({{"b.usdz", inner}}));
    ASSERT_TRUE(root.has_value());
    EXPECT_EQ(root->name, "x.usdz[b.usdz[c.usda]]");
    // Data that is not aligned is noted, once per package
    ASSERT_EQ(diagnostics_.all().size(), 1u);
    EXPECT_EQ(diagnostics_.all()[0].code, "usd-package-alignment");
    EXPECT_EQ(diagnostics_.all()[0].severity, Severity::Note);
}

TEST_F(PackageTest, PackagesWithoutLayerAreRefused) {
    EXPECT_EQ(root_of("PK\x03\x04").error().code, "zip-malformed");
    // Without any file, an archive is but its end record
    EXPECT_EQ(root_of(stored_zip({{"dir/", ""}})).error().code, "usd-empty-package");
    EXPECT_EQ(root_of(stored_zip({{"a.usda", "#usda 1.0", 8, 0}})).error().code, "zip-unsupported");
    std::string deep = stored_zip({{"a.usda", "#usda 1.0"}});
    for (int i = 0; i < 40; ++i) deep = stored_zip({{"p", deep}});
    EXPECT_EQ(root_of(deep).error().code, "package-depth");
}

TEST_F(PackageTest, AnchoredPathsStayInThePackage) {
    const auto anchored = [](std::string_view asset, const std::string& layer) {
        return anchor_in_package(asset, layer).value_or("outside");
    };
    EXPECT_EQ(anchored("./tex.png", "p.usdz[sub/root.usda]"), "p.usdz[sub/tex.png]");
    EXPECT_EQ(anchored("../tex.png", "p.usdz[sub/root.usda]"), "p.usdz[tex.png]");
    EXPECT_EQ(anchored("../../tex.png", "p.usdz[sub/root.usda]"), "p.usdz[../tex.png]");
    EXPECT_EQ(anchored("./b.usdz[c.usda]", "p.usdz[sub/root.usda]"), "p.usdz[sub/b.usdz[c.usda]]");
    EXPECT_EQ(anchored("./c.usda", "p.usdz[b.usdz[x/d.usda]]"), "p.usdz[b.usdz[x/c.usda]]");
    EXPECT_EQ(anchored("./a[1].png", "p.usdz[root.usda]"), "p.usdz[a\\[1\\].png]");
    EXPECT_EQ(anchored("/tex.png", "p.usdz[sub/root.usda]"), "p.usdz[/tex.png]");
    EXPECT_EQ(anchored("a/../../tex.png", "p.usdz[root.usda]"), "p.usdz[../tex.png]");
    EXPECT_EQ(anchored("./tex.png", "sub/root.usda"), "outside");
}

TEST_F(PackageTest, SearchPathsLookBesideTheLayerThenBesideTheRootLayer) {
    const std::string file = write("p.usdz", stored_zip({{"top/root.usda", "#usda 1.0"},
                                                         {"top/a.png", ""},
                                                         {"top/b.png", ""},
                                                         {"sub/layer.usda", "#usda 1.0"},
                                                         {"sub/a.png", ""}}));
    const std::string layer = file + "[sub/layer.usda]";
    EXPECT_EQ(anchor_in_package("a.png", layer), file + "[sub/a.png]");
    EXPECT_EQ(anchor_in_package("b.png", layer), file + "[top/b.png]");
    EXPECT_EQ(anchor_in_package("c.png", layer), std::nullopt);
}

}  // namespace
}  // namespace velatura::usd::package
