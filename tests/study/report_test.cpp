// SPDX-License-Identifier: Apache-2.0
// Tests of the test: what is planted in renders of known mean, noise and time is found, and nothing
// else.
#include "study/fake_render.h"
#include "study/rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace velatura::test {

namespace {

using study::BiasClass;
using study::Knob;
using study::Verdict;

const std::vector<Knob> two_choices = {{"way", "--way", {{"a"}, {"b"}, {"c"}}},
                                       {"tree", "--tree", {{"good"}, {"other"}}}};

}  // namespace

TEST(Report, NoiseBiasAndTimeAreThoseOfTheRenders) {
    FakeStudy s(
        {{"depth", "--depth", {{"4", BiasClass::Biased}, {"2", BiasClass::Biased}, {"0"}}, "0"}});
    FakeRenderer r;
    r.settings["--depth 0"] = {.noise = 1.2, .time = 1.5, .scale = 1.02};
    r.settings["--depth 2"] = {.noise = 0.8, .time = 0.5, .scale = 0.9};
    const study::Report report = s.run(r);
    // All relative to the image of the exact value, 1.02 m for a pixel of m: noise of 0.05 (0.5 +
    // at) √(m² + 0.01), biases in proportion to m
    double square = 0, ratio = 0;
    for (int i = 0; i < 1000; ++i)
        for (int c = 0; c < 3; ++c) {
            const double at = i / 1000.0, m = 0.2 + at + 0.1 * c, base = 1.02 * m * 1.02 * m + 0.01;
            square += 0.0025 * (0.5 + at) * (0.5 + at) * (m * m + 0.01) / base / 3000;
            ratio += m * m / base / 3000;
        }
    const double truth = std::sqrt(square);
    EXPECT_LT(report.noise.low, truth);
    EXPECT_GT(report.noise.high, truth);
    EXPECT_NEAR(report.noise.value, truth, 0.02 * truth);
    EXPECT_LT(report.noise.high - report.noise.low, 0.15 * truth);
    EXPECT_NEAR(report.bias, 0.02 * std::sqrt(ratio), 0.15 * 0.02);
    EXPECT_NEAR(report.error, std::hypot(report.noise.value, report.bias), 1e-9);
    EXPECT_NEAR(result_of(report, "depth", "2").bias, 0.12 * std::sqrt(ratio), 0.02 * 0.12);
    EXPECT_EQ(result_of(report, "depth", "0").bias, 0.0);
    EXPECT_NEAR(result_of(report, "depth", "2").time.value, 0.5, 0.05);
    EXPECT_LT(result_of(report, "depth", "2").time.low, 0.5);
    EXPECT_GT(result_of(report, "depth", "2").time.high, 0.5);
    // 100 pixels of the image for each of the grid
    EXPECT_NEAR(report.settings[0].cpu_s, 1.0, 0.1);
}

TEST(Report, ErrorsAreThoseOfTheTruthWhateverTheRenderLeavesOut) {
    // A render that keeps half of the light, and one that keeps all: the same settings, the same
    // errors
    const auto report_of = [](bool is_exact) {
        using Values = std::vector<study::KnobValue>;
        const study::KnobValue cut{"4", BiasClass::Biased}, whole{"0"};
        FakeStudy s(
            {{"depth", "--depth", is_exact ? Values{whole, cut} : Values{cut, whole}, "0"}});
        FakeRenderer r;
        r.settings[is_exact ? "" : "--depth 0"] = {.scale = 1};
        r.settings[is_exact ? "--depth 4" : ""] = {.scale = 0.5};
        return s.run(r);
    };
    const study::Report of_cut = report_of(false), of_whole = report_of(true);
    const double bias = result_of(of_whole, "depth", "4").bias;
    EXPECT_NEAR(of_cut.bias, bias, 0.03 * bias);
    EXPECT_NEAR(result_of(of_cut, "depth", "0").noise.value, of_whole.noise.value,
                0.03 * of_whole.noise.value);
}

TEST(Report, SlopesAreThoseOfTheRenders) {
    FakeStudy s(two_choices);
    FakeRenderer r;
    r.settings["--way b"] = {.slope = -0.75};
    const study::Report report = s.run(r);
    EXPECT_NEAR(report.settings[0].slope.value, -0.5, 0.01);
    EXPECT_NEAR(result_of(report, "way", "b").slope.value, -0.75, 0.02);
}

TEST(Report, NothingIsFoundWhereNothingIs) {
    for (const uint64_t seed : {0, 100, 200, 300}) {
        FakeStudy s(two_choices);
        s.options.seed = seed;
        FakeRenderer r;
        r.machine_drift = 0.5;
        const study::Report report = s.run(r);
        for (size_t i = 1; i < report.settings.size(); ++i)
            EXPECT_EQ(report.settings[i].verdict, Verdict::NoDifference)
                << report.settings[i].setting.options;
        EXPECT_EQ(report.bias, 0.0);
    }
}

TEST(Report, APlantedSlowDownIsFound) {
    // The render as it is takes a third longer than it could
    FakeStudy s(two_choices);
    FakeRenderer r;
    r.machine_drift = 0.5;
    r.settings["--tree other"] = {.time = 0.75, .is_same = true};
    r.settings["--way b"] = {.time = 1.5};
    const study::Report report = s.run(r);
    const study::SettingResult& tree = result_of(report, "tree", "other");
    EXPECT_EQ(tree.verdict, Verdict::MostEfficient);
    EXPECT_TRUE(tree.difference.is_same_image);
    EXPECT_NEAR(tree.time.value, 0.75, 0.09);
    EXPECT_EQ(report.rows.front().knob, "tree");
    const study::SettingResult& way = result_of(report, "way", "b");
    EXPECT_EQ(way.verdict, Verdict::Worse);
    EXPECT_NEAR(way.equal_time.value, std::sqrt(1.5), 0.1);
    EXPECT_EQ(result_of(report, "way", "c").verdict, Verdict::NoDifference);
}

