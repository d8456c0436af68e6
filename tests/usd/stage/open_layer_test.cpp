// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/open_layer.h"

#include "usd/layer/fields.h"
#include "usd/layer/layer_builder.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace velatura::usd::stage {
namespace {

using layer::LayerBuilder;
using layer::Path;
using layer::Specifier;
using layer::Token;
using layer::Value;

const Path ball = Path::from("/World/Ball");
const Path radius = Path::from("/World/Ball.radius");

LayerBuilder ball_builder() {
    LayerBuilder builder;
    EXPECT_TRUE(builder.define(ball, "Sphere"));
    EXPECT_TRUE(builder.set(radius, "double", Value(2.0)));
    return builder;
}

Stage opened(const LayerBuilder& builder, Diagnostics& diagnostics) {
    Result<Stage> stage = open_layer(builder.layer(), {}, diagnostics);
    EXPECT_TRUE(stage.has_value());
    EXPECT_TRUE(diagnostics.all().empty());
    return *stage;
}

/// The code of the error, "" where there is none.
std::string code_of(const Result<void>& result) {
    return result ? "" : result.error().code;
}

TEST(OpenLayer, ComposesALayerInMemory) {
    LayerBuilder builder = ball_builder();
    const Path proto = Path::from("/Class"), copy = Path::from("/World/Copy");
    EXPECT_TRUE(builder.define(proto, "Xform", Specifier::Class));
    EXPECT_TRUE(builder.define(proto.append_child("Box"), "Cube"));
    EXPECT_TRUE(builder.define(copy, "Xform"));
    EXPECT_TRUE(builder.set_reference(copy, proto));
    EXPECT_TRUE(builder.set_metadata(copy, "instanceable", Value(true)));
    EXPECT_TRUE(builder.set_metadata(Path::absolute_root(), "upAxis", Value(Token("Z"))));
    EXPECT_TRUE(builder.set_targets(Path::from("/World/Ball.material:binding"), {proto}));
    EXPECT_TRUE(builder.apply_schema(ball, "MaterialBindingAPI"));
    EXPECT_TRUE(builder.apply_schema(ball, "MaterialBindingAPI"));
    EXPECT_TRUE(builder.connect(Path::from("/World/Ball.x"), "float", {radius}));
    EXPECT_TRUE(builder.set_samples(Path::from("/World/Ball.y"), "float",
                                    {{2.0, Value(4.0f)}, {0.0, Value(2.0f)}}));
    Diagnostics diagnostics;
    const Stage stage = opened(builder, diagnostics);
    EXPECT_EQ(stage.root_file(), "memory.usda");
    EXPECT_EQ(stage.layer_files(), std::vector<std::string>{"memory.usda"});
    EXPECT_EQ(stage.up_axis(), "Z");
    const Prim prim = stage.prim_at(ball);
    EXPECT_EQ(prim.type_name(), "Sphere");
    EXPECT_EQ(prim.attribute("radius").get<double>(), 2.0);
    EXPECT_EQ(prim.relationship("material:binding").targets(), std::vector<Path>{proto});
    EXPECT_EQ(prim.applied_schemas(), std::vector<Token>{Token("MaterialBindingAPI")});
    EXPECT_EQ(prim.attribute("x").connections(), std::vector<Path>{radius});
    EXPECT_EQ(prim.attribute("y").get<float>(1.0), 3.0f);
    EXPECT_TRUE(stage.prim_at(copy).is_instance());
    EXPECT_EQ(stage.prim_at("/World/Copy/Box").type_name(), "Cube");
    EXPECT_TRUE(stage.prim_at("/World").is_defined());
}

// What is built later is not seen by a stage that is open
TEST(OpenLayer, KeepsWhatItWasOpenedWith) {
    LayerBuilder builder = ball_builder();
    Diagnostics diagnostics;
    const Stage before = opened(builder, diagnostics);
    EXPECT_TRUE(builder.set(radius, "double", Value(3.0)));
    EXPECT_TRUE(builder.define(ball, "Cube"));
    const Stage after = opened(builder, diagnostics);
    EXPECT_EQ(before.prim_at(ball).attribute("radius").get<double>(), 2.0);
    EXPECT_EQ(after.prim_at(ball).attribute("radius").get<double>(), 3.0);
    EXPECT_EQ(after.prim_at(ball).type_name(), "Cube");
    EXPECT_TRUE(builder.remove(Path::from("/World")));
    EXPECT_FALSE(builder.remove(ball));
    EXPECT_FALSE(builder.remove(Path::absolute_root()));
    const Stage empty = opened(builder, diagnostics);
    EXPECT_FALSE(empty.prim_at("/World").is_valid());
    EXPECT_EQ(before.prim_at(ball).type_name(), "Sphere");
    // Removed and defined again, it has nothing of what it was
    EXPECT_TRUE(builder.define(ball));
    const Stage last = opened(builder, diagnostics);
    const Prim again = last.prim_at(ball);
    EXPECT_EQ(again.type_name(), "");
    EXPECT_TRUE(again.property_names().empty());
}

TEST(LayerBuilder, RejectsWhatNoLayerHolds) {
    LayerBuilder builder = ball_builder();
    const Path root = Path::absolute_root();
    const std::vector<Result<void>> rejected = {
        builder.define(radius, "Sphere"),
        builder.define(root, "Sphere"),
        builder.define(Path::from("Relative"), "Sphere"),
        builder.define(Path::from("/A{v=b}C"), "Sphere"),
        builder.set(ball, "double", Value(1.0)),
        builder.set(Path::from("/None.x"), "double", Value(1.0)),
        builder.set(radius, "doubel", Value(1.0)),
        builder.set(radius, "double", Value(1.0f)),
        builder.set(radius, "double[]", Value(1.0)),
        builder.set(radius, "double", Value()),
        builder.set_samples(radius, "double", {{0.0, Value(1.0)}, {1.0, Value(1)}}),
        builder.connect(radius, "double", {ball}),
        builder.set_targets(radius, {ball}),
        builder.set_targets(Path::from("/World/Ball.r"), {Path::from("Relative")}),
        builder.apply_schema(Path::from("/None"), "MaterialBindingAPI"),
        builder.set_reference(ball, radius),
        builder.set_metadata(Path::from("/None"), "kind", Value(Token("model"))),
        builder.set_metadata(ball, "kind", Value()),
    };
    for (size_t i = 0; i < rejected.size(); ++i)
        EXPECT_EQ(code_of(rejected[i]), "usd-author") << "call " << i;
    EXPECT_EQ(builder.layer()->spec_count(), ball_builder().layer()->spec_count());
    Diagnostics diagnostics;
    EXPECT_EQ(opened(builder, diagnostics).prim_at(ball).attribute("radius").get<double>(), 2.0);
    // A block is a value of every type; the schema's fallback shows
    EXPECT_TRUE(builder.set(radius, "double", Value::block()));
    EXPECT_EQ(opened(builder, diagnostics).prim_at(ball).attribute("radius").get<double>(), 1.0);
}

}  // namespace
}  // namespace velatura::usd::stage
