// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "base/frames.h"
#include "base/tasks.h"
#include "compositor/mix/mix_job.h"
#include "compositor/test_stack.h"
#include "image/exr.h"
#include "layers/layer_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>

namespace velatura::compositor::mix {
namespace {

namespace fs = std::filesystem;

TEST(Keys, AreLinearBetweenFrames) {
    const auto at = [](Control::Kind kind, const char* text, double frame) {
        Look look = look_of({{kind, text}});
        return look_at(std::move(look), frame).controls[0].factor;
    };
    using enum Control::Kind;
    EXPECT_EQ(at(Gain, "key=1@1,2@3", 1)[0], 1.0f);
    EXPECT_EQ(at(Gain, "key=1@1,2@3", 2)[0], 1.5f);
    EXPECT_EQ(at(Gain, "key=1@1,2@3", 9)[0], 2.0f);
    EXPECT_EQ(at(Gain, "key=2@3,1@1", 0)[0], 1.0f);
    // All in stops: linear in stops
    EXPECT_EQ(at(Gain, "key=0st@0,2st@2", 1)[0], 2.0f);
    EXPECT_EQ(at(Gain, "key=1@0,+2st@2", 1)[0], 2.5f);
    EXPECT_EQ(at(Tint, "key=1,1,1@0,0,.5,1@4", 2), (std::array<float, 3>{0.5f, 0.75f, 1.0f}));
    EXPECT_EQ(at(Kelvin, "key=3000@0,5000@2", 1), kelvin_tint(4000.0f));
    EXPECT_EQ(at(Shadow, "key=0@0,1@4", 1)[0], 0.25f);
    for (const char* bad : {"key=1@", "key=@1", "key=1@1,2", "key=1@1,2@1", "key=1@x", "key=-1@2"})
        EXPECT_FALSE(parse_control(Gain, bad).has_value()) << bad;
    const Look keyed = look_of({{Gain, "key=1@1,2@3"}});
    EXPECT_TRUE(has_keys(keyed));
    EXPECT_FALSE(has_keys(look_of({{Gain, "key=2"}})));
    EXPECT_EQ(look_at(*look_from_json(look_to_json(keyed)), 2).controls[0].factor[0], 1.5f);
    const auto json = look_from_json(
        R"({"schema": "velatura.look/1", "controls": [
            {"do": "gain", "name": "key", "keys": {"10": 2, "9": "+0st"}}]})");
    ASSERT_TRUE(json.has_value()) << json.error().message;
    EXPECT_EQ(look_at(*json, 9.5).controls[0].factor[0], 1.5f);
}

/// Beauty and data are layers as well.
TEST(MixJob, WithLayersOfAFileWithoutLightLayers) {
    film::LayerSet set = film::test_layer_set();
    set.bounce_layers = set.group_layers = false;
    film::Film film({0, 0, 24, 18}, set);
    film::render(film, 0, 2);
    MixJob job;
    job.inputs = {film::temporary_file("beauty_only.exr")};
    job.output = film::temporary_file("beauty_mixed.exr");
    job.look = look_of({{Control::Kind::Gain, "all=2"}});
    job.with_layers = true;
    ASSERT_TRUE(film.write(job.inputs[0], {}).has_value());
    const auto warnings = mix_one(job, job.inputs, job.output, {}, 1);
    ASSERT_TRUE(warnings.has_value()) << warnings.error().message;
    EXPECT_TRUE(warnings->empty());
    const auto before = LayerStack::load(job.inputs[0]), after = LayerStack::load(job.output);
    ASSERT_TRUE(after.has_value()) << after.error().message;
    const auto check = layers::check_layers(after->image(), after->header());
    EXPECT_TRUE(check.is_good()) << check.problems[0];
    for (size_t i = 0; i < before->image().data.pixel_count(); ++i) {
        ASSERT_EQ(after->channel("rgba", 1)->value(i), 2 * before->channel("rgba", 1)->value(i));
        ASSERT_EQ(after->image().find("Z")->value(i), before->image().find("Z")->value(i));
    }
}

TEST(Presets, DifferencesAreToldControlByControl) {
    using enum Control::Kind;
    Look a = look_of({{Gain, "key=2"}, {Mute, "sky"}, {Shadow, "key=0.5"}});
    Look b = look_of({{Gain, "key=3"}, {Shadow, "key=0.5"}, {Tint, "fill=1,1,0"}});
    b.exposure_stops = 1;
    b.view = "Raw";
    b.rows["warm"] = {"key", "fill"};
    EXPECT_EQ(
        look_differences(a, b),
        (std::vector<std::string>{"  --gain key 2 -> 3", "- --mute sky on", "+ --tint fill 1,1,0",
                                  "+ --rows warm key,fill", "+ --exposure 1", "+ --view Raw"}));
    EXPECT_TRUE(look_differences(a, a).empty());
    b.controls[0].matte = "object:tree";
    const auto back = look_from_json(look_to_json(b));
    ASSERT_TRUE(back.has_value()) << back.error().message;
    EXPECT_TRUE(look_differences(b, *back).empty());
}