TEST(Report, APlantedBiasIsFound) {
    FakeStudy s(two_choices);
    FakeRenderer r;
    r.settings["--way b"] = {.scale = 1.01};
    r.settings["--tree other"] = {.tilt = 0.02};
    const study::Report report = s.run(r);
    EXPECT_EQ(result_of(report, "way", "b").verdict, Verdict::Suspect);
    EXPECT_NEAR(result_of(report, "way", "b").difference.shift, 0.01, 0.002);
    // One that leaves the energy of the image as it is
    EXPECT_EQ(result_of(report, "tree", "other").verdict, Verdict::Suspect);
    EXPECT_EQ(result_of(report, "way", "c").verdict, Verdict::NoDifference);
    EXPECT_EQ(report.rows.front().verdict, Verdict::Suspect);
}

TEST(Report, LightThatIsMetTooRarelyIsNoBrokenPromise) {
    FakeStudy s({{"way",
                  "--way",
                  {{"a"},
                   {"b", BiasClass::Unbiased, true},
                   {"c", BiasClass::Unbiased, true},
                   {"d", BiasClass::Unbiased, true}}}});
    FakeRenderer r;
    r.settings["--way d"] = {.tilt = 0.2};
    r.settings["--way b"] = {.scale = 0.8};
    r.settings["--way c"] = {.scale = 1.2};
    const study::Report report = s.run(r);
    EXPECT_EQ(result_of(report, "way", "b").verdict, Verdict::Worse)
        << "what it misses is its error";
    EXPECT_EQ(result_of(report, "way", "d").verdict, Verdict::Worse)
        << "as much too dark here as too bright there";
    EXPECT_EQ(result_of(report, "way", "c").verdict, Verdict::Suspect)
        << "nobody finds more light than there is";
}

TEST(Report, LessNoiseInTheSameTimeIsTheBestBuy) {
    FakeStudy s(two_choices);
    FakeRenderer r;
    r.settings["--way b"] = {.noise = 0.7, .time = 1.5};
    r.settings["--way c"] = {.noise = 0.7, .time = 1.2};
    const study::Report report = s.run(r);
    EXPECT_EQ(result_of(report, "way", "c").verdict, Verdict::MostEfficient);
    EXPECT_NEAR(result_of(report, "way", "c").equal_time.value, 0.7 * std::sqrt(1.2), 0.03);
    EXPECT_EQ(result_of(report, "way", "b").verdict, Verdict::Better);
    EXPECT_EQ(report.rows.front().knob, "way");
    EXPECT_EQ(study::advised_options(report, report.rows.front()), "--way c");
}

TEST(Report, PreparationCountsAsTime) {
    FakeStudy s(two_choices);
    FakeRenderer r;
    // The image takes 1 s: half of it is won, and two are spent before
    r.settings["--tree other"] = {.time = 0.5, .is_same = true, .setup_s = 2.0};
    const study::Report report = s.run(r);
    EXPECT_EQ(result_of(report, "tree", "other").verdict, Verdict::Worse);
}

TEST(Report, ABiasThatWouldNotBeSeenIsReckonedWith) {
    FakeStudy s({{"depth", "--depth", {{"0"}, {"8", BiasClass::Biased}}, "0"},
                 {"way", "--way", {{"a"}, {"b"}}}});
    s.options.rounds = 3;
    FakeRenderer r;
    const study::Report report = s.run(r);
    const auto skew = [](const study::Estimate& e) { return e.high * e.low / (e.value * e.value); };
    EXPECT_NEAR(skew(result_of(report, "way", "b").equal_time), 1.0, 1e-9);
    const study::SettingResult& cut = result_of(report, "depth", "8");
    ASSERT_FALSE(cut.difference.is_seen);
    EXPECT_NEAR(skew(cut.equal_time),
                std::hypot(1.0, cut.difference.bias_limit / report.noise.value), 0.02);
}

TEST(Report, WideIntervalsAreToldAndNotTakenForEquality) {
    for (const int rounds : {2, 100}) {
        FakeStudy s({{"way", "--way", {{"a"}, {"b"}}}});
        s.options.rounds = rounds;
        FakeRenderer r;
        const study::Report report = s.run(r);
        const auto row = std::find_if(report.rows.begin(), report.rows.end(),
                                      [](const study::KnobRow& k) { return k.knob == "way"; });
        ASSERT_NE(row, report.rows.end());
        ASSERT_EQ(row->verdict, Verdict::NoDifference);
        EXPECT_EQ(row->advice.starts_with("no significant difference at equal time: -"),
                  rounds == 2)
            << row->advice;
        EXPECT_EQ(row->advice.starts_with("no difference at equal time, to "), rounds == 100)
            << row->advice;
        EXPECT_EQ(study::advised_options(report, *row), "");
    }
}

TEST(Report, OneRoundJudgesNothing) {
    FakeStudy s(two_choices);
    s.options.rounds = 1;
    FakeRenderer r;
    r.settings["--way b"] = {.noise = 3, .time = 4};
    const study::Report report = s.run(r);
    EXPECT_EQ(result_of(report, "way", "b").verdict, Verdict::Unknown);
    EXPECT_FALSE(study::to_json(report).empty());
    EXPECT_FALSE(study::to_csv(report).empty());
}

}  // namespace velatura::test
