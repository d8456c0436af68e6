// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/light.h"
#include "translate/context/context.h"

#include <string_view>

namespace velatura::translate::lights {

/// What prims of type Light and prims with LightAPI have in common.

/// Attribute that gives `inputs:<name>` its value: itself, or what it is connected to.
Attribute light_input(Context& ctx, Prim prim, std::string_view name);
/// Intensity of a light of that USD type where nothing is authored.
double default_intensity(std::string_view type);
double input_number(Context& ctx, Prim prim, std::string_view name, double fallback);

/// Color × blackbody × intensity × 2^exposure, in double.
Vec3d read_radiance(Context& ctx, Prim prim, double default_intensity);
/// Whether the radiance is one that a light can have; warns when it is not.
bool is_good_radiance(Context& ctx, Prim prim, const Vec3d& Le);

/// ShapingAPI. A profile that cannot be read is left out with an error.
scene::Shaping read_shaping(Context& ctx, Prim prim);

/// UsdLuxShadowAPI, but for shadow:enable, which link_all() reads.
scene::LightLinks read_shadow(Context& ctx, Prim light);

/// Names features of the light that are not honored: attributes of old schemas.
void warn_light_features(Context& ctx, Prim prim);

}  // namespace velatura::translate::lights
