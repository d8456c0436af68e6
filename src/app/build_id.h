// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace velatura::app {

/// 16 hexadecimal digits of the sources of the renderer and its plugins, the compiler and its
/// options: builds of one id give the same pixels. The definition is made by the build
/// (src/cmake/build_id.cmake).
std::string_view build_id();

}  // namespace velatura::app
