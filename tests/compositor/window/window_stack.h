// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/levels.h"
#include "compositor/window/session.h"
#include "film/film_scene.h"
#include "image/exr.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace velatura::compositor::window {

/// A file of made-up light that has everything the window shows; pixels `data` of an image
/// `display`.
inline std::string window_file(const std::string& name,
                               const image::Window& data,
                               const image::Window& display,
                               uint64_t samples = 2) {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = set.shadow_layers = set.halves = true;
    film::Film film(data, set);
    film::render(film, 0, samples);
    film::FileInfo info;
    info.display = display;
    const std::string path = film::temporary_file(name);
    EXPECT_TRUE(film.write(path, info).has_value());
    return path;
}

/// A file of no more than its groups.
inline std::string plain_file(const std::string& name, const image::Window& data) {
    film::LayerSet set = film::test_layer_set();
    set.bounce_layers = set.data_layers = false;
    film::Film film(data, set);
    film::render(film, 0, 1);
    const std::string path = film::temporary_file(name);
    EXPECT_TRUE(film.write(path, {}).has_value());
    return path;
}

/// An image over the pixels of the stack with a matte `M` that takes values from 0 to 1.
inline Result<void> write_matte(const std::string& path, const LayerStack& stack) {
    image::Image matte;
    matte.data = stack.image().data;
    matte.display = stack.image().display;
    std::vector<float> values(matte.data.pixel_count());
    for (size_t i = 0; i < values.size(); ++i) values[i] = float(i % 11) / 10;
    image::Channel channel;
    channel.name = "M";
    channel.data = std::move(values);
    matte.parts.emplace_back().channels.push_back(std::move(channel));
    return image::write_exr(path, matte);
}

inline std::shared_ptr<const Levels> levels_of(const std::string& path) {
    auto stack = LayerStack::load(path);
    EXPECT_TRUE(stack.has_value());
    auto levels = Levels::make(std::make_shared<const LayerStack>(std::move(*stack)));
    EXPECT_TRUE(levels.has_value());
    return std::make_shared<const Levels>(std::move(*levels));
}

inline std::shared_ptr<const Levels> small_levels() {
    static const auto levels = levels_of(window_file("small.exr", {3, 2, 43, 31}, {0, 0, 48, 33}));
    return levels;
}

inline Session session_of_small() {
    Session session{RecentFiles("")};
    session.show("small.exr", small_levels());
    return session;
}

}  // namespace velatura::compositor::window
