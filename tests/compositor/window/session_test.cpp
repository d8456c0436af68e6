// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/session.h"

#include "base/atomic_file.h"
#include "layers/layer_file.h"
#include "window_stack.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

namespace velatura::compositor::window {
namespace {

void press(Session& session, const char* keys) {
    const auto key = key_press_of(keys);
    ASSERT_TRUE(key.has_value()) << keys;
    session.press(*key);
}

TEST(Session, KeysWorkOnTheSelectedRow) {
    Session session = session_of_small();
    EXPECT_EQ(session.selected(), "all");
    press(session, "down");
    press(session, "down");
    EXPECT_EQ(session.selected(), "key");
    press(session, "right");
    press(session, "right");
    press(session, "shift+left");
    press(session, "m");
    press(session, "s");
    const RowState row = row_state(session.look(), "key");
    EXPECT_FLOAT_EQ(row.stops, 0.45f);
    EXPECT_TRUE(row.is_muted);
    EXPECT_TRUE(row.is_soloed);
    EXPECT_TRUE(session.is_soloing());
    press(session, "ctrl+z");
    EXPECT_FALSE(row_state(session.look(), "key").is_soloed);
    press(session, "ctrl+shift+z");
    EXPECT_TRUE(row_state(session.look(), "key").is_soloed);
    press(session, "shift+r");
    EXPECT_EQ(row_state(session.look(), "key"), RowState());
    for (int i = 0; i < 20; ++i) press(session, "up");
    EXPECT_EQ(session.selected(), "all");
    session.set_page(Page::Bounces);
    EXPECT_EQ(session.selected(), "direct");
}

TEST(Session, ASearchKeepsKeysOnWhatIsSeen) {
    Session session = session_of_small();
    const std::vector<std::string> all = session.targets_of_page();
    EXPECT_EQ(session.found(all), all);
    session.search_rows("KE");
    EXPECT_EQ(session.found(all), std::vector<std::string>{"key"});
    EXPECT_EQ(session.selected(), "key");
    press(session, "down");
    press(session, "m");
    EXPECT_TRUE(row_state(session.look(), "key").is_muted);
    // Nothing found: keys change nothing
    session.search_rows("no such row");
    EXPECT_EQ(session.selected(), "");
    const Look before = session.look();
    press(session, "m");
    press(session, "right");
    EXPECT_TRUE(same_look(session.look(), before));
    // Rows are found by what they show
    session.search_rows("all light");
    EXPECT_EQ(session.selected(), "all");
    press(session, "ctrl+f");
    EXPECT_TRUE(session.take_search_request());
    EXPECT_FALSE(session.take_search_request());
}

TEST(Session, AnInputSpaceIsThatOfTheCommand) {
    Session session = session_of_small();
    const auto bytes = [&] { return session.screen_tile(0, {0, 0, 48, 33}).rgba; };
    const auto own = bytes();
    session.set_input_space("ACEScg");
    EXPECT_EQ(session.look_error(), "");
    EXPECT_NE(bytes(), own) << "other numbers";
    EXPECT_EQ(session.image(0)->look.input_space, "ACEScg");
    EXPECT_FALSE(session.has_unsaved_look()) << "no part of a look";
    session.set_input_space("no such space");
    EXPECT_NE(session.look_error().find("no such space"), std::string::npos);
    session.set_input_space("");
    EXPECT_EQ(session.look_error(), "");
    EXPECT_EQ(bytes(), own);
}

TEST(Session, LookBMayBeOfAnotherFile) {
    Session session = session_of_small();
    const auto other = levels_of(window_file("other.exr", {3, 2, 43, 31}, {0, 0, 48, 33}, 3));
    session.edit("", [](Look& l) { set_muted(l, "fill", true); });
    session.compare("other.exr", other);
    EXPECT_TRUE(session.is_wiping());
    EXPECT_EQ(session.compared(), "other.exr");
    // B is what the other file alone shows with that look
    Session alone{RecentFiles("")};
    alone.show("other.exr", other);
    const image::Window all = {0, 0, 48, 33};
    const auto bytes = [&](const Session& s, size_t look) { return s.screen_tile(look, all).rgba; };
    EXPECT_EQ(bytes(session, 1), bytes(alone, 0));
    press(session, "c");
    alone.edit("", [](Look& l) { set_muted(l, "fill", true); });
    EXPECT_EQ(bytes(session, 1), bytes(alone, 0));
    EXPECT_NE(bytes(session, 0), bytes(session, 1));
    // Both in one mode and one display
    press(session, "g");
    press(alone, "g");
    EXPECT_EQ(bytes(session, 1), bytes(alone, 0));
    session.set_display("sRGB", "Raw");
    alone.set_display("sRGB", "Raw");
    EXPECT_EQ(bytes(session, 1), bytes(alone, 0));
    // Its file is one that is open
    const std::string path = film::temporary_file("other.exr");
    session.compare(path, other);
    ASSERT_TRUE(session.ask_to_replace(Dialog::WriteOutput, path));
    EXPECT_TRUE(session.replaces_layers());
    session.set_dialog(Dialog::None);
    // What is written from B is of the other file
    press(session, "x");
    EXPECT_EQ(&session.stack(), &other->stack(0));
    session.perform(Action::EndComparison);
    EXPECT_EQ(session.compared(), "");
    EXPECT_EQ(bytes(session, 0), bytes(session, 1)) << "the same look of the same file";
}

TEST(Session, AFileOfAnotherSizeIsNotCompared) {
    Session session = session_of_small();
    session.compare("large.exr", levels_of(plain_file("large.exr", {0, 0, 50, 33})));
    EXPECT_EQ(session.compared(), "");
    EXPECT_TRUE(session.message().is_error);
    EXPECT_NE(session.message().text.find("large.exr has 50×33 pixels"), std::string::npos)
        << session.message().text;
    // Nor does a comparison outlive a file of another size
    session.compare("other.exr",
                    levels_of(window_file("other.exr", {3, 2, 43, 31}, {0, 0, 48, 33})));
    session.show("large.exr", levels_of(plain_file("large.exr", {0, 0, 50, 33})));
    EXPECT_EQ(session.compared(), "");
}

TEST(Session, AHeldKeyStepsOnAndThrowsASwitchOnce) {
    Session session = session_of_small();
    session.select("key");
    const auto hold = [&](const char* keys, int repeats) {
        press(session, keys);
        for (int i = 0; i < repeats; ++i) session.press(*key_press_of(keys), true);
    };
    hold("m", 3);
    EXPECT_TRUE(row_state(session.look(), "key").is_muted);
    hold("w", 1);
    EXPECT_TRUE(session.is_wiping());
    hold("right", 3);
    EXPECT_FLOAT_EQ(row_state(session.look(), "key").stops, 1);
    // One step of undo, however long it was held; pressed again it is another
    press(session, "right");
    press(session, "ctrl+z");
    EXPECT_FLOAT_EQ(row_state(session.look(), "key").stops, 1);
    press(session, "ctrl+z");
    EXPECT_EQ(row_state(session.look(), "key").stops, 0);
    EXPECT_TRUE(row_state(session.look(), "key").is_muted);
    hold("]", 1);
    EXPECT_FLOAT_EQ(session.look().exposure_stops, 0.5f);
}

TEST(Session, EveryLookMakesANewImage) {
    Session session = session_of_small();
    const uint64_t rendered = session.image(0)->version;
    press(session, "]");
    EXPECT_FLOAT_EQ(session.look().exposure_stops, 0.25f);
    EXPECT_NE(session.image(0)->version, rendered);
    press(session, "0");
    EXPECT_EQ(session.look().exposure_stops, 0);
    const uint64_t back = session.image(0)->version;
    session.edit("", [](Look&) {});
    EXPECT_EQ(session.image(0)->version, back);
}

TEST(Session, TheWipeShowsBothLooks) {
    Session session = session_of_small();
    press(session, "]");
    EXPECT_EQ(session.work_request().images[1], nullptr);
    press(session, "w");
    EXPECT_NE(session.work_request().images[1], nullptr);
    EXPECT_EQ(session.look(1).exposure_stops, 0);
    press(session, "c");
    EXPECT_FLOAT_EQ(session.look(1).exposure_stops, 0.25f);
    press(session, "ctrl+z");
    EXPECT_EQ(session.look(1).exposure_stops, 0);
    press(session, "x");
    EXPECT_EQ(session.active(), 1u);
    EXPECT_EQ(session.work_request().noise_of, 1u);
    press(session, "w");
    EXPECT_EQ(session.work_request().images[0], nullptr);
    session.set_wipe(7);
    EXPECT_EQ(session.wipe(), 1);
}

TEST(Session, DisplayAndViewAreThoseOfBothLooks) {
    Session session = session_of_small();
    session.set_display("sRGB", "Raw");
    EXPECT_EQ(session.look(0).view, "Raw");
    EXPECT_EQ(session.look(1).view, "Raw");
    const uint64_t good = session.image(0)->version;
    session.set_display("sRGB", "No such view");
    EXPECT_EQ(session.image(0)->version, good);
    // What is wrong is said until it is mended, whatever else there is to say
    session.report("saved x.png");
    EXPECT_NE(session.look_error().find("No such view"), std::string::npos) << session.look_error();
    // The other look is seen while both are
    press(session, "w");
    press(session, "x");
    session.edit("", [](Look& l) { l.view = "Raw"; });
    EXPECT_EQ(session.look_error().find("look A: "), 0u) << session.look_error();
    press(session, "x");
    session.set_display("sRGB", "Raw");
    EXPECT_TRUE(session.look_error().empty());
}

TEST(Session, AnImageOfAnotherLookIsNotSaved) {
    Session session = session_of_small();
    const std::string path = film::temporary_file("stale.exr");
    session.set_display("sRGB", "No such view");
    const auto no_view = session.output_writer(path)();
    ASSERT_FALSE(no_view.has_value());
    EXPECT_NE(no_view.error().message.find("No such view"), std::string::npos);
    session.set_display("sRGB", "Raw");
    session.edit(
        "", [](Look& l) { l.controls.push_back(*parse_control(Control::Kind::Mute, "moon")); });
    const auto no_row = session.output_writer(path)();
    ASSERT_FALSE(no_row.has_value());
    EXPECT_NE(no_row.error().message.find("moon"), std::string::npos);
    EXPECT_FALSE(read_file(path).has_value());
}

TEST(Session, PresetsAreThoseOfTheCommand) {
    Session session = session_of_small();
    session.edit("", [](Look& l) { set_stops(l, "key", 1.5f); });
    const std::string path = film::temporary_file("session_look.json");
    session.save_preset(path);
    EXPECT_FALSE(session.message().is_error) << session.message().text;
    const auto text = read_file(path);
    ASSERT_TRUE(text.has_value());
    EXPECT_TRUE(same_look(*look_from_json(*text), session.look()));
    press(session, "ctrl+r");
    EXPECT_TRUE(session.look().controls.empty());
    session.load_preset(path);
    EXPECT_FLOAT_EQ(row_state(session.look(), "key").stops, 1.5f);
    press(session, "ctrl+z");
    EXPECT_TRUE(session.look().controls.empty());
}

TEST(Session, APresetWaitsForAFile) {
    const std::string path = film::temporary_file("waits.json");
    ASSERT_TRUE(write_file_atomically(path, R"({"schema": "velatura.look/1", "controls": [
        {"do": "gain", "name": "key", "value": "+2st"}]})")
                    .has_value());
    Session session{RecentFiles("")};
    session.load_preset(path);
    EXPECT_FALSE(session.message().is_error);
    EXPECT_NE(session.message().text.find("waits.json waits"), std::string::npos);
    session.show("small.exr", small_levels());
    EXPECT_FLOAT_EQ(row_state(session.look(), "key").stops, 2);
    EXPECT_FALSE(row_state(session.look(1), "key").stops > 0);
    // For the first file only
    press(session, "ctrl+r");
    session.show("small.exr", small_levels());
    EXPECT_EQ(row_state(session.look(), "key"), RowState());
}

