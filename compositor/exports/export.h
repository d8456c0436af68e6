// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/mix/mix_plan.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::compositor::exports {

/// A mix as other programs can rebuild it from the same file: Σ gain · layer in this order, in
/// float, alpha of the beauty.
struct MixRecipe {
    struct Term {
        std::string layer;  ///< as controls name it
        std::string part;   ///< of the file; empty where it has one
        std::array<float, 3> gain = {1, 1, 1};
        std::array<std::string, 3> channels = {};  ///< full names in the file; empty: layer.R …
        std::array<size_t, 3> places = {};         ///< of these in the part, as OpenImageIO counts
    };

    std::string file;  ///< as the user names it; of a sequence with #### for the frame
    bool is_sequence = false;
    int first_frame = 1, last_frame = 1;  ///< of a sequence, as far as its files are here
    std::vector<Term> terms;              ///< at least one
    std::string alpha_part;
    bool has_alpha = false;
    std::string alpha_channel = "A";  ///< full name in the file
    size_t alpha_place = 0;
    int width = 0, height = 0;  ///< of the whole image
    /// From its middle to that of the pixels that are stored, right and up.
    std::array<double, 2> offset = {};
    float pixel_aspect = 1;
    std::string look;  ///< JSON, one line
};

/// `file`: what the script reads, a file or a sequence (base/frames.h). Errors: "export-split" (a
/// file whose layers lie in files beside it), "export-matte" (gains that are not the same for every
/// pixel), "export-sequence" (a sequence that other programs have no name for).
Result<MixRecipe> mix_recipe(const LayerStack& stack,
                             const mix::MixPlan& plan,
                             const Look& look,
                             const std::string& file);

/// A shell script for oiiotool 2.4 or newer: `sh mix.sh [IN.exr [OUT.exr]]`, #### in both for a
/// sequence.
std::string oiio_script(const MixRecipe& recipe);

/// A Nuke script: a Read, and a Group that adds up the layers with a knob per fader, set as the
/// look is: exposure; gain, tint and mute of all, of each group and bounce; a trim per bounce of a
/// group; lifts of shadows, what clamps gave back, and gains within Cryptomattes. `file`: as for
/// mix_recipe; where it is relative, the script names it by where the script itself is, which is to
/// be `folder`. Errors: those of mix_recipe ("export-matte": a matte that is an image, or a clamp
/// within one), those of load_matte.
Result<std::string> nuke_script(const LayerStack& stack,
                                const mix::MixPlan& plan,
                                const Look& look,
                                const std::string& file,
                                const std::string& folder = "");

/// A Python script that builds the mix as compositing nodes: in Blender, or
/// `blender -b -P mix.py -- [IN.exr [OUT.exr]]`.
std::string blender_script(const MixRecipe& recipe);

}  // namespace velatura::compositor::exports
