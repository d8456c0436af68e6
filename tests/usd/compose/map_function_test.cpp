// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/map_function.h"

#include <gtest/gtest.h>

namespace velatura::usd::compose {
namespace {

layer::Path p(const char* text) {
    return layer::Path::from(text);
}

TEST(MapFunction, MapsSubtreesAndNothingElse) {
    const MapFunction map({{p("/Model"), p("/World/Car")}}, {});
    EXPECT_EQ(map.to_target(p("/Model/Geo.points")), p("/World/Car/Geo.points"));
    EXPECT_EQ(map.to_source(p("/World/Car")), p("/Model"));
    EXPECT_TRUE(map.to_target(p("/Other")).is_empty());
    EXPECT_TRUE(map.to_source(p("/World")).is_empty());
}

TEST(MapFunction, RootIdentityKeepsTheMapOneToOne) {
    const MapFunction map = MapFunction({{p("/Class"), p("/A")}}, {}).with_root_identity();
    EXPECT_EQ(map.to_target(p("/Other/B")), p("/Other/B"));
    EXPECT_EQ(map.to_target(p("/Class/B")), p("/A/B"));
    // </A> of the source has no image: </A> of the target belongs to </Class>
    EXPECT_TRUE(map.to_target(p("/A")).is_empty());
}

TEST(MapFunction, CompositionEqualsMappingTwice) {
    const MapFunction inner = MapFunction({{p("/C"), p("/M")}}, {1.0, 2.0}).with_root_identity();
    const MapFunction outer({{p("/M"), p("/W/M1")}}, {10.0, 3.0});
    const MapFunction both = outer.after(inner);
    for (const char* text : {"/C", "/C/x", "/C/x.y", "/M", "/D"}) {
        EXPECT_EQ(both.to_target(p(text)), outer.to_target(inner.to_target(p(text)))) << text;
    }
    EXPECT_DOUBLE_EQ(both.time_offset().apply(5.0), 10.0 + 3.0 * (1.0 + 2.0 * 5.0));
    EXPECT_EQ(both.inverse().to_target(p("/W/M1/x")), p("/C/x"));
}

TEST(MapFunction, IdentityIsNeutral) {
    const MapFunction map({{p("/M"), p("/A")}}, {1.0, 2.0});
    EXPECT_EQ(map.after(MapFunction::identity()), map);
    EXPECT_EQ(MapFunction::identity().after(map), map);
}

}  // namespace
}  // namespace velatura::usd::compose