TEST(Session, KeysAreReadAtTheFrameAndKept) {
    film::LayerSet set = film::test_layer_set();
    film::Film film({0, 0, 12, 9}, set);
    film::render(film, 0, 2);
    film::FileInfo info;
    info.scene_json = R"({"frame": 7.0})";
    const std::string layers = film::temporary_file("frame.exr");
    ASSERT_TRUE(film.write(layers, info).has_value());
    Session session{RecentFiles("")};
    session.show(layers, levels_of(layers));
    EXPECT_EQ(session.frame(), 7);

    const std::string path = film::temporary_file("keys.json");
    ASSERT_TRUE(write_file_atomically(path, R"({"schema": "velatura.look/1", "controls": [
        {"do": "gain", "name": "key", "keys": {"1": "0st", "13": "2st"}}]})")
                    .has_value());
    session.load_preset(path);
    EXPECT_NE(session.message().text.find("frame 7"), std::string::npos) << session.message().text;
    const auto image_is_that_of = [&](double frame) {
        const ImageTask& task = *session.image(0);
        const Look look = look_at(session.look(), frame);
        const auto plan = mix::plan_mix(session.stack(), look);
        EXPECT_TRUE(plan.has_value());
        const auto expected = mix::apply_mix(session.stack(), *plan, look, false);
        const auto shown = mix::apply_mix(session.stack(), *task.plans[0], task.look, false);
        return std::get<std::vector<float>>(shown.find("G")->data) ==
               std::get<std::vector<float>>(expected.find("G")->data);
    };
    EXPECT_TRUE(image_is_that_of(7));
    EXPECT_FALSE(image_is_that_of(1));
    session.set_frame(13);
    EXPECT_TRUE(image_is_that_of(13));
    session.set_frame(std::numeric_limits<double>::infinity());
    EXPECT_EQ(session.frame(), 13);

    // A preset that waited is told of with the frame that was asked for
    Session waiting{RecentFiles("")};
    waiting.load_preset(path);
    waiting.show(layers, levels_of(layers), 13);
    EXPECT_NE(waiting.message().text.find("frame 13"), std::string::npos) << waiting.message().text;

    // Another gain of the row is beside the keys, which a saved preset still holds
    session.edit("", [](Look& l) { set_stops(l, "key", 1); });
    EXPECT_TRUE(image_is_that_of(13));
    session.save_preset(path);
    const auto saved = look_from_json(*read_file(path));
    ASSERT_TRUE(saved.has_value());
    ASSERT_EQ(saved->controls.size(), 2u);
    EXPECT_EQ(saved->controls[0].keys, session.look().controls[0].keys);
    EXPECT_EQ(saved->controls[0].keys.size(), 2u);
}

