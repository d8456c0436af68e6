// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"
#include "film/film.h"
#include "film/film_scene.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <utility>

namespace velatura::compositor {

/// The film as the compositor gets it: through a file.
inline LayerStack through_file(const film::Film& film) {
    const std::string path = film::temporary_file("stack.exr");
    EXPECT_TRUE(film.write(path, {}).has_value());
    auto stack = LayerStack::load(path);
    EXPECT_TRUE(stack.has_value());
    return std::move(*stack);
}

inline Look look_of(std::initializer_list<std::pair<Control::Kind, const char*>> controls) {
    Look look;
    for (const auto& [kind, text] : controls) look.controls.push_back(*parse_control(kind, text));
    return look;
}

}  // namespace velatura::compositor
