// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"
#include "compositor/look/faders.h"
#include "compositor/look/mattes.h"

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::mix {

/// In place of the number of a matte.
inline constexpr size_t whole_image = size_t(-1);

/// A gain within a matte m: 1 + m (gain − 1) per pixel.
struct MattedGain {
    size_t matte = whole_image;
    std::array<float, 3> gain = {1, 1, 1};

    bool operator==(const MattedGain&) const = default;
};

/// A share within a matte: m times it per pixel.
struct MattedShare {
    size_t matte = whole_image;
    float share = 0;

    bool operator==(const MattedShare&) const = default;
};

/// A mix in terms of what the file stores.
struct MixPlan {
    /// Stored layers and their gain per channel, in the order in which they are folded. What a
    /// pixel of a layer adds is (value + clamp_share · value of the clamp layer) · gain ·
    /// matte_factor.
    struct Term {
        std::string layer;
        std::array<float, 3> gain = {1, 1, 1};
        std::vector<MattedGain> matted_gains = {};   ///< factors beside the gain
        std::vector<MattedShare> matted_lifts = {};  ///< their sum is a factor; empty = 1
        std::string clamp_layer = {};                ///< empty = nothing is given back
        std::vector<MattedShare> clamp_shares = {};  ///< the largest counts
        /// Of a lifted shadow: the layer of the family that holds the light's direct light.
        std::string direct_layer = {};
        std::vector<MattedShare> lifts =
            {};  ///< of it, which the gain or matted_lifts hold as well
    };

    std::string family;       ///< whose layers are gained: matrix, bounces, groups, beauty, plain
    std::vector<Term> terms;  ///< the family, in the order of its closure
    std::vector<Term> shadow_terms;  ///< S_<group>, S_<group>_<caster>, added after them
    /// What the file holds beside the mix and what follows its gains: shadows, unoccluded light,
    /// what clamps took; rows of a file of another renderer.
    std::vector<Term> beside = {};
    /// Of all light, where it has one gain and no shadow is lifted; without exposure.
    std::optional<std::array<float, 3>> common_gain = {};
    Faders faders = {};  ///< the gains, as a person sets them
    std::vector<Matte> mattes = {};
    std::vector<std::string> notes = {};  ///< what the look asks for and the file has no need of

    /// Those of the family, then those of shadows, as they are folded.
    std::vector<Term> all_terms() const;
    /// What mattes make of a term's gain at a pixel of the data window.
    float matte_factor(const Term& term, size_t c, size_t pixel) const;
    float clamp_share(const Term& term, size_t pixel) const;
};

/// True if what a term gains or gives back is not the same for every pixel.
bool has_mattes(const MixPlan::Term& term);

/// Translates a look into gains of the finest stored family that can express it. `file` is needed
/// for mattes where the stack has no pixels; its strips take at most `strip_bytes`.
/// Errors: "unknown-name" (usage; lists all names that the file lacks, those that may have been
/// meant, and those there are), "mix-not-stored" (says which layers to render), "layer-missing"
/// (the header names a layer that the file does not have), "bad-gain" (usage; gains of a layer that
/// multiply to more than largest_factor), those of load_matte.
Result<MixPlan> plan_mix(const LayerStack& stack,
                         const Look& look,
                         const layers::StripReader* file = nullptr,
                         size_t strip_bytes = size_t(1) << 30);

/// The plan without the values of its mattes. `is_brief`: an unknown name is told without the list
/// of those there are. Errors: those of plan_mix but for mattes.
Result<MixPlan> plan_gains(const LayerStack& stack, const Look& look, bool is_brief = false);

}  // namespace velatura::compositor::mix