TEST(Session, MattesAreReadOnce) {
    const auto levels = levels_of(window_file("once.exr", {0, 0, 200, 110}, {}, 1));
    const std::string path = film::temporary_file("once_matte.exr");
    ASSERT_TRUE(write_matte(path, levels->stack(0)).has_value());
    Session session{RecentFiles("")};
    session.show("once.exr", levels);
    const auto set_gain = [&](const char* gain) {
        session.edit("", [&](Look& l) {
            l.controls = {*parse_control(Control::Kind::Gain, gain)};
            l.controls[0].matte = path + ":M";
        });
    };
    set_gain("key=2");
    ASSERT_TRUE(session.look_error().empty()) << session.look_error();
    const LevelPlans before = session.image(0)->plans;
    ASSERT_GE(before.size(), 2u);
    set_gain("key=3");
    const LevelPlans& after = session.image(0)->plans;
    for (size_t k = 0; k < before.size(); ++k) {
        EXPECT_NE(before[k], after[k]);
        EXPECT_EQ(before[k]->mattes.at(0).values, after[k]->mattes.at(0).values) << "level " << k;
    }
    EXPECT_NE(after[0]->mattes[0].values, after[1]->mattes[0].values);
    // Another matte is another one
    session.edit("", [&](Look& l) { l.controls[0].matte = "!" + path + ":M"; });
    EXPECT_NE(session.image(0)->plans[0]->mattes[0].values, before[0]->mattes[0].values);
}

