// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace velatura::test {

/// Seen from (0, 0, 10), 4 x 4 units at the origin: a square, half of it behind a veil that is
/// there by a quarter and stands at z = 2, a glass ball, and two instances of two prims each, under
/// a dome.
std::string still_life();

}  // namespace velatura::test
