// SPDX-License-Identifier: Apache-2.0
// Objects of a Cryptomatte under the mouse, and mattes of them.
#include "compositor/window/matte_pick.h"

#include "compositor/look/mattes.h"
#include "window_stack.h"

#include <gtest/gtest.h>

#include <bit>

namespace velatura::compositor::window {
namespace {

const std::vector<std::string> names = {"/World/vase", "table, left", "a*b?", R"(back\slash "q")"};

/// Eight pixels: object i % 4 covers ¾ of each, the next one ¼.
image::Image made_image() {
    image::Image image;
    image.data = {2, 1, 6, 3};
    image.display = {0, 0, 8, 4};
    image::Part& part = image.parts.emplace_back();
    const auto add = [&](const std::string& name, const auto& value) {
        image::Channel channel;
        channel.name = name;
        std::vector<float> values(image.data.pixel_count());
        for (size_t i = 0; i < values.size(); ++i) values[i] = value(i);
        channel.data = std::move(values);
        part.channels.push_back(std::move(channel));
    };
    const auto id = [](size_t i) { return std::bit_cast<float>(layers::matte_id(names[i % 4])); };
    for (const char* c : {"R", "G", "B", "key.R", "key.G", "key.B"})
        add(c, [](size_t) { return 0.5f; });
    add("CryptoObject00.R", [&](size_t i) { return id(i); });
    add("CryptoObject00.G", [](size_t) { return 0.75f; });
    add("CryptoObject00.B", [&](size_t i) { return id(i + 1); });
    add("CryptoObject00.A", [](size_t) { return 0.25f; });
    layers::Cryptomatte matte{"CryptoObject", {}};
    for (const std::string& name : names) matte.names.push_back({name, layers::matte_id(name)});
    layers::describe_cryptomatte(matte, image.attributes);
    return image;
}

std::shared_ptr<const Levels> made_levels(image::Image image = made_image()) {
    auto stack = LayerStack::from_image(std::move(image), ForeignFiles::Plain);
    EXPECT_TRUE(stack.has_value()) << stack.error().message;
    auto levels = Levels::make(std::make_shared<const LayerStack>(std::move(*stack)));
    return std::make_shared<const Levels>(std::move(*levels));
}

TEST(MattePicker, NamesWhatIsUnderTheMouse) {
    const auto levels = made_levels();
    const MattePicker picker(levels->stack(0));
    ASSERT_EQ(picker.layers(), std::vector<std::string>{"CryptoObject"});
    // Pixel 1 of the data window
    const auto objects = picker.at(levels->stack(0), "CryptoObject", 3, 1);
    ASSERT_EQ(objects.size(), 2u);
    EXPECT_EQ(objects[0].name, names[1]);
    EXPECT_FLOAT_EQ(objects[0].coverage, 0.75f);
    EXPECT_EQ(objects[0].text(), "table, left 75 %");
    EXPECT_EQ(objects[1].name, names[2]);
    EXPECT_TRUE(picker.at(levels->stack(0), "CryptoObject", 0, 0).empty()) << "not stored";
    EXPECT_TRUE(picker.at(levels->stack(0), "CryptoAsset", 3, 1).empty());
}

TEST(MattePicker, MattesOfAnyNamesAreThoseOfTheCommand) {
    const auto levels = made_levels();
    for (size_t first = 0; first < names.size(); ++first) {
        for (size_t count = 1; count <= names.size() - first; ++count) {
            const std::vector<std::string> some(names.begin() + long(first),
                                                names.begin() + long(first + count));
            const auto matte =
                load_matte(levels->stack(0), nullptr, matte_text("CryptoObject", some));
            ASSERT_TRUE(matte.has_value()) << matte.error().message;
            for (size_t i = 0; i < 8; ++i) {
                const auto has = [&](size_t n) { return n % 4 >= first && n % 4 < first + count; };
                const float expected = (has(i) ? 0.75f : 0) + (has(i + 1) ? 0.25f : 0);
                EXPECT_FLOAT_EQ((*matte->values)[i], expected) << matte->text << " at " << i;
            }
        }
    }
    EXPECT_EQ(matte_text("CryptoObject", {}), "");
}

TEST(Session, RowsActWithinWhatWasPicked) {
    Session session{RecentFiles("")};
    session.show("matte.exr", made_levels());
    session.press(*key_press_of("p"));
    ASSERT_TRUE(session.is_picking());
    session.select("key");
    session.press(*key_press_of("m"));
    session.pick(2, 1);
    session.pick(3, 1);
    EXPECT_EQ(session.matte(), R"(CryptoObject:/World/vase,table\, left)");
    for (int i = 0; i < 4; ++i) session.press(*key_press_of("right"));
    // Beside what acts everywhere
    ASSERT_EQ(session.look().controls.size(), 2u);
    EXPECT_EQ(session.look().controls[0].matte, "");
    EXPECT_EQ(session.look().controls[1].matte, session.matte());
    EXPECT_FLOAT_EQ(row_state(session.look(), {"key", session.matte()}).stops, 1);
    EXPECT_EQ(row_state(session.look(), "key").stops, 0);
    EXPECT_EQ(session.look_error(), "");
    EXPECT_TRUE(advanced_controls(session.look(), session.rows(), session.matte()).empty());
    EXPECT_EQ(advanced_controls(session.look(), session.rows()), std::vector<size_t>{1});
    // The same as a preset
    const auto look = look_from_json(look_to_json(session.look()));
    ASSERT_TRUE(look.has_value());
    EXPECT_TRUE(same_look(*look, session.look()));
    // A second click takes it out
    session.pick(2, 1);
    EXPECT_EQ(session.matte(), "CryptoObject:table, left");
    session.clear_matte();
    EXPECT_EQ(session.matte(), "");
    EXPECT_EQ(session.look().controls.size(), 2u);
}

/// Red over the bytes of the screen: half of it where the matte is 1, as far as it covers a pixel.
TEST(Session, TheMatteIsDrawnWhileItIsPicked) {
    Session session{RecentFiles("")};
    const auto levels = made_levels();
    session.show("drawn.exr", levels);
    session.press(*key_press_of("p"));
    EXPECT_TRUE(session.image(0)->matte.empty());
    session.pick(2, 1);
    const ImageTask& task = *session.image(0);
    ASSERT_EQ(task.matte.size(), levels->count());
    const std::vector<float>& matte = *task.matte[0]->mattes[0].values;
    const auto shown = [&](const std::vector<float>* drawn) {
        return show_tile(
            {levels->stack(0), *task.plans[0], 0, *task.transform, levels->not_finite(), drawn},
            task.mode, levels->frame(0));
    };
    const ShownTile with = shown(&matte), without = shown(nullptr);
    size_t reddened = 0;
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 8; ++x) {
            const size_t i = 4 * size_t(8 * y + x);
            const image::Window data = levels->stack(0).image().data;
            const float share = data.contains(x, y) ? 0.5f * matte[data.index(x, y)] : 0.0f;
            reddened += share > 0;
            for (size_t c = 0; c < 3; ++c) {
                const float red = c == 0 ? 255.0f : 0.0f;
                EXPECT_NEAR(with.rgba[i + c],
                            (1 - share) * float(without.rgba[i + c]) + share * red, 0.5001)
                    << x << " " << y;
            }
        }
    }
    // Pixels 0 and 4 show the vase, 3 and 7 a quarter of it
    EXPECT_EQ(reddened, 4u);
    // What is read at a pixel, and what is written, is the image
    EXPECT_TRUE(session.screen_tile(0, levels->frame(0)).rgba == without.rgba);
    session.press(*key_press_of("p"));
    EXPECT_TRUE(session.image(0)->matte.empty()) << "not while nothing is picked";
}

TEST(Session, ObjectsWithoutANameAreSaid) {
    image::Image image = made_image();
    layers::Cryptomatte none{"CryptoObject", {{names[0], layers::matte_id(names[0])}}};
    layers::describe_cryptomatte(none, image.attributes);
    Session session{RecentFiles("")};
    session.show("nameless.exr", made_levels(std::move(image)));
    session.pick(3, 1);
    EXPECT_EQ(session.matte(), "");
    EXPECT_TRUE(session.message().is_error);
    EXPECT_NE(session.message().text.find("without a name"), std::string::npos);
    // A file without mattes has nothing to pick
    session.show("small.exr", small_levels());
    session.press(*key_press_of("p"));
    EXPECT_FALSE(session.is_picking());
    EXPECT_TRUE(session.message().is_error);
}

}  // namespace
}  // namespace velatura::compositor::window