TEST(Session, TellsWhatTheFileHasNoNeedOf) {
    Session session = session_of_small();
    EXPECT_TRUE(session.notes().empty());
    session.edit(
        "", [](Look& l) { l.controls.push_back(*parse_control(Control::Kind::Clamp, "all=1")); });
    ASSERT_EQ(session.notes().size(), 1u);
    EXPECT_NE(session.notes()[0].find("--clamp"), std::string::npos);
    session.edit("", [](Look& l) { set_muted(l, "moon", true); });
    EXPECT_TRUE(session.notes().empty());
    press(session, "ctrl+z");
    EXPECT_EQ(session.notes().size(), 1u);
    press(session, "ctrl+z");
    EXPECT_TRUE(session.notes().empty());
}

TEST(Session, APresetOfAnotherShotSaysWhatItCannotFind) {
    Session session = session_of_small();
    const uint64_t good = session.image(0)->version;
    const std::string path = film::temporary_file("other_shot.json");
    ASSERT_TRUE(write_file_atomically(path, R"({"schema": "velatura.look/1", "controls": [
        {"do": "gain", "name": "moon", "value": "2"}, {"do": "gain", "name": "key",
            "value": "2"}]})")
                    .has_value());
    session.load_preset(path);
    EXPECT_NE(session.look_error().find("moon"), std::string::npos);
    EXPECT_EQ(session.image(0)->version, good) << "the last picture stays";
    EXPECT_EQ(advanced_controls(session.look(), session.rows()), std::vector<size_t>{0});
    session.edit("", [](Look& l) { l.controls.erase(l.controls.begin()); });
    EXPECT_TRUE(session.look_error().empty());
    EXPECT_NE(session.image(0)->version, good);

    ASSERT_TRUE(write_file_atomically(path, "no preset").has_value());
    session.load_preset(path);
    EXPECT_TRUE(session.message().is_error);
    session.load_preset(film::temporary_file("missing.json"));
    EXPECT_TRUE(session.message().is_error);
    EXPECT_FLOAT_EQ(row_state(session.look(), "key").stops, 1);
}

