// SPDX-License-Identifier: Apache-2.0
#include "import/layer_author.h"
#include "usd/layer/fields.h"

#include <gtest/gtest.h>

namespace velatura::import {

TEST(ValidName, KeepsWhatUsdAllows) {
    EXPECT_EQ(valid_name("Lamp_01", "x"), "Lamp_01");
    EXPECT_EQ(valid_name("Säule", "x"), "Säule");
}

TEST(ValidName, ReplacesWhatUsdDoesNotAllow) {
    EXPECT_EQ(valid_name("my lamp.001", "x"), "my_lamp_001");
    EXPECT_EQ(valid_name("3d", "x"), "_3d");
    EXPECT_EQ(valid_name("", "Mesh"), "Mesh");
    EXPECT_EQ(valid_name("***", "Mesh"), "Mesh");
    EXPECT_EQ(valid_name("a\xff\xfe"
                         "b",
                         "x"),
              "a__b");
}

TEST(LayerAuthor, SiblingsGetDifferentNames) {
    usd::layer::Layer layer("test.usda");
    LayerAuthor author(layer);
    const Path root = author.define(Path::absolute_root(), "Root", "Xform");
    EXPECT_EQ(author.define(root, "a", "Xform").to_string(), "/Root/a");
    EXPECT_EQ(author.define(root, "a", "Xform").to_string(), "/Root/a_1");
    EXPECT_EQ(author.define(root, "a", "Xform").to_string(), "/Root/a_2");
    EXPECT_EQ(author.define(root, "a_3", "Xform").to_string(), "/Root/a_3");
    EXPECT_EQ(author.define(root, "a", "Xform").to_string(), "/Root/a_4");
    const auto* name =
        layer.field_as<std::string>(Path::from("/Root/a_2"), usd::layer::Token("displayName"));
    ASSERT_TRUE(name != nullptr);
    EXPECT_EQ(*name, "a");
}

}  // namespace velatura::import
