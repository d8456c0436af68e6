// SPDX-License-Identifier: Apache-2.0
#include "accumulate/names.h"

#include "accumulate/layer_set.h"

#include <gtest/gtest.h>

namespace velatura::image {
namespace {

TEST(GroupNames, BecomeLegalUniqueAndShort) {
    accumulate::LayerSet set;
    for (const char* name :
         {"key", "key", "Key Light/left", "12", "", "env", "b1", "tail", "Höhe",
          "a_very_long_light_name_indeed_1", "a_very_long_light_name_indeed_2"}) {
        set.groups.push_back({name, {}, false});
    }
    set.normalize_names();
    std::set<std::string> seen;
    for (const accumulate::LightGroup& g : set.groups) {
        EXPECT_TRUE(seen.insert(g.name).second) << g.name;
        EXPECT_LE(g.name.size(), accumulate::max_group_name_bytes);
        EXPECT_TRUE(accumulate::is_legal_channel_name("tail_" + g.name + "_hA.R")) << g.name;
    }
    EXPECT_EQ(set.groups[0].name, "key");
    EXPECT_EQ(set.groups[1].name, "key_2");
    EXPECT_EQ(set.groups[2].name, "Key_Light_left");
    EXPECT_EQ(set.groups[3].name, "light12");
    EXPECT_EQ(set.groups[5].name, "env_light");
    EXPECT_EQ(set.groups[6].name, "b1_light");
}

TEST(GroupNames, StayAsTheyAreWhenNormalizedAgain) {
    accumulate::LayerSet set;
    for (const char* name : {"key", "key", "env", "a_very_long_light_name_indeed"})
        set.groups.push_back({name, {}, false});
    set.normalize_names();
    accumulate::LayerSet again = set;
    again.normalize_names();
    EXPECT_EQ(again, set);
}

TEST(ChannelNames, AreJudgedByTheContract) {
    for (const char* good : {"R", "b0.R", "C_key.G", "tail_x_hA.B", "Z", "st.U"})
        EXPECT_TRUE(accumulate::is_legal_channel_name(good));
    for (const char* bad :
         {"", "12.R", "a.b.R", "b0.", ".R", "b 0.R", "a_name_of_more_than_31_bytes_all.R"}) {
        EXPECT_FALSE(accumulate::is_legal_channel_name(bad)) << bad;
    }
}

TEST(LayerSet, SurvivesJson) {
    accumulate::LayerSet set;
    set.last_bounce = 7;
    set.matrix_layers = set.halves = true;
    set.groups.push_back({"key", {"/World/Key"}, false});
    set.groups.push_back({"sky", {"/World/Sky"}, true});
    const auto back = accumulate::LayerSet::from_json(set.to_json());
    ASSERT_TRUE(back.has_value());
    EXPECT_EQ(*back, set);
    EXPECT_FALSE(accumulate::LayerSet::from_json("{}").has_value());
    EXPECT_FALSE(accumulate::LayerSet::from_json("[").has_value());
}

TEST(AccumulatorTable, GivesEveryCellItsOwnNumber) {
    accumulate::LayerSet set;
    set.last_bounce = 2;
    set.matrix_layers = set.shadow_layers = set.halves = true;
    set.groups = {{"a", {}, false}, {"b", {}, false}, {"c", {}, false}};
    const accumulate::AccumulatorTable t(set);
    std::set<uint32_t> seen = {accumulate::AccumulatorTable::beauty,
                               accumulate::AccumulatorTable::coverage,
                               t.albedo(),
                               t.normal(),
                               t.position(),
                               t.surface(),
                               t.hits()};
    EXPECT_EQ(seen.size(), 7u);
    for (int c = 0; c < 4; ++c) {
        for (int g = 0; g < 3; ++g) EXPECT_TRUE(seen.insert(t.matrix(c, g)).second);
    }
    for (int g = 0; g < 3; ++g) EXPECT_TRUE(seen.insert(t.unoccluded(g)).second);
    EXPECT_EQ(seen.size(), t.count());
    EXPECT_EQ(*seen.rbegin() + 1, t.count());
    EXPECT_EQ(t.bounce(0), accumulate::AccumulatorTable::absent);
    EXPECT_EQ(t.half_of(5), t.count() + 5);
}

}  // namespace
}  // namespace velatura::image
