// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/file_follower.h"

#include "base/atomic_file.h"
#include "window_stack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::window {
namespace {

namespace fs = std::filesystem;

constexpr image::Window frame = {0, 0, 48, 33};

/// A file of the film's light after so many samples.
std::string render(const std::string& name, uint64_t samples) {
    return window_file(name, frame, frame, samples);
}

/// As a render replaces its file: whole, under another inode.
void replace(const std::string& path, const std::string& by) {
    const auto bytes = read_file(by);
    ASSERT_TRUE(bytes.has_value());
    ASSERT_TRUE(write_file_atomically(path, *bytes).has_value());
}

/// As a copy over a slow network: into the file itself.
void write_in_place(const std::string& path, const std::string& bytes) {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    ASSERT_NE(file, nullptr);
    EXPECT_EQ(std::fwrite(bytes.data(), 1, bytes.size(), file), bytes.size());
    EXPECT_EQ(std::fclose(file), 0);
}

uint64_t samples_of(const std::shared_ptr<const Levels>& levels) {
    return levels->stack(0).header().samples.end;
}

TEST(FollowedFiles, AreReadOnceWhenTheyAreReplaced) {
    const std::string path = render("followed.exr", 1), next = render("followed_next.exr", 4);
    FollowedFiles files({path}, "", states_of({path}));
    EXPECT_FALSE(files.check().has_value()) << "as it was read";
    replace(path, next);
    auto found = files.check();
    ASSERT_TRUE(found.has_value());
    ASSERT_TRUE(found->has_value());
    EXPECT_EQ(samples_of(**found), 4u);
    EXPECT_FALSE(files.check().has_value());
    // The same bytes in another file are another file: only its state is looked at
    replace(path, next);
    EXPECT_TRUE(files.check().has_value());
}

TEST(FollowedFiles, ADamagedFileIsReportedOnceAndTheNextOneRead) {
    const std::string path = render("damaged.exr", 1), next = render("damaged_next.exr", 2);
    FollowedFiles files({path}, "", states_of({path}));
    const std::string whole = read_file(next).value();
    for (const size_t share : {size_t(0), whole.size() / 100, whole.size() / 2}) {
        write_in_place(path, whole.substr(0, share));
        const auto found = files.check();
        ASSERT_TRUE(found.has_value()) << share;
        EXPECT_FALSE(found->has_value()) << share;
        EXPECT_FALSE(files.check().has_value()) << "reported once";
    }
    write_in_place(path, whole);
    const auto found = files.check();
    ASSERT_TRUE(found.has_value() && found->has_value());
    EXPECT_EQ(samples_of(**found), 2u);
}

TEST(FollowedFiles, AFileThatIsGoneMayComeBack) {
    const std::string path = render("gone.exr", 1), next = render("gone_next.exr", 2);
    FollowedFiles files({path}, "", states_of({path}));
    fs::remove(path);
    auto found = files.check();
    ASSERT_TRUE(found.has_value() && !found->has_value());
    EXPECT_EQ(found->error().message, path + " was removed");
    EXPECT_FALSE(files.check().has_value());
    replace(path, next);
    found = files.check();
    ASSERT_TRUE(found.has_value() && found->has_value());
    EXPECT_EQ(samples_of(**found), 2u);
}

TEST(FollowedFiles, AFileThatIsNotThereYetIsWaitedFor) {
    const std::string path = film::temporary_file("awaited.exr");
    fs::remove(path);
    FollowedFiles files({path}, "", {});
    auto found = files.check();
    ASSERT_TRUE(found.has_value() && !found->has_value());
    EXPECT_EQ(found->error().message, path + " not found");
    render("awaited.exr", 1);
    found = files.check();
    ASSERT_TRUE(found.has_value() && found->has_value());
}

TEST(FollowedFiles, SeveralFilesAreOneMix) {
    const std::string a = plain_file("aov_key.exr", frame), b = plain_file("aov_fill.exr", frame);
    FollowedFiles files({a, b}, "", states_of({a, b}));
    EXPECT_FALSE(files.check().has_value());
    replace(b, a);
    const auto found = files.check();
    ASSERT_TRUE(found.has_value() && found->has_value());
    std::vector<std::string> names = (**found)->stack(0).group_names();
    std::sort(names.begin(), names.end());
    EXPECT_EQ(names, (std::vector<std::string>{"fill", "key"}));
}

TEST(FileFollower, BringsTheNewestAndWakes) {
    const std::string path = render("live.exr", 1), next = render("live_next.exr", 8);
    std::promise<void> woken;
    std::atomic<bool> is_woken = false;
    FileFollower follower(
        {path}, "", states_of({path}),
        [&] {
            if (!is_woken.exchange(true)) woken.set_value();
        },
        0.01);
    EXPECT_FALSE(follower.take().has_value());
    EXPECT_EQ(follower.state(), "following live.exr");
    replace(path, next);
    ASSERT_EQ(woken.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
    const auto news = follower.take();
    ASSERT_TRUE(news.has_value() && news->has_value());
    EXPECT_EQ(samples_of((*news)->levels), 8u);
    EXPECT_FALSE((*news)->is_other_image);
    EXPECT_FALSE(follower.take().has_value());
}

TEST(FollowingSession, KeepsLookUndoZoomAndWhatIsSelected) {
    Session session = session_of_small();
    const auto renewed = levels_of(window_file("small_2.exr", {3, 2, 43, 31}, {0, 0, 48, 33}, 4));
    session.select("key");
    session.press(*key_press_of("right"));
    session.press(*key_press_of("m"));
    session.press(*key_press_of("ctrl+z"));
    session.set_page(Page::Lights);
    session.view().set_scale(3);
    const uint64_t before = session.image(0)->version, look = session.image(0)->look_version;
    session.renew(renewed);
    EXPECT_EQ(&session.stack(), &renewed->stack(0));
    EXPECT_EQ(session.path(), "small.exr");
    EXPECT_FLOAT_EQ(row_state(session.look(), "key").stops, 0.25f);
    EXPECT_EQ(session.selected(), "key");
    EXPECT_EQ(session.view().scale(), 3);
    EXPECT_EQ(session.image(0)->levels, renewed);
    EXPECT_GT(session.image(0)->version, before) << "another image";
    EXPECT_EQ(session.image(0)->look_version, look) << "of the same look";
    EXPECT_TRUE(session.can_redo());
    session.press(*key_press_of("ctrl+shift+z"));
    EXPECT_TRUE(row_state(session.look(), "key").is_muted);
    session.press(*key_press_of("ctrl+z"));
    session.press(*key_press_of("ctrl+z"));
    EXPECT_FALSE(session.can_undo());
    // Plain looks are no reason to forget what can be redone
    session.renew(small_levels());
    EXPECT_TRUE(session.can_redo());
    // An image of another camera replaces the tiles at once
    const uint64_t shown = session.image(0)->look_version;
    session.renew(renewed, true);
    EXPECT_GT(session.image(0)->look_version, shown);
}

TEST(FollowingSession, OfAFileWithOtherLayersKeepsWhatFits) {
    Session session = session_of_small();
    session.edit("", [](Look& l) {
        set_muted(l, "key", true);
        set_muted(l, "b1", true);
    });
    const auto plain = levels_of(plain_file("fewer.exr", {0, 0, 60, 40}));
    session.renew(plain);
    EXPECT_EQ(session.look_error(), "");
    ASSERT_NE(session.image(0), nullptr);
    const std::vector<std::string> notes = session.notes();
    EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const std::string& note) {
        return note.find("skipped") == 0 && note.find("b1") != std::string::npos;
    }));
    EXPECT_TRUE(row_state(session.look(), "b1").is_muted) << "it is in the look still";
    // What the command makes of the same look without the bounce
    Session alone{RecentFiles("")};
    alone.show("fewer.exr", plain);
    alone.edit("", [](Look& l) { set_muted(l, "key", true); });
    const image::Window all = {0, 0, 60, 40};
    EXPECT_EQ(session.screen_tile(0, all).rgba, alone.screen_tile(0, all).rgba);
    session.renew(small_levels());
    EXPECT_TRUE(session.notes().empty());
}

TEST(FollowingSession, IsASwitch) {
    Session session = session_of_small();
    EXPECT_FALSE(session.is_following());
    session.press(*key_press_of("shift+f5"));
    EXPECT_TRUE(session.is_following());
    session.perform(Action::Follow);
    EXPECT_FALSE(session.is_following());
}

}  // namespace
}  // namespace velatura::compositor::window
