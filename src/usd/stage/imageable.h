// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/stage.h"

#include <string>

namespace velatura::usd::stage {

/// False when the prim's own opinion is "invisible": then everything below it is invisible too.
bool is_visible_itself(Prim prim, TimeCode time = {});

/// "default", "render", "proxy" or "guide": authored on this Imageable, else of the nearest
/// Imageable ancestor with an authored purpose, else "default".
std::string computed_purpose(Prim prim);

}  // namespace velatura::usd::stage
