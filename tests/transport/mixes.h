// SPDX-License-Identifier: Apache-2.0
// Renders as the compositor gets them, and looks.
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"
#include "film/film.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <string>

namespace velatura::test {

/// A render through a file.
inline compositor::LayerStack through_file(const film::Film& film) {
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) /
                                       ("velatura_mix_" + std::to_string(getpid()) + ".exr");
    EXPECT_TRUE(film.write(path.string(), {}).has_value());
    auto stack = compositor::LayerStack::load(path.string());
    EXPECT_TRUE(stack.has_value());
    std::filesystem::remove(path);
    return std::move(*stack);
}

inline compositor::Control gain(const std::string& name, double stops) {
    compositor::Control control;
    control.target = name;
    control.factor.fill(float(std::exp2(stops)));
    return control;
}

/// `transport/gloss` → `gloss`.
inline std::string name_of(const testing::TestParamInfo<const char*>& info) {
    const std::string path = info.param;
    return path.substr(path.find('/') + 1);
}

}  // namespace velatura::test