TEST(Session, TheLookGoesOnWithTheNextFile) {
    Session session = session_of_small();
    session.edit("", [](Look& l) {
        set_stops(l, "key", 1.5f);
        set_muted(l, "sky", true);
    });
    press(session, "x");
    session.edit("", [](Look& l) { set_stops(l, "fill", -1); });
    const Looks before = {session.look(0), session.look(1)};
    // A file that lacks a light: its image is the look without that light, and says so
    const std::string path = film::temporary_file("fewer_lights.exr");
    film::LayerSet set = film::test_layer_set();
    for (film::LightGroup& group : set.groups) {
        if (group.name == "fill") group.name = "lamp";
    }
    film::Film film({0, 0, 12, 9}, set);
    film::render(film, 0, 2);
    ASSERT_TRUE(film.write(path, {}).has_value());
    session.show(path, levels_of(path));
    EXPECT_TRUE(same_look(session.look(0), before[0]));
    EXPECT_TRUE(same_look(session.look(1), before[1])) << "nothing of a look is lost";
    EXPECT_EQ(session.active(), 1u);
    EXPECT_TRUE(session.look_error().empty()) << session.look_error();
    ASSERT_EQ(session.notes().size(), 1u);
    EXPECT_NE(session.notes()[0].find("skipped --gain fill"), std::string::npos);
    // Back: all of it acts again, and undo leads to where it came from
    session.show("small.exr", small_levels());
    EXPECT_TRUE(session.notes().empty());
    press(session, "ctrl+z");
    EXPECT_EQ(row_state(session.look(1), "fill"), RowState());
    press(session, "ctrl+z");
    EXPECT_EQ(row_state(session.look(0), "key"), RowState());
}

TEST(Session, LooksOutliveAWindowThatIsKilled) {
    const AutosavedLooks kept(film::temporary_file("kept_looks"));
    const auto begin = [&] {
        Session session{RecentFiles(""), kept};
        session.show("small.exr", small_levels());
        return session;
    };
    {
        Session session = begin();
        session.edit("", [](Look& l) { set_stops(l, "key", 1.5f); });
        press(session, "x");
        session.edit("", [](Look& l) { set_muted(l, "fill", true); });
        session.autosave_looks();
        EXPECT_TRUE(session.has_unsaved_look());
        // Killed here: nothing of it is told that the end is near
    }
    Session again = begin();
    EXPECT_FLOAT_EQ(row_state(again.look(0), "key").stops, 1.5f);
    EXPECT_TRUE(row_state(again.look(1), "fill").is_muted);
    EXPECT_NE(again.message().text.find("from before"), std::string::npos);
    Session other{RecentFiles(""), kept};
    other.show("another.exr", small_levels());
    EXPECT_EQ(row_state(other.look(), "key"), RowState()) << "of its own file only";
    // The last step of undo is the light as rendered
    press(again, "ctrl+z");
    EXPECT_EQ(row_state(again.look(0), "key"), RowState());
    again.autosave_looks();
    EXPECT_FALSE(kept.find("small.exr")) << "as rendered, there is nothing to keep";
    press(again, "ctrl+shift+z");
    again.autosave_looks();
    EXPECT_TRUE(kept.find("small.exr"));
    again.edit("", [](Look& l) { l = Look(); });
    press(again, "x");
    again.edit("", [](Look& l) { l = Look(); });
    again.edit("", [](Look& l) { set_stops(l, "key", 0.5f); });
    again.autosave_looks();
    again.save_preset(film::temporary_file("kept_as_preset.json"));
    EXPECT_FALSE(again.has_unsaved_look());
    EXPECT_FALSE(kept.find("small.exr")) << "a preset holds it";
}

