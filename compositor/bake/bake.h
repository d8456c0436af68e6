// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::bake {

/// What a baked mix says about one light prim; only what it changes.
struct BakedLight {
    std::string path;  ///< prim path
    std::optional<double> intensity, exposure;
    std::optional<std::array<double, 3>> color;  ///< in Bake::color_space
    std::vector<std::string> connected = {};     ///< inputs whose connections have to go
    bool has_color_space = false;                ///< the color's space has to be said
};

/// A look as opinions over light prims, and what of it lights cannot say.
struct Bake {
    std::vector<BakedLight> lights;
    std::string color_space = "lin_rec709_scene";  ///< that of the file
    /// What the layer does to whole groups, as a look of the file: a mute, or a gain and a tint
    /// each.
    Look baked;
    std::vector<std::string> partial;  ///< groups whose prims got different things: in no look
    std::vector<std::string> left;     ///< one line each: what did not become an opinion, and why
    std::vector<std::string> notes;    ///< what is baked and still differs
};

/// Turns gains, tints, mutes and solos of whole groups into intensity, exposure and color of their
/// prims. A gain multiplies the intensity; one in stops adds to the exposure; where an input has
/// time samples the other one takes the gain, so that its animation stays. Keys count at the values
/// that they have (look_at). Errors: "unknown-name", "no-light-values" (the file does not say what
/// its lights were), "bad-gain" (an exposure or a product of gains that no light can have).
Result<Bake> bake_look(const LayerStack& stack, const Look& look);

}  // namespace velatura::compositor::bake
