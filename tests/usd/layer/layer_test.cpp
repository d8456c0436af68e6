// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/layer.h"

#include "usd/layer/fields.h"

#include <gtest/gtest.h>

namespace velatura::usd::layer {
namespace {

TEST(Layer, ListsChildrenInAuthoredOrder) {
    Layer layer("a.usda");
    layer.create_spec(Path::from("/B"), SpecKind::Prim, {});
    layer.create_spec(Path::from("/A"), SpecKind::Prim, {});
    layer.create_spec(Path::from("/B.x"), SpecKind::Attribute, {});
    layer.create_spec(Path::from("/B{v=}"), SpecKind::VariantSet, {});
    layer.create_spec(Path::from("/B{v=one}"), SpecKind::Variant, {});
    layer.create_spec(Path::from("/B{v=one}C"), SpecKind::Prim, {});
    ASSERT_EQ(layer.pseudo_root().prim_children().size(), 2u);
    EXPECT_EQ(layer.pseudo_root().prim_children()[0].str(), "B");
    EXPECT_EQ(layer.spec(Path::from("/B"))->variant_sets()[0].str(), "v");
    EXPECT_EQ(layer.spec(Path::from("/B{v=}"))->variants()[0].str(), "one");
    EXPECT_EQ(layer.spec(Path::from("/B{v=one}"))->prim_children()[0].str(), "C");
    std::string order;
    layer.for_each_spec(Path::absolute_root(),
                        [&](Path p, const Spec&) { order += p.to_string() + ' '; });
    EXPECT_EQ(order, "/ /B /B.x /B{v=} /B{v=one} /B{v=one}C /A ");
    EXPECT_EQ(layer.spec_count(), 7u);
}

TEST(Layer, KeepsTheSpecThatIsThere) {
    Layer layer("a.usda");
    const Path path = Path::from("/A");
    layer.create_spec(path, SpecKind::Prim, {}).set_field(fields().kind, Value(Token("model")), {});
    EXPECT_TRUE(layer.create_spec(path, SpecKind::Prim, {}).has_field(fields().kind));
    EXPECT_EQ(layer.pseudo_root().prim_children().size(), 1u);
}

TEST(Spec, SortsFieldsAndKeepsPlaces) {
    Spec spec(SpecKind::Prim, SourceLoc{1, 2, 3});
    spec.set_field(Token("b"), Value(1), SourceLoc{1, 5, 6});
    spec.set_field(Token("a"), Value(2), {});
    spec.set_field(Token("b"), Value(3), SourceLoc{1, 7, 8});
    ASSERT_EQ(spec.fields().size(), 2u);
    EXPECT_EQ(spec.fields()[0].name.str(), "a");
    EXPECT_EQ(spec.field(Token("b"))->get_or(0), 3);
    EXPECT_EQ(spec.field_loc(Token("b")).line, 7u);
    EXPECT_EQ(spec.field_loc(Token("a")).line, 2u);
}

TEST(Layer, FallsBackForTimeCodesPerSecond) {
    Layer layer("a.usda");
    EXPECT_EQ(layer.time_codes_per_second(), 24.0);
    layer.pseudo_root().set_field(fields().frames_per_second, Value(30.0), {});
    EXPECT_EQ(layer.time_codes_per_second(), 30.0);
    layer.pseudo_root().set_field(fields().time_codes_per_second, Value(60.0), {});
    EXPECT_EQ(layer.time_codes_per_second(), 60.0);
    EXPECT_TRUE(layer.has_time_codes_per_second());
}

TEST(Layer, DefaultPrimIsANameOrAPath) {
    Layer layer("a.usda");
    EXPECT_TRUE(layer.default_prim().is_empty());
    layer.pseudo_root().set_field(fields().default_prim, Value(Token("World")), {});
    EXPECT_EQ(layer.default_prim().to_string(), "/World");
    layer.pseudo_root().set_field(fields().default_prim, Value(Token("/World/Cam")), {});
    EXPECT_EQ(layer.default_prim().to_string(), "/World/Cam");
    layer.pseudo_root().set_field(fields().default_prim, Value(Token("not a path")), {});
    EXPECT_TRUE(layer.default_prim().is_empty());
}

TEST(LayerOffset, ComposesAndInverts) {
    const LayerOffset outer{10.0, 2.0};
    const LayerOffset inner{3.0, 0.5};
    const LayerOffset both = outer.after(inner);
    for (const double t : {-1.0, 0.0, 4.0}) {
        EXPECT_DOUBLE_EQ(both.apply(t), outer.apply(inner.apply(t)));
        EXPECT_DOUBLE_EQ(both.inverse().apply(both.apply(t)), t);
    }
}

}  // namespace
}  // namespace velatura::usd::layer
