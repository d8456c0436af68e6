// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/stage.h"

#include <string>
#include <string_view>

namespace velatura::usd::stage {

/// False when the prim's own opinion is "invisible": then everything below it is invisible too.
bool is_visible_itself(Prim prim, TimeCode time = {});

/// "default", "render", "proxy" or "guide": authored on this Imageable, else of the nearest
/// Imageable ancestor with an authored purpose, else "default".
std::string computed_purpose(Prim prim);

/// False when VisibilityAPI, on the prim or the nearest one above with an opinion, makes what is of
/// this purpose ("render", "proxy", "guide") invisible. Nothing authored: true.
/// Ref: UsdGeomVisibilityAPI; its fallback for guides is left to the purposes that are rendered.
bool is_purpose_visible(Prim prim, std::string_view purpose);

}  // namespace velatura::usd::stage
