// SPDX-License-Identifier: Apache-2.0
#include "compositor/look/controls.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

namespace velatura::compositor {
namespace {

TEST(Gain, IsAFactorOrStops) {
    const std::vector<std::pair<const char*, float>> good = {
        {"2", 2.0f}, {"0.5", 0.5f}, {"+1st", 2.0f}, {"-1st", 0.5f}, {"1.5st", std::exp2(1.5f)},
        {"0", 0.0f}, {"0st", 1.0f}};
    for (const auto& [text, value] : good) {
        const auto gain = parse_gain(text);
        ASSERT_TRUE(gain.has_value()) << text;
        EXPECT_EQ(*gain, value) << text;
    }
    for (const char* text : {"", "st", "-1", "two", "1.5stops", "nan", "inf", "1,5", "++1"}) {
        EXPECT_EQ(parse_gain(text).has_value(), false) << text;
    }
}

/// In this grammar +1st is a gain in stops and 1 a factor: of +1.5, 2.83 and 1.5 are both meant by
/// somebody.
TEST(Gain, WithASignAndWithoutStIsRefusedWithBothSpellings) {
    for (const auto& [text, stops, factor] :
         {std::tuple{"+1.5", "+1.5st", "1.5"}, std::tuple{"-1", "-1st", "1"},
          std::tuple{"+0", "+0st", "0"}, std::tuple{"-.5", "-.5st", "0.5"}}) {
        const auto gain = parse_gain(text);
        ASSERT_FALSE(gain.has_value()) << text;
        EXPECT_EQ(gain.error().code, "bad-gain");
        EXPECT_EQ(gain.error().message, std::string("'") + text + "' is ambiguous: " + stops +
                                            " is a gain in stops, " + factor + " a factor");
        EXPECT_TRUE(parse_gain(stops).has_value()) << stops;
        EXPECT_TRUE(parse_gain(factor).has_value()) << factor;
    }
    EXPECT_FALSE(parse_control(Control::Kind::Gain, "key=+1@1,+2@24").has_value());
}

TEST(Gain, IsOfSixtyFourStopsAtMost) {
    EXPECT_EQ(*parse_gain("+64st"), 0x1p64f);
    EXPECT_EQ(*parse_gain("-64st"), 0x1p-64f);
    EXPECT_TRUE(parse_gain("1e19").has_value());
    for (const char* text : {"+200st", "-200st", "+64.1st", "2e19", "1e38"}) {
        const auto gain = parse_gain(text);
        ASSERT_FALSE(gain.has_value()) << text;
        EXPECT_EQ(gain.error().code, "bad-gain");
        EXPECT_NE(gain.error().message.find("64 stops"), std::string::npos) << gain.error().message;
    }
    EXPECT_FALSE(parse_control(Control::Kind::Gain, "key=0st@1,+200st@2").has_value());
    EXPECT_FALSE(parse_control(Control::Kind::Tint, "key=1,1,1e30").has_value());
}

TEST(Control, SaysWhatItExpected) {
    EXPECT_TRUE(parse_control(Control::Kind::Tint, "key=1,.9,.8").has_value());
    for (const char* text : {"key=1,1", "key=1,1,1,1", "key=", "=1,1,1", "key", "key=1,-1,1"}) {
        EXPECT_FALSE(parse_control(Control::Kind::Tint, text).has_value()) << text;
    }
    for (const char* text : {"key=1.5", "key=-0.1", "key=x"}) {
        EXPECT_FALSE(parse_control(Control::Kind::Shadow, text).has_value()) << text;
    }
    // A name may hold what parts names from values elsewhere
    EXPECT_EQ(parse_control(Control::Kind::Mute, "key=1")->target, "key=1");
    EXPECT_FALSE(parse_control(Control::Kind::Mute, "").has_value());
    EXPECT_FALSE(parse_control(Control::Kind::Kelvin, "key=100").has_value());
}

TEST(KelvinTint, IsWhiteAtD65WarmBelowAndKeepsLuminance) {
    const auto white = kelvin_tint(6504.0f), warm = kelvin_tint(3200.0f),
               cool = kelvin_tint(12000.0f);
    for (const float v : white) EXPECT_NEAR(v, 1.0f, 1e-6f);
    EXPECT_GT(warm[0], warm[1]);
    EXPECT_GT(warm[1], warm[2]);
    EXPECT_LT(cool[0], cool[2]);
    for (const auto& t : {warm, cool})
        EXPECT_NEAR(0.2126f * t[0] + 0.7152f * t[1] + 0.0722f * t[2], 1.0f, 1e-5f);
}

TEST(Look, SurvivesJson) {
    Look look;
    look.controls.push_back(*parse_control(Control::Kind::Gain, "indirect=+1.5st"));
    look.controls.push_back(*parse_control(Control::Kind::Tint, "fill=1,.9,.8"));
    look.controls.push_back(*parse_control(Control::Kind::Mute, "env"));
    look.controls.push_back(*parse_control(Control::Kind::Shadow, "key=0.3"));
    look.exposure_stops = -0.5f;
    look.view = "sRGB";
    const auto back = look_from_json(look_to_json(look));
    ASSERT_TRUE(back.has_value()) << back.error().message;
    EXPECT_EQ(look_to_json(*back), look_to_json(look));
    ASSERT_EQ(back->controls.size(), 4u);
    EXPECT_EQ(back->controls[0].factor, look.controls[0].factor);
    for (const char* bad :
         {"", "{}", "{\"schema\":\"velatura.look/1\",\"controls\":[],\"exposure\":65}",
          "{\"schema\":\"velatura.look/1\",\"controls\":[],\"exposure\":-1e99}",
          "{\"schema\":\"other\",\"controls\":[]}",
          "{\"schema\":\"velatura.look/1\",\"controls\":[{\"do\":\"blur\",\"name\":\"key\"}]}",
          "{\"schema\":\"velatura.look/1\",\"controls\":[{\"do\":\"gain\",\"name\":\"key\"}]}"}) {
        EXPECT_EQ(look_from_json(bad).error().code, "bad-preset") << bad;
    }
    const std::string deep = std::string(200000, '[') + std::string(200000, ']');
    EXPECT_EQ(look_from_json(
                  "{\"schema\":\"velatura.look/1\",\"controls\":[],\"rows\":{\"a\":" + deep + "}}")
                  .error()
                  .code,
              "bad-preset");
}

}  // namespace
}  // namespace velatura::compositor
