// SPDX-License-Identifier: Apache-2.0
#include "study/fake_render.h"

#include <gtest/gtest.h>

#include <thread>

namespace velatura::test {

using namespace velatura::study;

namespace {

const std::vector<Knob> one_choice = {{"way", "--way", {{"a"}, {"b"}}}};

Facts usual_facts() {
    Facts facts;
    facts.now = {{"--max-depth", "6"},
                 {"--sampler", "sobol"},
                 {"--light-selection", "tree"},
                 {"--dicing-rate", "1"}};
    return facts;
}

}  // namespace

TEST(Knobs, WhatTheSceneDoesNotHoldIsNotStudied) {
    Facts facts = usual_facts();
    std::set<std::string> names;
    for (const Knob& k : knobs_for(facts, {})) names.insert(k.name);
    EXPECT_EQ(names, (std::set<std::string>{"max bounces", "sampler"}));
    facts.holds = {"several lights", "subdivision by rate"};
    facts.effects = {"textures"};
    names.clear();
    for (const Knob& k : knobs_for(facts, {})) names.insert(k.name);
    EXPECT_EQ(names, (std::set<std::string>{"max bounces", "sampler", "light selection",
                                            "dicing rate", "effect textures"}));
    EXPECT_EQ(knobs_for(facts, {"sampler"}).size(), 1u);
    EXPECT_EQ(knobs_for(facts, {"max-depth"}).size(), 1u);
}

TEST(Knobs, ApproximationsAreHeldAgainstTheExactValue) {
    const Facts facts = usual_facts();
    const std::vector<Setting> settings = settings_for(knobs_for(facts, {"--max-depth"}), facts);
    ASSERT_GE(settings.size(), 3u);
    EXPECT_TRUE(settings[0].is_now);
    EXPECT_EQ(settings[1].options, "--max-depth 0");
    EXPECT_EQ(settings[1].anchor, 1u);
    for (size_t i = 2; i < settings.size(); ++i) {
        EXPECT_EQ(settings[i].anchor, 1u);
        EXPECT_EQ(settings[i].bias_class, BiasClass::Biased);
        EXPECT_NE(settings[i].value, "6") << "what is there already";
    }
}

TEST(Experiments, EndInTimeWithWhatTheyHave) {
    FakeStudy s(one_choice);
    s.options.time_s = 0.5;
    s.options.rounds = 1000000;
    FakeRenderer fake;
    const auto slow = [&](const RenderRequest& request) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        return fake(request);
    };
    const auto start = std::chrono::steady_clock::now();
    ASSERT_TRUE(run_experiments(s.settings, s.options, slow, {}, s.tallies));
    // No bound on a busy machine: that it ends at all, after the time, with some rounds
    EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(100));
    EXPECT_GE(s.tallies.rounds, 1);
    EXPECT_LT(s.tallies.rounds, 40);
}

TEST(Experiments, AStopLeavesAReport) {
    FakeStudy s(one_choice);
    FakeRenderer fake;
    ExperimentCallbacks callbacks;
    callbacks.is_stopped = [&] { return fake.calls >= 5; };
    ASSERT_TRUE(run_experiments(s.settings, s.options, std::ref(fake), callbacks, s.tallies));
    // The third round has no other half
    EXPECT_EQ(s.tallies.settings[0].rounds.size(), 2u);
    EXPECT_EQ(s.tallies.settings[1].rounds.size(), 2u);
    const Report report = make_report(s.subject, s.knobs, s.facts, s.settings, s.tallies);
    EXPECT_NE(result_of(report, "way", "b").verdict, Verdict::Unknown);
}

