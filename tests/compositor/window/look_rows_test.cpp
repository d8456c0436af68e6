// SPDX-License-Identifier: Apache-2.0
#include "compositor/look/look_rows.h"

#include "window_stack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace velatura::compositor::window {
namespace {

using Kind = Control::Kind;

Look look_of(std::initializer_list<std::pair<Kind, const char*>> controls) {
    Look look;
    for (const auto& [kind, text] : controls) look.controls.push_back(*parse_control(kind, text));
    return look;
}

TEST(MixerRows, AreWhatTheFileStores) {
    const MixerRows rows = mixer_rows(small_levels()->stack(0));
    EXPECT_EQ(rows.lights,
              (std::vector<std::string>{"all", "env", "key", "fill", "sky", "emissive", "off"}));
    EXPECT_EQ(rows.bounces,
              (std::vector<std::string>{"direct", "indirect", "b0", "b1", "b2", "tail"}));
    EXPECT_EQ(rows.columns, (std::vector<std::string>{"b0", "b1", "b2", "tail"}));
    // A light that never shines casts no shadow
    EXPECT_EQ(rows.shadows, (std::vector<std::string>{"key", "fill", "sky", "emissive"}));
    EXPECT_TRUE(rows.has_place(Kind::Gain, "key"));
    EXPECT_TRUE(rows.has_place(Kind::Gain, "indirect"));
    EXPECT_TRUE(rows.has_place(Kind::Gain, "sky:b1"));
    EXPECT_FALSE(rows.has_place(Kind::Gain, "moon"));
    EXPECT_FALSE(rows.has_place(Kind::Gain, "moon:b1"));
}

TEST(LookRows, ShowWhatWasSet) {
    Look look;
    EXPECT_EQ(row_state(look, "key"), RowState());
    set_stops(look, "key", 1.254f);
    set_muted(look, "key", true);
    set_soloed(look, "key", true);
    set_tint(look, "key", {1, 0.5f, 0.25f});
    set_kelvin(look, "key", 3204.0f);
    const RowState row = row_state(look, "key");
    EXPECT_FLOAT_EQ(row.stops, 1.25f);
    EXPECT_TRUE(row.is_muted);
    EXPECT_TRUE(row.is_soloed);
    EXPECT_EQ(row.tint, (std::array<float, 3>{1, 0.5f, 0.25f}));
    EXPECT_EQ(row.kelvin, 3200.0f);
    EXPECT_EQ(row_state(look, "fill"), RowState());
    reset_row(look, "key");
    EXPECT_TRUE(look.controls.empty());
}

TEST(LookRows, MeanTheSameAsThePresetTheyAreSavedAs) {
    Look look;
    for (int i = -600; i <= 600; i += 37) set_stops(look, "g" + std::to_string(i), float(i) / 100);
    set_tint(look, "key", {0.3333f, 0.1f, 2});
    set_kelvin(look, "key", 4567.0f);
    set_share(look, Kind::Shadow, "key", 0.333f);
    const auto loaded = look_from_json(look_to_json(look));
    ASSERT_TRUE(loaded.has_value());
    ASSERT_EQ(loaded->controls.size(), look.controls.size());
    for (size_t i = 0; i < look.controls.size(); ++i)
        EXPECT_EQ(loaded->controls[i].factor, look.controls[i].factor);
}

TEST(LookRows, NeutralValuesLeaveNoControl) {
    Look look;
    set_stops(look, "key", 1);
    set_stops(look, "key", 0.004f);
    set_tint(look, "key", {1, 1, 1});
    set_kelvin(look, "key", std::nullopt);
    set_share(look, Kind::Shadow, "key", 0.5f);
    set_share(look, Kind::Shadow, "key", 0);
    EXPECT_TRUE(look.controls.empty());
}

TEST(LookRows, ValuesOutOfRangeAreHeldWithinIt) {
    Look look;
    set_kelvin(look, "key", 100.0f);
    EXPECT_EQ(row_state(look, "key").kelvin, 1667.0f);
    set_share(look, Kind::Shadow, "key", 7);
    EXPECT_EQ(share_given(look, Kind::Shadow, "key"), 1);
    set_tint(look, "key", {-1, 0, 1});
    EXPECT_EQ(row_state(look, "key").tint, (std::array<float, 3>{0, 0, 1}));
}

TEST(LookRows, AGainOfZeroIsMinusInfinity) {
    const Look look = look_of({{Kind::Gain, "key=0"}});
    EXPECT_EQ(row_state(look, "key").stops, -std::numeric_limits<float>::infinity());
}

TEST(LookRows, EditsStayInTheirPlace) {
    Look look = look_of({{Kind::Gain, "key=1.7"},
                         {Kind::Gain, "fill=2"},
                         {Kind::Gain, "key=3"},
                         {Kind::Mute, "moon"}});
    set_stops(look, "fill", -1);
    ASSERT_EQ(look.controls.size(), 4u);
    // What was not touched is as it was typed
    EXPECT_EQ(look.controls[0].value, "1.7");
    EXPECT_EQ(look.controls[1].value, "-1.00st");
    EXPECT_EQ(look.controls[2].value, "3");
}

TEST(LookRows, NumbersThatAreNotFiniteChangeNothing) {
    Look look;
    set_tint(look, "key", {1, 0.5f, 0.25f});
    const Look before = look;
    for (const float bad :
         {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
          std::numeric_limits<float>::quiet_NaN()}) {
        set_tint(look, "key", {1, bad, 1});
        set_stops(look, "key", bad);
        set_kelvin(look, "key", bad);
        set_share(look, Kind::Shadow, "key", bad);
        EXPECT_TRUE(same_look(look, before)) << bad;
    }
    // The largest numbers that a control takes are the largest that a row gives it
    set_tint(look, "key", {std::numeric_limits<float>::max(), 1, -1});
    EXPECT_EQ(row_state(look, "key").tint, (std::array<float, 3>{largest_factor, 1, 0}));
    for (const float sign : {1.0f, -1.0f}) {
        set_stops(look, "key", sign * std::numeric_limits<float>::max());
        EXPECT_EQ(row_state(look, "key").stops, sign * largest_stops);
    }
}

TEST(LookRows, WhatHasNoRowIsListed) {
    const MixerRows rows = mixer_rows(small_levels()->stack(0));
    const Look look = look_of({{Kind::Gain, "key=1.7"},
                               {Kind::Gain, "key=3"},
                               {Kind::Mute, "moon"},
                               {Kind::Gain, "sky:b1=2"},
                               {Kind::Shadow, "key=0.3"},
                               {Kind::Shadow, "all=0.1"},
                               {Kind::Gain, "shadow=0.5"}});
    EXPECT_EQ(advanced_controls(look, rows), (std::vector<size_t>{1, 2, 5, 6}));
    EXPECT_EQ(control_text(look.controls[3]), "gain sky:b1 2");
}

TEST(LookRows, ControlsWithMattesOrKeysAreNoRows) {
    Look look = look_of({{Kind::Gain, "key=2"}, {Kind::Gain, "fill=1@1,2@24"}});
    look.controls[0].matte = "object:vase";
    EXPECT_EQ(row_state(look, "key"), RowState());
    EXPECT_EQ(row_state(look, "fill"), RowState());
    EXPECT_EQ(advanced_controls(look, mixer_rows(small_levels()->stack(0))).size(), 2u);
    EXPECT_EQ(control_text(look.controls[0]), "gain key 2 within object:vase");
    set_stops(look, "key", -1);
    ASSERT_EQ(look.controls.size(), 3u);
    EXPECT_EQ(look.controls[0].value, "2");
    reset_row(look, "fill");
    EXPECT_EQ(look.controls.size(), 3u);
}

TEST(LookRows, SharesAreKeptByKind) {
    Look look;
    set_share(look, Kind::Caster, "key:vase", 0.25f);
    set_share(look, Kind::Clamp, "all", 1);
    EXPECT_EQ(share_given(look, Kind::Caster, "key:vase"), 0.25f);
    EXPECT_EQ(share_given(look, Kind::Clamp, "all"), 1);
    EXPECT_EQ(share_given(look, Kind::Shadow, "all"), 0);
    const auto loaded = look_from_json(look_to_json(look));
    ASSERT_TRUE(loaded.has_value());
    EXPECT_TRUE(same_look(*loaded, look));
}

TEST(LookRows, SoloAloneTogglesOneSolo) {
    Look look = look_of({{Kind::Solo, "fill"}, {Kind::Gain, "key=2"}});
    toggle_only_solo(look, "key");
    EXPECT_TRUE(row_state(look, "key").is_soloed);
    EXPECT_FALSE(row_state(look, "fill").is_soloed);
    toggle_only_solo(look, "key");
    EXPECT_FALSE(row_state(look, "key").is_soloed);
    EXPECT_EQ(look.controls.size(), 1u);
}

TEST(LookRows, ABoxTakesStopsOrAMultiplier) {
    const std::pair<const char*, float> good[] = {
        {"1.5", 1.5f},      {"+1.5", 1.5f}, {"-2", -2}, {"1.5 st", 1.5f},
        {"+0.25st", 0.25f}, {"2x", 1},      {"x4", 2},  {"×0.5", -1},
        {"0.5×", -1},       {" 8 x ", 3},   {"1x", 0},  {".5", 0.5f},
    };
    for (const auto& [text, stops] : good) {
        const auto value = stops_of_text(text);
        ASSERT_TRUE(value.has_value()) << text;
        EXPECT_FLOAT_EQ(*value, stops) << text;
    }
    for (const char* text : {"", "x", "st", "two", "2xx2", "-1x", "1,5", "nan", "inf", "2 stx"})
        EXPECT_FALSE(stops_of_text(text).has_value()) << text;
    EXPECT_EQ(stops_of_text("0x"), -std::numeric_limits<float>::infinity());
}

}  // namespace
}  // namespace velatura::compositor::window