/// How many frames fit at once depends on all that each of them holds.
TEST(Sequence, MemoryIsForMattesAndLayersAsWell) {
    constexpr size_t pixels = 24 * 18;
    film::Film film({0, 0, 24, 18}, film::test_layer_set());
    film::render(film, 0, 2);
    ASSERT_TRUE(film.write(frame_path(film::temporary_file("mem.##.exr"), 2), {}).has_value());
    MixJob job;
    job.inputs = {film::temporary_file("mem.##.exr")};
    job.output = film::temporary_file("mem_out.##.exr");
    job.look = look_of({{Control::Kind::Gain, "key=2"}, {Control::Kind::Gain, "key=1@1,3@3"}});
    const std::vector<int> frames = {1, 2, 3, 4};  // the first is not there
    const MemoryShare bare = share_memory(job, frames);
    EXPECT_EQ(bare.frame_bytes, 48 * pixels);
    const size_t fewest = bare.strip_bytes;
    job.memory_bytes = 2 * (bare.frame_bytes + (size_t(64) << 20));
    const MemoryShare two = share_memory(job, frames);
    EXPECT_EQ(two.frames, std::min<size_t>(2, size_t(thread_count())));
    EXPECT_LT(two.strip_bytes, fewest);
    // Two mattes, one of them twice
    const std::string mask = frame_path(job.inputs[0], 2);
    job.look.controls.push_back(job.look.controls[0]);
    job.look.controls[0].matte = job.look.controls[1].matte = mask + ":A";
    job.look.controls[2].matte = mask + ":Z";
    EXPECT_EQ(share_memory(job, frames).frame_bytes, (48 + 2 * 4) * pixels);
    EXPECT_EQ(share_memory(job, frames).frames, 1u);
    // All channels of the file
    job.with_layers = true;
    const auto stack = LayerStack::load(mask);
    ASSERT_TRUE(stack.has_value());
    size_t channels = 0;
    for (const image::Part& part : stack->image().parts) channels += part.channels.size();
    EXPECT_EQ(share_memory(job, frames).frame_bytes, (48 + 2 * 4 + channels * 8) * pixels);
    job.memory_bytes = 1;
    EXPECT_EQ(share_memory(job, frames).frames, 1u);
    EXPECT_GT(share_memory(job, frames).strip_bytes, 1u);
    job.memory_bytes = size_t(1) << 40;
    EXPECT_EQ(share_memory(job, frames).frames, std::min<size_t>(4, size_t(thread_count())));
}

TEST(Sequence, MixesFramesAndReportsThoseThatAreMissing) {
    for (const int frame : {1, 2, 4}) {
        film::Film film({0, 0, 24, 18}, film::test_layer_set());
        film::render(film, uint64_t(frame), uint64_t(frame + 2));
        ASSERT_TRUE(
            film.write(frame_path(film::temporary_file("seq.##.exr"), frame), {}).has_value());
    }
    ASSERT_TRUE(write_file_atomically(film::temporary_file("seq.05.exr"), "no image").has_value());
    MixJob job;
    job.inputs = {film::temporary_file("seq.##.exr")};
    job.output = film::temporary_file("mixed.##.exr");
    job.look = look_of({{Control::Kind::Gain, "all=1@1,4@4"}});
    std::map<int, FrameOutcome> outcomes;
    mix_sequence(job, {1, 2, 3, 4, 5}, [&](const FrameOutcome& o) { outcomes[o.frame] = o; });
    ASSERT_EQ(outcomes.size(), 5u);
    EXPECT_EQ(outcomes[3].error->code, "frame-missing");
    EXPECT_EQ(outcomes[5].error->code, "io-open");
    EXPECT_FALSE(fs::exists(frame_path(job.output, 5)));
    for (const int frame : {1, 2, 4}) {
        ASSERT_FALSE(outcomes[frame].error) << outcomes[frame].error->message;
        const auto before = image::read_exr(frame_path(job.inputs[0], frame)),
                   after = image::read_exr(frame_path(job.output, frame));
        ASSERT_TRUE(before.has_value() && after.has_value());
        for (size_t i = 0; i < before->data.pixel_count(); ++i) {
            const float expected = float(frame) * before->find("G")->value(i);
            ASSERT_NEAR(after->find("G")->value(i), expected, 1e-5f * (1.0f + std::abs(expected)));
        }
    }
    EXPECT_EQ(
        mix_one(job, {frame_path(job.inputs[0], 1)}, frame_path(job.output, 1), {}, 1).error().code,
        "no-frame");
}

}  // namespace
}  // namespace velatura::compositor::mix