TEST(Experiments, GoOnFromWhatWasStored) {
    FakeStudy whole(one_choice), parts(one_choice);
    FakeRenderer fake;
    whole.options.rounds = 6;
    (void)whole.run(fake);
    parts.options.rounds = 4;
    (void)parts.run(fake);
    const std::string bytes = to_bytes(parts.tallies, "scene and settings");
    EXPECT_FALSE(from_bytes(bytes, "another scene").has_value());
    EXPECT_FALSE(from_bytes(bytes.substr(0, bytes.size() - 9), "scene and settings").has_value());
    std::string damaged = bytes;
    damaged[damaged.size() / 2] = char(damaged[damaged.size() / 2] ^ 1);
    EXPECT_FALSE(from_bytes(damaged, "scene and settings").has_value());
    auto stored = from_bytes(bytes, "scene and settings");
    ASSERT_TRUE(stored.has_value());
    parts.tallies = std::move(*stored);
    parts.options.rounds = 6;
    (void)parts.run(fake);
    for (size_t i = 0; i < whole.settings.size(); ++i) {
        EXPECT_EQ(whole.tallies.settings[i].rounds, parts.tallies.settings[i].rounds);
        EXPECT_EQ(whole.tallies.settings[i].at(64)->image.sum,
                  parts.tallies.settings[i].at(64)->image.sum);
        EXPECT_EQ(whole.tallies.settings[i].difference.square,
                  parts.tallies.settings[i].difference.square);
    }
}

TEST(Experiments, WhatCannotBeRenderedIsLeftOutWithAReason) {
    FakeStudy s(one_choice);
    FakeRenderer fake;
    const auto picky = [&](const RenderRequest& request) -> Result<RenderRun> {
        if (request.options == "--way b") return Error{"usage", "no such way"};
        return fake(request);
    };
    ASSERT_TRUE(run_experiments(s.settings, s.options, picky, {}, s.tallies));
    EXPECT_EQ(s.tallies.settings[1].rejection, "no such way");
    EXPECT_EQ(s.tallies.settings[0].rounds.size(), 12u);
}

TEST(Experiments, WhatIsSettledLeavesTheTimeToTheRest) {
    FakeStudy s({{"way", "--way", {{"a"}, {"b"}, {"c"}}},
                 {"kind", "--kind", {{"a", BiasClass::Changes}, {"b", BiasClass::Changes}}}});
    FakeRenderer fake;
    fake.settings["--way b"] = {.noise = 2};
    const Report report = s.run(fake);
    EXPECT_LE(result_of(report, "way", "b").rounds, 4);
    EXPECT_EQ(result_of(report, "way", "b").verdict, Verdict::Worse);
    EXPECT_EQ(result_of(report, "kind", "b").rounds, 2);
    EXPECT_EQ(result_of(report, "way", "c").rounds, 12);
    EXPECT_EQ(report.settings[0].rounds, 12);
}

/// Rounds differ in how noisy they are: what took part in few of them must not look noisier for it.
TEST(Experiments, ASettledSettingOfTheSameImageHasItsNoise) {
    FakeStudy s({{"tree", "--tree", {{"good"}, {"other"}}}});
    FakeRenderer fake;
    fake.settings["--tree other"] = {.is_same = true};
    const auto wild_later = [&](const RenderRequest& request) {
        FakeRenderer f = fake;
        if (request.seed >= 6) f.noise *= 3;
        return f(request);
    };
    ASSERT_TRUE(run_experiments(s.settings, s.options, wild_later, {}, s.tallies));
    const Report report = make_report(s.subject, s.knobs, s.facts, s.settings, s.tallies);
    const SettingResult& other = result_of(report, "tree", "other");
    EXPECT_EQ(other.rounds, 6);
    EXPECT_EQ(other.noise.value, report.noise.value);
    EXPECT_EQ(other.verdict, Verdict::NoDifference);
}

TEST(Experiments, TheGridFitsIntoTheTimeAndTheImage) {
    FakeStudy s(one_choice);
    FakeRenderer fake;
    s.options.time_s = 0;
    const Result<Grid> min = choose_grid(s.settings, s.options, std::ref(fake));
    ASSERT_TRUE(min.has_value());
    EXPECT_NEAR(double(min->pixels()), 96, 12);
    EXPECT_NEAR(double(min->width) / min->height, 1.5, 0.1);
    s.options.time_s = 1e6;
    s.options.width = 20;
    s.options.height = 10;
    const Result<Grid> max = choose_grid(s.settings, s.options, std::ref(fake));
    ASSERT_TRUE(max.has_value());
    EXPECT_EQ(*max, (Grid{20, 10}));
}

}  // namespace velatura::test
