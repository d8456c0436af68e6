// SPDX-License-Identifier: Apache-2.0
// Files that nobody would make, through every command that takes a file of others: none may end the
// program, exit codes are those of the docs, and nothing of a file is lost in silence.
#include "base/atomic_file.h"
#include "base/command_line.h"
#include "base/input_guard.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/io/layer_stack.h"
#include "compositor/random_exr.h"
#include "film/film_scene.h"
#include "image/exr.h"
#include "layers/strip_reader.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <bit>
#include <cmath>
#include <filesystem>
#include <functional>
#include <set>

namespace velatura::compositor::cli {
namespace {

namespace fs = std::filesystem;

std::string path_of(const std::string& name) {
    return film::temporary_file("random_" + name);
}

struct Ended {
    int code = -1;
    std::string out, err;
};

/// A command of velatura-comp, in this process.
Ended comp(const std::vector<std::string>& arguments) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    Ended ended;
    {
        CommandLine app("", "velatura-comp");
        std::function<int()> run;
        for (const auto add :
             {add_info_command, add_mix_command, add_noise_command, add_verify_command,
              add_diff_command, add_export_command, add_view_command})
            add(app, run);
        const auto exit = app.parse(arguments);
        ended.code = exit ? exit->code : run();
        if (exit) std::fputs(exit->text.c_str(), stderr);
    }
    stop_guarding_inputs();
    end_warnings();
    ended.out = testing::internal::GetCapturedStdout();
    ended.err = testing::internal::GetCapturedStderr();
    return ended;
}

/// Every channel of the file is one of a row, of the beauty or of data, or its part is named as
/// skipped.
void expect_nothing_lost(const RandomExr& file, const LayerStack& stack) {
    std::set<std::pair<std::string, std::string>> listed;  // part, channel
    const image::Image& image = stack.image();
    const auto list = [&](const layers::ChannelRef& place) {
        listed.emplace(image.parts[place.part].name,
                       image.parts[place.part].channels[place.channel].name);
    };
    for (const accumulate::LayerEntry& entry : stack.header().layers) {
        for (size_t c = 0; c < 4; ++c)
            if (const auto place = stack.place(entry.name, c)) list(*place);
        if (entry.family == "data")
            for (const layers::ChannelRef& place : stack.data_channels(entry.name)) list(place);
    }
    if (const auto alpha = stack.place("rgba", 3)) list(*alpha);
    std::string notes;
    for (const std::string& note : stack.notes()) notes += note + "\n";
    for (const RandomExr::Part& part : file.parts) {
        const bool is_skipped = notes.find("part " + part.name + " skipped") != std::string::npos;
        EXPECT_EQ(is_skipped, part.is_far) << part.name;
        if (is_skipped) continue;
        for (const RandomExr::Channel& c : part.channels)
            EXPECT_TRUE(listed.count({part.name, c.name})) << part.name << ": " << c.name;
    }
}

float finite(float v) {
    return std::isfinite(v) ? v : 0.0f;
}

/// Without gains the mix is the beauty, NaN and infinity as 0; without a beauty the sum of the rows
/// in the order of the file.
void expect_beauty(const RandomExr& file, const LayerStack& stack, const image::Image& mixed) {
    constexpr std::array names = {"R", "G", "B"};
    for (size_t c = 0; c < 3; ++c) {
        const image::Channel* const out = mixed.find(names[c]);
        ASSERT_TRUE(out);
        std::vector<float> expected(mixed.data.pixel_count(), 0.0f);
        if (const RandomExr::Channel* beauty = file.beauty_channel(c)) {
            const image::Window& own = file.parts[0].data;
            for (int y = own.y0; y < own.y1; ++y)
                for (int x = own.x0; x < own.x1; ++x)
                    expected[mixed.data.index(x, y)] += finite(beauty->values[own.index(x, y)]);
        } else {
            ASSERT_FALSE(stack.has_beauty());
            for (const std::string& row : stack.group_names()) {
                const image::Channel* const values = stack.channel(row, c);
                ASSERT_TRUE(values) << row;
                for (size_t i = 0; i < expected.size(); ++i)
                    expected[i] += finite(values->value(i));
            }
        }
        for (size_t i = 0; i < expected.size(); ++i)
            ASSERT_EQ(std::bit_cast<uint32_t>(out->value(i)), std::bit_cast<uint32_t>(expected[i]))
                << names[c] << " of pixel " << i;
    }
}

/// With its layers the mix has every channel of the file: data bit for bit, light where it is
/// finite.
void expect_all_carried(const RandomExr& file, const image::Image& mixed) {
    for (const RandomExr::Part& part : file.parts) {
        if (part.is_far) continue;
        for (const RandomExr::Channel& c : part.channels) {
            const image::Channel* of = nullptr;
            for (const image::Part& p : mixed.parts)
                if (p.name.empty() || p.name == part.name || p.name == part.name + "_rows")
                    of = of ? of : p.find(c.name);
            ASSERT_TRUE(of) << part.name << ": " << c.name;
            for (int y = part.data.y0; y < part.data.y1; ++y) {
                for (int x = part.data.x0; x < part.data.x1; ++x) {
                    const float before = c.values[part.data.index(x, y)],
                                now = of->value(mixed.data.index(x, y));
                    const bool is_same =
                        std::bit_cast<uint32_t>(now) == std::bit_cast<uint32_t>(before) ||
                        (!std::isfinite(before) &&
                         (now == 0 || std::isnan(now) == std::isnan(before)));
                    ASSERT_TRUE(is_same)
                        << c.name << " at " << x << "," << y << ": " << before << " became " << now;
                }
            }
        }
    }
}

constexpr size_t max_of_a_sheet = 30;

void try_file(uint64_t seed) {
    const std::string path = path_of("file.exr"), output = path_of("mix.exr");
    const RandomExr file = write_random_exr(seed, path);
    SCOPED_TRACE(file.what);
    fs::remove(output);
    const auto stack = LayerStack::load(path, ForeignFiles::Plain);
    const bool has_light = stack.has_value();
    if (!has_light) {
        EXPECT_EQ(stack.error().code, "not-layers") << stack.error().message;
        EXPECT_EQ(file.beauty, RandomExr::Beauty::NoLight) << stack.error().message;
    }
    if (has_light) expect_nothing_lost(file, *stack);

    const int code = has_light ? 0 : 1;
    const Ended info = comp({"info", "--json", path});
    EXPECT_EQ(info.code, code) << info.err;
    if (has_light) {
        const auto json = nlohmann::json::parse(info.out, nullptr, false);
        EXPECT_FALSE(json.is_discarded());
        if (!json.is_discarded()) {
            EXPECT_EQ(json["layers"].size(), stack->header().layers.size());
        }
    }
    EXPECT_EQ(comp({"info", path}).code, code);
    const Ended mix = comp({"mix", path, "-o", output});
    EXPECT_EQ(mix.code, code) << mix.err;
    EXPECT_EQ(fs::exists(output), has_light);
    if (has_light) {
        const auto mixed = image::read_exr(output);
        ASSERT_TRUE(mixed.has_value()) << mixed.error().message;
        expect_beauty(file, *stack, *mixed);
        for (const std::string& note : stack->notes())
            EXPECT_NE(mix.err.find(note), std::string::npos) << note;
    }
    const Ended carried = comp({"mix", path, "-o", output, "--with-layers"});
    EXPECT_EQ(carried.code, code) << carried.err;
    if (has_light) {
        const auto mixed = image::read_exr(output);
        ASSERT_TRUE(mixed.has_value()) << mixed.error().message;
        expect_all_carried(file, *mixed);
        EXPECT_EQ(comp({"info", output}).code, 0);
        const auto again = LayerStack::load(output, ForeignFiles::Plain);
        ASSERT_TRUE(again.has_value()) << again.error().message;
        EXPECT_TRUE(again->has_beauty());
    }
    const Ended verified = comp({"verify", path});
    EXPECT_EQ(verified.code, 4) << verified.err;
    EXPECT_FALSE(verified.err.empty());
    // Without half images there is nothing to tell noise from
    EXPECT_EQ(comp({"noise", path}).code, 1);
    const Ended same = comp({"diff", path, path});
    EXPECT_EQ(same.code, 0) << same.err;
    for (const char* program : {"nuke", "oiio", "blender"}) {
        const Ended script = comp({"export", program, path, "-o", path_of("script")});
        EXPECT_EQ(script.code, code) << program << ": " << script.err;
        for (size_t n = 0; has_light && n < stack->notes().size(); ++n)
            EXPECT_NE(script.err.find(stack->notes()[n]), std::string::npos) << stack->notes()[n];
    }
    // Sheets of many layers take seconds
    size_t channels = 0;
    for (const RandomExr::Part& part : file.parts) channels += part.channels.size();
    if (channels > max_of_a_sheet) return;
    EXPECT_EQ(comp({"view", path, "-o", path_of("sheet.png")}).code, 0);
}

TEST(RandomFiles, SixtyGoThroughEveryCommand) {
    for (uint64_t seed = 1; seed <= 60 && !HasFatalFailure(); ++seed) try_file(seed);
}

/// The others, a hundred at a time.
class ManyRandomFiles : public testing::TestWithParam<uint64_t> {};

TEST_P(ManyRandomFiles, GoThroughEveryCommand) {
    for (uint64_t seed = GetParam(); seed < GetParam() + 97 && !HasFatalFailure(); ++seed)
        try_file(seed);
}

INSTANTIATE_TEST_SUITE_P(TwoThousand, ManyRandomFiles, testing::Range<uint64_t>(61, 2001, 97));

}  // namespace
}  // namespace velatura::compositor::cli