TEST(Session, AsksBeforeALookOrAFileIsLost) {
    Session session = session_of_small();
    press(session, "ctrl+q");
    EXPECT_TRUE(session.wants_to_quit()) << "nothing would be lost";
    Session edited = session_of_small();
    edited.edit("", [](Look& l) { set_stops(l, "key", 1); });
    press(edited, "ctrl+q");
    EXPECT_FALSE(edited.wants_to_quit());
    EXPECT_EQ(edited.dialog(), Dialog::Quit);
    edited.set_dialog(Dialog::None);
    const std::string preset = film::temporary_file("asked.json");
    EXPECT_FALSE(edited.ask_to_replace(Dialog::SavePreset, preset)) << "there is no such file yet";
    edited.save_preset(preset);
    EXPECT_TRUE(edited.ask_to_replace(Dialog::SavePreset, preset));
    EXPECT_EQ(edited.dialog(), Dialog::Replace);
    EXPECT_EQ(edited.replaced(), std::pair(Dialog::SavePreset, preset));
    EXPECT_FALSE(edited.replaces_layers());
    press(edited, "ctrl+q");
    EXPECT_TRUE(edited.wants_to_quit()) << "a preset holds the look";
    // By another name: what counts is the file
    const std::string layers = window_file("asked_layers.exr", {0, 0, 8, 6}, {}, 1);
    const std::string link = film::temporary_file("asked_link.exr");
    std::filesystem::remove(link);
    std::filesystem::create_symlink(layers, link);
    Session own{RecentFiles("")};
    own.show(layers, levels_of(layers));
    ASSERT_TRUE(own.ask_to_replace(Dialog::WriteOutput, link));
    EXPECT_TRUE(own.replaces_layers());
}

TEST(Session, FramesBesideAndTheFileAgainAreAskedFor) {
    const std::string first = window_file("shot.0009.exr", {0, 0, 8, 6}, {}, 1);
    const std::string second = window_file("shot.0010.exr", {0, 0, 8, 6}, {}, 1);
    const std::string last = window_file("shot.0012.exr", {0, 0, 8, 6}, {}, 1);
    Session session{RecentFiles("")};
    session.show(second, levels_of(second));
    const auto asked = [&](const char* keys) {
        press(session, keys);
        return session.take_wanted_file();
    };
    EXPECT_EQ(asked("f5"), second);
    EXPECT_EQ(asked("pageup"), first);
    EXPECT_EQ(asked("pagedown"), last) << "over a frame that is not there";
    EXPECT_EQ(session.take_wanted_file(), std::nullopt) << "once";
    session.show(last, levels_of(last));
    EXPECT_EQ(asked("pagedown"), std::nullopt);
    EXPECT_TRUE(session.message().is_error);
    session.show("small.exr", small_levels());
    EXPECT_EQ(asked("pageup"), std::nullopt) << "its name has no number";
}

TEST(Session, WritesTheMixedFile) {
    Session session = session_of_small();
    session.edit("", [](Look& l) { set_stops(l, "key", 1); });
    const std::string path = film::temporary_file("session_mix.exr");
    ASSERT_TRUE(session.output_writer(path)().has_value());
    const auto written = layers::read_layer_file(path);
    ASSERT_TRUE(written.has_value());
    const ImageTask& task = *session.image(0);
    const image::Image expected = mix::apply_mix(session.stack(), *task.plans[0], task.look, false);
    for (size_t i = 0; i < expected.data.pixel_count(); ++i)
        ASSERT_EQ(written->find("G")->value(i), expected.find("G")->value(i));
}

TEST(Session, WithoutAFileKeysDoNoHarm) {
    Session session{RecentFiles("")};
    for (const KeyBinding& b : key_bindings()) session.press(b.press);
    EXPECT_FALSE(session.has_file());
    EXPECT_TRUE(session.wants_to_quit());
    EXPECT_EQ(session.work_request().levels, nullptr);
}

}  // namespace
}  // namespace velatura::compositor::window
